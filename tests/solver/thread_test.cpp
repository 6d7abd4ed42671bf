// SPDX-License-Identifier: Apache-2.0
// tests/solver: the thread slides through an anchor against friction, keeps its length, and has the correct weight.
#include "solver/thread.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "suture/suture.h"

namespace catgut {
namespace {

// A straight thread along x between two held ends, one node of it anchored to a pinned particle of tissue (index `nodes`).
struct Line {
  StrandModel model;
  Strand thread;
  ThreadScratch scratch;
  Column<Vec4> x, v, prev;
  std::vector<float> inv_mass;
  std::vector<RigidModel> body_model = std::vector<RigidModel>(2);
  std::vector<RigidBody> body = std::vector<RigidBody>(2);
  float h = 1.0f / 960, damping = 60;
  size_t at;

  Line(uint32_t nodes, float spacing, float mass, float compliance, size_t anchored) : at(anchored) {
    model.count = nodes;
    model.spacing = spacing;
    model.inv_mass = 1 / mass;
    model.stretch_compliance = compliance;
    model.bend_sweeps = 0;
    for (uint32_t i = 0; i < nodes; ++i) {
      x.push_back(point({spacing * static_cast<float>(i), 0, 0}));
      inv_mass.push_back(1 / mass);
      thread.order.push_back(i);
    }
    x.push_back(x[at]);
    inv_mass.push_back(0);
    v.assign(x.size(), {});
    thread.rest.assign(nodes - 1, spacing);
    thread.tension.assign(nodes - 1, 0);
    thread.cut.assign(nodes - 1, 0);
    thread.hold = {{0, 0, {}}, {nodes - 1, 1, {}}};
    body[0].x = xyz(x[0]);
    body[1].x = xyz(x[nodes - 1]);
    ThreadAnchor a;
    a.slot = static_cast<uint32_t>(at);
    a.point = particle_point(nodes);
    thread.anchor.push_back(a);
    scratch.resize(nodes);
  }
  ThreadAnchor& anchor() { return thread.anchor[0]; }
  void step() {
    std::fill(scratch.lambda.begin(), scratch.lambda.end(), 0.0f);
    prev = x;
    for (size_t i = 0; i < x.size(); ++i)
      if (inv_mass[i] > 0) add(x[i], xyz(v[i]) * h);
    solve_thread(model, thread, scratch, x.data(), prev.data(), inv_mass.data(), body_model, body, h);
    for (size_t i = 0; i < x.size(); ++i) set(v[i], (xyz(x[i]) - xyz(prev[i])) / (h * (1 + damping * h)));
  }
  // The needle end moves by `by` [m] in `seconds`, and waits as long again.
  void pull(float by, float seconds) {
    const int steps = static_cast<int>(seconds / h);
    for (int i = 0; i < steps; ++i) body[1].x.x += by / static_cast<float>(steps), step();
    for (int i = 0; i < steps; ++i) step();
  }
  double total_rest() const { return std::accumulate(thread.rest.begin(), thread.rest.end(), 0.0); }
  double rest_free() const { return std::accumulate(thread.rest.begin(), thread.rest.begin() + static_cast<long>(at), 0.0); }
};

// 20 segments of 0.01 m/N on each side: 5 N/m.
Line soft_line() { return Line(41, 0.01f, 1e-4f, 0.01f, 20); }

TEST(ThreadSlide, holds_below_the_friction) {
  Line line = soft_line();
  line.anchor().friction = 0.03f;
  line.pull(0.005f, 1);  // 0.025 N
  EXPECT_NEAR(line.anchor().tension_needle, 0.025, 1e-4);
  EXPECT_NEAR(line.anchor().tension_free, 0, 1e-4);
  EXPECT_DOUBLE_EQ(line.rest_free(), 20 * double{0.01f});
}

TEST(ThreadSlide, slides_above_it_until_friction_carries_the_difference) {
  Line line = soft_line();
  line.anchor().friction = 0.03f;
  line.pull(0.014f, 1);  // 0.07 N if nothing slid
  EXPECT_LT(line.rest_free(), 20 * double{0.01f} - 1e-3);
  const double difference = double{line.anchor().tension_needle} - double{line.anchor().tension_free};
  EXPECT_LT(difference, 0.0303);
  EXPECT_GT(difference, 0.0270);
  // Two springs of 5 N/m: slide s satisfies (0.014 - s) 5 - 5 s = 0.03.
  EXPECT_NEAR(20 * double{0.01f} - line.rest_free(), 0.004, 4e-4);
}

TEST(ThreadSlide, with_no_friction_both_sides_pull_alike) {
  Line line = soft_line();
  line.pull(0.014f, 1);
  EXPECT_NEAR(line.anchor().tension_needle, line.anchor().tension_free, 5e-4);
  EXPECT_NEAR(line.anchor().tension_needle, 0.035, 5e-4);
}

TEST(ThreadSlide, capstan_ratio) {
  Line line = soft_line();
  line.anchor().capstan_friction = 0.5f;
  line.body[0].x.x -= 0.004f;  // 0.02 N on the free side before anything slides
  for (int i = 0; i < 960; ++i) line.step();
  line.pull(0.012f, 1);
  EXPECT_GT(line.anchor().tension_free, 0.02f);
  EXPECT_NEAR(line.anchor().tension_needle / line.anchor().tension_free, 1.5, 0.05);
}

TEST(ThreadSlide, total_rest_length_never_changes) {
  Line line = soft_line();
  line.anchor().friction = 0.01f;
  const double before = line.total_rest();
  for (int round = 0; round < 5; ++round) {
    line.pull(0.012f, 0.3f);
    EXPECT_NEAR(line.total_rest() / before, 1, 1e-6);
    line.pull(-0.016f, 0.3f);
    EXPECT_NEAR(line.total_rest() / before, 1, 1e-6);
  }
}

// The scenes' suture drawn through one suture point by a hand at 0.15 m/s for 60 mm: particles pass one after the other.
TEST(ThreadSlide, a_steady_pull_does_not_stretch_the_thread) {
  SolverModel model;
  model.tissue = 1;
  model.count = 1 + 101;
  model.h = 1.0f / 960;
  model.body.resize(3);
  model.gravity = model.tissue_gravity = {};
  model.thread_damping = 12;
  model.inv_mass.assign(model.count, 1 / 2e-6f);
  model.inv_mass[0] = 0;
  model.needle_arc.resize(1);
  StrandModel& t = model.strand.emplace_back();
  t.first_slot = 1, t.count = 101, t.spacing = 0.0016f, t.radius = 0.00015f, t.inv_mass = 1 / 2e-6f;
  t.stretch_compliance = 1e-6f, t.bend_compliance = 2e4f;
  const std::vector<float> mass{1.0f};
  std::vector<Vec3> start(1);
  for (uint32_t i = 0; i < t.count; ++i) start.push_back({t.spacing * (static_cast<float>(i) - 90), 0, 0});
  model.shape = make_shape_model(std::span(start).first(1), mass, std::vector<std::vector<uint32_t>>{{0}});
  SolverState state = make_solver_state(model, start);
  SolverScratch scratch;
  prepare_scratch(model, scratch);
  state.body[2].x = start.back();
  state.strand[0].hold.push_back({t.first_slot + 100, 2, {}});
  ThreadAnchor a;
  a.slot = t.first_slot + 90;
  a.point = particle_point(0);
  a.friction = 0.03f, a.capstan_friction = 0.08f;
  state.strand[0].anchor.push_back(a);
  SutureModel suture;
  SutureState stitches;
  stitches.suture.resize(1);
  stitches.suture[0].bite.resize(1);
  stitches.suture[0].point.push_back({0, false, 0});
  Jobs jobs(1);
  EventList events;
  double most = 0;
  const double before = std::accumulate(state.strand[0].rest.begin(), state.strand[0].rest.end(), 0.0);
  for (int i = 0; i < 384; ++i) {
    state.body[2].x.x += 0.15f * model.h;
    substep(model, state, scratch, jobs, nullptr);
    SutureContext sewing{model, state, scratch, suture, stitches, events};
    pull(sewing);
    // Stretch between the anchor and the hand. A stuck anchor lets go at the end of the substep in which the pull exceeds its
    // friction. This hand starts at full speed, so the first substeps are not a steady pull.
    if (i < 10) continue;
    const auto& order = state.strand[0].order;
    const size_t node = static_cast<size_t>(std::find(order.begin(), order.end(), a.slot) - order.begin());
    double now = 0, rest = 0;
    for (size_t k = node; k + 1 < order.size(); ++k) {
      now += double{distance(thread_position(state.strand[0], k, state.x.data(), state.body),
                             thread_position(state.strand[0], k + 1, state.x.data(), state.body))};
      rest += double{state.strand[0].rest[k]};
    }
    most = std::max(most, now / rest - 1);
  }
  EXPECT_LT(most, 1e-3);
  EXPECT_NEAR(std::accumulate(state.strand[0].rest.begin(), state.strand[0].rest.end(), 0.0) / before, 1, 1e-6);
  EXPECT_GE(std::count_if(events.begin(), events.end(), [](const Event& e) { return e.kind == EventKind::particle_passed; }),
            35);
}

// Weight against geometric stiffness: a taut, light thread between two hands hangs as a catenary, without extra tension.
TEST(ThreadWeight, a_taut_light_thread_does_not_pull_by_itself) {
  for (const float h : {1.0f / 480, 1.0f / 960}) {
    Line line(175, 0.0016f, 2e-6f, 1e-6f, 0);
    line.thread.anchor.clear();
    line.h = h;
    line.damping = 12;
    line.model.gravity = {0, -9.81f, 0};
    line.body[1].x.x *= 0.9f;
    for (uint32_t i = 0; i < 175; ++i) line.x[i].x *= 0.9f, line.x[i].y = -0.0007f * static_cast<float>(std::min(i, 174 - i));
    for (int i = 0; i < static_cast<int>(3 / h); ++i) {
      for (size_t k = 1; k < 174; ++k) line.v[k].y -= 9.81f * h;
      line.step();
    }
    const double weight = 174 * 2e-6 * 9.81;
    EXPECT_NEAR(line.thread.tension[0] / weight, 0.7486, 0.01) << "substep " << h;
  }
}

// A hanging thread is cut in its middle: the lower part falls freely, the upper part stays.
TEST(ThreadCut, the_lower_half_falls_the_upper_half_stays) {
  constexpr uint32_t kNodes = 61, kCut = 30;  // nodes 0 .. 30 stay
  Line line(kNodes, 0.0016f, 2e-6f, 1e-6f, 45);
  line.thread.hold.pop_back();
  line.model.bend_sweeps = 3, line.model.distance_sweeps = 3, line.model.bend_compliance = 2e4f;
  line.model.gravity = {0, -9.81f, 0};
  for (uint32_t i = 0; i < kNodes; ++i) line.x[i] = point({0, -0.0016f * static_cast<float>(i), 0});
  line.thread.anchor.clear();
  auto steps = [&](int n) {
    for (int k = 0; k < n; ++k) {
      for (size_t i = 1; i < kNodes; ++i) line.v[i].y -= 9.81f * line.h;
      line.step();
    }
  };
  steps(960);
  auto middle = [&](uint32_t from, uint32_t to) {
    double sum = 0;
    for (uint32_t i = from; i < to; ++i) sum += double{line.x[i].y} / (to - from);
    return sum;
  };
  auto length_of = [&](uint32_t from, uint32_t to) {
    double sum = 0;
    for (uint32_t i = from; i + 1 < to; ++i) sum += double{distance(xyz(line.x[i]), xyz(line.x[i + 1]))};
    return sum;
  };
  const double upper = middle(0, kCut + 1), lower = middle(kCut + 1, kNodes);
  EXPECT_NEAR(line.thread.tension[0], 60 * 2e-6 * 9.81, 1e-5);
  line.thread.cut[kCut] = 1;
  line.damping = 0;
  steps(192);
  const double t = 0.2, fall = 0.5 * 9.81 * t * t;
  EXPECT_NEAR(lower - middle(kCut + 1, kNodes), fall, 0.01 * fall);
  EXPECT_NEAR(middle(0, kCut + 1), upper, 1e-4);
  EXPECT_NEAR(length_of(0, kCut + 1), kCut * 0.0016, 1e-4 * kCut * 0.0016);
  EXPECT_NEAR(length_of(kCut + 1, kNodes), (kNodes - kCut - 2) * 0.0016, 1e-4 * 0.048);
  EXPECT_EQ(line.thread.tension[kCut], 0);
  EXPECT_NEAR(line.thread.tension[0], 30 * 2e-6 * 9.81, 0.1 * 30 * 2e-6 * 9.81);
}

// Beside an anchor: no thread can pass to or from a cut-off part, for any pull.
TEST(ThreadCut, nothing_slides_through_an_anchor_beside_a_cut) {
  Line line = soft_line();
  line.pull(0.014f, 0.5f);  // it slides
  line.pull(0.002f, 0.1f);
  const auto rest = line.thread.rest;
  line.thread.cut[line.at] = 1;
  line.anchor().slipping = 1;
  line.pull(0.01f, 0.5f);
  EXPECT_EQ(line.thread.rest, rest);
  EXPECT_EQ(line.anchor().slipping, 0);
  for (const Vec4& p : line.x) EXPECT_TRUE(is_finite(xyz(p)));
  EXPECT_NEAR(line.thread.tension.back(), 0, 1e-4) << "the needle side is loose";
  EXPECT_GT(line.thread.tension.front(), 0.01f) << "the other is held as it was";
}

TEST(ThreadNumbers, one_segment_carries_its_load) {
  // A body of 10 g hangs on a thread of one segment: lambda / h^2 is its weight.
  Line line(2, 0.1f, 1e-4f, 1e-4f, 0);
  line.thread.anchor.clear();
  line.body_model[1].inv_mass = 100;
  line.body_model[1].gravity = true;
  line.body[1].x = {0, -0.1f, 0};
  line.x[1] = point({0, -0.1f, 0});
  for (int i = 0; i < 4000; ++i) {
    predict(line.body_model[1], line.body[1], {0, -9.81f, 0}, line.h);
    line.step();
    update_velocity(line.body_model[1], line.body[1], line.h, 20);
  }
  EXPECT_NEAR(line.thread.tension[0], 0.0981, 0.0981 * 1e-3);
}

}  // namespace
}  // namespace catgut
