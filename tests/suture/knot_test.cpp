// SPDX-License-Identifier: Apache-2.0
// tests/suture: throws and knots (paper 2.4, its last two paragraphs), sentence by sentence.
#include <gtest/gtest.h>

#include <cstdlib>

#include "core/random.h"
#include "tie.h"

namespace catgut {
namespace {

Vec3 target_of(Tie& r, size_t k = 0) { return position_of(r.sewn().knot[k].target, r.x()); }
const ThreadAnchor* anchor_at(Tie& r, uint32_t slot) {
  for (const ThreadAnchor& a : r.thread().anchor)
    if (a.slot == slot) return &a;
  return nullptr;
}
double rest_between(Tie& r, size_t a, size_t b) {
  double sum = 0;
  for (size_t i = std::min(a, b); i < std::max(a, b); ++i) sum += double{r.thread().rest[i]};
  return sum;
}

// "If the tool that has the loop around it grabs the free end of the rope passed the loop, a 3D object that represents the knot
// is created. The loop's ends are attached to the object, and the whole loop detaches from the tool."
TEST(Knot, is_begun_when_the_tool_with_the_loop_takes_the_other_end) {
  for (const bool tail : {false, true}) {
    TieSetup setup;
    setup.wrap_tail = tail;
    setup.older = 45, setup.newer = 50;
    Tie r(setup);
    ASSERT_EQ(r.loop().wraps, 1u);
    const uint32_t first = r.loop().first, last = r.loop().last;
    const int chirality = r.loop().chirality;
    r.take();
    ASSERT_EQ(r.suture().instrument[0].held, Held::thread);
    ASSERT_EQ(r.count(EventKind::throw_started), 1u);
    EXPECT_EQ(r.last(EventKind::throw_started)->value, 1.0f);
    EXPECT_EQ(r.loop().wraps, 0u);
    EXPECT_EQ(r.holds(HoldKind::loop), 0u);
    EXPECT_EQ(r.count(EventKind::loop_released), 0u) << "it became a throw";
    ASSERT_EQ(r.sewn().knot.size(), 1u);
    const Knot& k = r.sewn().knot[0];
    EXPECT_EQ(k.phase, KnotPhase::tightening);
    EXPECT_EQ(k.end[0], first);
    EXPECT_EQ(k.end[1], last);
    EXPECT_EQ(k.strand, r.suture().instrument[0].slot);
    EXPECT_EQ(k.throws, 1u);
    EXPECT_EQ(k.thrown[0].chirality, chirality);
    EXPECT_EQ(k.thrown[0].needle_end, tail ? 0 : 1);
    for (uint32_t slot : k.end) {
      const ThreadAnchor* a = anchor_at(r, slot);
      ASSERT_NE(a, nullptr);
      EXPECT_GT(length(a->offset), 0.01f) << "it begins where the loop was";
      EXPECT_FALSE(a->knotted);
    }
    EXPECT_EQ(r.count(EventKind::technique_fault), 0u);
  }
}

// "As the tool moves away from its original position, the knot object moves towards the suture point."
TEST(Knot, comes_down_as_far_as_the_tool_goes_away_and_does_not_go_back_up) {
  Tie r;
  r.take();
  ASSERT_EQ(r.sewn().knot.size(), 1u);
  const float far = length(r.sewn().knot[0].from);
  EXPECT_NEAR(far, 0.015f, 0.002f);
  const Vec3 from = r.sewn().knot[0].hand_from, away = rotate(r.frame.q, Vec3{0, 0.6f, 0.8f});
  for (int i = 0; i < 4; ++i) {
    r.move(0, away * 0.0015f, 0.1f);
    const float gone = distance(r.solver().body[0].x, from);
    ASSERT_EQ(r.sewn().knot[0].phase, KnotPhase::tightening);
    EXPECT_NEAR(r.sewn().knot[0].left, far - gone, 0.0005f);
    const ThreadAnchor* a = anchor_at(r, r.sewn().knot[0].end[0]);
    EXPECT_NEAR(length(a->offset), r.sewn().knot[0].left, 0.003f);
  }
  const float left = r.sewn().knot[0].left;
  r.move(0, away * -0.004f, 0.2f);
  EXPECT_LE(r.sewn().knot[0].left, left);
  EXPECT_EQ(r.count(EventKind::throw_locked), 0u);
}

// "When the knot object reaches the suture point or midpoint between the two previous suture points, it is locked in place, and
// the attached particles are released." Beyond the paper, it then holds a particle of both strands, at one point of the tissue.
TEST(Knot, locks_at_the_midpoint_and_holds_both_strands_there) {
  Tie r;
  const double length = r.rest_length();
  r.take();
  const uint32_t outer = r.sewn().knot[0].end[1];
  r.pull_tight();
  ASSERT_EQ(r.count(EventKind::throw_locked), 1u);
  ASSERT_EQ(r.sewn().knot.size(), 1u);
  const Knot& k = r.sewn().knot[0];
  EXPECT_EQ(k.phase, KnotPhase::locked);
  EXPECT_LT(distance(target_of(r), r.middle()), 1e-6f);
  ASSERT_EQ(k.slots, 2u);
  EXPECT_EQ(r.thread().anchor.size(), 4u);
  EXPECT_EQ(anchor_at(r, outer), nullptr) << "the loop's ends are released";
  for (uint32_t i = 0; i < 2; ++i) {
    const ThreadAnchor* a = anchor_at(r, k.slot[i]);
    ASSERT_NE(a, nullptr);
    EXPECT_TRUE(a->knotted);
    EXPECT_EQ(length2(a->offset), 0);
    EXPECT_LT(distance(xyz(r.x()[k.slot[i]]), target_of(r)), 1e-4f);
  }
  EXPECT_LT(r.node_of(k.slot[0]), r.node_of_point(0));
  EXPECT_GT(r.node_of(k.slot[1]), r.node_of_point(1));
  EXPECT_EQ(k.throws, 1u);
  EXPECT_EQ(k.thrown[0].wraps, 1u);
  EXPECT_EQ(k.thrown[0].chirality, 1);
  EXPECT_EQ(k.thrown[0].tension, r.last(EventKind::throw_locked)->value);
  EXPECT_LT(k.thrown[0].gap, 0.003f);
  // Tight: the thread between knot and suture points equals the path.
  EXPECT_EQ(k.slack_removed, 1u);
  EXPECT_NEAR(rest_between(r, r.node_of(k.slot[0]), r.node_of_point(0)), distance(target_of(r), r.point_at(0)), 0.0003);
  EXPECT_NEAR(rest_between(r, r.node_of(k.slot[1]), r.node_of_point(1)), distance(target_of(r), r.point_at(1)), 0.0003);
  EXPECT_NEAR(r.rest_length(), length, 1e-6);
  EXPECT_TRUE(r.order_is_whole());
  EXPECT_EQ(r.suture().instrument[0].held, Held::thread) << "the hand still has the end";
}

// "... the knot object moves towards the suture point", if there is one.
TEST(Knot, goes_to_the_suture_point_if_there_is_one) {
  Tie r;
  // The older point is removed; its thread is free end from there on.
  r.sewn().point[0] = r.sewn().point[1];
  r.sewn().point.pop_back();
  r.thread().anchor.erase(r.thread().anchor.begin());
  r.sewn().point[0].anchor = 0;
  r.lay_along(r.node_of_point(0) - 1, -1, r.past_the_tip(r.point_at(0)), 0);
  r.input.hand[0].jaw = 0.3f;
  r.tick();
  ASSERT_EQ(r.sewn().knot.size(), 1u);
  EXPECT_LT(distance(target_of(r), r.point_at(0)), 1e-7f);
  r.pull_tight();
  ASSERT_EQ(r.count(EventKind::throw_locked), 1u);
  EXPECT_EQ(r.sewn().knot[0].slots, 2u);
}

// With more than two points, the knot joins the two ends of the stitch.
TEST(Knot, of_a_long_stitch_goes_between_its_two_ends) {
  TieSetup setup;
  setup.older = 25, setup.newer = 40;
  Tie r(setup);
  lock(r, 30, r.place(0.3f, 0.004f).at);
  lock(r, 35, r.place(0.42f, 0.004f).at);
  const Vec3 ends = 0.5f * (r.point_at(0) + r.point_at(1));  // the first two that were made: the outermost along the thread
  r.take();
  ASSERT_EQ(r.sewn().knot.size(), 1u);
  EXPECT_LT(distance(target_of(r), 0.5f * (r.point_at(0) + r.point_at(1))), 1e-6f);
  EXPECT_LT(distance(target_of(r), ends), 0.001f);
}

// The end of a Connell: the needle's strand is tied to a bight between the last two points, or to itself. "... the knot object
// will move toward the midpoint of the last two created suture points."
TEST(Knot, of_a_running_suture_tied_to_itself_goes_to_the_midpoint_of_the_last_two_points) {
  TieSetup setup;
  setup.older = 15, setup.newer = 40;
  Tie r(setup);
  lock(r, 28, r.place(0.3f, 0.004f).at);
  ASSERT_EQ(r.loop().wraps, 1u);
  // The jaws take the thread between the last two points made: nodes 28 and 40.
  const size_t bight = 34;
  for (size_t i = 29; i < 40; ++i) {
    const float s = i <= bight ? static_cast<float>(i - 28) / 6 : static_cast<float>(40 - i) / 6;
    set(r.solver().x[r.thread().order[i]], lerp(i <= bight ? r.point_at(2) : r.point_at(1), r.solver().body[0].x, s));
  }
  r.input.hand[0].jaw = 0.3f;
  r.tick();
  ASSERT_EQ(r.suture().instrument[0].held, Held::thread);
  ASSERT_EQ(r.sewn().knot.size(), 1u);
  EXPECT_LT(distance(target_of(r), 0.5f * (r.point_at(1) + r.point_at(2))), 1e-6f);
  r.pull_tight();
  ASSERT_EQ(r.count(EventKind::throw_locked), 1u);
  EXPECT_EQ(r.sewn().knot[0].slots, 1u);
  EXPECT_GT(r.node_of(r.sewn().knot[0].slot[0]), r.node_of_point(1)) << "a particle of the needle's strand";
}

TEST(Knot, without_a_bite_is_a_fault_and_the_loop_falls_off) {
  Tie r;
  r.sewn().point.clear();
  r.thread().anchor.clear();
  r.lay_along(24, -1, r.past_the_tip(xyz(r.x()[r.thread().order[25]])), 0);
  r.input.hand[0].jaw = 0.3f;
  r.tick();
  ASSERT_EQ(r.suture().instrument[0].held, Held::thread);
  ASSERT_EQ(r.count(EventKind::technique_fault), 1u);
  EXPECT_EQ(r.last(EventKind::technique_fault)->fault, Fault::knot_without_bite);
  EXPECT_EQ(r.count(EventKind::loop_released), 1u);
  EXPECT_TRUE(r.sewn().knot.empty());
  EXPECT_EQ(r.holds(HoldKind::loop), 0u);
  EXPECT_TRUE(r.thread().anchor.empty());
}

TEST(Knot, begun_with_the_needle_still_in_the_tissue_is_said_and_goes_on) {
  Tie r;
  r.sewn().bite.resize(2);
  r.sewn().open.push_back({1, NeedlePhase::tip_in});
  r.take();
  ASSERT_EQ(r.count(EventKind::technique_fault), 1u);
  EXPECT_EQ(r.last(EventKind::technique_fault)->fault, Fault::needle_in_tissue);
  EXPECT_EQ(r.last(EventKind::technique_fault)->which, 1u);
  EXPECT_EQ(r.count(EventKind::throw_started), 1u);
}

// Jaws that close directly at the loop grasp the other end, however near the loop's own strands are.
TEST(Knot, the_jaws_take_the_other_end_and_not_the_loops_own_strand) {
  TieSetup setup;
  setup.depth = 0.0016f;
  Tie r(setup);
  ASSERT_EQ(r.loop().wraps, 1u);
  float nearest = 1;
  for (size_t i = r.node_of(r.loop().last) + 1; i < r.thread().order.size(); ++i)
    nearest = std::min(nearest, distance(xyz(r.x()[r.thread().order[i]]), r.solver().body[0].x));
  ASSERT_LT(nearest, r.model->suture.grasp_reach);
  r.take();
  ASSERT_EQ(r.suture().instrument[0].held, Held::thread);
  EXPECT_LT(r.node_of(r.suture().instrument[0].slot), r.node_of_point(0));
  EXPECT_EQ(r.count(EventKind::throw_started), 1u);
}

// The data of a state without positions and their derivatives.
struct Written {
  std::vector<uint32_t> order, anchored, held;
  std::vector<float> rest;
  std::vector<uint8_t> collides, cut;
  size_t points, knots, pins, attachments;
  std::array<uint32_t, 2> wraps;
};
Written written(Tie& r) {
  Written w;
  w.order = r.thread().order, w.rest = r.thread().rest, w.cut = r.thread().cut;
  for (const ThreadAnchor& a : r.thread().anchor) w.anchored.push_back(a.slot);
  for (const ThreadHold& h : r.thread().hold) w.held.push_back(h.slot);
  w.collides = r.collides();
  w.points = r.sewn().point.size(), w.knots = r.sewn().knot.size(), w.pins = r.solver().pin.size();
  w.attachments = r.solver().attach.size();
  w.wraps = {r.loop(0).wraps, r.loop(1).wraps};
  return w;
}

// "If the user decides they do not want to proceed with finalizing or tightening the knot, they can release the free end of the
// thread. After letting go, the loop will be released, and the knot object will be destroyed."
TEST(Knot, letting_go_takes_it_back_and_nothing_is_left_of_it) {
  // The twin grasps the end and releases it without a loop.
  Tie tied, twin;
  // Tissue and thread always move slightly: full friction makes the two comparable.
  for (Tie* r : {&tied, &twin})
    for (ThreadAnchor& a : r->thread().anchor) a.friction = 100, a.slipping = 0;
  for (float jaw : {1.0f, 0.7f}) twin.input.hand[0].jaw = jaw, twin.tick();
  ASSERT_EQ(twin.count(EventKind::loop_released), 1u);
  for (Tie* r : {&tied, &twin}) {
    r->take();
    for (ThreadAnchor& a : r->thread().anchor) a.friction = 100;
    ASSERT_EQ(r->suture().instrument[0].held, Held::thread);
    r->move(0, rotate(r->frame.q, Vec3{0, -0.3f, 0.8f}) * 0.006f, 0.2f);
    r->open(0);
  }
  ASSERT_EQ(tied.count(EventKind::throw_started), 1u);
  ASSERT_EQ(tied.count(EventKind::throw_undone), 1u);
  EXPECT_EQ(twin.count(EventKind::throw_started), 0u);
  const Written a = written(tied), b = written(twin);
  EXPECT_EQ(a.order, b.order);
  EXPECT_EQ(a.rest, b.rest);
  EXPECT_EQ(a.anchored, b.anchored);
  EXPECT_EQ(a.held, b.held);
  EXPECT_EQ(a.collides, b.collides);
  EXPECT_EQ(a.cut, b.cut);
  EXPECT_EQ(a.points, b.points);
  EXPECT_EQ(a.knots, 0u);
  EXPECT_EQ(a.pins, b.pins);
  EXPECT_EQ(a.attachments, b.attachments);
  EXPECT_EQ(a.wraps, b.wraps);
  for (size_t k = 0; k < 2; ++k) EXPECT_EQ(tied.sewn().point[k].anchor, twin.sewn().point[k].anchor);
}

TEST(Knot, a_further_throw_lies_on_the_first_and_a_reef_differs_from_a_granny) {
  for (const int second : {-1, 1}) {
    TieSetup setup;
    setup.particles = 110;
    Tie r(setup);
    r.take();
    r.pull_tight();
    ASSERT_EQ(r.count(EventKind::throw_locked), 1u);
    const std::array<uint32_t, 2> slot = r.sewn().knot[0].slot;
    const double inside = rest_between(r, r.node_of(slot[0]), r.node_of(slot[1]));
    r.wrap(second);
    ASSERT_EQ(r.loop().wraps, 1u);
    r.take();
    ASSERT_EQ(r.sewn().knot.size(), 1u) << "the same knot";
    EXPECT_EQ(r.sewn().knot[0].throws, 2u);
    EXPECT_EQ(r.sewn().knot[0].begun, 1u);
    EXPECT_EQ(r.sewn().knot[0].phase, KnotPhase::tightening);
    EXPECT_EQ(r.last(EventKind::throw_started)->which, 0u);
    r.pull_tight();
    ASSERT_EQ(r.count(EventKind::throw_locked), 2u);
    const Knot& k = r.sewn().knot[0];
    EXPECT_EQ(k.phase, KnotPhase::locked);
    EXPECT_EQ(k.slot, slot);
    EXPECT_EQ(r.thread().anchor.size(), 4u);
    EXPECT_EQ(k.thrown[0].chirality * k.thrown[1].chirality, second) << "opposite signs: a reef knot";
    EXPECT_EQ(rest_between(r, r.node_of(slot[0]), r.node_of(slot[1])), inside);
    EXPECT_TRUE(r.order_is_whole());
  }
}

TEST(Knot, taking_back_a_further_throw_leaves_the_first) {
  TieSetup setup;
  setup.particles = 110;
  Tie r(setup);
  r.take();
  r.pull_tight();
  ASSERT_EQ(r.count(EventKind::throw_locked), 1u);
  const Knot before = r.sewn().knot[0];
  r.wrap(-1);
  r.take();
  ASSERT_EQ(r.sewn().knot[0].throws, 2u);
  r.move(0, rotate(r.frame.q, Vec3{0, 0, 0.003f}), 0.1f);
  r.open(0);
  EXPECT_EQ(r.count(EventKind::throw_undone), 1u);
  ASSERT_EQ(r.sewn().knot.size(), 1u);
  const Knot& k = r.sewn().knot[0];
  EXPECT_EQ(k.phase, KnotPhase::locked);
  EXPECT_EQ(k.throws, 1u);
  EXPECT_EQ(k.slot, before.slot);
  EXPECT_EQ(k.thrown[0].tension, before.thrown[0].tension);
  EXPECT_EQ(r.thread().anchor.size(), 4u);
}

// --- "With a knot created and tightened, the suture-pulling system is affected." ---

// "When the suture pulling checks where to move a particle, it will stop at knots." From both sides.
TEST(PullWithKnot, no_particle_passes_a_locked_knot) {
  Tie r;
  r.take();
  r.pull_tight();
  ASSERT_EQ(r.count(EventKind::throw_locked), 1u);
  const Knot k = r.sewn().knot[0];
  const std::array<size_t, 4> nodes = {r.node_of(k.slot[0]), r.node_of_point(0), r.node_of_point(1), r.node_of(k.slot[1])};
  const std::vector<float> rest(r.thread().rest.begin() + static_cast<long>(nodes[0]),
                                r.thread().rest.begin() + static_cast<long>(nodes[3]));
  const size_t passed = r.count(EventKind::particle_passed);
  // The needle pulls its strand taut and 8 mm beyond; the hand does the same with the tail.
  for (int side = 0; side < 2; ++side) {
    const Vec3 knot = target_of(r);
    if (side == 0) {
      Pose to = r.circle();
      const Vec3 swage = xyz(r.x()[r.thread().order.back()]);
      const float taut = static_cast<float>(rest_between(r, nodes[3], r.thread().order.size() - 1));
      to.p += normalized(swage - knot) * (taut + 0.008f - distance(swage, knot));
      r.needle_to(to, 1.0f);
    } else {
      const Vec3 hand = r.solver().body[0].x;
      const float taut = static_cast<float>(rest_between(r, nodes[0], r.node_of(k.strand)));
      r.move(0, normalized(hand - knot) * (taut + 0.008f - distance(hand, knot)), 1.0f);
    }
    float most = 0;
    for (float t : r.thread().tension) most = std::max(most, t);
    EXPECT_GT(most, 5 * r.model->suture.pass_tension) << "it was a pull";
    EXPECT_EQ(r.count(EventKind::particle_passed), passed);
    EXPECT_EQ(nodes[0], r.node_of(k.slot[0]));
    EXPECT_EQ(nodes[1], r.node_of_point(0));
    EXPECT_EQ(nodes[2], r.node_of_point(1));
    EXPECT_EQ(nodes[3], r.node_of(k.slot[1]));
    EXPECT_TRUE(std::equal(rest.begin(), rest.end(), r.thread().rest.begin() + static_cast<long>(nodes[0])));
  }
}

// A running suture continues from a knot: knot at 20 and 26, then two points with slack between them and behind them.
void running_suture(Rig& rig, bool with_knot, Place& p) {
  rig.wait(0.1f);
  lock(rig, 20, rig.place(0.0f, 0.004f).at);
  lock(rig, 25, rig.place(0.2f, 0.004f).at);
  p = rig.place(0.9f, 0.004f);
  lock(rig, 34, rig.place(0.55f, 0.004f).at);
  lock(rig, 43, p.at);
  const size_t n = rig.thread().order.size();
  const auto arch = [&](size_t a, size_t b, Vec3 from, Vec3 to, Vec3 out) {
    const float length = static_cast<float>(b - a) * rig.model->solver.strand[0].spacing, chord = distance(from, to);
    const float height = 0.5f * std::sqrt(std::max(0.0f, length * length - chord * chord));
    for (size_t i = a + 1; i < b; ++i) {
      const float s = static_cast<float>(i - a) / static_cast<float>(b - a);
      set(rig.solver().x[rig.thread().order[i]], lerp(from, to, s) + out * (height * (1 - std::abs(2 * s - 1))));
    }
  };
  lay(rig, 0, 19, rig.point_at(0), {0, 1, 0}, -1);
  arch(20, 25, rig.point_at(0), rig.point_at(1), rig.place(0.1f).out);
  arch(25, 34, rig.point_at(1), rig.point_at(2), rig.place(0.35f).out);
  arch(34, 43, rig.point_at(2), rig.point_at(3), rig.place(0.7f).out);
  lay(rig, 44, n - 1, rig.point_at(3), p.out, 1);
  put_needle(rig, xyz(rig.solver().x[rig.thread().order.back()]));
  if (with_knot) {
    Knot k;
    k.phase = KnotPhase::locked;
    k.target = midway(rig.model->solver.shape.rest.data(), rig.thread().anchor[0].point, rig.thread().anchor[1].point);
    k.slot = {rig.thread().order[18], rig.thread().order[27]};
    k.strand = rig.thread().order[10];
    k.slots = 2, k.slack_removed = 1, k.throws = 1;
    rig.sewn().knot.push_back(k);
    for (uint32_t slot : k.slot) {
      ThreadAnchor a;
      a.slot = slot;
      a.point = k.target;
      a.knotted = true;
      rig.thread().anchor.push_back(a);
      set(rig.solver().x[slot], position_of(k.target, rig.x()));
    }
  }
}

void draw(Rig& rig, const Place& p, float meters) {
  for (int i = 0; i < static_cast<int>(meters / 0.0002f); ++i) {
    Pose to = rig.circle();
    to.p += p.out * 0.0002f;
    rig.needle_to(to, 1.0f / 60);
  }
}

// "If there are no knots on the thread, the suture pulling will check from the needle end to the free end for slack between
// suture points, and if none is found, it will pull from the free end."
TEST(PullWithKnot, without_one_thread_comes_from_the_free_end_once_the_slack_is_out) {
  SceneSpec scene = weightless(60);
  scene.mechanics.pass_tension = 0.005f;  // single particles of tissue move far before more slides
  Rig rig(scene);
  Place p;
  running_suture(rig, false, p);
  const size_t tail = rig.node_of_point(0);
  draw(rig, p, 0.035f);
  EXPECT_LT(rig.node_of_point(0), tail);
  EXPECT_TRUE(rig.order_is_whole());
}

// "With a knot created, the suture pulling will perform the same slack check from the needle end but will stop checking when
// the knot is found. This ensures slack is resolved up to the knot, respecting that the thread cannot be pulled past the knot."
TEST(PullWithKnot, slack_is_resolved_up_to_the_knot_and_no_further) {
  Rig rig(weightless(60));
  Place p;
  running_suture(rig, true, p);
  const size_t tail = rig.node_of_point(0), second = rig.node_of_point(1);
  const uint32_t needle_side = rig.sewn().knot[0].slot[1];
  const size_t knot = rig.node_of(needle_side);
  const std::vector<float> rest(rig.thread().rest.begin(), rig.thread().rest.begin() + static_cast<long>(knot));
  const double length = rig.rest_length();
  draw(rig, p, 0.012f);
  EXPECT_GE(rig.count(EventKind::particle_passed), 4u) << "slack between knot and needle is resolved";
  EXPECT_EQ(rig.node_of_point(0), tail);
  EXPECT_EQ(rig.node_of_point(1), second);
  EXPECT_EQ(rig.node_of(needle_side), knot);
  for (size_t i = 0; i < knot; ++i) EXPECT_EQ(rig.thread().rest[i], rest[i]) << i;
  for (const Event& e : rig.seen)
    if (e.kind == EventKind::particle_passed) { EXPECT_GE(e.which, 2u) << "only points this side of the knot"; }
  EXPECT_NEAR(rig.rest_length(), length, 1e-6);
}

TEST(DrawThrough, moves_exactly_that_much_and_loses_nothing) {
  for (const int way : {1, -1})
    for (const float meters : {0.0003f, 0.0016f, 0.0101f, 0.02f}) {
      Rig rig(weightless(50));
      rig.wait(0.05f);
      lock(rig, 25, rig.place(0.4f).at);
      const uint32_t slot = rig.thread().order[25];
      const auto behind = [&] {
        double s = 0;
        for (size_t i = 0; i < rig.node_of(slot); ++i) s += double{rig.thread().rest[i]};
        return s;
      };
      const double length = rig.rest_length(), before = behind();
      SutureContext context = rig.context();
      OneSuture one(context, 0);
      EXPECT_NEAR(draw_through(one, slot, way, meters), meters, 1e-7f);
      EXPECT_NEAR(behind(), before - way * double{meters}, 1e-6);
      EXPECT_NEAR(rig.rest_length(), length, 1e-7);
      EXPECT_TRUE(rig.order_is_whole());
      for (float r : rig.thread().rest) EXPECT_GT(r, 0);
    }
}

TEST(DrawThrough, stops_where_the_next_particle_is_locked) {
  Rig rig(weightless(50));
  rig.wait(0.05f);
  lock(rig, 25, rig.place(0.4f).at);
  lock(rig, 28, rig.place(0.5f).at);
  const uint32_t slot = rig.thread().order[28];
  const float three = rig.thread().rest[25] + rig.thread().rest[26] + rig.thread().rest[27];
  SutureContext context = rig.context();
  OneSuture one(context, 0);
  const float gone = draw_through(one, slot, 1, 0.05f);
  EXPECT_LT(gone, three);
  EXPECT_GT(gone, three - 0.0002f);
  EXPECT_EQ(rig.node_of(slot), 26u);
}

TEST(Midway, is_the_middle_at_rest_and_under_every_affine_motion) {
  Rig rig;
  rig.wait(0.1f);
  const SolverModel& m = rig.model->solver;
  const auto point = [&](float angle) {
    SurfaceHit hit;
    const Place p = rig.place(angle);
    EXPECT_TRUE(nearest_surface(m, rig.state->scratch.candidates, rig.x(), p.at, 0.004f, hit));
    const uint32_t corner = m.collision.surface[hit.end.triangle][0];
    const uint32_t* member = m.shape.member.data() + size_t{m.shape.cluster_of[corner]} * m.shape.cluster_stride;
    uint32_t count = 0;
    while (count < m.shape.cluster_stride && member[count] < m.tissue) ++count;
    return spread_point({member, count}, m.shape.rest.data(), p.at);
  };
  const EmbeddedPoint a = point(0.3f), b = point(0.6f), c = midway(m.shape.rest.data(), a, b);
  EXPECT_LE(c.count, EmbeddedPoint::kMaxParticles);
  float sum = 0;
  for (uint32_t k = 0; k < c.count; ++k) sum += c.weight[k];
  EXPECT_NEAR(sum, 1, 1e-5f);
  const Vec4* rest = m.shape.rest.data();
  EXPECT_LT(distance(position_of(c, rest), 0.5f * (position_of(a, rest) + position_of(b, rest))), 1e-6f);
  Column<Vec4> bent(m.shape.rest.begin(), m.shape.rest.end());
  for (Vec4& p : bent) set(p, Vec3{1.2f * p.x + 0.3f * p.y, p.y - 0.2f * p.z, 0.9f * p.z} + Vec3{0.01f, 0, 0});
  EXPECT_LT(distance(position_of(c, bent.data()), 0.5f * (position_of(a, bent.data()) + position_of(b, bent.data()))), 1e-5f);
}

// A saved state with a loop, with a throw under way, with a knot being tightened or with a locked one
// continues identically.
TEST(KnotState, is_saved_whole) {
  Tie r;
  std::vector<std::vector<std::byte>> saved;
  std::vector<TickInput> input;
  std::vector<uint64_t> hash;
  const auto play = [&](int ticks) {
    saved.push_back(save_state(*r.model, *r.state));
    for (int i = 0; i < ticks; ++i) r.tick(), input.push_back(r.input), hash.push_back(hash_state(*r.model, *r.state));
  };
  play(3);
  r.take();
  input.clear(), hash.clear(), saved.clear();
  const Vec3 away = rotate(r.frame.q, Vec3{0, 0.7f, 0.7f});
  std::vector<size_t> at;
  for (int part = 0; part < 8; ++part) {
    at.push_back(hash.size());
    saved.push_back(save_state(*r.model, *r.state));
    for (int i = 0; i < 6; ++i) {
      r.input.hand[0].pose.p += away * 0.0008f;
      r.tick();
      input.push_back(r.input), hash.push_back(hash_state(*r.model, *r.state));
    }
  }
  ASSERT_EQ(r.count(EventKind::throw_locked), 1u);
  for (size_t s = 0; s < saved.size(); ++s) {
    StatePtr again = initial_state(*r.model);
    load_state(*r.model, *again, saved[s]);
    EXPECT_EQ(save_state(*r.model, *again), saved[s]);
    Jobs jobs(2);
    for (size_t i = at[s]; i < hash.size(); ++i) {
      step(*r.model, *again, input[i], jobs);
      ASSERT_EQ(hash_state(*r.model, *again), hash[i]) << "saved at " << at[s] << ", tick " << i;
    }
  }
}

// Random hands: wind, grasp, release, cut, request a new suture, save and load. Nothing breaks, and every
// index is valid (load_state checks).
TEST(KnotState, survives_hands_that_do_anything) {
  const bool long_run = std::getenv("CATGUT_LONG") != nullptr;
  Random random(7);
  for (int run = 0; run < (long_run ? 40 : 2); ++run) {
    TieSetup setup;
    setup.particles = 100;
    setup.older = 30 + random.next() % 20, setup.newer = setup.older + 5;
    setup.way = random.next() % 2 ? 1 : -1;
    setup.wrap_tail = random.next() % 3 == 0;
    SceneSpec scene = weightless(100);
    if (random.next() % 2) scene.solver.gravity = {0, -9.81f, 0};
    Tie r(setup, scene);
    const double length = r.rest_length();
    for (int i = 0; i < 60; ++i) {
      switch (random.next() % 9) {
        case 0:
          if (r.sewn().point.size() >= 2) r.take(random.next() % 2);
          break;
        case 1:
          r.open(random.next() % 2, random.next() % 2 ? 1.0f : 0.7f);
          break;
        case 2:
          r.pull_tight(0.01f + 0.01f * random.uniform());
          break;
        case 3:
          r.move(0, rotate(r.frame.q, Vec3{random.uniform() - 0.5f, random.uniform(), random.uniform() - 0.5f}) * 0.02f, 0.2f);
          break;
        case 4:
          if (r.sewn().point.size() >= 2) r.wrap(random.next() % 2 ? 1 : -1, random.next() % 2 ? 1.25f : 2.25f);
          break;
        case 5:
          snip(r, between(r, random.next() % (r.thread().order.size() - 1), random.uniform()));
          break;
        case 6:
          if (random.next() % 3) break;
          if (r.ghost >= 0) r.let_go();
          r.order(CommandKind::new_suture, 0);
          break;
        case 7:
          r.input.hand[1] = r.input.hand[0], r.input.hand[1].pose.p += Vec3{0.002f, 0, 0}, r.tick();
          break;
        case 8:
          if (r.sewn().point.size() < 2 && r.thread().anchor.empty()) r.sew(6 * random.uniform()), r.put_tool(), r.tick();
          break;
      }
      if (HasFatalFailure()) return;
      ASSERT_TRUE(r.order_is_whole());
      ASSERT_NEAR(r.rest_length(), length, 1e-4);
      const std::vector<std::byte> saved = save_state(*r.model, *r.state);
      StatePtr again = initial_state(*r.model);
      ASSERT_NO_THROW(load_state(*r.model, *again, saved)) << "run " << run << ", deed " << i;
    }
  }
}

}  // namespace
}  // namespace catgut
