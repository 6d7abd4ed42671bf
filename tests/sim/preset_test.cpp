// SPDX-License-Identifier: Apache-2.0
// tests/sim: what a solver preset may not change: how stiff the tissue is.
#include <gtest/gtest.h>

#include "procedure/scene_file.h"
#include "sim/model.h"
#include "sim/state.h"

namespace catgut {
namespace {

// [N/m] that a place on the rim answers when a soft spring draws it inward with some 0.1 N, as a needle's friction does.
float rim_stiffness(const std::string& name, const std::string& preset) {
  constexpr float kAway = 0.1f, kForce = 0.1f;  // [m] to the spring's far end; [N] at the start
  SceneSpec scene = read_scene(name);
  use_preset(scene, preset);
  const auto model = build_model(scene);
  const StatePtr state = initial_state(*model);
  Jobs jobs(1);
  TickInput nobody;
  nobody.hand = no_hands();
  const auto run = [&](int ticks) {
    for (int k = 0; k < ticks; ++k, ++nobody.tick) step(*model, *state, nobody, jobs);
  };
  run(30);
  const std::vector<uint32_t>& rim = model->picture.rim[0];
  const auto at = [&](uint32_t i) { return xyz(state->solver.x[i]); };
  Vec3 center{};
  for (uint32_t i : rim) center += at(i) / static_cast<float>(rim.size());
  const Vec3 from = at(rim[0]), inward = normalized(center - from);
  Attachment spring;
  spring.point = particle_point(rim[0]);
  spring.target = from + inward * kAway;
  spring.compliance = kAway / kForce;
  state->solver.attach.push_back(spring);
  run(120);
  const float moved = dot(at(rim[0]) - from, inward);
  return (kAway - moved) / spring.compliance / moved;
}

TEST(Presets, answer_a_force_with_the_same_stiffness) {
  for (const char* scene : {"purse_string", "stay", "lembert"}) {
    const float usual = rim_stiffness(scene, "default"), paper = rim_stiffness(scene, "paper");
    EXPECT_GT(usual, 10) << scene;
    EXPECT_NEAR(paper / usual, 1, 0.1) << scene << ": " << usual << " and " << paper << " N/m";
  }
}

}  // namespace
}  // namespace catgut
