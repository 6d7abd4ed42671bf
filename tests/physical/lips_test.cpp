// SPDX-License-Identifier: Apache-2.0
// tests/physical: two bowel ends that are pressed together obey the law of contact. Measured from the motion and the impulses
// that a step leaves, and from the forces at the held ends.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "physical/physical.h"
#include "validation/suture_scenes.h"

namespace catgut::physical {
namespace {

using validation::Sewn;

// Two tubes, their rims `gap` apart. The held ends can be moved toward each other.
struct Pressed {
  Sewn s;
  Pressed() {
    const wall::Wall w = validation::two_tubes(0.5e-3f);
    s.model = make_model(w, validation::knot_settings(0.3f));
    s.state.wall = w.state;
    std::vector<Vec3> far;
    for (int i = 0; i < 8; ++i) far.push_back({0.3f + 0.5e-3f * static_cast<float>(i), 0, 0});
    s.state.thread = thread::make_state(far);
    s.start();
    s.hold.clear();
  }
  template <typename Visit>
  void each_held(Visit visit) {
    wall::State& w = s.state.wall;
    for (uint32_t c = 0; c < wall::columns(w); ++c)
      if (w.topology.slot[c] == wall::kNone) visit(c, w.motion.x[2 * c].z > 0 ? 1.0f : -1.0f);
  }
  void move(Vec3 upper) {  // [m/s]
    each_held([&](uint32_t c, float side) { s.state.wall.motion.v[2 * c] = wall::float4(upper * side); });
  }
};

// [m/s] by which the contacts of a step break the law: overlap that grows, what presses comes apart, what sticks slides.
float broken_law(const Sewn& s) {
  float worst = 0;
  const wall::State& w = s.state.wall;
  for (const wall::Contact& c : s.state.lip) {
    const Vec3 u = wall::velocity(c.point, w.motion) - wall::velocity(c.other, w.motion);
    const float h = s.model.wall.step, wanted = c.gap >= 0 ? -c.gap / h : std::min(-c.gap / h, s.scratch->lips.push_out);
    // The wall between the two yields.
    const float pressed = dot(c.impulse, c.normal), un = dot(u, c.normal) + s.scratch->lips.softness / (h * h) * pressed;
    const float drag = length(c.impulse - c.normal * pressed), slid = length(u - c.normal * dot(u, c.normal));
    EXPECT_LE(drag, 1.001f * c.friction * pressed + 1e-9f);
    worst = std::max(worst, wanted - un);
    if (pressed > 1e-6f) worst = std::max(worst, un - wanted);
    if (pressed > 1e-6f && drag < 0.98f * c.friction * pressed) worst = std::max(worst, slid);
  }
  return worst;
}

TEST(Lips, what_is_pressed_together_neither_overlaps_nor_slides_nor_pulls) {
  Pressed p;
  // Together by 1.5 mm, askew, so that there is friction; then at rest.
  std::vector<float> broken;
  size_t most = 0;
  for (int i = 0; i < 400; ++i) {
    p.move({0.5e-3f, 0, -2.5e-3f});
    p.s.run(0.001f);
    if (i >= 100) broken.push_back(broken_law(p.s));
    most = std::max(most, p.s.state.lip.size());
  }
  EXPECT_GT(most, 40u);
  std::sort(broken.begin(), broken.end());
  std::printf("law broken by %.3f mm/s in the median, %.3f at most\n", 1e3 * static_cast<double>(broken[150]),
              1e3 * static_cast<double>(broken.back()));
  EXPECT_LT(broken[150], 0.02e-3f);
  EXPECT_LT(broken.back(), 0.1e-3f);
  p.move({});
  p.s.run(1.0f);
  for (const wall::Contact& c : p.s.state.lip) EXPECT_GT(c.gap, -5e-6f);
  // The held end of the upper tube bears what the lips press on it.
  const std::vector<uint32_t>& piece = p.s.model.surface.piece;
  uint32_t upper = 0;
  p.each_held([&](uint32_t c, float side) {
    if (side > 0) upper = piece[c];
  });
  Vec3 pressed{};
  for (const wall::Contact& c : p.s.state.lip) {
    if (piece[c.point.column[0]] == upper) pressed += c.impulse / p.s.model.wall.step;
    if (piece[c.other.column[0]] == upper) pressed -= c.impulse / p.s.model.wall.step;
  }
  wall::elastic_forces(p.s.model.wall, p.s.state.wall, p.s.scratch->wall);
  Vec3 held{};
  p.each_held([&](uint32_t c, float side) {
    if (side > 0) held += wall::vec3(p.s.scratch->wall.force[2 * c]);
  });
  EXPECT_GT(length(pressed), 0.5f);
  EXPECT_LT(distance(pressed, held), 0.02f * length(pressed));
}

// Lists of near faces are kept from step to step. Two ends are pressed together, slid over each other by more than the margins
// of such lists, and drawn apart.
TEST(Lips, a_search_that_remembers_finds_what_a_new_one_finds) {
  Pressed p;
  size_t most = 0;
  for (int i = 0; i < 240; ++i) {
    const float slide = i % 120 < 60 ? 0.05f : -0.02f;
    p.move(i < 60 ? Vec3{0, 0, -0.04f} : i < 200 ? Vec3{slide, 0.4f * slide, -2e-3f} : Vec3{0, 0, 0.05f});
    State twin = p.s.state;
    Scratch fresh(p.s.model, twin);
    Hands hands;
    step(p.s.model, twin, fresh, hands, *p.s.jobs);
    p.s.run(0.001f);
    ASSERT_EQ(hash_state(twin), hash_state(p.s.state)) << "step " << i;
    most = std::max(most, p.s.state.lip.size());
  }
  EXPECT_GT(most, 40u);
}

}  // namespace
}  // namespace catgut::physical
