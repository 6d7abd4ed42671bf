// SPDX-License-Identifier: Apache-2.0
// tests/suture: loops of thread round a tool (paper 2.4, figure 10). A collection of shapes, each generated and named;
// then loops wound by hands in a whole scene.
#include "suture/loop.h"

#include <gtest/gtest.h>

#include <functional>
#include <string>

#include "tie.h"

namespace catgut {
namespace {

// The real tools of sim/build: jaws and shaft.
const std::vector<Capsule> kTool = {{{0, 0, 0.0015f}, {0, 0, 0.016f}, 0.0012f}, {{0, 0, 0.018f}, {0, 0, 0.12f}, 0.0025f}};
constexpr float kReach = 0.0025f, kOn = 0.00135f;  // [m] radius of thread that lies on the jaws
constexpr float kTurn = 2 * kPi;

using Curve = std::vector<Vec3>;  // finely sampled, tool frame

Curve operator+(Curve a, const Curve& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}
Curve line(Vec3 a, Vec3 b) {
  Curve c;
  const int n = std::max(1, static_cast<int>(distance(a, b) / 0.0001f));
  for (int i = 0; i <= n; ++i) c.push_back(lerp(a, b, static_cast<float>(i) / static_cast<float>(n)));
  return c;
}
// An arc round the tool's axis (or round `center`) from angle a by `angle`, with linear radii and depth.
struct Arc {
  float from = 0, angle = kTurn;
  float radius = kOn, radius_end = 0;     // [m] 0: as at the start
  float depth = 0.008f, pitch = 0.0004f;  // [m] z at the start; advance per turn toward the hand
  float flat = 1;                         // the y radius over the x radius
  Vec3 center;
};
Curve arc(const Arc& a) {
  Curve c;
  const int n = 400;
  const float end = a.radius_end > 0 ? a.radius_end : a.radius;
  for (int i = 0; i <= n; ++i) {
    const float s = static_cast<float>(i) / n, phi = a.from + a.angle * s, r = a.radius + (end - a.radius) * s;
    c.push_back(a.center +
                Vec3{r * std::cos(phi), a.flat * r * std::sin(phi), a.depth + a.pitch * std::abs(a.angle) / kTurn * s});
  }
  return c;
}
// Straight leads of `length` that leave both ends along the thread's own direction.
Curve with_leads(const Curve& c, float length = 0.03f, float rise = 0) {
  const Vec3 in = normalized(c[1] - c[0]), out = normalized(c.back() - c[c.size() - 2]);
  return line(c.front() - in * length - Vec3{0, 0, rise}, c.front()) + c +
         line(c.back(), c.back() + out * length + Vec3{0, 0, rise});
}
// Leads straight away from the tool's axis: the thread does not cross itself again.
Curve with_radial_leads(const Curve& c, float length = 0.03f) {
  const Vec3 a{c.front().x, c.front().y, 0}, b{c.back().x, c.back().y, 0};
  return line(c.front() + normalized(a) * length, c.front()) + c + line(c.back(), c.back() + normalized(b) * length);
}
Curve mirrored(Curve c) {
  for (Vec3& p : c) p.y = -p.y;
  return c;
}
Curve reversed(Curve c) {
  std::reverse(c.begin(), c.end());
  return c;
}
Curve shifted(Curve c, Vec3 by) {
  for (Vec3& p : c) p += by;
  return c;
}

// Particles `spacing` apart along the curve, the first `phase` of a spacing in.
std::vector<Vec3> sample(const Curve& c, float spacing, float phase) {
  std::vector<Vec3> p;
  float next = phase * spacing, along = 0;
  for (size_t i = 0; i + 1 < c.size(); ++i) {
    const float l = distance(c[i], c[i + 1]);
    while (l > 0 && next <= along + l) {
      p.push_back(lerp(c[i], c[i + 1], (next - along) / l));
      next += spacing;
    }
    along += l;
  }
  return p;
}

LoopVerdict judge(const std::vector<Vec3>& thread, const Pose& tool, float spacing) {
  std::vector<Vec4> x;
  std::vector<uint32_t> order;
  for (const Vec3& p : thread) {
    order.push_back(static_cast<uint32_t>(x.size()));
    x.push_back(point(transform(tool, p)));
  }
  return find_loop(x.data(), order, {tool, kTool}, spacing, kReach);
}

struct Shape {
  const char* name;
  Curve curve;
  LoopReason reason = LoopReason::none;
  uint32_t wraps = 1;
  int32_t turn = 1;
  float spacing = 0;  // [m] 0: all of 1.2, 1.6 and 2.5 mm
};

std::vector<Shape> zoo() {
  std::vector<Shape> z;
  const auto is = [&](const char* name, Curve c, uint32_t wraps, int32_t turn, float spacing = 0) {
    z.push_back({name, std::move(c), LoopReason::none, wraps, turn, spacing});
  };
  const auto none = [&](const char* name, Curve c, LoopReason why, float spacing = 0) {
    z.push_back({name, std::move(c), why, 0, 0, spacing});
  };
  const auto coil = [](float turns, float radius = 0.0018f) {
    Arc a;
    a.angle = turns * kTurn;
    a.radius = radius;
    return a;
  };
  Arc a;

  // --- loops ---
  is("single wrap", with_leads(arc(coil(1.2f))), 1, 1);
  is("single wrap, the other way", mirrored(with_leads(arc(coil(1.2f)))), 1, -1);
  is("single wrap, free end and needle end exchanged", reversed(with_leads(arc(coil(1.2f)))), 1, -1);
  a = coil(1.2f), a.pitch = -0.0004f;
  is("single wrap that advances toward the tip turns the same way", with_leads(arc(a)), 1, 1);
  is("single wrap of strands that cross at a right angle", with_leads(arc(coil(0.75f))), 1, 1);
  is("single wrap of strands that cross at 60 degrees", with_leads(arc(coil(0.83f))), 1, 1);
  is("tight wrap on the metal", with_leads(arc(coil(1.25f, kOn))), 1, 1);
  is("double wrap", with_leads(arc(coil(2.2f))), 2, 1);
  is("double wrap, the other way", mirrored(with_leads(arc(coil(2.2f)))), 2, -1);
  is("double wrap, strands at a right angle", with_leads(arc(coil(1.75f))), 2, 1);
  is("triple wrap", with_leads(arc(coil(3.2f))), 3, 1);
  is("triple wrap, the other way", mirrored(with_leads(arc(coil(3.2f)))), 3, -1);
  is("five wraps", with_leads(arc(coil(5.2f, 0.0021f))), 5, 1);
  a = coil(1.2f, 0.0033f);
  is("wrap with slack", with_leads(arc(a)), 1, 1);
  a = coil(2.2f, 0.0033f);
  is("double wrap with slack", with_leads(arc(a)), 2, 1);
  a = coil(1.3f, 0.0033f), a.flat = 0.55f;
  is("loose ellipse, flat", with_leads(arc(a)), 1, 1);
  a = coil(1.3f, 0.0019f), a.flat = 1.7f;
  is("loose ellipse, tall", with_leads(arc(a)), 1, 1);
  a = coil(1.2f, 0.0022f), a.center = {0.001f, -0.0006f, 0};
  is("loop that hangs to one side", with_leads(arc(a)), 1, 1);
  a = coil(2.2f, 0.0032f), a.radius_end = 0.0016f;
  is("spiral that closes up", with_leads(arc(a)), 2, 1);
  a = coil(2.2f, 0.0016f), a.radius_end = 0.0032f;
  is("spiral that opens", with_leads(arc(a)), 2, 1);
  a = coil(1.25f), a.depth = 0.0012f;
  is("wrap close behind the tip", with_leads(arc(a)), 1, 1);
  a = coil(1.2f, 0.0036f), a.depth = 0.05f;
  is("wrap far up the shaft", with_leads(arc(a)), 1, 1);
  a = coil(2.2f, 0.003f), a.depth = 0.0163f;
  is("double wrap where jaws and shaft meet", with_leads(arc(a)), 2, 1);
  a = coil(2.15f, 0.0021f), a.pitch = 0.001f;
  is("double wrap with a millimeter between its turns", with_leads(arc(a)), 2, 1);
  is("wrap with a kink beside it",
     with_leads(arc(coil(1.2f))) + arc({0, -0.9f * kTurn, 0.0022f, 0, 0.008f, 0, 1, Vec3{0.03f, 0.008f, 0}}), 1, 1, 0.0016f);
  is("single wrap, then straight along the shaft",
     with_leads(arc(coil(1.2f))) + line({-0.02f, 0.022f, 0.0084f}, {-0.02f, 0.022f, 0.06f}), 1, 1);
  is("a single and, later, a double wrap: the larger is reported",
     with_leads(arc(coil(1.2f)), 0.012f) + shifted(with_leads(arc(coil(2.2f)), 0.012f), {0, 0, 0.012f}), 2, 1);
  is("a near miss and, later, a loop: the later one is found",
     with_radial_leads(arc(coil(0.7f)), 0.012f) + shifted(with_leads(arc(coil(1.2f)), 0.012f), {0, 0, 0.008f}), 1, 1);
  a = {kPi, -1.1f * kTurn, 0.0022f, 0, 0.00842f, 0.0004f, 1, Vec3{0.0044f, 0.0007f, 0}};
  is("figure of eight with the tool in one of its rings",
     with_leads(arc({0, 1.05f * kTurn, 0.0022f, 0, 0.008f, 0.0004f, 1, {}}) + arc(a)), 1, 1);
  a = {kPi, 1.5f * kTurn, 0.0021f, 0, 0.008f, 0.0004f, 1, {}};
  is("one and a half turns: thread leaves where it was going", with_leads(arc(a)), 1, 1);

  // --- none ---
  none("nothing near", line({-0.05f, 0.02f, 0.01f}, {0.05f, 0.02f, 0.01f}), LoopReason::no_crossing);
  none("thread across the tool", line({-0.03f, kOn, 0.01f}, {0.03f, kOn, 0.01f}), LoopReason::no_crossing);
  none("thread bent over the tool", with_leads(arc(coil(0.45f))), LoopReason::no_crossing);
  none("open curl of 200 degrees", with_radial_leads(arc(coil(200.0f / 360))), LoopReason::no_crossing);
  none("open curl of 270 degrees", with_radial_leads(arc(coil(0.75f))), LoopReason::no_crossing);
  none("near miss: 330 degrees", with_radial_leads(arc(coil(330.0f / 360))), LoopReason::no_crossing);
  none("near miss: 330 degrees, the other way", mirrored(with_radial_leads(arc(coil(330.0f / 360)))), LoopReason::no_crossing);
  none("near miss: an arc of 330 degrees and no more", arc(coil(330.0f / 360, 0.0024f)), LoopReason::no_crossing);
  none("thread along the shaft", line({0.0027f, 0, 0.002f}, {0.0027f, 0, 0.1f}), LoopReason::no_crossing);
  none("thread along the shaft and back on the other side",
       line({0.0027f, 0, 0.002f}, {0.0027f, 0.0001f, 0.07f}) + line({-0.0027f, 0, 0.07f}, {-0.0027f, 0.0002f, 0.002f}),
       LoopReason::no_crossing);
  a = coil(3), a.pitch = 0.006f;
  none("steep helix", with_radial_leads(arc(a)), LoopReason::too_deep);
  a = coil(2.2f), a.pitch = 0.0045f;
  none("helix of two turns, 4.5 mm a turn", with_leads(arc(a)), LoopReason::too_deep);
  a = coil(2.2f), a.pitch = -0.0045f;
  none("helix of two turns toward the tip", with_leads(arc(a)), LoopReason::too_deep);
  a = coil(1.2f), a.pitch = 0.008f;
  none("one turn stretched over 8 mm of the jaws", with_leads(arc(a)), LoopReason::too_deep);
  a = coil(1.2f, 0.0009f), a.center = {0.0025f, 0, 0};
  none("loop beside the tool", with_leads(arc(a)), LoopReason::tip_outside, 0.0008f);
  a = coil(2.2f, 0.0009f), a.center = {0, -0.0025f, 0};
  none("double loop beside the tool", with_leads(arc(a)), LoopReason::tip_outside, 0.0008f);
  a = coil(1.2f, 0.0018f), a.depth = -0.003f;
  none("loop beyond the tip", with_leads(arc(a)), LoopReason::no_crossing);
  a = coil(2.2f, 0.0018f), a.depth = -0.0012f;
  none("double loop just beyond the tip", with_leads(arc(a)), LoopReason::no_crossing);
  a = coil(1.2f, 0.0018f), a.center = {0.03f, 0, 0};
  none("loop round nothing", with_leads(arc(a)), LoopReason::no_crossing);
  a = coil(1.2f, 0.012f);
  none("loop of thread far round the tool, touching nothing", with_leads(arc(a)), LoopReason::no_crossing);
  none("figure of eight beside the tool",
       with_leads(arc({0, kTurn, 0.0007f, 0, 0.008f, 0.0004f, 1, {0.0017f, 0.0016f, 0}}) +
                      arc({kPi, -1.2f * kTurn, 0.0007f, 0, 0.0084f, 0.0004f, 1, {0.0031f, 0.0016f, 0}}),
                  0.005f),
       LoopReason::tip_outside, 0.0006f);
  none(
      "thread crossing over itself twice beside the tool",
      line({-0.01f, 0.002f, 0.008f}, {0.0024f, 0.002f, 0.008f}) + line({0.0024f, 0.002f, 0.008f}, {0.0024f, 0.0025f, 0.0083f}) +
          line({0.0024f, 0.0025f, 0.0083f}, {0, 0.0016f, 0.0084f}) + line({0, 0.0016f, 0.0084f}, {-0.0022f, 0.0026f, 0.0085f}) +
          line({-0.0022f, 0.0026f, 0.0085f}, {-0.01f, 0.005f, 0.0086f}),
      LoopReason::tip_outside, 0.0006f);
  return z;
}

const std::vector<Pose> kPoses = {
    {},
    {{0.1f, -0.05f, 0.2f}, axis_angle({1, 0, 0}, 1.1f)},
    {{-0.03f, 0.02f, 0.01f}, axis_angle(normalized(Vec3{1, 2, -1}), 2.3f)},
    {{0, 0.3f, 0}, axis_angle({0, 0, 1}, 0.7f)},
    {{0.01f, 0.01f, 0.01f}, axis_angle(normalized(Vec3{-3, 0.5f, 1}), 3.1f)},
};

TEST(LoopZoo, every_shape_is_what_its_name_says_at_every_angle_of_the_tool_and_for_coarse_and_fine_thread) {
  const std::vector<Shape> shapes = zoo();
  EXPECT_GE(shapes.size(), 50u);
  for (const Shape& s : shapes)
    for (const float spacing : s.spacing > 0 ? std::vector<float>{s.spacing} : std::vector<float>{0.0012f, 0.0016f, 0.0025f})
      for (const float phase : {0.0f, 0.21f, 0.5f, 0.83f})
        for (size_t k = 0; k < kPoses.size(); ++k) {
          SCOPED_TRACE(std::string(s.name) + ", spacing " + std::to_string(spacing) + ", phase " + std::to_string(phase) +
                       ", pose " + std::to_string(k));
          const std::vector<Vec3> thread = sample(s.curve, spacing, phase);
          const LoopVerdict v = judge(thread, kPoses[k], spacing);
          EXPECT_STREQ(loop_reason_name(v.reason), loop_reason_name(s.reason));
          EXPECT_EQ(v.wraps, s.wraps);
          if (s.wraps == 0) continue;
          EXPECT_EQ(v.turn, s.turn);
          EXPECT_LE(v.first + 2, v.last);
          ASSERT_LT(v.last, thread.size());
          for (size_t i = v.first; i <= v.last; ++i)
            EXPECT_LT(std::hypot(thread[i].x, thread[i].y), 0.0025f + kReach) << "its particles lie on the tool";
        }
}

// --- the stage ---

// "When both checks are identified as true, all the particles in the loop are attached to the tool using particle attachments."
TEST(Loop, its_particles_are_frozen_on_the_tool_and_go_where_it_goes) {
  for (const int way : {1, -1}) {
    TieSetup setup;
    setup.way = way;
    Tie r(setup);
    ASSERT_EQ(r.count(EventKind::loop_formed), 1u);
    EXPECT_EQ(r.last(EventKind::loop_formed)->which, 1u);
    EXPECT_EQ(r.last(EventKind::loop_formed)->value, static_cast<float>(way));
    EXPECT_EQ(r.loop().wraps, 1u);
    EXPECT_EQ(r.loop().chirality, way);
    const size_t first = r.node_of(r.loop().first), last = r.node_of(r.loop().last);
    EXPECT_EQ(r.holds(HoldKind::loop), last - first + 1);
    std::vector<Vec3> where;
    for (size_t i = first; i <= last; ++i)
      where.push_back(to_local(r.solver().body[0].pose(), xyz(r.x()[r.thread().order[i]])));
    r.move(0, Vec3{0, 0.004f, 0} + r.first.out * 0.004f, 0.4f);
    for (size_t i = first; i <= last; ++i)
      EXPECT_LT(distance(to_local(r.solver().body[0].pose(), xyz(r.x()[r.thread().order[i]])), where[i - first]), 1e-6f);
    EXPECT_EQ(r.count(EventKind::loop_formed), 1u) << "a loop is reported once";
    EXPECT_EQ(r.count(EventKind::loop_rejected), 0u);
  }
}

// A square knot's throws are wrapped in opposite senses with the same end, or in the same sense with the other end.
TEST(Loop, handedness_is_that_of_the_half_knot_whichever_end_was_wrapped) {
  for (const bool tail : {false, true})
    for (const int way : {1, -1}) {
      TieSetup setup;
      setup.way = way, setup.wrap_tail = tail;
      setup.older = 45, setup.newer = 50;
      Tie r(setup);
      ASSERT_EQ(r.loop().wraps, 1u) << (tail ? "tail" : "needle end");
      EXPECT_EQ(r.loop().chirality, way) << (tail ? "tail" : "needle end");
    }
}

TEST(Loop, turns_that_follow_are_added) {
  TieSetup setup;
  Tie r(setup);
  ASSERT_EQ(r.loop().wraps, 1u);
  const uint32_t first = r.loop().first, last = r.loop().last;
  // The strand beyond the frozen turn is wound round once more.
  const Pose tool = r.solver().body[0].pose();
  const size_t from = r.node_of(last) + 1;
  std::vector<Vec3> c;
  const Vec3 start = to_local(tool, xyz(r.x()[last]));
  const float phi0 = std::atan2(start.y, start.x);
  for (int i = 0; i <= 250; ++i) {
    const float phi = 1.2f * kTurn * static_cast<float>(i) / 250;
    c.push_back(transform(tool, {0.0021f * std::cos(phi0 + phi), 0.0021f * std::sin(phi0 + phi), start.z + 0.0001f * phi}));
  }
  const Vec3 out = normalized(c.back() - c[c.size() - 2]);
  Tie::line(c, c.back(), c.back() + out * 0.3f);
  c[0] = xyz(r.x()[last]);
  r.lay_along(from, 1, c, r.thread().order.size() - 1);
  r.let_go();
  put_needle(r, xyz(r.x()[r.thread().order.back()]));
  r.tick();
  EXPECT_EQ(r.loop().wraps, 2u);
  EXPECT_EQ(r.loop().first, first);
  EXPECT_GT(r.node_of(r.loop().last), r.node_of(last));
  EXPECT_EQ(r.holds(HoldKind::loop), r.node_of(r.loop().last) - r.node_of(r.loop().first) + 1);
  EXPECT_EQ(r.count(EventKind::loop_formed), 2u);
}

TEST(Loop, opening_wide_lets_it_go_once_and_it_does_not_come_back_by_itself) {
  Tie r;
  ASSERT_EQ(r.loop().wraps, 1u);
  for (float jaw : {0.6f, 0.9f, 0.93f}) r.input.hand[0].jaw = jaw, r.tick();
  EXPECT_EQ(r.loop().wraps, 1u) << "jaws open to take the other end";
  r.input.hand[0].jaw = 1, r.tick();
  EXPECT_EQ(r.loop().wraps, 0u);
  EXPECT_EQ(r.holds(HoldKind::loop), 0u);
  EXPECT_EQ(r.count(EventKind::loop_released), 1u);
  r.wait(0.2f);
  EXPECT_EQ(r.count(EventKind::loop_formed), 1u) << "a released loop counts again only after it has been off the tool";
}

TEST(Loop, a_pull_harder_than_a_grip_strips_it_off) {
  SceneSpec scene = weightless(90);
  Tie r({}, scene);
  ASSERT_EQ(r.loop().wraps, 1u);
  Pose to = r.circle();
  to.p += normalized(xyz(r.x()[r.thread().order.back()]) - r.solver().body[0].x) * 0.03f;
  r.needle_to(to, 0.5f);
  ASSERT_EQ(r.count(EventKind::loop_released), 1u);
  EXPECT_GT(r.last(EventKind::loop_released)->value, r.model->suture.instrument[0].thread_grip);
  EXPECT_EQ(r.holds(HoldKind::loop), 0u);
}

TEST(Loop, a_tool_that_holds_something_forms_none) {
  TieSetup setup;
  setup.turns = 0;
  Tie r(setup);
  r.take();
  ASSERT_EQ(r.suture().instrument[0].held, Held::thread);
  r.lay_along(r.node_of_point(1) + 1, 1, r.round_the_tool(r.point_at(1), 1.25f, 1), r.thread().order.size() - 1);
  r.wait(0.05f);
  EXPECT_EQ(r.count(EventKind::loop_formed), 0u);
}

TEST(Loop, a_rejection_is_told_once_and_brushing_thread_is_not_spoken_of) {
  // A helix: five turns along the jaws, 5 mm apart.
  TieSetup setup;
  setup.turns = 0;
  Tie r(setup);
  EXPECT_EQ(r.count(EventKind::loop_rejected), 0u);
  r.wait(0.2f);
  EXPECT_EQ(r.count(EventKind::loop_rejected), 0u) << "thread past the tip";
  std::vector<Vec3> c{r.point_at(1)};
  const float z = to_local(r.frame, r.point_at(1)).z;
  for (int i = 0; i <= 300; ++i) {
    const float phi = 1.25f * kTurn * static_cast<float>(i) / 300;
    c.push_back(transform(r.frame, {Tie::kRound * std::cos(phi), Tie::kRound * std::sin(phi), z + 0.0008f * phi}));
  }
  Tie::line(c, c.back(), c.back() + rotate(r.frame.q, Vec3{-0.3f, 0, 0.1f}));
  r.lay_along(r.node_of_point(1) + 1, 1, c, r.thread().order.size() - 1);
  r.let_go();
  put_needle(r, xyz(r.x()[r.thread().order.back()]));
  r.wait(0.2f);
  EXPECT_EQ(r.count(EventKind::loop_formed), 0u);
  ASSERT_EQ(r.count(EventKind::loop_rejected), 1u);
  EXPECT_EQ(r.last(EventKind::loop_rejected)->reason, LoopReason::too_deep);
}

// Nothing is placed directly: the forceps winds the thread round the needle holder, and the physics lays it.
TEST(Loop, a_hand_that_carries_the_thread_round_the_tool_lays_loops) {
  for (const int way : {1, -1})
    for (const float turns : {1.3f, 2.3f}) {
      TieSetup setup;
      setup.turns = 0;
      setup.particles = 130;
      setup.above = 0.06f;  // room for a hand between tool and tissue
      Tie r(setup);
      const float side = static_cast<float>(way);
      // The needle's strand stands straight out beside the tool; the forceps grasps it 24 mm beyond.
      const Vec3 beside = transform(r.frame, Vec3{side * 0.0016f, 0, 0.006f});
      std::vector<Vec3> c{r.point_at(1)};
      Tie::line(c, r.point_at(1), beside);
      Tie::line(c, beside, beside + rotate(r.frame.q, Vec3{0, 0.3f, 0}));
      r.lay_along(r.node_of_point(1) + 1, 1, c, r.thread().order.size() - 1);
      r.let_go();
      put_needle(r, xyz(r.x()[r.thread().order.back()]));
      r.let_go();  // the needle floats along
      size_t held = r.node_of_point(1) + 1;
      while (to_local(r.frame, xyz(r.x()[r.thread().order[held]])).y < 0.018f + 0.016f * turns) ++held;
      const Vec3 at = xyz(r.x()[r.thread().order[held]]);
      const Quat turned = r.frame.q * axis_angle({1, 0, 0}, kPi);  // the hand comes from the other side
      r.show(1, {at, turned}, 0.3f);
      ASSERT_EQ(r.suture().instrument[1].held, Held::thread);
      // Nearly taut, like a surgeon's: wound thread is no longer between hand and tool. And past the strand that comes
      // from the tissue, not through it.
      const float wound = 0.0015f, loose = 0.0018f, free = to_local(r.frame, at).y;
      const int ticks = static_cast<int>(turns * 60);
      for (int i = 1; i <= ticks; ++i) {
        const float phi = turns * kTurn * static_cast<float>(i) / static_cast<float>(ticks), left = free - loose * phi;
        r.input.hand[1].pose.p =
            transform(r.frame, {side * (wound * std::cos(phi) - left * std::sin(phi)),
                                wound * std::sin(phi) + left * std::cos(phi), 0.006f - 0.003f * std::min(1.0f, phi)});
        r.tick();
        if (HasFatalFailure()) return;
      }
      r.wait(0.2f);
      EXPECT_EQ(r.loop().wraps, turns < 2 ? 1u : 2u) << "way " << way;
      EXPECT_EQ(r.loop().chirality, way);
      EXPECT_EQ(r.count(EventKind::loop_rejected), 0u) << "half a turn on the way to a whole one is no mistake";
    }
}

TEST(Loop, a_near_miss_is_spoken_of_when_the_jaws_close) {
  TieSetup setup;
  setup.turns = 0;
  Tie r(setup);
  std::vector<Vec3> c;
  const float z = to_local(r.frame, r.point_at(1)).z;
  Tie::line(c, r.point_at(1), transform(r.frame, {0, -0.0017f, z}));
  for (int i = 0; i <= 200; ++i) {
    const float phi = (-90.0f + 320.0f * static_cast<float>(i) / 200) * kPi / 180;
    c.push_back(transform(r.frame, {0.0017f * std::cos(phi), 0.0017f * std::sin(phi), z}));
  }
  Tie::line(c, c.back(), c.back() + rotate(r.frame.q, Vec3{-0.2f, -0.2f, 0}));
  r.lay_along(r.node_of_point(1) + 1, 1, c, r.thread().order.size() - 1);
  r.let_go();
  put_needle(r, xyz(r.x()[r.thread().order.back()]));
  r.take();
  EXPECT_EQ(r.suture().instrument[0].held, Held::thread);
  EXPECT_EQ(r.count(EventKind::loop_formed), 0u);
  ASSERT_EQ(r.count(EventKind::loop_rejected), 1u);
  EXPECT_EQ(r.last(EventKind::loop_rejected)->reason, LoopReason::no_crossing);
}

}  // namespace
}  // namespace catgut
