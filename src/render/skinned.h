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
void find_motion(std::span<const Vec3> particle_rest, std::span<const Vec3> particle, std::span<const Quat> rotation,
                 std::vector<Motion>& motion);

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

}  // namespace catgut
