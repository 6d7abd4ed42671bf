// SPDX-License-Identifier: Apache-2.0
// tests of solver/contact, tools on tools: the force between two hands, in closed form; no pass-through;
// Coulomb; momentum; and separate tools have no contact.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <functional>

#include "core/hash.h"
#include "solver/substep.h"

namespace catgut {
namespace {

constexpr float kShaft = 0.0025f, kJaw = 0.0012f;           // [m] radii
constexpr float kHand = 1.0f / 3000, kHandTurning = 0.05f;  // [m/N], [rad/(N m)]
const Quat kLevel = axis_angle({0, 1, 0}, 0.5f * kPi);      // a tool that lies along x
const Quat kAcross{};                                       // and one along z

// Two tools as in the scenes, each on the spring of a hand.
struct Pair {
  SolverModel model;
  SolverState state;
  SolverScratch scratch;
  Jobs jobs{1};
  uint64_t step = 0;
  float deepest = 0;   // [m] overlap so far
  float steepest = 0;  // [m/s] of a tool so far

  Pair(const Pose& a, const Pose& b, float friction = 0, bool hands = true) {
    constexpr uint32_t kNodes = 8;
    std::vector<Vec3> start(1, Vec3{1, 1, 1});
    for (uint32_t i = 0; i < kNodes; ++i) start.push_back({2, 2, 2 + 0.0016f * static_cast<float>(i)});
    model.tissue = 1;
    model.count = 1 + kNodes;
    model.h = 1.0f / 960;
    model.gravity = model.tissue_gravity = {};
    model.body_damping = hands ? 20.0f : 0.0f;
    model.friction.tool = friction;
    model.inv_mass.assign(model.count, 1 / 2e-6f);
    model.inv_mass[0] = 0;
    StrandModel& t = model.strand.emplace_back();
    t.first_slot = 1, t.count = kNodes, t.spacing = 0.0016f, t.radius = 0.00015f, t.inv_mass = 1 / 2e-6f;
    model.body.resize(3);
    for (size_t k = 0; k < 2; ++k) {
      RigidModel& m = model.body[k];
      m.inv_mass = 20;
      m.inv_inertia = {2e4f, 2e4f, 4e4f};
      m.capsule.push_back({{0, 0, 0.0015f}, {0, 0, 0.016f}, kJaw});
      m.capsule.push_back({{0, 0, 0.018f}, {0, 0, 0.12f}, kShaft});
    }
    model.body[model.needle_body(0)].inv_mass = 1 / 3e-4f, model.body[model.needle_body(0)].inv_inertia = {1e8f, 1e8f, 1e8f};
    model.body[model.needle_body(0)].gravity = true;  // a needle, without a hand
    model.body[model.needle_body(0)].capsule.push_back({{}, {0, 0, 0.002f}, 0.0003f});
    const std::vector<float> mass{1.0f};
    model.shape = make_shape_model(std::span(start).first(1), mass, std::vector<std::vector<uint32_t>>{{0}});
    model.collision = make_tissue_collision(model.shape.rest, mass, std::vector<uint32_t>{0}, mass, {});
    state = make_solver_state(model, start);
    prepare_scratch(model, scratch);
    state.body[model.needle_body(0)].x = state.body[model.needle_body(0)].prev_x = {3, 3, 3};
    const std::array<Pose, 2> at{a, b};
    for (size_t k = 0; k < 2; ++k) {
      state.body[k].x = state.body[k].prev_x = at[k].p;
      state.body[k].q = state.body[k].prev_q = at[k].q;
      if (!hands) continue;
      Weld hand;
      hand.a = static_cast<int>(k);
      hand.target = at[k];
      hand.compliance = kHand;
      hand.angular_compliance = kHandTurning;
      state.weld.push_back(hand);
    }
  }
  float gap() const {
    float least = 1;
    for (const Capsule& a : model.body[0].capsule)
      for (const Capsule& b : model.body[1].capsule) {
        const Pose pa = state.body[0].pose(), pb = state.body[1].pose();
        const Vec3 a0 = transform(pa, a.a), a1 = transform(pa, a.b), b0 = transform(pb, b.a), b1 = transform(pb, b.b);
        const auto [s, t] = closest_on_segments(a0, a1, b0, b1);
        least = std::min(least, distance(lerp(a0, a1, s), lerp(b0, b1, t)) - a.radius - b.radius);
      }
    return least;
  }
  void run(double seconds, const std::function<void(float)>& hands = {}) {
    const int steps = static_cast<int>(std::lround(seconds / double{model.h}));
    for (int i = 0; i < steps; ++i) {
      if (hands) hands(static_cast<float>(i + 1) * model.h);
      if (step++ % 16 == 0) {
        find_boxes(model, state, scratch, jobs, nullptr);
        find_candidates(model, state, scratch, 0.008f, nullptr);
      }
      substep(model, state, scratch, jobs, nullptr);
      deepest = std::max(deepest, -gap());
      for (size_t k = 0; k < 2; ++k) steepest = std::max(steepest, length(state.body[k].v));
    }
  }
  const BodyContact& on(size_t k) const { return scratch.on_body[k]; }
  Vec3 force_on(size_t k) const { return on(k).linear / (model.h * model.h); }
  Vec3 hand_force(size_t k) const { return state.weld[k].lambda / (model.h * model.h); }  // on the tool
  uint64_t hash() const {
    uint64_t h = 0;
    for (const RigidBody& b : state.body) h = hash_bytes(&b, sizeof b, h);
    return hash_bytes(state.x.data(), state.x.size() * sizeof(Vec4), h);
  }
};

void expect_near(Vec3 a, Vec3 b, float within) {
  EXPECT_LT(distance(a, b), within) << a.x << " " << a.y << " " << a.z << " and " << b.x << " " << b.y << " " << b.z;
}

// Crossing shafts, one hand lower than the other tool allows: both springs carry the same force, all of it in the
// springs. The lever of the crossing on the wrist's spring counts too.
TEST(ToolsOnTools, two_hands_balance_in_closed_form) {
  for (const float lever : {0.02f, 0.06f, 0.1f}) {
    SCOPED_TRACE(lever);
    const float overlap = 0.003f;
    // Along x and along z, their axes cross `lever` from either tip; the second begins above and its hand goes down.
    const Pose low{{-lever, 0, 0}, kLevel}, high{{0, 2 * kShaft + 0.0005f, -lever}, kAcross};
    Pair p(low, high);
    p.run(0.2,
          [&](float t) { p.state.weld[1].target.p.y = 2 * kShaft + 0.0005f - (overlap + 0.0005f) * std::min(1.0f, t / 0.1f); });
    p.run(1.0);
    const float spring = kHand + lever * lever * kHandTurning, want = overlap / (2 * spring);
    const Vec3 one = p.force_on(0), two = p.force_on(1);
    std::printf("tools crossing %3.0f mm from the tips, hands %.0f mm into each other: %.3f N, in closed form %.3f N\n",
                1e3 * double{lever}, 1e3 * double{overlap}, double{length(two)}, double{want});
    EXPECT_NEAR(two.y, want, 0.03f * want);
    expect_near(one, -two, 1e-3f * want);
    expect_near(p.hand_force(0), -one, 0.01f * want);  // what the hands feel
    expect_near(p.hand_force(1), -two, 0.01f * want);
    expect_near(p.on(1).pressing / (p.model.h * p.model.h), two, 1e-3f * want);
    EXPECT_NEAR(p.on(1).pressed / (p.model.h * p.model.h), want, 0.03f * want);
    expect_near(p.on(0).angular + cross(p.state.body[0].x, p.on(0).linear),
                -(p.on(1).angular + cross(p.state.body[1].x, p.on(1).linear)), 1e-4f * length(p.on(0).angular));
    EXPECT_LT(p.deepest, 0.0001f);
    EXPECT_LT(length(p.state.body[1].v), 1e-4f) << "at rest";
  }
}

// A hand that drives its shaft across the other, at hand speed and far beyond: it stays on its side, for any contact
// without a force limit.
TEST(ToolsOnTools, nothing_passes_through) {
  for (const float speed : {0.05f, 0.2f, 0.5f, 1.5f})
    for (const float along : {0.008f, 0.03f, 0.09f})
      for (const float on_other : {0.008f, 0.05f}) {
        SCOPED_TRACE(testing::Message() << speed << " m/s, " << along << " and " << on_other << " m from the tips");
        Pair p({{-on_other, 0, 0}, kLevel}, {{0, 0.02f, -along}, kAcross}, 0.1f);
        p.model.tool_force = 1000;
        const float far = 0.03f, travel = 0.02f + far;
        p.run(travel / speed + 0.1f, [&](float t) { p.state.weld[1].target.p.y = 0.02f - std::min(travel, speed * t); });
        // At the crossing: distance of the axes, with the sign of the side.
        const Pose a = p.state.body[0].pose(), b = p.state.body[1].pose();
        const Vec3 ends[4] = {transform(a, {0, 0, 0}), transform(a, {0, 0, 0.12f}), transform(b, {0, 0, 0}),
                              transform(b, {0, 0, 0.12f})};
        const auto [s, t] = closest_on_segments(ends[0], ends[1], ends[2], ends[3]);
        EXPECT_LT(p.deepest, 0.0002f);
        EXPECT_TRUE(is_finite(a.p) && is_finite(b.p));
        const bool slid_off = s <= 0 || s >= 1 || t <= 0 || t >= 1;
        if (!slid_off) { EXPECT_GT(dot(lerp(ends[2], ends[3], t) - lerp(ends[0], ends[1], s), Vec3{0, 1, 0}), 0); }
      }
}

// A hand without force feedback continues: the force never exceeds the limit, and the tools finally slip past each other
// instead of interlocking.
TEST(ToolsOnTools, beyond_the_bound_they_slip_past_each_other) {
  for (const float speed : {0.05f, 0.2f, 0.5f}) {
    SCOPED_TRACE(speed);
    Pair p({{-0.05f, 0, 0}, kLevel}, {{0, 0.02f, -0.03f}, kAcross}, 0.1f);
    float most = 0;
    const float travel = 0.05f;
    p.run(travel / speed + 0.3f, [&](float t) {
      most = std::max(most, p.on(1).pressed / (p.model.h * p.model.h));
      p.state.weld[1].target.p.y = 0.02f - std::min(travel, speed * t);
    });
    EXPECT_GT(most, 0.9f * p.model.tool_force);
    EXPECT_LT(most, 1.2f * p.model.tool_force) << "of all it was pushed by, whatever was taken back";
    EXPECT_GE(p.gap(), -1e-5f);
    for (size_t k = 0; k < 2; ++k) EXPECT_LT(distance(p.state.body[k].x, p.state.weld[k].target.p), 1e-4f) << k;
  }
}

// Free bodies without damping: momentum and angular momentum are conserved.
TEST(ToolsOnTools, free_tools_keep_momentum) {
  for (const float friction : {0.0f, 0.3f}) {
    Pair p({{-0.03f, 0, 0}, kLevel}, {{0, 0.008f, -0.05f}, kAcross}, friction, false);
    p.state.body[1].v = {0.1f, -0.4f, 0.05f};
    p.state.body[1].omega = {1, 0.5f, 2};
    const auto momentum = [&] {
      std::array<Vec3, 2> sum{};
      for (size_t k = 0; k < 2; ++k) {
        const RigidBody& b = p.state.body[k];
        const RigidModel& m = p.model.body[k];
        const Vec3 l = rotate(conjugate(b.q), b.omega),
                   spin = rotate(b.q, {l.x / m.inv_inertia.x, l.y / m.inv_inertia.y, l.z / m.inv_inertia.z});
        sum[0] += b.v / m.inv_mass;
        sum[1] += spin + cross(b.x, b.v / m.inv_mass);
      }
      return sum;
    };
    const auto before = momentum();
    p.run(0.1);
    const auto after = momentum();
    EXPECT_GT(length(p.state.body[0].v), 0.02f) << "they were to meet";
    expect_near(after[0], before[0], 1e-4f * length(before[0]));
    // Free bodies are integrated without their gyroscopic torque, with or without contact: 2 %.
    expect_near(after[1], before[1], 0.02f * length(before[1]));
  }
}

// The upper tool slides along the lower one under load: the hand feels friction times the normal force, against the motion.
TEST(ToolsOnTools, sliding_obeys_coulomb) {
  for (const float friction : {0.1f, 0.3f}) {
    Pair p({{-0.06f, 0, 0}, kLevel}, {{0, 2 * kShaft, -0.06f}, kAcross}, friction);
    p.run(0.3, [&](float t) { p.state.weld[1].target.p.y = 2 * kShaft - 0.004f * std::min(1.0f, 5 * t); });
    const auto pressed = [&] { return p.on(1).pressed / (p.model.h * p.model.h); };
    const auto rubbed = [&] { return length(p.on(1).rubbing) / (p.model.h * p.model.h); };
    EXPECT_LT(rubbed(), 1.001f * friction * pressed());
    // A slow lateral pull, far below the friction limit: they stick.
    const auto apart = [&] { return p.state.body[1].x.x - p.state.body[0].x.x; };
    const float before = apart();
    p.run(0.1, [&](float t) { p.state.weld[1].target.p.x = 0.0001f * std::min(1.0f, 20 * t); });
    EXPECT_LT(std::abs(apart() - before), 0.00001f);
    EXPECT_GT(rubbed(), 0.1f);
    const float from = p.state.weld[1].target.p.x;
    p.run(0.5, [&](float t) { p.state.weld[1].target.p.x = from + 0.02f * t; });
    EXPECT_GT(pressed(), 1.0f);
    EXPECT_NEAR(rubbed(), friction * pressed(), 0.02f * friction * pressed());
    EXPECT_LT(p.on(1).rubbing.x, 0) << "against the way";
    EXPECT_NEAR(p.hand_force(1).x, rubbed(), 0.1f * rubbed());
  }
}

// Parallel shafts, pressed together along their whole length: they stay parallel except for the wrists' compliance, without
// rolling or jitter, and each hand feels the other's push.
TEST(ToolsOnTools, parallel_shafts_lie_still) {
  for (const float shift : {0.0f, 0.03f, -0.05f}) {
    SCOPED_TRACE(shift);
    Pair p({{}, kAcross}, {{0, 0.006f, shift}, kAcross}, 0.1f);
    p.run(0.2, [&](float t) { p.state.weld[1].target.p.y = 0.006f - 0.003f * std::min(1.0f, 10 * t); });
    p.run(0.5);
    const Quat was[2] = {p.state.body[0].q, p.state.body[1].q};
    p.run(0.5);
    for (size_t k = 0; k < 2; ++k) {
      const RigidBody& b = p.state.body[k];
      EXPECT_LT(length(rotation_vector(b.q * conjugate(was[k]))), 1e-4f);
      const Vec3 turned = rotation_vector(b.q);
      EXPECT_LT(std::abs(turned.z), 1e-3f) << "about its own axis";
      EXPECT_LT(std::abs(turned.y), 1e-3f) << "aside";
      EXPECT_LT(std::abs(turned.x), 0.05f);
      EXPECT_LT(length(b.v), 1e-3f);
    }
    EXPECT_LT(p.deepest, 0.0001f);
    EXPECT_GT(p.force_on(1).y, 1.0f);
    expect_near(p.force_on(0), -p.force_on(1), 0.01f);
  }
}

// Hands that connect with overlapping tools, even on the same axis: separated in some ticks, without a jerk.
TEST(ToolsOnTools, deep_overlap_is_undone_gently) {
  const std::array<Pose, 4> other{Pose{{}, kAcross}, Pose{{0, 0.001f, 0.02f}, kAcross}, Pose{{-0.05f, 0, 0.05f}, kLevel},
                                  Pose{{-0.05f, -0.001f, 0.05f}, kLevel}};
  for (const Pose& there : other) {
    Pair p({{}, kAcross}, there, 0.1f);
    p.run(0.3);
    EXPECT_GT(p.gap(), -0.0001f);
    EXPECT_LT(p.steepest, 0.3f);
    p.run(0.5);
    for (size_t k = 0; k < 2; ++k) EXPECT_LT(length(p.state.body[k].v), 2e-3f) << "and at rest";
  }
}

// Tools that do not touch: the same bits as without contact, near or far; a disconnected hand, or the needle,
// touches none.
TEST(ToolsOnTools, apart_is_as_if_there_were_none) {
  const auto wander = [](Pair& p, bool contact) {
    p.run(0.3, [&](float t) {
      p.state.weld[1].target.p.x = 0.02f * std::sin(30 * t);
      p.state.weld[0].target.p.z = 0.01f * std::sin(20 * t);
      if (!contact) p.scratch.candidates.tool_pair.clear();
    });
    return p.hash();
  };
  for (const float above : {0.0053f, 0.04f, 0.3f}) {
    const Pose low{{-0.05f, 0, 0}, kLevel}, high{{0, above, -0.05f}, kAcross};
    Pair with(low, high, 0.1f), without(low, high, 0.1f);
    without.model.body[0].capsule.clear();
    without.model.body[1].capsule.clear();
    EXPECT_EQ(wander(with, true), wander(without, false)) << above;
    EXPECT_EQ(with.scratch.candidates.tool_pair.empty(), above > 0.1f);
    EXPECT_GT(with.gap(), 0);
  }
  Pair absent({{}, kAcross}, {{0, 0.001f, 0}, kAcross});
  absent.state.body_collides[1] = 0;
  absent.run(0.1);
  EXPECT_EQ(length(absent.on(0).linear), 0);
  EXPECT_LT(absent.gap(), -0.003f);
}

}  // namespace
}  // namespace catgut
