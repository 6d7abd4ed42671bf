// SPDX-License-Identifier: Apache-2.0
// validation: a wall under external forces, and where its columns are.
#pragma once
#include <algorithm>
#include <cmath>
#include <vector>

#include "wall/wall.h"

namespace catgut::validation {

constexpr float kTick = 1.0f / 60;

// Steps under external forces for `seconds`; they ramp up over the first third. force: 2 per column.
inline void settle(wall::Wall& w, const std::vector<Vec3>& force, double seconds) {
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

inline Vec3 middle(const wall::Wall& w, uint32_t c) { return wall::vec3(w.state.motion.x[2 * c]); }
inline Vec3 rest_middle(const wall::Wall& w, uint32_t c) { return (w.model.mesh.outer[c] + w.model.mesh.inner[c]) * 0.5f; }

}  // namespace catgut::validation
