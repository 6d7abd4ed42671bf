// SPDX-License-Identifier: Apache-2.0
// render/skinned: a mesh that follows particles, several frames of surface at a time: what geometry/skin computes, with the
// texture's direction beside the normal, in the order and the form in which it is drawn. Once per picture, however many eyes
// look at it.
#pragma once
#include <array>
#include <span>
#include <vector>

#include "exchange/picture.h"

namespace catgut {

// How each particle has moved since rest: an affine map (columns and shift) and its rotation. One cache line each, so that a
// vertex only blends sixteen numbers.
struct alignas(64) Motion {
  float m[12];
  Quat q;
};
struct Motions {
  std::vector<Motion> of;
  std::vector<uint8_t> moved;  // since the picture before; by less than can be seen counts as not at all
  std::vector<Vec3> seen;      // [m] where each was when it last moved
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
// A vertex whose particles have gone astray keeps its frame of rest.
Skinned follow(const SkinnedVertex& vertex, std::span<const Motion> motion);
inline bool has_moved(const SkinnedVertex& v, const Motions& motion) {
  return motion.moved[v.slot[0]] | motion.moved[v.slot[1]] | motion.moved[v.slot[2]] | motion.moved[v.slot[3]];
}

}  // namespace catgut
