// SPDX-License-Identifier: Apache-2.0
// tests of solver/thread_touch: a taut thread round a tool stays round it, and loads the tool.
#include <gtest/gtest.h>

#include <cmath>

#include "solver/substep.h"

namespace catgut {
namespace {

constexpr float kRadius = 0.0025f, kThread = 0.00015f, kSpacing = 0.0016f;

// A thread laid round a capsule along z (body 0). Its ends are held by small bodies (1 and 2, 10 g), each on a
// spring of 100 N/m whose other end a hand moves.
struct Wrap {
  SolverModel model;
  SolverState state;
  SolverScratch scratch;
  Jobs jobs{1};
  double deepest_node = 0, deepest_middle = 0;

  // turns: of the circle that it lies on, from the left side over the top; the helix climbs by `pitch` a turn.
  Wrap(float turns, float pitch, float friction, float h, uint32_t tail = 25) {
    const float reach = kRadius + kThread + 1e-5f, arc = 2 * kPi * turns * reach;
    const uint32_t around = static_cast<uint32_t>(std::ceil(arc / kSpacing)), nodes = 2 * tail + around + 1;
    std::vector<Vec3> start(1, Vec3{1, 1, 1});
    auto on_arc = [&](float phi) {
      const float turn = (phi + kPi) / (2 * kPi);
      return Vec3{reach * std::cos(kPi - (phi + kPi)), reach * std::sin(kPi - (phi + kPi)), pitch * (turn - 0.5f * turns)};
    };
    const float from = -kPi, to = from + 2 * kPi * turns;  // phi + pi is the angle wound so far, from the left side
    for (uint32_t i = 0; i < nodes; ++i) {
      const float s = (static_cast<float>(i) - static_cast<float>(tail)) * kSpacing;
      if (s <= 0) start.push_back(on_arc(from) + Vec3{0, s, 0});
      else if (s >= arc) {
        const Vec3 a = on_arc(to), b = on_arc(to - 0.01f), way = normalized(Vec3{a.x - b.x, a.y - b.y, 0});
        start.push_back(a + way * (s - arc));
      } else start.push_back(on_arc(from + s / reach));
    }
    model.tissue = 1;
    model.count = 1 + nodes;
    model.h = h;
    model.body.resize(3);
    model.gravity = model.tissue_gravity = {};
    model.thread_damping = 12;
    model.body_damping = 20;
    model.friction.thread = friction;
    model.inv_mass.assign(model.count, 1 / 2e-6f);
    model.inv_mass[0] = 0;
    model.body[0].capsule.push_back({{0, 0, -0.02f}, {0, 0, 0.02f}, kRadius});
    model.body[1].inv_mass = model.body[2].inv_mass = 100;
    model.body[1].inv_inertia = model.body[2].inv_inertia = {1e6f, 1e6f, 1e6f};
    StrandModel& t = model.strand.emplace_back();
    t.first_slot = 1, t.count = nodes, t.spacing = kSpacing, t.radius = kThread, t.inv_mass = 1 / 2e-6f;
    t.stretch_compliance = 1e-6f, t.bend_compliance = 2e4f;
    if (h > 1.0f / 500) t.distance_sweeps = t.bend_sweeps = 3, model.contact_sweeps = 5;
    const std::vector<float> mass{1.0f};
    model.shape = make_shape_model(std::span(start).first(1), mass, std::vector<std::vector<uint32_t>>{{0}});
    model.collision = make_tissue_collision(model.shape.rest, mass, std::vector<uint32_t>{0}, mass, {});
    state = make_solver_state(model, start);
    state.body[1].x = state.body[1].prev_x = start[1];
    state.body[2].x = state.body[2].prev_x = start.back();
    state.strand[0].hold.push_back({1, 1, {}});
    state.strand[0].hold.push_back({nodes, 2, {}});
    prepare_scratch(model, scratch);
    for (int k = 1; k <= 2; ++k) {
      Weld hand;
      hand.a = k;
      hand.target.p = state.body[static_cast<size_t>(k)].x;
      hand.compliance = 0.01f;
      hand.angular_compliance = 1;
      state.weld.push_back(hand);
    }
  }
  // Both ends are pulled by about `newton`, in the directions in which they leave the tool.
  void pull(float newton) {
    const size_t last = state.strand[0].order.size() - 1;
    state.weld[0].target.p += normalized(at(0) - at(1)) * (0.01f * newton);
    state.weld[1].target.p += normalized(at(last) - at(last - 1)) * (0.01f * newton);
  }
  void run(double seconds) {
    const int steps = static_cast<int>(seconds / double{model.h});
    for (int i = 0; i < steps; ++i) {
      if (i % 8 == 0) {
        find_boxes(model, state, scratch, jobs, nullptr);
        find_candidates(model, state, scratch, 0.008f, nullptr);
      }
      substep(model, state, scratch, jobs, nullptr);
      look();
    }
  }
  Vec3 at(size_t i) const { return thread_position(state.strand[0], i, state.x.data(), state.body); }
  double depth(Vec3 p) const {
    const Vec3 local = to_local(state.body[0].pose(), p);
    return double{kRadius} + double{kThread} - double{length(Vec3{local.x, local.y, 0})};
  }
  void look() {
    for (size_t i = 0; i < state.strand[0].order.size(); ++i) {
      deepest_node = std::max(deepest_node, depth(at(i)));
      if (i > 0) deepest_middle = std::max(deepest_middle, depth((at(i) + at(i - 1)) * 0.5f));
    }
  }
  double stretch() const {
    double rest = 0;
    for (float r : state.strand[0].rest) rest += double{r};
    return double{thread_length(state.strand[0], state.x.data(), state.body)} / rest - 1;
  }
  // How far the thread winds round the tool [turns].
  double turns() const {
    double sum = 0;
    for (size_t i = 1; i < state.strand[0].order.size(); ++i) {
      const Vec3 a = to_local(state.body[0].pose(), at(i - 1)), b = to_local(state.body[0].pose(), at(i));
      sum += std::atan2(double{a.x} * double{b.y} - double{a.y} * double{b.x},
                        double{a.x} * double{b.x} + double{a.y} * double{b.y});
    }
    return std::abs(sum) / (2 * double{kPi});
  }
  double tension(size_t pair) const { return double{state.strand[0].tension[pair]}; }
  Vec3 force_on_tool() const { return scratch.on_body[0].linear / (model.h * model.h); }
};

TEST(ThreadOnTool, a_taut_thread_over_a_tool_stays_outside_and_the_tool_feels_it) {
  for (const float h : {1.0f / 480, 1.0f / 960}) {
    Wrap w(0.5f, 0, 0, h);
    w.pull(1);
    w.run(2);
    EXPECT_LT(w.deepest_node, 1e-4) << h;
    EXPECT_LT(w.deepest_middle, 4e-4) << h;
    EXPECT_LT(std::abs(w.stretch()), 0.01) << h;
    EXPECT_NEAR(w.tension(0), 1, 0.1) << h;
    // Without friction the tension is uniform, and the tool carries both ends.
    const double first = w.tension(0), last = w.tension(w.state.strand[0].tension.size() - 1);
    EXPECT_NEAR(first, last, 0.01) << h;
    EXPECT_NEAR(w.force_on_tool().y, -(first + last), 0.1 * (first + last)) << h;
    EXPECT_NEAR(w.force_on_tool().x, 0, 0.1 * (first + last)) << h;
  }
}

TEST(ThreadOnTool, a_whole_turn_stays_wound) {
  for (const float h : {1.0f / 480, 1.0f / 960}) {
    Wrap w(1, 0.002f, 0, h);
    const double before = w.turns();
    w.pull(0.2f);
    w.run(2);
    EXPECT_LT(w.deepest_node, 1e-4) << h;
    EXPECT_LT(w.deepest_middle, 4e-4) << h;
    EXPECT_LT(std::abs(w.stretch()), 0.01) << h;
    EXPECT_NEAR(w.turns(), before, 0.05) << h;
    EXPECT_GT(w.tension(0), 0.1) << h;
  }
}

TEST(ThreadOnTool, lifted_off_nothing_sticks) {
  Wrap w(0.5f, 0, 0.15f, 1.0f / 960);
  w.pull(0.5f);
  w.run(0.5);
  EXPECT_LT(double{w.force_on_tool().y}, -0.5);
  // The tool goes down and away, at 0.1 m/s: the thread's middle must not follow it.
  const size_t middle = w.state.strand[0].order.size() / 2;
  const Vec3 was = w.at(middle);
  for (int i = 0; i < 192; ++i) w.state.body[0].x.y -= 0.1f * w.model.h, w.run(double{w.model.h} * 1.01);
  EXPECT_EQ(length(w.force_on_tool()), 0);
  EXPECT_LT(std::abs(w.tension(middle)), 0.1);
  EXPECT_LT(double{was.y - w.at(middle).y}, 0.012);
  EXPECT_LT(w.depth(w.at(middle)), -0.002);
}

// A tool held by a spring moves until the spring carries the thread's force, and settles.
TEST(ThreadOnTool, a_tool_in_a_hand_gives_way_and_rests) {
  for (const float h : {1.0f / 480, 1.0f / 960}) {
    Wrap w(0.5f, 0, 0, h);
    w.model.body[0].inv_mass = 20;
    w.model.body[0].inv_inertia = {2e4f, 2e4f, 4e4f};
    Weld hand;
    hand.a = 0;
    hand.compliance = 1.0f / 3000;
    hand.angular_compliance = 0.05f;
    w.state.weld.push_back(hand);
    w.pull(1);
    w.run(2);
    const double force = w.tension(0) + w.tension(w.state.strand[0].tension.size() - 1);
    EXPECT_GT(force, 1.5);
    EXPECT_NEAR(w.force_on_tool().y, -force, 0.05 * force) << h;
    EXPECT_NEAR(w.state.weld[2].lambda.y / (h * h), force, 0.05 * force) << h;
    EXPECT_LT(length(w.state.body[0].v), 0.01f) << h;
    EXPECT_LT(w.deepest_node, 1e-4) << h;
  }
}

// Capstan (Euler): pulled over half a turn against friction, the tensions have the ratio exp(pi mu). Friction is an implicit
// drag by the last substep's speed and tension. It comes out too small rather than too large, more so in long substeps.
TEST(ThreadOnTool, friction_makes_a_capstan) {
  const float mu = 0.2f;
  for (const float h : {1.0f / 480, 1.0f / 960}) {
    Wrap w(0.5f, 0, mu, h);
    w.pull(0.5f);
    w.run(1);
    // Both hands move, one after the other, at 10 mm/s.
    double ratio = 0;
    const int steps = static_cast<int>(1 / h);
    for (int i = 0; i < steps; ++i) {
      for (size_t k = 0; k < 2; ++k) w.state.weld[k].target.p.y += (k == 0 ? 0.01f : -0.01f) * h;
      w.run(double{h} * 1.01);
      if (i >= steps / 2) ratio += w.tension(w.state.strand[0].tension.size() - 1) / w.tension(0) / (steps - steps / 2);
    }
    const double euler = std::exp(double{kPi} * double{mu});
    EXPECT_NEAR(ratio, euler, 0.3 * euler) << h;
    EXPECT_GT(ratio, 1.3) << h;
    EXPECT_LT(w.deepest_node, 1e-4) << h;
  }
}

}  // namespace
}  // namespace catgut
