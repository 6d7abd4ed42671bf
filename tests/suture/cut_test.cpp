// SPDX-License-Identifier: Apache-2.0
// tests/suture: scissors: every stage treats a cut as an end of the thread; a wrong one is reported and stays.
#include <gtest/gtest.h>

#include "tie.h"

namespace catgut {
namespace {

size_t cuts(Rig& r) { return static_cast<size_t>(std::count(r.thread().cut.begin(), r.thread().cut.end(), 1)); }

TEST(Cut, the_nearest_pair_within_reach_once_a_command) {
  Rig r(weightless(40));
  r.wait(0.1f);
  snip(r, between(r, 12) + Vec3{0, 0.006f, 0});
  EXPECT_EQ(r.count(EventKind::thread_cut), 0u) << "out of reach";
  snip(r, between(r, 12, 0.4f) + Vec3{0, 0.003f, 0});
  ASSERT_EQ(r.count(EventKind::thread_cut), 1u);
  EXPECT_EQ(cuts(r), 1u);
  EXPECT_EQ(r.thread().cut[12], 1);
  EXPECT_EQ(r.last(EventKind::thread_cut)->which, r.thread().order[12]);
  EXPECT_EQ(r.last(EventKind::thread_cut)->value, -1.0f) << "no stitch to measure to";
  EXPECT_EQ(r.last(EventKind::technique_fault)->fault, Fault::cut_before_knot);
  // Without another command nothing is cut, whatever comes between the blades and whatever button is down.
  r.input.hand[1].buttons = kButtonCut | kButtonNewSuture;
  r.tick();
  for (int i = 0; i < 10; ++i) {
    r.input.hand[1].pose.p = between(r, 20), r.solver().body[1].x = between(r, 20);
    r.tick();
  }
  EXPECT_EQ(cuts(r), 1u);
}

TEST(Cut, nothing_acts_across_it) {
  Rig r(weightless(40));
  r.wait(0.1f);
  snip(r, between(r, 20));
  ASSERT_EQ(r.thread().cut[20], 1);
  r.wait(0.3f);
  const auto x = r.solver().x;
  // The needle moves away with its piece; the other one stays.
  r.hold_needle();
  Pose to = r.circle();
  to.p += Vec3{0.05f, 0.03f, 0.02f};
  r.needle_to(to, 0.8f);
  EXPECT_GT(distance(xyz(r.x()[r.thread().order[21]]), xyz(x[r.thread().order[21]])), 0.01f);
  for (size_t i = 0; i <= 20; ++i)
    EXPECT_LT(distance(xyz(r.x()[r.thread().order[i]]), xyz(x[r.thread().order[i]])), 0.0005f) << i;
  EXPECT_EQ(r.thread().tension[20], 0);
}

TEST(Cut, at_the_swage_takes_the_thread_off_the_needle) {
  Rig r(weightless(40));
  r.wait(0.1f);
  snip(r, between(r, 38, 0.8f));
  ASSERT_EQ(r.count(EventKind::thread_cut), 1u);
  EXPECT_EQ(cuts(r), 0u);
  EXPECT_TRUE(r.thread().hold.empty());
  Snapshot seen;
  publish(*r.model, *r.state, seen);
  EXPECT_FALSE(seen.active().needle_on_thread);
  r.hold_needle();
  Pose to = r.circle();
  to.p += Vec3{0.1f, 0.06f, 0};
  r.needle_to(to, 0.8f);
  EXPECT_GT(distance(xyz(r.x()[r.thread().order.back()]), needle_swage(r.model->solver.needle_arc[0], r.needle())), 0.03f);
}

TEST(Cut, a_needle_without_thread_leaves_none_in_the_tissue) {
  Rig r;
  r.wait(0.2f);
  snip(r, between(r, r.thread().order.size() - 2, 0.8f));
  ASSERT_TRUE(r.thread().hold.empty());
  const Place p = r.place(0.4f);
  r.whole_bite(p);
  EXPECT_EQ(r.count(EventKind::bite_completed), 1u);
  EXPECT_EQ(r.count(EventKind::suture_point), 0u);
  EXPECT_TRUE(r.thread().anchor.empty());
  EXPECT_TRUE(r.nothing_left_of_a_bite());
}

TEST(Cut, tells_how_long_the_tail_is_and_that_the_throws_are_too_few) {
  SceneSpec scene = weightless(90);
  scene.technique.throws = 2;
  Tie r({}, scene);
  r.take();
  r.pull_tight();
  ASSERT_EQ(r.count(EventKind::throw_locked), 1u);
  r.open(0);
  const Knot k = r.sewn().knot[0];
  const size_t at = r.node_of(k.slot[1]) + 4;
  float length = 0;
  for (size_t i = r.node_of(k.slot[1]); i < at; ++i) length += r.thread().rest[i];
  const float rest = r.thread().rest[at];
  snip(r, between(r, at));
  ASSERT_EQ(r.count(EventKind::thread_cut), 1u);
  ASSERT_EQ(r.thread().cut[at], 1);
  EXPECT_NEAR(r.last(EventKind::thread_cut)->value, length + 0.5f * rest, 0.0003f);
  ASSERT_EQ(r.count(EventKind::technique_fault), 1u);
  EXPECT_EQ(r.last(EventKind::technique_fault)->fault, Fault::too_few_throws);
  EXPECT_EQ(r.last(EventKind::technique_fault)->which, 0u);
  snip(r, between(r, r.node_of(k.slot[0]) - 5));
  EXPECT_EQ(r.count(EventKind::thread_cut), 2u);
  EXPECT_EQ(r.count(EventKind::technique_fault), 1u) << "of one knot it is said once";
  // The knot still holds.
  EXPECT_EQ(r.sewn().knot[0].slots, 2u);
  EXPECT_EQ(r.thread().anchor.size(), 4u);
}

TEST(Cut, in_the_stitch_is_a_fault_and_opens_it) {
  Rig r(weightless(60));
  r.wait(0.1f);
  lock(r, 20, r.place(0.0f, 0.004f).at);
  lock(r, 30, r.place(0.5f, 0.004f).at);
  const float before = length_between_ends(r.thread(), r.sewn());
  const Vec3 a = r.point_at(0), b = r.point_at(1);
  for (size_t i = 21; i < 30; ++i)
    set(r.solver().x[r.thread().order[i]], lerp(a, b, static_cast<float>(i - 20) / 10) + r.place(0.25f).out * 0.004f);
  const Vec3 at = between(r, 25);
  snip(r, at);
  ASSERT_EQ(r.count(EventKind::thread_cut), 1u);
  EXPECT_EQ(r.last(EventKind::technique_fault)->fault, Fault::cut_in_stitch);
  EXPECT_GT(length_between_ends(r.thread(), r.sewn()), before + 0.01f) << "nothing is drawn together any more";
  r.wait(0.3f);
  EXPECT_EQ(cuts(r), 1u) << "nothing is repaired";
}

TEST(Cut, to_a_pull_is_the_end_of_the_thread) {
  Rig r(weightless(40));
  r.wait(0.1f);
  const Place p = r.place(0.4f, 0.004f);
  lock(r, 30, p.at);
  lay(r, 0, 29, r.point_at(0), p.up, -1);
  lay(r, 31, 39, r.point_at(0), p.out, 1);
  put_needle(r, xyz(r.x()[r.thread().order.back()]));
  r.thread().cut[24] = 1;
  const std::vector<uint32_t> order(r.thread().order.begin(), r.thread().order.begin() + 26);
  for (int i = 0; i < 100; ++i) {
    Pose to = r.circle();
    to.p += p.out * 0.0002f;
    r.needle_to(to, 1.0f / 60);
  }
  EXPECT_GE(r.count(EventKind::particle_passed), 3u);
  EXPECT_GE(r.count(EventKind::thread_exhausted), 1u);
  EXPECT_TRUE(std::equal(order.begin(), order.end(), r.thread().order.begin())) << "what is beyond the cut stays";
  EXPECT_EQ(r.thread().cut[24], 1);
  EXPECT_EQ(cuts(r), 1u);
  EXPECT_EQ(r.node_of_point(0), 26u);
}

TEST(Cut, through_a_loop_takes_it_off) {
  Tie r;
  ASSERT_EQ(r.loop().wraps, 1u);
  snip(r, between(r, r.node_of(r.loop().first) + 1));
  EXPECT_EQ(r.count(EventKind::loop_released), 1u);
  EXPECT_EQ(r.loop().wraps, 0u);
  EXPECT_EQ(r.holds(HoldKind::loop), 0u);
}

TEST(Cut, off_the_stitch_takes_a_throw_back) {
  TieSetup setup;
  setup.older = 45, setup.newer = 50;
  Tie r(setup);
  r.take();
  ASSERT_EQ(r.sewn().knot.size(), 1u);
  r.thread().cut[r.node_of_point(0) - 3] = 1;  // the grasped end, between jaw and stitch
  r.tick();
  EXPECT_EQ(r.count(EventKind::throw_undone), 1u);
  EXPECT_TRUE(r.sewn().knot.empty());
  EXPECT_EQ(r.thread().anchor.size(), 2u);
}

// A stay suture: "A tool can grab the two ends of the thread and hold it."
TEST(Cut, both_ends_are_held_by_one_tool) {
  Rig r(weightless(80));
  r.wait(0.1f);
  snip(r, between(r, 70));
  const Vec3 at{0.05f, 0.05f, 0.05f};
  for (size_t i = 0; i <= 35; ++i) {  // a hairpin whose ends meet
    set(r.solver().x[r.thread().order[i]], at + Vec3{0.001f, 0, -0.0016f * static_cast<float>(i)});
    set(r.solver().x[r.thread().order[70 - i]], at + Vec3{-0.001f, 0, -0.0016f * static_cast<float>(i)});
  }
  ToolInput& hand = r.input.hand[0];
  hand.connected = 1, hand.pose = {at, {}}, hand.jaw = 0.3f;
  r.tick();
  ASSERT_EQ(r.suture().instrument[0].held, Held::thread);
  std::vector<uint32_t> held;
  for (const ThreadHold& h : r.thread().hold)
    if (h.kind == HoldKind::jaw) held.push_back(h.slot);
  ASSERT_EQ(held.size(), 2u);
  EXPECT_LE(std::min(r.node_of(held[0]), r.node_of(held[1])), 2u);
  EXPECT_GE(std::max(r.node_of(held[0]), r.node_of(held[1])), 68u);
  for (int i = 0; i < 30; ++i) {
    hand.pose.p.y += 0.0005f;
    r.tick();
    for (uint32_t slot : held) EXPECT_LT(distance(xyz(r.x()[slot]), r.solver().body[0].x), 0.004f);
  }
  for (float jaw : {0.4f, 0.7f}) hand.jaw = jaw, r.tick();
  for (const ThreadHold& h : r.thread().hold) EXPECT_NE(h.kind, HoldKind::jaw) << "opening drops both";
}

// Two threads lie across each other under the same scissors: the command says which of them is meant.
TEST(Cut, the_command_names_the_suture) {
  for (const uint16_t which : {uint16_t{0}, uint16_t{1}}) {
    SceneSpec scene = weightless(40);
    scene.suture.assign(2, {scene.thread, scene.needle});
    Rig r(scene);
    r.wait(0.1f);
    std::vector<Strand>& strand = r.solver().strand;
    // The second thread beside the first, 1 mm above it.
    for (size_t i = 0; i < strand[1].order.size(); ++i) {
      const Vec3 beside = xyz(r.x()[strand[0].order[i]]) + Vec3{0, 0.001f, 0};
      r.solver().x[strand[1].order[i]] = point(beside);
    }
    snip(r, between(r, 12), 1, which);
    ASSERT_EQ(r.count(EventKind::thread_cut), 1u);
    EXPECT_EQ(r.last(EventKind::thread_cut)->suture, which);
    for (uint16_t k = 0; k < 2; ++k)
      EXPECT_EQ(std::count(strand[k].cut.begin(), strand[k].cut.end(), 1), k == which) << "thread " << k;
    r.order(CommandKind::new_suture, 1, which);
    EXPECT_EQ(r.suture().suture[which].suture_index, 1u);
    EXPECT_EQ(r.suture().suture[1 - which].suture_index, 0u) << "the other lies as it was";
  }
}

TEST(Cut, commands_that_cannot_be_carried_out_change_nothing_and_are_reported) {
  Rig r(weightless(40));
  r.wait(0.1f);
  const auto refused = [&](CommandKind kind, size_t hand, uint16_t argument) {
    const size_t before = r.count(EventKind::instrument_refused);
    r.order(kind, hand, argument);
    return r.count(EventKind::instrument_refused) == before + 1;
  };
  r.input.hand[1].connected = 1;
  for (const CommandKind kind : {CommandKind::cut, CommandKind::new_suture}) {
    EXPECT_TRUE(refused(kind, 1, 1)) << "there is one suture";
    EXPECT_TRUE(refused(kind, 3, 0)) << "a hand that is not connected";
    EXPECT_TRUE(refused(kind, 200, 0)) << "no such hand";
  }
  EXPECT_EQ(r.count(EventKind::thread_cut), 0u);
  EXPECT_EQ(r.sewn().suture_index, 0u);
}

}  // namespace
}  // namespace catgut
