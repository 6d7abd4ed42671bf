// SPDX-License-Identifier: Apache-2.0
// sim: see clamps.h.
#include "sim/clamps.h"

#include <algorithm>
#include <cmath>

namespace catgut {
namespace {

template <typename Visit>
void each_clamped(const Model& model, const wall::State& w, size_t body, Visit visit) {
  for (uint32_t c = 0; c < wall::columns(w); ++c)
    if (w.topology.slot[c] == wall::kNone && model.wall[2 * w.topology.source[c]] == body) visit(c);
}

}  // namespace

bool has_clamp(const Model& model, size_t body) {
  return model.physical && body < model.scene.body.size() && model.rim.size() == model.scene.body.size() &&
         model.scene.body[body].pinned_length > 0;
}

MovingClamps::MovingClamps(const Model& model, State& state, const CommandList& commands, wall::Scratch& scratch) {
  wall::State& w = state.physical.world.wall;
  for (const Command& c : commands) {
    if (!moves_clamp(c.kind) || !has_clamp(model, c.argument)) continue;
    Clamp& clamp = clamp_[count_++];
    clamp = {c.argument, normalized(model.scene.body[c.argument].axis), kClampSpeed, 0, kClampRange};
    if (c.kind == CommandKind::retract_clamp) clamp.speed = -kClampSpeed;
    if (c.kind != CommandKind::pull_clamp) continue;
    wall::elastic_forces(model.physical->world.wall, w, scratch);
    float back = 0;  // [N] of the wall on its clamp, toward the opening
    each_clamped(model, w, clamp.body, [&](uint32_t i) { back += dot(wall::vec3(scratch.force[2 * i]), clamp.axis); });
    clamp.least = -kClampRange, clamp.speed = kClampSpeed * std::clamp(back / kClampPull - 1, -1.0f, 1.0f);
  }
}

void MovingClamps::move(const Model& model, State& state, float h) const {
  wall::State& w = state.physical.world.wall;
  const wall::Mesh& rest = model.physical->world.wall.mesh;
  for (size_t i = 0; i < count_; ++i) {
    const Clamp& clamp = clamp_[i];
    each_clamped(model, w, clamp.body, [&](uint32_t c) {
      const uint32_t r = w.topology.source[c];
      const float at = dot(wall::vec3(w.motion.x[2 * c]) - 0.5f * (rest.outer[r] + rest.inner[r]), clamp.axis),
                  left = std::max(0.0f, clamp.speed > 0 ? clamp.most - at : at - clamp.least);
      w.motion.v[2 * c] = wall::float4(clamp.axis * std::copysign(std::min(std::abs(clamp.speed), left / h), clamp.speed));
    });
  }
}

void MovingClamps::stop(const Model& model, State& state) const {
  wall::State& w = state.physical.world.wall;
  for (size_t i = 0; i < count_; ++i) each_clamped(model, w, clamp_[i].body, [&](uint32_t c) { w.motion.v[2 * c] = {}; });
}

}  // namespace catgut
