// tests/suture: scissors, and a fresh needle and thread (paper 2.5.3, 3.4).
#include <gtest/gtest.h>

#include "rig.h"

namespace catgut {
namespace {

struct Tied : Rig {
  explicit Tied(const SceneSpec& scene = plain_scene()) : Rig(scene) {
    wait(0.2f);
    const Place p = place(0.4f);
    whole_bite(p);
    draw(p, 0.05f, 0.6f);
  }
  // A locked knot, made by hand: one more anchor on each strand, at the stitch.
  void tie() {
    Knot k;
    k.phase = KnotPhase::locked;
    k.target = thread().anchor[0].point;
    k.slots = 2;
    k.throws = 1;
    for (size_t side = 0; side < 2; ++side) {
      const size_t node = side == 0 ? node_of_point(0) - 2 : node_of_point(1) + 2;
      ThreadAnchor a;
      a.slot = thread().order[node];
      a.point = k.target;
      a.knotted = true;
      thread().anchor.push_back(a);
      k.slot[side] = a.slot;
    }
    k.strand = k.slot[0];
    suture().knot.push_back(k);
  }
  // The tool appears at `at` with the button down.
  void press(size_t hand, uint32_t button, Vec3 at) {
    input.hand[hand].connected = 1;
    input.hand[hand].pose = {at, {}};
    input.hand[hand].buttons = button;
    tick();
  }
  Vec3 node(size_t i) { return xyz(x()[thread().order[i]]); }
};

TEST(Cut, nothing_acts_across_a_cut_and_the_button_acts_once) {
  Tied r;
  ASSERT_EQ(r.suture().point.size(), 2u);
  r.tie();
  const size_t at = r.node_of_point(1) + 12;
  r.press(0, kButtonCut, r.node(at));
  ASSERT_EQ(r.count(EventKind::thread_cut), 1u);
  size_t cuts = 0, where = 0;
  for (size_t i = 0; i < r.thread().cut.size(); ++i)
    if (r.thread().cut[i]) ++cuts, where = i;
  ASSERT_EQ(cuts, 1u);
  EXPECT_NEAR(static_cast<double>(where), static_cast<double>(at), 2);
  r.wait(0.3f);  // the button is still down
  EXPECT_EQ(r.count(EventKind::thread_cut), 1u);
  EXPECT_EQ(r.count(EventKind::technique_fault), 0u) << "beyond the knot is where one cuts";
  // The two ends part: the needle's piece is drawn away, the stitch's stays.
  const Vec3 left = r.node(where);
  r.draw(r.place(0.4f), 0.05f, 0.5f);
  EXPECT_LT(distance(r.node(where), left), 0.03f);
  EXPECT_GT(distance(r.node(where), r.node(where + 1)), 0.01f);
}

TEST(Cut, within_the_stitch_it_is_done_and_told) {
  Tied r;
  r.tie();
  r.press(0, kButtonCut, 0.5f * (r.node(r.node_of_point(1)) + r.node(r.node_of_point(1) + 1)));
  ASSERT_EQ(r.count(EventKind::technique_fault), 1u);
  EXPECT_EQ(static_cast<Fault>(static_cast<int>(r.last(EventKind::technique_fault)->value)), Fault::cut_in_stitch);
}

TEST(Cut, before_anything_is_tied_it_is_done_and_told) {
  Tied r;
  r.press(0, kButtonCut, r.node(r.node_of_point(1) + 8));
  ASSERT_EQ(r.count(EventKind::thread_cut), 1u);
  ASSERT_EQ(r.count(EventKind::technique_fault), 1u);
  EXPECT_EQ(static_cast<Fault>(static_cast<int>(r.last(EventKind::technique_fault)->value)), Fault::cut_before_knot);
}

TEST(Cut, at_the_swage_the_needle_comes_off_and_the_thread_stays_whole) {
  Tied r;
  r.tie();
  r.press(0, kButtonCut, needle_swage(r.model->solver.needle_arc, r.needle()));
  EXPECT_EQ(r.count(EventKind::thread_cut), 1u);
  EXPECT_EQ(std::count(r.thread().cut.begin(), r.thread().cut.end(), 1), 0);
  EXPECT_TRUE(r.thread().hold.empty());
  r.draw(r.place(0.4f), 0.05f, 0.5f);
  EXPECT_GT(distance(r.node(r.thread().order.size() - 1), needle_swage(r.model->solver.needle_arc, r.needle())), 0.02f);
}

TEST(Cut, in_the_air_it_cuts_nothing) {
  Tied r;
  r.press(0, kButtonCut, {0.1f, 0.1f, 0.1f});
  EXPECT_EQ(r.count(EventKind::thread_cut), 0u);
}

TEST(Settle, what_is_tied_becomes_a_stitch_with_pins_and_thread_and_needle_are_as_at_the_start) {
  Tied r;
  r.tie();
  r.let_go();
  r.press(1, kButtonNewSuture, {0.1f, 0.1f, 0});
  ASSERT_EQ(r.count(EventKind::stitch_settled), 1u);
  ASSERT_EQ(r.count(EventKind::suture_taken), 1u);
  ASSERT_EQ(r.suture().settled.size(), 1u);
  EXPECT_GT(r.suture().settled[0].node.size(), 6u);
  ASSERT_EQ(r.suture().settled[0].knot.size(), 1u);
  EXPECT_TRUE(r.suture().point.empty() && r.suture().knot.empty() && r.thread().anchor.empty());
  EXPECT_TRUE(r.order_is_whole());
  EXPECT_NEAR(r.rest_length(), 174 * 0.0016, 1e-6);
  EXPECT_LT(distance(r.needle().x, r.model->needle_start.p), 0.002f);
  // Knot to entry, exit to knot: the bite itself runs in the tissue.
  ASSERT_EQ(r.solver().pin.size(), 2u);
  for (const TissuePin& p : r.solver().pin) EXPECT_EQ(p.owner, PinOwner::stitch);
  // The picture's stitch lies where the thread lay.
  Snapshot seen;
  publish(*r.model, *r.state, seen);
  ASSERT_EQ(seen.settled.size(), 1u);
  const Bite& bite = r.suture().bite[0];  // the tissue has sprung back since: where its holes are now
  for (const Vec3& end : {position_of(bite.entry.point, r.x()), position_of(bite.exit.point, r.x())}) {
    float nearest = 1;
    for (const Vec3& p : seen.settled[0].node) nearest = std::min(nearest, distance(p, end));
    EXPECT_LT(nearest, 0.0015f);
  }
  // And it can be sewn with again.
  r.wait(0.3f);
  r.whole_bite(r.place(2.0f));
  EXPECT_EQ(r.suture().point.size(), 2u);
}

TEST(Settle, with_the_needle_in_the_tissue_it_is_refused_and_told) {
  Rig r;
  r.wait(0.2f);
  const Place p = r.place(0.4f);
  r.approach(p);
  r.drive(p, -1.0f, 0.0f);
  ASSERT_FALSE(r.suture().open.empty());
  r.input.hand[1].connected = 1;
  r.input.hand[1].pose = {{0.1f, 0.1f, 0}, {}};
  r.input.hand[1].buttons = kButtonNewSuture;
  r.tick();
  EXPECT_EQ(r.count(EventKind::suture_taken), 0u);
  ASSERT_EQ(r.count(EventKind::technique_fault), 1u);
  EXPECT_EQ(static_cast<Fault>(static_cast<int>(r.last(EventKind::technique_fault)->value)), Fault::needle_in_tissue);
}

TEST(Settle, an_untied_stitch_is_lost_and_told) {
  Tied r;
  r.let_go();
  r.press(1, kButtonNewSuture, {0.1f, 0.1f, 0});
  EXPECT_EQ(r.count(EventKind::stitch_settled), 0u);
  EXPECT_EQ(r.count(EventKind::suture_taken), 1u);
  EXPECT_EQ(static_cast<Fault>(static_cast<int>(r.last(EventKind::technique_fault)->value)), Fault::cut_before_knot);
  EXPECT_TRUE(r.suture().settled.empty() && r.solver().pin.empty());
}

// "so that physics is no longer performed on previous sutures": what a tick works on stays the same over ten of them, and such
// a state can be saved and loaded.
TEST(Settle, ten_stitches_leave_one_thread) {
  Tied r;
  for (int i = 0; i < 10; ++i) {
    if (i > 0) {
      const Place p = r.place(0.4f + 0.5f * static_cast<float>(i));
      r.whole_bite(p);
      r.draw(p, 0.05f, 0.6f);
      ASSERT_EQ(r.suture().point.size(), 2u) << i;
    }
    r.tie();
    r.let_go();
    r.press(1, kButtonNewSuture, {0.1f, 0.1f, 0});
    r.input.hand[1].buttons = 0;
    r.wait(0.1f);
    ASSERT_EQ(r.suture().settled.size(), static_cast<size_t>(i) + 1);
    EXPECT_EQ(r.thread().order.size(), 175u);
    EXPECT_TRUE(r.thread().anchor.empty());
    EXPECT_EQ(r.solver().pin.size(), 2 * (static_cast<size_t>(i) + 1));
  }
  const auto bytes = save_state(*r.model, *r.state);
  StatePtr again = initial_state(*r.model);
  load_state(*r.model, *again, bytes);
  EXPECT_EQ(hash_state(*r.model, *r.state), hash_state(*r.model, *again));
}

}  // namespace
}  // namespace catgut
