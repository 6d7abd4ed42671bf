// SPDX-License-Identifier: Apache-2.0
// solver/volume: tetrahedra keep their volume, C = V - V0 = 0 (paper 2.1), as an XPBD constraint. Tetrahedra are colored at
// build time so that those of one color share no particle: each color is one parallel stage, Gauss-Seidel between colors.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "geometry/mesh.h"
#include "solver/particles.h"

namespace catgut {

struct VolumeModel {
  std::vector<Tet> tet;             // sorted by color
  std::vector<float> rest;          // [m^3]
  std::vector<uint32_t> color_end;  // index one past the last tetrahedron of each color
};
VolumeModel make_volume_model(std::span<const Vec3> rest, std::span<const Tet> tet);
float tet_volume(Vec3 a, Vec3 b, Vec3 c, Vec3 d);  // [m^3], signed

// One sweep over tetrahedra [first, last) of one color. lambda: one per tetrahedron, cleared at the start of a substep;
// compliance in [m^6/J], i.e. energy = (V - V0)^2 / (2 compliance) in joule.
void solve_volume(const VolumeModel& model, Vec4* x, const float* inv_mass, float compliance, float h, float* lambda,
                  uint32_t first, uint32_t last);

}  // namespace catgut
