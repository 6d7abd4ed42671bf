// SPDX-License-Identifier: Apache-2.0
// geometry/remesh: resamples a surface to another number of vertices, evenly spaced: particles require equal distances, which
// organ files rarely have.
#pragma once
#include <string>

#include "geometry/mesh.h"

namespace catgut {

// A manifold surface with exactly `vertices` vertices on `mesh` (manifold, one piece, as clean_mesh leaves it) and triangles as
// near equilateral as its shape allows. Edges are split and collapsed one at a time (link condition: preserves the topology),
// flipped toward six neighbors, and vertices slide along the surface. Vertices on a rim slide along the rim only and end evenly
// spaced on it. The same input gives the same bits. where: the file, for messages. Throws InputError when the number of
// vertices is too small for the surface.
TriangleMesh remesh(const TriangleMesh& mesh, size_t vertices, const std::string& where);

// The smallest and the mean smallest angle over all triangles [degrees], and edge lengths [m].
struct MeshQuality {
  float least_angle = 0, mean_least_angle = 0;
  float shortest = 0, mean = 0, longest = 0;
};
MeshQuality mesh_quality(const TriangleMesh& mesh);

}  // namespace catgut
