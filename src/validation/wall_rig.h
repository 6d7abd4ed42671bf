// SPDX-License-Identifier: Apache-2.0
// validation: what the checks of the wall share: a tube, external forces, and where its columns are.
#pragma once
#include <algorithm>
#include <cmath>
#include <vector>

#include "wall/wall.h"

namespace catgut::validation {

using wall::Wall;

constexpr double kPi2 = 6.283185307179586;
constexpr float kTick = 1.0f / 60;

// Steps under external forces for `seconds`; they grow over the first third. force: 2 per column.
inline void settle(Wall& w, const std::vector<Vec3>& force, double seconds) {
  Jobs jobs(1);
  const int steps = static_cast<int>(std::lround(seconds / w.model.step));
  for (int i = 0; i < steps; ++i) {
    for (size_t c = 0; c < force.size(); ++c)
      w.scratch.external[c] =
          wall::float4(force[c] * std::min(1.0f, static_cast<float>(i) / (0.3f * static_cast<float>(steps))));
    wall::begin_step(w.model, w.state, w.scratch, jobs);
    wall::finish_step(w.model, w.state, jobs);
  }
}

inline Vec3 middle(const Wall& w, uint32_t c) { return wall::vec3(w.state.motion.x[2 * c]); }
inline Vec3 rest_middle(const Wall& w, uint32_t c) { return (w.model.mesh.outer[c] + w.model.mesh.inner[c]) * 0.5f; }

inline wall::Spec tube_spec(int around, int rings, float step, const wall::Layer& layer) {
  wall::Spec s;
  wall::TubeShape shape;
  shape.around = around, shape.rings = rings;
  s.mesh = wall::tube(shape);
  s.layer = {layer};
  s.step = step;
  s.drag = 20;
  return s;
}

// Second part of check_wall: contact, and strings through holes.
struct Lines;
void check_wall_coupling(Lines& out);

}  // namespace catgut::validation
