// SPDX-License-Identifier: Apache-2.0
// render/skinned: a mesh that follows particles, with several surface frames at once. It is geometry/skin plus the texture
// direction beside the normal, in the order and format of the draw call. Once per frame, for any number of
// eyes.
#pragma once
#include <array>
#include <span>
#include <vector>

#include "exchange/picture.h"

namespace catgut {

// Motion of each particle since rest: an affine map (columns and translation) and its rotation. One cache line each, so that a
// vertex blends only sixteen numbers.
struct alignas(64) Motion {
  float m[12];
  Quat q;
};
struct Motions {
  std::vector<Motion> of;
  std::vector<uint8_t> moved;  // since the previous frame; invisible motion counts as none
  std::vector<Vec3> seen;      // [m] position of each when it last moved
};
void find_motion(std::span<const Vec3> particle_rest, std::span<const Vec3> particle, std::span<const Quat> rotation,
                 Motions& motion);

struct SkinnedVertex {
  std::array<uint32_t, 4> slot;
  std::array<float, 4> weight;
  Vec3 rest;   // [m]
  Quat frame;  // at rest: x along the texture, z the normal
};

struct Skinned {
  Vec3 position;
  Quat frame;
};
// A vertex whose particles are invalid keeps its rest frame.
Skinned follow(const SkinnedVertex& vertex, std::span<const Motion> motion);
inline bool has_moved(const SkinnedVertex& v, const Motions& motion) {
  return motion.moved[v.slot[0]] | motion.moved[v.slot[1]] | motion.moved[v.slot[2]] | motion.moved[v.slot[3]];
}

}  // namespace catgut
