// SPDX-License-Identifier: Apache-2.0
// tests/sim: faults of technique are reported, once, without other consequences. Whole ticks with hands and needle on real
// tissue, one test per fault, and some seconds after each in which the state stays valid (the rig asserts it every tick).
#include <gtest/gtest.h>

#include "../suture/tie.h"
#include "procedure/scene_file.h"

namespace catgut {
namespace {

constexpr float kAfterwards = 3;  // [s]

std::vector<Event> faults(const Rig& r) {
  std::vector<Event> found;
  for (const Event& e : r.seen)
    if (e.kind == EventKind::technique_fault) found.push_back(e);
  return found;
}
// Reported once so far, and not again in the following seconds.
void expect_told_once(Rig& r, Fault fault, uint32_t which) {
  for (const bool later : {false, true}) {
    if (later) r.wait(kAfterwards);
    ASSERT_FALSE(testing::Test::HasFatalFailure());
    const std::vector<Event> reported = faults(r);
    ASSERT_EQ(reported.size(), 1u) << (later ? "seconds later" : "at once");
    EXPECT_STREQ(fault_name(reported[0].fault), fault_name(fault));
    EXPECT_EQ(reported[0].which, which);
    EXPECT_TRUE(is_finite(reported[0].where));
    EXPECT_LT(length(reported[0].where), 0.2f) << "somewhere in the field";
  }
  EXPECT_TRUE(r.order_is_whole());
}

// --- bites in the wrong order --------------------------------------------------------------------------------------------

// On the upper side of one of the two bowel ends of a seam's scene (they face each other along x), `along` it.
Place on_top(Rig& r, uint32_t wall, float along_x, float z) {
  const float side = wall == 0 ? -1.0f : 1.0f;
  SurfaceHit hit;
  const Vec3 above{side * along_x, r.model->scene.body[wall].radius + 0.0005f, z};
  EXPECT_TRUE(nearest_surface(r.model->solver, r.state->scratch.candidates, r.x(), above, 0.008f, hit));
  const Vec3 out{0, 1, 0}, up{0, 0, 1};
  return {hit.point, out, cross(out, up), up};
}
void bite_and_draw(Rig& r, const Place& p) {
  const size_t before = r.count(EventKind::bite_completed);
  r.let_go();  // of the bite before
  r.whole_bite(p);
  r.draw(p, 0.03f, 0.5f);
  ASSERT_EQ(r.count(EventKind::bite_completed), before + 1);
}

// A stay suture goes through one end, then through the other; here it comes back to the first.
TEST(WrongTechnique, a_stay_suture_that_goes_back_is_wrong_body) {
  Rig r(read_scene("stay"));
  r.wait(0.3f);
  bite_and_draw(r, on_top(r, 0, 0.012f, 0));
  bite_and_draw(r, on_top(r, 1, 0.012f, 0));
  ASSERT_TRUE(faults(r).empty()) << "so far it is in order";
  bite_and_draw(r, on_top(r, 0, 0.012f, 0.008f));
  expect_told_once(r, Fault::wrong_body, 2);
}

// A Connell bite goes from outside in; one that comes out again on the outside was too shallow.
TEST(WrongTechnique, a_connell_bite_that_does_not_reach_the_inside_is_wrong_layer) {
  Rig r(read_scene("connell"));
  r.wait(0.3f);
  bite_and_draw(r, on_top(r, 0, 0.010f, 0));
  expect_told_once(r, Fault::wrong_layer, 0);
}

// The purse-string has an event of its own for it, which names the suture point.
TEST(WrongTechnique, purse_string_bites_out_of_order_are_said) {
  Rig r;
  r.wait(0.3f);
  for (const float angle : {0.2f, 1.2f, 0.7f, 1.7f}) bite_and_draw(r, r.place(angle));
  const size_t reported = r.count(EventKind::bite_out_of_order);
  ASSERT_GE(reported, 1u);
  std::vector<uint32_t> which;
  for (const Event& e : r.seen)
    if (e.kind == EventKind::bite_out_of_order) which.push_back(e.which);
  EXPECT_EQ(which.front(), 2u) << "the third point is further from the second than the fifth is";
  std::sort(which.begin(), which.end());
  EXPECT_EQ(std::adjacent_find(which.begin(), which.end()), which.end()) << "each once";
  r.wait(kAfterwards);
  EXPECT_EQ(r.count(EventKind::bite_out_of_order), reported);
  EXPECT_TRUE(faults(r).empty());
}

// --- one wall only -------------------------------------------------------------------------------------------------------

// The tube of the rig, and another that faces it.
SceneSpec two_ends(const std::string& technique) {
  SceneSpec s = weightless(90);
  s.body.push_back(s.body[0]);
  s.body[1].name = "the other";
  s.body[1].position = {0, 0.012f, 0};
  s.body[1].axis = {0, -1, 0};
  s.technique.name = technique;
  return s;
}

TEST(WrongTechnique, a_stitch_tied_through_one_wall_is_said) {
  Tie r({}, two_ends("stay"));
  ASSERT_TRUE(faults(r).empty());
  r.take();
  ASSERT_EQ(r.count(EventKind::throw_started), 1u);
  r.pull_tight();
  EXPECT_EQ(r.count(EventKind::throw_locked), 1u) << "it is tied all the same";
  expect_told_once(r, Fault::one_wall_only, 1);
  EXPECT_TRUE(r.state->plan[0].pair.empty()) << "and draws nothing to the other wall";
}

// --- a knot before any suture point --------------------------------------------------------------------------------------

TEST(WrongTechnique, a_knot_before_any_bite_is_said) {
  for (const char* technique : {"none", "stay"}) {
    SCOPED_TRACE(technique);
    Tie r({}, two_ends(technique));
    r.sewn().point.clear();
    r.thread().anchor.clear();
    r.lay_along(r.setup.older - 1, -1, r.past_the_tip(xyz(r.x()[r.thread().order[r.setup.older]])), 0);
    r.input.hand[0].jaw = 0.3f;
    r.tick();
    ASSERT_EQ(r.suture().instrument[0].held, Held::thread);
    expect_told_once(r, Fault::knot_without_bite, 0);
    EXPECT_TRUE(r.sewn().knot.empty());
  }
}

// --- pulling with the needle in the tissue -------------------------------------------------------------------------------

// A complete bite, and the needle in the tissue again for a second one.
struct HalfBite : Rig {
  Place first, second;
  HalfBite() {
    wait(0.3f);
    first = place(0.2f), second = place(0.6f);
    bite_and_draw(*this, first);
    enter();
  }
  void enter() {
    let_go();
    approach(second);
    drive(second, -1.0f, 1.2f);
  }
  // Hand 1 grasps the thread `nodes` beyond the first bite: toward the needle (positive), or on the tail.
  void take(int nodes) {
    const size_t node =
        nodes > 0 ? node_of_point(1) + static_cast<size_t>(nodes) : node_of_point(0) - static_cast<size_t>(-nodes);
    ToolInput& hand = input.hand[1];
    hand.connected = 1;
    hand.pose = {xyz(x()[thread().order[node]]), axis_angle({1, 0, 0}, -0.5f * kPi)};
    hand.jaw = 0.7f;
    // The tool is placed there directly: obstacles on the path are not the subject.
    RigidBody& tool = solver().body[1];
    tool = {};
    tool.x = tool.prev_x = hand.pose.p, tool.q = tool.prev_q = hand.pose.q;
    state->hand[1].pose = hand.pose;
    state->hand[1].known = 1;
    hand.jaw = 0.3f;
    tick();
    ASSERT_EQ(suture().instrument[1].held, Held::thread);
  }
  void pull(Vec3 by, float seconds) {
    const Vec3 from = input.hand[1].pose.p;
    const int ticks = static_cast<int>(std::lround(seconds / model->dt));
    for (int i = 1; i <= ticks && !testing::Test::HasFatalFailure(); ++i) {
      input.hand[1].pose.p = from + by * (static_cast<float>(i) / static_cast<float>(ticks));
      tick();
    }
  }
  void let_thread_go() {
    for (float jaw : {0.5f, 0.8f}) input.hand[1].jaw = jaw, tick();
  }
};

TEST(WrongTechnique, pulling_the_tail_with_the_needle_in_the_tissue_is_said_once_a_bite) {
  HalfBite r;
  ASSERT_NE(phase_of(r.sewn()), NeedlePhase::outside);
  ASSERT_TRUE(faults(r).empty()) << "the needle itself drew the thread so far";
  r.take(-8);
  r.pull(r.first.out * 0.02f + r.first.up * 0.02f, 0.5f);
  EXPECT_GE(r.count(EventKind::particle_passed), 2u) << "nothing is repaired: the thread came";
  expect_told_once(r, Fault::needle_in_tissue, 1);
  EXPECT_EQ(faults(r)[0].who, 1);

  // Withdrawn and driven again, it is another bite, and the same mistake is another fault.
  r.let_thread_go();
  r.drive(r.second, 1.2f, -1.3f);
  ASSERT_EQ(r.count(EventKind::bite_withdrawn), 1u);
  r.enter();
  r.take(-8);
  r.pull(r.first.out * 0.03f + r.first.up * 0.03f, 0.5f);
  ASSERT_EQ(faults(r).size(), 2u);
  EXPECT_EQ(faults(r)[1].which, 2u);
}

TEST(WrongTechnique, pulling_the_needles_strand_with_the_needle_in_the_tissue_is_said) {
  HalfBite r;
  r.take(6);
  r.pull(r.first.out * 0.03f + r.first.up * 0.03f, 0.7f);
  expect_told_once(r, Fault::needle_in_tissue, 1);
}

TEST(WrongTechnique, holding_still_and_pulling_with_the_needle_out_are_no_mistakes) {
  HalfBite r;
  r.take(-8);
  r.wait(0.5f);
  r.let_thread_go();
  // The bite is finished: the needle pulls thread through both holes and through the previous bite, which is allowed.
  r.drive(r.second, 1.2f, 4.3f);
  ASSERT_EQ(r.count(EventKind::bite_completed), 2u);
  r.draw(r.second, 0.05f, 0.8f);
  EXPECT_GE(r.count(EventKind::particle_passed), 2u);
  const size_t passed = r.count(EventKind::particle_passed);
  r.take(-8);
  r.pull(r.first.out * 0.02f + r.first.up * 0.02f, 0.5f);
  EXPECT_GT(r.count(EventKind::particle_passed), passed) << "now the tail may be pulled";
  EXPECT_TRUE(faults(r).empty());
}

// --- cutting at the wrong place ------------------------------------------------------------------------------------------

TEST(WrongTechnique, cutting_the_thread_between_suture_points_is_said) {
  Tie r;
  const size_t node = (r.setup.older + r.setup.newer) / 2;
  const uint32_t slot = r.thread().order[node];
  snip(r, between(r, node));
  ASSERT_EQ(r.count(EventKind::thread_cut), 1u);
  expect_told_once(r, Fault::cut_in_stitch, slot);
}

TEST(WrongTechnique, cutting_before_anything_is_tied_is_said) {
  TieSetup setup;
  setup.turns = 0;
  Tie r(setup);
  const size_t node = r.setup.newer + 12;
  const uint32_t slot = r.thread().order[node];
  snip(r, between(r, node));
  ASSERT_EQ(r.count(EventKind::thread_cut), 1u);
  expect_told_once(r, Fault::cut_before_knot, slot);
}

// Lembert and the scissors both see that the knot will get no more throws.
TEST(WrongTechnique, cutting_a_knot_of_one_throw_is_one_fault_for_all_who_see_it) {
  SceneSpec scene = weightless(90);
  scene.body.push_back(scene.body[0]);
  scene.body[1].name = "inner";
  scene.body[1].radius = 0.0125f;
  scene.body[1].particles = 900;
  scene.technique.name = "lembert";
  Tie r({}, scene);
  r.take();
  r.pull_tight();
  ASSERT_EQ(r.count(EventKind::throw_locked), 1u);
  const size_t before = faults(r).size();  // both points lie in one layer, which is reported when it locks
  r.open(0);
  snip(r, between(r, r.node_of(r.sewn().knot[0].slot[0]) - 6));
  ASSERT_EQ(r.count(EventKind::thread_cut), 1u);
  r.wait(kAfterwards);
  size_t too_few = 0;
  for (const Event& e : faults(r)) too_few += e.fault == Fault::too_few_throws;
  EXPECT_EQ(too_few, 1u);
  EXPECT_EQ(faults(r).size(), before + 1);
}

}  // namespace
}  // namespace catgut
