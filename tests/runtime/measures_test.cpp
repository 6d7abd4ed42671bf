// SPDX-License-Identifier: Apache-2.0
// tests/runtime: what the profiler shows of a scene.
#include "runtime/measures.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "procedure/scene_file.h"
#include "sim/model.h"
#include "sim/simulation.h"
#include "sim/state.h"

namespace catgut {
namespace {

float peak(const Measures& m, const std::string& name) {
  const auto found = std::find_if(m.force.begin(), m.force.end(), [&](const ForceMeasure& f) { return name == f.name; });
  return found == m.force.end() ? -1 : found->peak_n;
}

// No hand holds a tool.
TickInput no_hands() {
  TickInput input;
  for (ToolInput& hand : input.hand) hand.connected = 0;
  return input;
}

TEST(Measures, a_physical_scene_shows_its_thread_wall_and_forces) {
  const SceneSpec scene = read_scene("interrupted_tied");
  const auto model = build_model(scene);
  const StatePtr state = initial_state(*model);
  Jobs jobs(1);
  for (int i = 0; i < 30; ++i) step(*model, *state, no_hands(), jobs);
  Measures m;
  m.stage_ms[0] = 3;
  measure(*model, *state, m);
  EXPECT_EQ(m.stage_ms[0], 3) << "times are not its own";
  EXPECT_TRUE(m.physical);
  EXPECT_EQ(m.thread_particles, 200u);
  EXPECT_LE(m.awake, 200u);
  EXPECT_GT(m.columns, 100u);
  EXPECT_EQ(m.without_room, 0u);
  const auto& thread = state->physical.world.thread;
  EXPECT_FLOAT_EQ(peak(m, "thread"), std::abs(*std::max_element(thread.tension.begin(), thread.tension.end(),
                                                                [](float a, float b) { return std::abs(a) < std::abs(b); })));
  EXPECT_EQ(peak(m, "bite"), 0);
  EXPECT_EQ(peak(m, "seam"), -1) << "of guided mechanics";
  // Loads of a known size, as the physics keeps them: a force, impulses over a step of the wall, and over the square of the
  // thread's.
  physical::State& world = state->physical.world;
  const physical::Model& physics = model->physical->world;
  world.hole.emplace_back().load = {0, 0.3f, -0.4f};
  world.lip.emplace_back().impulse = Vec3{0, 0, 2} * physics.wall.step;
  world.contact.emplace_back().normal_impulse = 0.7f * physics.thread.substep * physics.thread.substep;
  world.thread.overflow = 2;
  measure(*model, *state, m);
  EXPECT_FLOAT_EQ(peak(m, "bite"), 0.5f);
  EXPECT_FLOAT_EQ(peak(m, "wall on wall"), 2);
  EXPECT_FLOAT_EQ(peak(m, "thread on wall"), 0.7f);
  EXPECT_EQ(m.without_room, 2u);
}

TEST(Measures, a_guided_scene_shows_its_constraints) {
  const auto model = build_model(read_scene("stay"));
  const StatePtr state = initial_state(*model);
  Jobs jobs(1);
  for (int i = 0; i < 30; ++i) step(*model, *state, {}, jobs);
  Measures m;
  measure(*model, *state, m);
  EXPECT_FALSE(m.physical);
  EXPECT_GT(m.clusters, 0u);
  EXPECT_GE(peak(m, "thread"), 0);
  EXPECT_GT(peak(m, "tool and needle"), 0);
  EXPECT_EQ(peak(m, "wall on wall"), -1);
}

}  // namespace
}  // namespace catgut
