// SPDX-License-Identifier: Apache-2.0
// geometry/mesh_clean: makes a manifold, consistently oriented surface from a triangle soup, or reports why it cannot.
#pragma once
#include <string>

#include "geometry/mesh.h"

namespace catgut {

// Length of the bounding box's diagonal; 0 for an empty mesh.
float diagonal(const TriangleMesh& mesh);

// Joins vertices nearer than `tolerance`, drops triangles that lost a corner or occur twice, and unused vertices.
TriangleMesh weld(const TriangleMesh& mesh, float tolerance);

// weld (tolerance 5e-6 of the size: 1e-6 m for an organ of 0.2 m), then: every edge in at most two triangles, all triangles
// oriented consistently and outward (openings assumed closed), vertices that join two fans split, specks (below 1 % of the
// area) dropped. Where the file contains both sides of a wall, the outer surface is kept and those inside it are dropped.
// where: the file, for messages. Throws InputError: no triangles, no area, edges shared by more than two triangles, a surface
// with one side only, several surfaces side by side.
TriangleMesh clean_mesh(const TriangleMesh& mesh, const std::string& where);

}  // namespace catgut
