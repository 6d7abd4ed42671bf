// SPDX-License-Identifier: Apache-2.0
// wall/cut: the wall divides along edges of its faces. Columns on the cut are copied and corners remapped; shapes at rest,
// frames and velocities are carried over. Cutting only removes links, so the old factor stays a valid bound of the stiffness:
// copies share its row, plus a diagonal part for motion against each other. A new factor is made when asked for.
#pragma once
#include <array>
#include <span>

#include "wall/wall.h"

namespace catgut::wall {

// Cuts the given edges (pairs of columns of the present topology). Returns the columns that were added; the scratch grows with
// them. A column is divided only where the cut separates its faces: the inner end of a slit stays whole.
uint32_t cut(const Model& model, State& state, Scratch& scratch, std::span<const std::array<uint32_t, 2>> edge);

// The factor of the present topology. Independent of the motion: it may be made elsewhere from a copy of the topology and put
// in place between two steps.
void refactor(const Model& model, State& state, Scratch& scratch);

// The pieces of the wall: per column, the smallest column of its piece.
std::vector<uint32_t> pieces(const State& state);

}  // namespace catgut::wall
