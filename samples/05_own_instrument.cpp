// SPDX-License-Identifier: Apache-2.0
// Sample: an instrument of your own, without a change to Catgut. A bulldog clamp, which is not in the table, is parked on the
// rim of a bowel end and pulls it sideways with the force given in the scene. Shows: an InstrumentModel, a scene with
// instruments, their data in the Snapshot.
#include <cmath>
#include <cstdio>

#include "sim/simulation.h"

using namespace catgut;

int main() {
  InstrumentModel bulldog;
  bulldog.name = "bulldog";
  bulldog.title = "Bulldog clamp";
  bulldog.capabilities = kHoldTissue | kClamp;
  bulldog.body.inv_mass = 1 / 0.008f;             // [1/kg]
  bulldog.body.inv_inertia = {1e6f, 1e6f, 2e6f};  // [1/(kg m^2)]
  bulldog.body.capsule = {{{0, 0, 0.0015f}, {0, 0, 0.035f}, 0.002f}};
  bulldog.jaw.length = 0.02f;
  bulldog.tissue_grip = 5;  // [N]

  SceneSpec scene;
  scene.body.emplace_back();  // an open tube, 40 mm across, its rim's center at the origin
  scene.technique.name = "none";
  InstrumentSpec clamp;
  clamp.kind = "bulldog";
  clamp.where = "parked";
  clamp.at = {scene.body[0].radius, 0, 0};  // [m]
  clamp.pull = {0.2f, 0, 0};                // [N] outward
  scene.instrument = {clamp};
  const InstrumentModel own[] = {bulldog};
  const auto model = build_model(scene, own);
  const auto state = initial_state(*model);

  Jobs jobs(1);
  Snapshot seen;
  TickInput input;
  input.hand = no_hands();
  publish(*model, *state, seen);
  const Vec3 before = seen.instrument[0].pose.p;
  for (; input.tick < 180; ++input.tick) step(*model, *state, input, jobs);
  publish(*model, *state, seen);
  const InstrumentView& v = seen.instrument[0];
  const float moved = v.pose.p.x - before.x;
  std::printf("%s: holds %s, pulls %.3f N, drew the rim %.1f mm outward\n", picture_model(*model).instrument[0].title.c_str(),
              v.held == Held::tissue ? "tissue" : "nothing", length(v.pull), 1e3 * moved);
  const bool pulls = std::abs(length(v.pull) - 0.2f) < 0.05f;
  return state_is_valid(*model, *state) && v.held == Held::tissue && pulls && moved > 0.0005f ? 0 : 1;
}
