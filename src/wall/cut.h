// SPDX-License-Identifier: Apache-2.0
// wall/cut: divides the wall along edges of its faces. Columns on the cut are copied and corners remapped; rest shapes,
// frames and velocities are kept. Cutting only removes links, so the old factor remains a valid bound of the stiffness.
// Copies share its row, plus a diagonal part for their relative motion. A new factor is made on request.
#pragma once
#include <array>
#include <span>

#include "wall/wall.h"

namespace catgut::wall {

// Cuts the given edges (pairs of columns of the present topology). Returns the added columns; the scratch grows with
// them. A column is divided only where the cut separates its faces: the inner end of a slit stays connected.
uint32_t cut(const Model& model, State& state, Scratch& scratch, std::span<const std::array<uint32_t, 2>> edge);

// The factor of the present topology. Independent of the motion: it may be computed elsewhere from a copy of the topology and
// installed between two steps.
void refactor(const Model& model, State& state, Scratch& scratch);

// The pieces of the wall: per column, the smallest column of its piece.
std::vector<uint32_t> pieces(const State& state);

}  // namespace catgut::wall
