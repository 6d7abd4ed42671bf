// SPDX-License-Identifier: Apache-2.0
// geometry/skin: moves a visible mesh with its particles by linear skinning (paper 2.1: "adjustable influence radii and
// falloff").
#pragma once
#include <span>

#include "exchange/picture.h"

namespace catgut {

// Fills skin_particle and skin_weight of `mesh`: each vertex follows its (up to four) nearest particles within `influence` [m],
// weight (1 - d / reach)^falloff normalized, where reach = the smaller of `influence` and the distance of the fifth nearest. A
// particle's weight reaches zero where another replaces it among the four, so the image has no seams.
// A vertex with none in reach follows its nearest only. particle_rest must not be empty.
void bind_skin(VisibleMesh& mesh, std::span<const Vec3> particle_rest, float influence, float falloff);

// Moves the mesh: position and normal have one entry per vertex of mesh. particle, rotation: the snapshot's, [m].
// particle_rest: rest positions with the same indexing.
void skin(const VisibleMesh& mesh, std::span<const Vec3> particle_rest, std::span<const Vec3> particle,
          std::span<const Quat> rotation, std::span<Vec3> position, std::span<Vec3> normal);

}  // namespace catgut
