// SPDX-License-Identifier: Apache-2.0
// geometry/topology: adjacency in a triangle mesh. Plain functions over index lists; results depend only on the
// mesh, in ascending or traversal order, never on hashing.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "geometry/mesh.h"

namespace catgut {

// For each of `vertices` vertices, those that share an edge with it, ascending.
std::vector<std::vector<uint32_t>> vertex_neighbors(std::span<const Triangle> triangle, size_t vertices);

// The openings of a manifold surface. Each loop in traversal order, counter-clockwise seen from outside the opening (its
// loop_normal points out of the organ when triangles are counter-clockwise seen from outside). Loops are ordered by their
// smallest vertex and start with it. Openings that touch in one vertex are separated by the triangle fan.
std::vector<std::vector<uint32_t>> boundary_loops(std::span<const Triangle> triangle);

// Unit normals, each triangle's weighted by its angle at the vertex; {0,0,0} for a vertex without area.
std::vector<Vec3> vertex_normals(const TriangleMesh& mesh);

// [m^2], and [m^3] enclosed by a closed surface (positive when counter-clockwise seen from outside).
double surface_area(const TriangleMesh& mesh);
double enclosed_volume(const TriangleMesh& mesh);

// An edge as one sortable number: smaller index first.
constexpr uint64_t edge_key(uint32_t a, uint32_t b) {
  return a < b ? static_cast<uint64_t>(a) << 32 | b : static_cast<uint64_t>(b) << 32 | a;
}

}  // namespace catgut
