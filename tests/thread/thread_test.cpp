// SPDX-License-Identifier: Apache-2.0
// tests/thread: the physical thread from outside: closed forms, conservation, replay. Knots and belt friction:
// tests/validation.
#include "thread/thread.h"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "thread/observe.h"
#include "thread/topology.h"
#include "validation/knot_scenes.h"
#include "validation/tool_ties.h"

namespace catgut::thread {
namespace {

std::vector<Vec3> line(size_t nodes, Vec3 from, Vec3 step) {
  std::vector<Vec3> p;
  for (size_t i = 0; i < nodes; ++i) p.push_back(from + step * static_cast<float>(i));
  return p;
}

Settings plain(float diameter = 0.35e-3f) {
  Settings s;
  s.material = properties(Material::silk, Size::usp_0);
  s.material.diameter = diameter;
  s.material.axial_stiffness = 500;
  s.material.bending_stiffness = 1e-8f;
  s.breaks = false;
  return s;
}

TEST(ThreadMaterial, has_sixteen_with_sane_numbers) {
  EXPECT_EQ(materials().size(), 16u);
  for (const Properties& p : materials()) {
    EXPECT_GT(p.diameter, 0.1e-3f) << p.name;
    EXPECT_LT(p.knot_strength, p.straight_strength) << p.name;
    EXPECT_GT(p.friction, 0.0f) << p.name;
    EXPECT_EQ(find_material(p.name), &p);
  }
  EXPECT_EQ(find_material("silk"), &properties(Material::silk, Size::usp_3_0));
  EXPECT_EQ(find_material("wool"), nullptr);
}

TEST(Thread, a_weight_stretches_it_by_force_over_stiffness) {
  const Settings settings = plain();
  State state = make_state(line(101, {0.3f, 0.2f, 0.1f}, {0, -1e-3f, 0}));
  Stepper stepper(state.nodes());
  Hold hold;
  hold.node = 0, hold.from = hold.to = state.position(0);
  const Pull pull{100, {0, -5, 0}};
  Surroundings around;
  around.holds = {&hold, 1}, around.pulls = {&pull, 1};
  for (int i = 0; i < 1500; ++i) stepper.step(settings, state, around);
  EXPECT_NEAR(hold.force.y, 5, 0.01);
  EXPECT_NEAR(0.1f - (state.position(100).y - hold.to.y) - 0.2f, 0.1f * 5 / 500, 2e-5);
  for (float t : state.tension) EXPECT_NEAR(t, 5, 0.02);
}

// Tip of a clamped rod under a transverse end load P L^2 / B = 1: Bisshopp and Drucker 1945, 10.1090/qam/13360.
TEST(Thread, a_clamped_end_bends_as_the_elastica_of_its_stiffness) {
  for (const float segment : {1e-3f, 0.5e-3f}) {
    Settings settings = plain();
    settings.material.bending_stiffness = 1e-7f;
    settings.damping = 10;
    const float length = 0.03f;
    const size_t n = static_cast<size_t>(std::lround(length / segment)) + 2;
    State state = make_state(line(n, {-segment, 0, 0}, {segment, 0, 0}));
    Stepper stepper(n);
    Hold hold[2];
    for (uint32_t i : {0u, 1u}) hold[i].node = i, hold[i].from = hold[i].to = state.position(i);
    const Pull pull{static_cast<uint32_t>(n) - 1, {0, -1e-7f / (length * length), 0}};
    Surroundings around;
    around.holds = hold, around.pulls = {&pull, 1};
    for (int i = 0; i < 2500; ++i) stepper.step(settings, state, around);
    // The discrete rod bends at its nodes, the clamp's node included: it is effectively half a segment longer.
    const float tolerance = 0.01f + 1.5f * segment / length;
    EXPECT_NEAR(-state.position(n - 1).y / length, 0.30172f, tolerance * 0.30172f) << segment;
    EXPECT_NEAR(1 - state.position(n - 1).x / length, 0.05643f, 2 * tolerance * 0.05643f) << segment;
  }
}

// Bent to an arc, bent back by most of the elastic curvature, then let go: from there it springs without yielding again. What
// is lost of the curvature is the elastic one, whatever the length of the segments; a bend that is less sharp springs back
// whole.
TEST(Thread, springs_back_from_a_bend_by_its_elastic_curvature) {
  Settings settings = plain();
  const float elastic = 1 / (4 * settings.material.diameter);  // [1/m]
  settings.material.elastic_curvature = elastic;
  settings.damping = 500;  // no swing past where it springs to: a bend that is drawn straight is forgotten
  for (const float segment : {0.25e-3f, 0.5e-3f})
    for (const float sharp : {0.7f, 1.4f, 2.0f}) {
      const size_t nodes = 2 + static_cast<size_t>(0.9f * kPi / (sharp * elastic * segment));
      const auto arc = [&](float curvature, size_t i) {
        const float a = curvature * segment * static_cast<float>(i), r = 1 / curvature;
        return Vec3{r * std::sin(a), r * (1 - std::cos(a)), 0};
      };
      State state = make_state(line(nodes, {}, {segment, 0, 0}));
      Stepper stepper(nodes);
      std::vector<Hold> hold(nodes);
      for (uint32_t i = 0; i < nodes; ++i) hold[i].node = i, hold[i].to = state.position(i);
      Surroundings around;
      around.holds = hold;
      const auto bend_to = [&](float from, float to) {
        for (int k = 1; k <= 101; ++k) {  // the last one at rest
          const float part = std::min(1.0f, 0.01f * static_cast<float>(k));
          for (size_t i = 0; i < nodes; ++i) hold[i].from = hold[i].to, hold[i].to = arc(from + (to - from) * part, i);
          stepper.step(settings, state, around);
        }
      };
      const auto bend_of_middle = [&] {
        const size_t i = nodes / 2;
        return length(state.position(i + 1) - state.position(i) * 2.0f + state.position(i - 1)) / (segment * segment);
      };
      bend_to(0, sharp * elastic);
      const float bent = bend_of_middle();
      bend_to(sharp * elastic, sharp * elastic - std::min(0.8f, 0.5f * sharp) * elastic);
      around.holds = {};
      for (int i = 0; i < 2000; ++i) stepper.step(settings, state, around);
      EXPECT_NEAR(bend_of_middle(), std::max(0.0f, bent - elastic), 0.03f * elastic) << segment << " " << sharp;
    }
}

TEST(Thread, keeps_its_momentum_when_it_hits_itself) {
  Settings settings = plain();
  settings.damping = 0;
  // A hairpin whose legs move toward each other, one faster.
  std::vector<Vec3> path = line(40, {-0.02f, 0, 0}, {0.5e-3f, 0, 0});
  for (int i = 1; i <= 12; ++i)
    path.push_back({path[39].x + 0.5e-3f * std::sin(i * 0.26f) * 4, 0.5e-3f * 4 * (1 - std::cos(i * 0.26f)), 0});
  for (const Vec3& p : line(40, path.back() - Vec3{0.5e-3f, 0, 0}, {-0.5e-3f, 0, 0})) path.push_back(p);
  State state = make_state(path);
  for (size_t i = 0; i < state.nodes(); ++i) state.v.set(i, i < 45 ? Vec3{0, 0.4f, 0.02f} : Vec3{0, -0.2f, 0});
  state.warm.assign(state.nodes(), 1);
  settings.mass_decay = 1e6f;  // constant masses: changing them would not conserve
  settings.touch_density = settings.free_density;
  Stepper stepper(state.nodes());
  auto momentum = [&] {
    Vec3 p{};
    for (size_t i = 0; i < state.nodes(); ++i) {
      const float span = 0.5f * ((i > 0 ? state.rest[i - 1] : 0) + (i < state.segments() ? state.rest[i] : 0));
      p += state.v.at(i) * (settings.free_density * span);
    }
    return p;
  };
  const Vec3 before = momentum();
  Surroundings around;
  bool touched = false;
  for (int i = 0; i < 60; ++i) {
    stepper.step(settings, state, around);
    for (const Crossing& c : state.crossing) touched |= c.normal_impulse > 0;
  }
  EXPECT_TRUE(touched);
  EXPECT_LT(length(momentum() - before), 2e-3f * length(before));
}

TEST(Thread, hangs_over_a_tool_and_weighs_on_it) {
  const Settings settings = plain();
  std::vector<Vec3> path = line(40, {-2.2e-3f, -0.02f, 0}, {0, 0.5e-3f, 0});
  for (int i = 1; i < 14; ++i) path.push_back({-2.2e-3f * std::cos(kPi * i / 14), 2.2e-3f * std::sin(kPi * i / 14), 0});
  for (const Vec3& p : line(41, {2.2e-3f, 0, 0}, {0, -0.5e-3f, 0})) path.push_back(p);
  State state = make_state(path);
  Stepper stepper(state.nodes());
  ToolCapsule tool;
  tool.a = tool.to_a = {0, 0, -0.02f}, tool.b = tool.to_b = {0, 0, 0.02f}, tool.radius = 2e-3f;
  const Pull pull[2] = {{0, {0, -1, 0}}, {static_cast<uint32_t>(path.size()) - 1, {0, -1, 0}}};
  Surroundings around;
  around.pulls = pull, around.tools = {&tool, 1};
  for (int i = 0; i < 500; ++i) stepper.step(settings, state, around);
  const Vec3 force = tool.force_a + tool.force_b;
  EXPECT_NEAR(force.y, -2, 0.02);
  EXPECT_NEAR(force.x, 0, 0.02);
  EXPECT_NEAR(tool.force_a.y, tool.force_b.y, 0.02);
}

// A scene with twelve sutures: 2200 nodes lie turn beside turn, and the last thread of all hangs over a rod. When the list of
// pairs was full it lost those of the last thread, which passed through a needle holder.
TEST(Thread, touches_a_rod_however_much_thread_lies_in_turns) {
  Settings settings = plain();
  settings.gravity = {};
  std::vector<Vec3> path;
  constexpr float kTurn = 2e-3f, kSegment = 0.5e-3f, kPitch = 0.8e-3f;  // [m]
  for (int i = 0; i < 2200; ++i) {
    const float angle = kSegment / kTurn * static_cast<float>(i);
    path.push_back({kTurn * std::cos(angle), 0.1f + kPitch * angle / 6.2831853f, kTurn * std::sin(angle)});
  }
  for (const Vec3 p : line(41, {-10e-3f, 2.7e-3f, 0}, {kSegment, 0, 0})) path.push_back(p);
  State state = make_state(path);
  state.broken[2199] = 1, state.rest[2199] = kSegment;
  Stepper stepper(state.nodes());
  ToolCapsule rod;
  rod.a = rod.to_a = {0, 0, -0.02f}, rod.b = rod.to_b = {0, 0, 0.02f}, rod.radius = 2.5e-3f;
  const std::vector<Pull> ends{{2200, {0, -0.1f, 0}}, {2240, {0, -0.1f, 0}}};
  Surroundings around;
  around.tools = {&rod, 1}, around.pulls = ends;
  for (int i = 0; i < 100; ++i) stepper.step(settings, state, around);
  EXPECT_GT(state.key.size(), 4096u) << "or the list was not full before, either";
  EXPECT_EQ(state.overflow, 0u);
  EXPECT_NEAR(state.position(2220).y, 2.5e-3f + 0.5f * settings.material.diameter, 0.05e-3f);
  EXPECT_NEAR(rod.force_a.y + rod.force_b.y, -0.2f, 0.01f) << "the rod bears both weights";
}

// Turns too near to each other for the list. What is left out is counted.
TEST(Thread, counts_the_pairs_that_its_list_had_no_room_for) {
  std::vector<Vec3> path;
  for (int i = 0; i < 1000; ++i) {
    const float angle = 0.25f * static_cast<float>(i);
    path.push_back({2e-3f * std::cos(angle), 0.25e-3f / 6.2831853f * angle, 2e-3f * std::sin(angle)});
  }
  State state = make_state(path);
  Stepper stepper(state.nodes());
  Surroundings around;
  stepper.step(plain(), state, around);
  EXPECT_EQ(state.key.size(), pair_capacity(path.size()));
  EXPECT_GT(state.overflow, 0u);
}

TEST(Thread, slides_down_a_slope_steeper_than_its_friction_only) {
  for (const float slope : {0.25f, 0.35f}) {
    Settings settings = plain();
    settings.gravity = {-9.81f * std::sin(std::atan(slope)), -9.81f * std::cos(std::atan(slope)), 0};
    settings.damping = 0;
    State state = make_state(line(30, {0, 0.5f * settings.material.diameter, 0}, {0, 0, 1e-3f}));
    Stepper stepper(state.nodes());
    Plane plane;
    plane.friction = 0.3f;
    Surroundings around;
    around.plane = &plane;
    for (int i = 0; i < 400; ++i) stepper.step(settings, state, around);
    // Beyond its friction it accelerates: g (sin - mu cos).
    const float a = slope - 0.3f, expected = a > 0 ? 0.5f * 9.81f * a * std::cos(std::atan(slope)) * 0.16f : 0;
    EXPECT_NEAR(-state.position(15).x, expected, 2e-5f + 0.03f * expected) << slope;
  }
}

TEST(Thread, breaks_at_its_strength_and_not_below) {
  for (const float share : {0.95f, 1.05f}) {
    Settings settings = plain();
    settings.material = properties(Material::silk, Size::usp_3_0);
    settings.breaks = true;
    State state = make_state(line(40, {}, {0.5e-3f, 0, 0}));
    Stepper stepper(state.nodes());
    Hold hold;
    hold.node = 0, hold.from = hold.to = state.position(0);
    Pull pull{39, {}};
    Surroundings around;
    around.holds = {&hold, 1}, around.pulls = {&pull, 1};
    for (int i = 0; i < 600; ++i) {
      pull.force.x = share * settings.material.straight_strength * std::min(1.0f, static_cast<float>(i) / 400);
      stepper.step(settings, state, around);
    }
    int broken = 0;
    for (uint8_t b : state.broken) broken += b;
    EXPECT_EQ(broken, share > 1 ? 1 : 0);
  }
}

// The bits of a run that is saved, loaded into a fresh state and continued are those of the uninterrupted run.
TEST(Thread, continues_from_a_copy_to_the_bit) {
  const Settings settings = validation::knot_settings(0.3f);
  validation::Tightened run(validation::lay_knot(validation::square(), settings.material.diameter, 0.5e-3f));
  validation::tighten(settings, run, 2, validation::Drawing::flat, 0.03f);
  State copy = run.knot.state;
  Stepper other(copy.nodes());
  Surroundings around;
  for (int i = 0; i < 20; ++i) {
    run.stepper.step(settings, run.knot.state, around);
    other.step(settings, copy, around);
    ASSERT_EQ(hash_state(run.knot.state), hash_state(copy)) << i;
  }
  copy.crossing[0].gap += 1e-9f;
  EXPECT_NE(hash_state(run.knot.state), hash_state(copy));
}

// A knot a meter away behaves like one at the origin: positions have more than 32 bits.
TEST(Thread, holds_a_meter_from_the_origin) {
  const Settings settings = validation::knot_settings(0.4f);
  validation::LaidKnot laid = validation::lay_knot(validation::square(), settings.material.diameter, 0.5e-3f);
  for (size_t i = 0; i < laid.state.nodes(); ++i) laid.state.x.add(i, {1.3f, -0.9f, 1.1f});
  validation::Tightened t(std::move(laid));
  validation::tighten(settings, t, 2);
  EXPECT_LT(std::abs(validation::creep(settings, t, 3, 8, 2)), 1e-6) << "it settles within six seconds";
}

std::vector<Vec3> closed(const validation::Throws& throws) {
  return validation::closed_curve(validation::lay_knot(throws, 0.35e-3f, 0.5e-3f));
}

TEST(Topology, determinants_are_those_of_the_books) {
  EXPECT_EQ(knot_determinant(closed(validation::single_throw())), 3u);
  EXPECT_EQ(knot_determinant(closed({{5, 1}})), 5u);
  EXPECT_EQ(knot_determinant(closed({{7, 1}})), 7u);
  EXPECT_EQ(knot_determinant(closed({{1, 1}})), 1u);
  EXPECT_EQ(knot_determinant(closed(validation::granny())), 9u);
  EXPECT_EQ(knot_determinant(closed(validation::square())), 9u);
  EXPECT_EQ(knot_determinant(closed(validation::surgeons())), 15u);
  EXPECT_EQ(knot_determinant(closed(validation::three_throws())), 27u);
  EXPECT_EQ(knot_determinant(closed(validation::surgeons_211())), 45u);
}

TEST(Topology, writhe_tells_granny_from_square) {
  EXPECT_NEAR(mean_writhe(closed(validation::square())), 0, 1.5);
  EXPECT_GT(std::abs(mean_writhe(closed(validation::granny()))), 4);
}

KnotType composed(std::vector<KnotFactor> factors) { return {true, std::move(factors)}; }

TEST(Topology, knot_type_finds_every_throw_and_its_hand) {
  EXPECT_EQ(knot_type(closed({{1, 1}})), composed({}));
  EXPECT_EQ(knot_type(closed({{3, 1}})), composed({{1, 1}}));
  EXPECT_EQ(knot_type(closed({{3, -1}})), composed({{1, -1}}));
  EXPECT_EQ(knot_type(closed({{7, -1}})), composed({{3, -1}}));
  EXPECT_EQ(knot_type(closed(validation::square())), composed({{1, 1}, {1, -1}}));
  EXPECT_EQ(knot_type(closed(validation::granny())), composed({{1, 1}, {1, 1}}));
  EXPECT_EQ(knot_type(closed({{3, -1}, {5, 1}})), composed({{2, 1}, {1, -1}}));
  EXPECT_EQ(knot_type(closed({{5, 1}, {5, -1}, {5, 1}, {3, 1}})), composed({{2, 1}, {2, 1}, {2, -1}, {1, 1}}));
}

// The figure-eight knot has the determinant of a double throw and is none.
TEST(Topology, knot_type_does_not_know_other_knots) {
  std::vector<Vec3> eight;
  for (int i = 0; i < 200; ++i) {
    const float t = 2 * kPi * static_cast<float>(i) / 200;
    eight.push_back({(2 + std::cos(2 * t)) * std::cos(3 * t), (2 + std::cos(2 * t)) * std::sin(3 * t), std::sin(4 * t)});
  }
  EXPECT_EQ(knot_determinant(eight), 5u);
  EXPECT_FALSE(knot_type(eight).known);
}

// A space curve bent by a smooth one-to-one map stays the knot that it is; its picture gets many more crossings.
TEST(Topology, knot_type_does_not_depend_on_shape) {
  std::vector<Vec3> coarse = closed(validation::surgeons_211()), curve;
  coarse.resize(coarse.size() - 4);  // without the far ends
  for (size_t i = 0; i + 1 < coarse.size(); ++i)
    for (int k = 0, n = 1 + static_cast<int>(distance(coarse[i], coarse[i + 1]) / 0.2e-3f); k < n; ++k)
      curve.push_back(lerp(coarse[i], coarse[i + 1], static_cast<float>(k) / static_cast<float>(n)) * 1000.0f);  // [mm]
  for (Vec3& p : curve) p.y += 3 * std::sin(0.8f * p.x), p.z += 2 * std::sin(0.9f * p.y), p.x += 2 * std::sin(0.7f * p.z);
  EXPECT_GT(project(curve, {0.3f, 0.5f, 0.8f}).size(), 20u);
  EXPECT_EQ(knot_type(close_curve(curve, {-300, 0, 50}, {300, 0, 50})), composed({{2, 1}, {1, 1}, {1, -1}}));
}

struct Named {
  validation::Throws throws;
  KnotName name;
  uint32_t count, wraps;
};

// Thread through two fixed holes that are nearer to each other than a node to the next. It is held at its begin and pulled at
// its end; a node waits between the holes.
struct TwoNearHoles {
  static constexpr float kSegment = 0.7e-3f;
  Settings settings;
  State state;
  std::optional<Stepper> stepper;
  Hold hold;
  Pull pull;
  std::vector<Vec3> at, speed, axis, impulse, moved;
  std::vector<float> w;
  std::vector<uint32_t> tilt_first;

  TwoNearHoles(Vec3 in, Vec3 between, Vec3 out, float apart, float friction, float pull_of_end)
      : at{{}, between * apart}, speed(2), axis(2, Vec3{0, 0, 1}), impulse(2), moved(2), w(4, 0.0f), tilt_first(3, 0) {
    settings.material = properties(Material::silk, Size::usp_2_0);
    settings.breaks = false;
    std::vector<Vec3> path = line(50, in * (-49.7f * kSegment), in * kSegment);
    std::vector<int32_t> hole(50, -1);
    for (const Vec3 p : {at[0], 0.5f * (at[0] + at[1]), at[1]}) path.push_back(p);
    for (const int32_t h : {0, -1, 1}) hole.push_back(h);
    for (const Vec3 p : line(49, at[1] + out * kSegment, out * kSegment)) path.push_back(p), hole.push_back(-1);
    state = make_laced_state(path, hole, friction);
    state.rest.assign(state.segments(), kSegment);
    stepper.emplace(state.nodes());
    hold.node = 0, hold.from = hold.to = state.position(0);
    pull = {static_cast<uint32_t>(state.segments()), out * pull_of_end};
  }
  // A step of 1 ms, in which the begin of the thread moves.
  void step(Vec3 moves = {}) {
    SoftPoints soft;
    soft.at = at, soft.speed = speed, soft.axis = axis, soft.w = w, soft.tilt_first = tilt_first;
    soft.impulse = impulse, soft.moved = moved;
    Surroundings around;
    around.holds = {&hold, 1}, around.pulls = {&pull, 1}, around.soft = &soft;
    hold.from = hold.to, hold.to = hold.to + moves;
    stepper->step(settings, state, around);
  }
};

// Thread that is drawn through both slides as through one, and bears what its friction on the way round makes of the pull at
// its end.
TEST(Thread, slides_through_two_holes_that_are_nearer_than_a_segment) {
  const float pull_of_end = 0.7f, friction = 0.15f;
  for (const float apart : {0.05e-3f, 0.15e-3f, 0.3e-3f, 0.4e-3f, 0.8e-3f})
    for (const float turn : {0.3f, 0.8f, 1.2f}) {
      const Vec3 in{1, 0, 0}, between{std::cos(turn), std::sin(turn), 0};
      const Vec3 out = normalized(Vec3{std::cos(2 * turn), std::sin(2 * turn), 0.3f});
      TwoNearHoles drawn(in, between, out, apart, friction, pull_of_end);
      for (int i = 0; i < 300; ++i) drawn.step();
      float most = 0;
      for (int i = 0; i < 500; ++i) {  // 10 mm/s
        drawn.step(in * -10e-6f);
        for (const float t : drawn.state.tension) most = std::max(most, t);
      }
      const float turned = std::acos(dot(in, between)) + std::acos(dot(between, out));
      EXPECT_NEAR(most, pull_of_end * std::exp(friction * turned), 0.1f) << apart << " m, " << turn;
      ASSERT_EQ(drawn.state.eyelet.size(), 2u);
      EXPECT_GE(drawn.state.eyelet[0].segment, 55u) << apart << " m, " << turn;  // 5 mm are seven nodes
    }
}

// The node between them that is struck stops, and the thread never bears more than a small part of its strength.
TEST(Thread, settles_between_two_holes_that_are_nearer_than_a_segment) {
  for (const float apart : {0.05e-3f, 0.15e-3f, 0.3e-3f}) {
    TwoNearHoles struck({1, 0, 0}, {-1, 0, 0}, normalized(Vec3{1, 0.2f, 0.3f}), apart, 0.15f, 0.05f);
    for (int i = 0; i < 300; ++i) struck.step();
    const size_t node = struck.state.eyelet[1].segment;
    struck.state.v.set(node, {0, 0.7f, 0.2f});
    float most = 0, late = 0;
    for (int i = 0; i < 500; ++i) {
      struck.step();
      for (const float t : struck.state.tension) most = std::max(most, t);
      if (i >= 200) late = std::max(late, length(struck.state.v.at(node)));
    }
    std::printf("%.2f mm apart: up to %.2f N; %.4f m/s after 0.2 s\n", 1e3 * static_cast<double>(apart),
                static_cast<double>(most), static_cast<double>(late));
    EXPECT_LT(most, 0.3f) << apart << " m";
    EXPECT_LT(late, 0.001f) << apart << " m";
  }
}

// Four holes in a soft thing, so near to each other that the thread has one node between them or none, and 5 N at the thread:
// two walls that a stitch draws together. With friction the holes' system can come near a singular one: without a bound a hole
// bore up to 930 kN here.
TEST(Thread, loads_holes_by_no_more_than_it_can_bear) {
  Settings settings;
  settings.material = properties(Material::silk, Size::usp_2_0);
  const float segment = 0.7e-3f, mass_w = 380, bears = settings.material.straight_strength;
  float most = 0;
  uint32_t seed = 1;
  const auto random = [&] { return static_cast<float>((seed = seed * 1664525u + 1013904223u) >> 8) * 0x1p-23f - 1; };
  for (int run = 0; run < 200; ++run) {
    std::vector<Vec3> at, speed(4), axis(4, Vec3{0, 0, 1});
    for (int i = 0; i < 4; ++i) at.push_back(Vec3{random(), random(), random()} * 0.7e-3f);
    std::vector<Vec3> path = line(20, at[0] - Vec3{20 * segment, 0, 0}, {segment, 0, 0});
    std::vector<int32_t> hole(20, -1);
    for (int i = 0; i < 4; ++i) {
      path.push_back(at[i]), hole.push_back(i);
      if (i < 3) path.push_back(0.5f * (at[i] + at[i + 1])), hole.push_back(-1);
    }
    for (const Vec3 p : line(20, at[3] + Vec3{0, segment, 0}, {0, segment, 0})) path.push_back(p), hole.push_back(-1);
    State state = make_laced_state(path, hole, 0.3f);
    state.rest.assign(state.segments(), segment);
    Stepper stepper(state.nodes());
    Hold hold;
    hold.node = 0, hold.from = hold.to = state.position(0);
    const Pull pull{static_cast<uint32_t>(state.segments()), {0, 5, 0}};
    std::vector<float> w(16, 0.0f);
    for (int i = 0; i < 4; ++i)
      for (int k = 0; k < 4; ++k) w[4 * i + k] = mass_w * (i == k ? 1.0f : i / 2 == k / 2 ? 0.95f : 0.1f);
    const std::vector<uint32_t> tilt_first(5, 0);
    std::vector<Vec3> impulse(4), moved(4);
    const std::vector<Vec3> home = at;
    for (int step = 0; step < 60; ++step) {
      SoftPoints soft;
      soft.at = at, soft.speed = speed, soft.axis = axis, soft.w = w, soft.tilt_first = tilt_first;
      soft.impulse = impulse, soft.moved = moved;
      Surroundings around;
      around.holds = {&hold, 1}, around.pulls = {&pull, 1}, around.soft = &soft;
      hold.from = hold.to, hold.to = hold.to - Vec3{20e-6f, 0, 0};
      stepper.step(settings, state, around);
      for (int i = 0; i < 4; ++i) {
        most = std::max(most, length(impulse[i]) / soft.step);
        at[i] += moved[i];
        speed[i] = (moved[i] / soft.step) * 0.5f + (home[i] - at[i]) * 100.0f;
      }
    }
  }
  std::printf("at most %.1f N on a hole, the thread bears %.1f N\n", static_cast<double>(most), static_cast<double>(bears));
  EXPECT_LT(most, 2 * bears);
}

TEST(Observe, names_what_was_wound_and_what_is_tight) {
  const Named all[] = {
      {validation::granny(), KnotName::granny, 2, 2},        {validation::square(), KnotName::square, 2, 2},
      {{{3, -1}, {3, 1}}, KnotName::square, 2, 2},           {{{3, -1}, {3, -1}}, KnotName::granny, 2, 2},
      {validation::surgeons(), KnotName::surgeons, 2, 3},    {{{3, 1}, {5, -1}}, KnotName::square, 2, 3},
      {validation::three_throws(), KnotName::square, 3, 3},  {{{3, 1}, {3, 1}, {3, -1}}, KnotName::mixed, 3, 3},
      {validation::surgeons_211(), KnotName::surgeons, 3, 4}};
  const Settings settings = validation::knot_settings(0.3f);
  for (const Named& n : all) {
    validation::Tightened t(validation::lay_on_rod(n.throws, settings.material.diameter, 0.5e-3f));
    for (const bool tight : {false, true}) {
      if (tight) validation::tighten(settings, t, 2);
      const SeenKnot seen = observe(settings, t.knot.state);
      EXPECT_EQ(seen.name, n.name) << name_of(seen.name) << " for " << name_of(n.name) << (tight ? ", tight" : ", wound");
      EXPECT_EQ(seen.throws, n.count);
      EXPECT_EQ(seen.wraps, n.wraps);
      EXPECT_GT(seen.confidence, 0.5f);
      EXPECT_FALSE(seen.sliding);
      for (uint32_t k = 0; k < n.count; ++k) {
        EXPECT_EQ(seen.item[k].half_turns, static_cast<uint32_t>(n.throws[k].half_turns)) << k;
        EXPECT_EQ(seen.item[k].hand, n.throws[k].hand) << k;
      }
    }
  }
}

// One strand kept tight, the other wound on it: half hitches, whatever the hands of the throws.
TEST(Observe, tells_half_hitches_from_flat_throws) {
  const Settings settings = validation::knot_settings(0.3f);
  for (const validation::Throws& throws : {validation::three_throws(), validation::surgeons_211()}) {
    validation::Tightened t(validation::lay_on_rod(throws, settings.material.diameter, 0.5e-3f));
    validation::tighten(settings, t, 2, validation::Drawing::under_tension);
    EXPECT_TRUE(observe(settings, t.knot.state).sliding);
  }
}

TEST(Observe, sees_a_single_throw_and_nothing_where_there_is_none) {
  const Settings settings = validation::knot_settings(0.3f);
  Surroundings nothing;
  for (const auto& [throws, wraps] : {std::pair{validation::Throws{{3, 1}}, 1u}, std::pair{validation::Throws{{5, 1}}, 2u},
                                      std::pair{validation::Throws{{1, 1}}, 0u}}) {
    validation::Tightened t(validation::lay_knot(throws, settings.material.diameter, 0.5e-3f));
    t.stepper.step(settings, t.knot.state, nothing);
    const uint64_t before = hash_state(t.knot.state);
    const SeenKnot seen = observe(settings, t.knot.state);
    EXPECT_EQ(seen.name, wraps ? KnotName::single_throw : KnotName::none);
    EXPECT_EQ(seen.wraps, wraps);
    EXPECT_EQ(hash_state(t.knot.state), before);  // it only observes
  }
}

// Two throws laid 3 mm apart and not drawn together.
TEST(Observe, calls_a_gap_between_throws_an_air_knot) {
  const Settings settings = validation::knot_settings(0.3f);
  validation::Tightened t(validation::lay_knot(validation::square(), settings.material.diameter, 0.5e-3f));
  Surroundings nothing;
  t.stepper.step(settings, t.knot.state, nothing);
  EXPECT_TRUE(observe(settings, t.knot.state).air);
  validation::tighten(settings, t, 2);
  EXPECT_FALSE(observe(settings, t.knot.state).air);
}

// Hands that feel decide by the state of the thread; the same state must give the same tie.
// A first throw on a rod, drawn with 1.7 N on each end. Then the hands keep 0.05 N, and what was drawn together goes apart by
// 4 mm: the middle of the bite is drawn down. Largest and smallest tension of the bite over the last millimeter.
struct Held {
  float drawn = 0, most = 0, least = 1e9f;  // [N]
};
Held first_throw(int half_turns, float friction_load) {
  Settings settings = plain();
  settings.material.friction_load = friction_load;
  const validation::Throw one{half_turns, 1};
  validation::LaidKnot k =
      validation::lay_on_rod({&one, 1}, settings.material.diameter, 2 * settings.material.diameter, 20e-3f);
  for (ToolCapsule& rod : k.rod) rod.friction = 0;
  Stepper stepper(k.state.nodes());
  Hold hold;
  hold.node = k.load_a, hold.from = hold.to = k.state.position(k.load_a), hold.stiffness = 2000;
  const Vec3 up{0, 0, 0.1f};
  const auto tension = [&] { return 0.5f * (k.state.tension[k.load_a] + k.state.tension[k.load_a - 1]); };
  Held result;
  for (int i = 0; i < 1400; ++i) {
    const float s = 1e-3f * static_cast<float>(i);
    const float hand = s < 0.4f ? 1.7f * std::min(1.0f, s / 0.2f) : std::max(0.05f, 1.7f * (0.6f - s) / 0.2f);
    if (i == 400) result.drawn = tension();
    hold.from = hold.to;
    if (i > 600) hold.to.z -= 5e-6f;
    const Pull pull[] = {{k.tail_a(), normalized(k.tail_direction_a + up) * hand},
                         {k.tail_b(), normalized(k.tail_direction_b + up) * hand}};
    Surroundings around;
    around.holds = {&hold, 1}, around.pulls = pull, around.tools = k.rod;
    stepper.step(settings, k.state, around);
    if (i >= 1200) result.most = std::max(result.most, tension()), result.least = std::min(result.least, tension());
  }
  return result;
}

TEST(FirstThrow, of_two_turns_locks_where_one_of_one_turn_slides_and_takes_more_pull) {
  const Held single = first_throw(3, 0.3f), twice = first_throw(5, 0.3f);
  std::printf("one turn: %.2f N of 1.7 drawn, then %.2f to %.2f N; two turns: %.2f N, then %.2f to %.2f N\n",
              static_cast<double>(single.drawn), static_cast<double>(single.least), static_cast<double>(single.most),
              static_cast<double>(twice.drawn), static_cast<double>(twice.least), static_cast<double>(twice.most));
  EXPECT_LT(single.most, 0.7f) << "with two hands of 0.05 N one turn slides";
  EXPECT_GT(twice.least, 1.5f) << "two turns do not";
  // Capstan, where friction is in proportion to the load: a turn more is 2.6 rad more of one strand round the other (measured
  // at friction 0.3).
  EXPECT_NEAR(std::log(first_throw(3, 0).drawn / first_throw(5, 0).drawn) / plain().material.friction, 2.6f, 0.6f);
}

// [m] by which a tied knot gives when its bite is loaded from nothing up to `load` [N], after both tails were pulled with
// `tails` [N]; 12 mm: it slides. The mean of three places of the nodes along the thread.
float gives(const validation::Throws& throws, float tails, float load) {
  Settings settings = validation::knot_settings(0.30f);
  settings.material = *find_material("silk 2-0");
  settings.breaks = false;
  const float segment = 0.7e-3f;
  float sum = 0;
  for (int k = 0; k < 3; ++k) {
    const float length = 15e-3f + static_cast<float>(k) * segment / 3;
    validation::Tightened t(validation::lay_knot(throws, settings.material.diameter, segment, length));
    const auto apart = [&] { return distance(t.knot.state.position(t.knot.load_a), t.knot.state.position(t.knot.load_b)); };
    validation::tighten(settings, t, tails, validation::Drawing::flat, 0.6f);
    const float before = apart();
    validation::pull_apart(settings, t, 0, 0.01f, load, 12e-3f);
    sum += apart() - before;
  }
  return sum / 3;
}

// Both ends pulled with 3.8 N tighten a square knot. A granny slides on, and so do throws that lie below another one: at
// friction 0.3 the ends' tension does not get past the last throw. Each throw must be tight before the next.
TEST(TiedKnot, gives_little_when_it_is_square_and_was_tightened) {
  const float square = gives(validation::square(), 3.8f, 0.8f), granny = gives(validation::granny(), 3.8f, 0.8f);
  const float three = gives(validation::three_throws(), 3.8f, 0.8f);
  std::printf("up to 0.8 N: square %.2f mm, granny %.2f mm, three throws tightened at once %.2f mm\n",
              1e3 * static_cast<double>(square), 1e3 * static_cast<double>(granny), 1e3 * static_cast<double>(three));
  EXPECT_LT(square, 0.8e-3f) << "a segment is 0.7 mm";
  EXPECT_GT(granny, 1.3f * square);
}

// A square knot that nothing loads: what the bite goes round has given way. A bar rubs across its strands and back, twice a
// second for 15 s, with at most 0.5 N on a segment; its lower side is at `height` [m] from the knot's middle. Returns the
// throws that are left.
uint32_t rubbed(float elastic_curvature, float height) {
  Settings settings = validation::knot_settings(0.30f);
  settings.material = *find_material("silk 2-0");
  settings.material.elastic_curvature = elastic_curvature;
  settings.material.friction_load = 0;  // in proportion to the load; more friction at small loads holds an elastic knot, too
  settings.breaks = false;
  settings.gravity = {0, 0, -0.1f}, settings.damping = 30;
  const float segment = 0.7e-3f, gave = 0.3e-3f;
  validation::Tightened t(validation::lay_on_rod(validation::square(), settings.material.diameter, segment));
  validation::tighten(settings, t, 2, validation::Drawing::flat, 0.6f);
  EXPECT_EQ(observe(settings, t.knot.state).throws, 2u);
  std::vector<ToolCapsule> tools = t.knot.rod;
  const uint32_t quarter = static_cast<uint32_t>(0.5f * kPi * tools[0].radius / segment);
  Hold hold[3];  // below the rod and beside it
  for (uint32_t k = 0; k < 3; ++k) {
    hold[k].node = t.knot.load_a + quarter * k - quarter;
    hold[k].from = t.knot.state.position(hold[k].node), hold[k].to = hold[k].from + Vec3{0, 0, k == 1 ? 0.0f : gave};
  }
  tools[0].radius -= gave;
  ToolCapsule bar;
  bar.radius = 1e-3f, bar.press = 0.5f;
  const auto place = [&](int tick) {
    return Vec3{4e-3f * std::sin(4 * kPi * 1e-3f * static_cast<float>(tick)), 0, height + bar.radius};
  };
  const Vec3 half{0, 6e-3f, 0};
  tools.push_back(bar);
  for (int i = 0; i < 15000; ++i) {
    ToolCapsule& b = tools.back();
    b.a = place(i) - half, b.b = place(i) + half, b.to_a = place(i + 1) - half, b.to_b = place(i + 1) + half;
    Surroundings around;
    around.tools = tools, around.holds = hold;
    t.stepper.step(settings, t.knot.state, around);
    for (Hold& h : hold) h.from = h.to;
  }
  return observe(settings, t.knot.state).throws;
}

TEST(TiedKnot, keeps_its_throws_without_load_because_bends_stay) {
  const float sharpest = find_material("silk 2-0")->elastic_curvature;
  for (const float height : {-0.7e-3f, -1.3e-3f}) {
    const uint32_t kept = rubbed(sharpest, height), sprung = rubbed(0, height);
    std::printf("of 2 throws %u are left, and %u of an elastic thread\n", kept, sprung);
    EXPECT_EQ(kept, 2u);
    EXPECT_LT(sprung, 2u) << "the bar is too gentle to tell the two apart";
  }
}

TEST(ToolTies, are_the_same_to_the_bit_every_time) {
  const Settings settings = validation::knot_settings(0.25f);
  validation::TieSettings how;
  how.seed = 5;
  const validation::TiedKnot first = validation::tie_with_tools(settings, {{1}}, how),
                             second = validation::tie_with_tools(settings, {{1}}, how);
  EXPECT_EQ(hash_state(first.state), hash_state(second.state));
  EXPECT_EQ(first.determinant, 3u);
  EXPECT_EQ(first.missed, 0);
  EXPECT_LE(first.fastest, 1.01f * how.speed);
  const SeenKnot seen = observe(settings, first.state);
  EXPECT_EQ(seen.name, KnotName::single_throw);
  EXPECT_EQ(seen.wraps, 1u);
}

}  // namespace
}  // namespace catgut::thread
