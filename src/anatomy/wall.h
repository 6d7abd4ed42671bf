// SPDX-License-Identifier: Apache-2.0
// anatomy/wall: thickens a surface into the wall of an organ. Shared by the bowel generator and the organ import.
#pragma once
#include <span>
#include <string>
#include <vector>

#include "anatomy/body.h"
#include "geometry/mesh.h"

namespace catgut {

struct WallSpec {
  std::string name = "body";    // of the organ, in messages
  float thickness = 0.0025f;    // [m]
  float density = 1050;         // [kg/m^3]
  bool extra_particle = false;  // for odd counts: one more, at mid-wall
  uint32_t extra_triangle = 0;  // of the sheet: its location
};

// Thickens `sheet` inward. Sheet vertex v becomes particle 2 v (serosa, on the sheet) and 2 v + 1 (mucosa, `thickness` inward
// along normal[v], unit, outward). The extra particle is last. Fills everything of BodyRest but name, visible and the pinned
// flags (all 0). Rims are in the order and sense of boundary_loops. Clusters: a particle, its neighbors on its side, its
// partner across the wall and the partner's neighbors; beyond 16 the farthest are left out.
// Where the sheet bends too sharply for the wall, the wall is thinner, down to a tenth. Throws InputError if that is still
// too thick (a tetrahedron would be inside out).
BodyRest thicken(const TriangleMesh& sheet, std::span<const Vec3> normal, const WallSpec& wall);

// The normals of the sheet, rotated toward their neighbors' where a wall of that thickness would otherwise fold over itself.
std::vector<Vec3> wall_directions(const TriangleMesh& sheet, float thickness);

// [m^3] positive for a Tet in the right order.
double tet_volume(std::span<const Vec3> position, const Tet& tet);

}  // namespace catgut
