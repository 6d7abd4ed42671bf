// SPDX-License-Identifier: Apache-2.0
// geometry/mesh: an indexed triangle mesh, used by importers, generators and rendering.
#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "core/math.h"

namespace catgut {

using Triangle = std::array<uint32_t, 3>;  // counter-clockwise seen from outside
using Tet = std::array<uint32_t, 4>;       // positive volume: (x1-x0) x (x2-x0) . (x3-x0) > 0

struct TriangleMesh {
  std::vector<Vec3> position;  // [m]
  std::vector<Triangle> triangle;
};

}  // namespace catgut
