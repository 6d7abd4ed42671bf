// SPDX-License-Identifier: Apache-2.0
// A piece of bowel, and one hand that presses on its rim: the tissue deforms, pushes back, and recovers.
// Shows: a scene in code, the tick, the published data, the force on a hand.
#include <algorithm>
#include <cstdio>

#include "sim/simulation.h"

using namespace catgut;

int main() {
  SceneSpec scene;
  scene.body.emplace_back();  // an open tube, 40 mm across, its rim's center at the origin
  scene.technique.name = "none";
  const auto model = build_model(scene);
  const auto state = initial_state(*model);
  Jobs jobs(1);
  Snapshot seen;
  TickInput input;
  input.hand[1].connected = 0;  // one hand is enough
  const PictureModel picture = picture_model(*model);
  const Vec3 rim = picture.particle_rest[picture.rim[0][0]], above = rim + Vec3{0, 0.02f, 0};

  const auto run = [&](double seconds, Vec3 from, Vec3 to) {
    const int ticks = static_cast<int>(seconds * scene.solver.tick_rate);
    for (int i = 1; i <= ticks; ++i, ++input.tick) {
      input.hand[0].pose.p = lerp(from, to, static_cast<float>(i) / static_cast<float>(ticks));
      step(*model, *state, input, jobs);
    }
    publish(*model, *state, seen);
  };
  run(0.5, above, above);
  const std::vector<Vec3> rest = seen.particle;
  const auto moved = [&] {  // [m] maximum displacement of a tissue particle
    float most = 0;
    for (size_t i = 0; i < picture.particle_rest.size(); ++i) most = std::max(most, distance(seen.particle[i], rest[i]));
    return most;
  };
  run(0.5, above, rim + Vec3{0, -0.004f, 0});
  const float pressed = moved(), force = length(seen.tool[0].force);
  std::printf("pressed: the tissue gives way by %.1f mm, the hand feels %.2f N\n", 1e3 * pressed, force);
  run(0.3, rim + Vec3{0, -0.004f, 0}, above);
  run(2.0, above, above);
  const float left = moved();
  std::printf("released: %.2f mm from where it was, %.1e J still moving\n", 1e3 * left, kinetic_energy(*model, *state));
  return state_is_valid(*model, *state) && pressed > 0.001f && force > 0.02f && left < 0.0005f ? 0 : 1;
}
