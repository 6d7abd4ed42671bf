// SPDX-License-Identifier: Apache-2.0
// physical/carry: a finished stitch that sleeps moves along with the wall round it, as a rigid body (docs/physical.md, "Cost").
// Reads what Sleep remembers of the wall; moves the nodes of strands that sleep.
//
// Nothing is stored for it: the motion follows from Sleep::watched and the wall, so that a saved state continues to the bit.
#pragma once
#include <span>
#include <utility>

#include "core/math.h"
#include "physical/sleep.h"

namespace catgut::physical {

// Of those columns that the strand loads: the best rigid motion, by least squares. Fewer than three: none. watched: of
// Sleep::watched, the strand's own at least.
Carry carry_of(const SleepModel& model, std::span<const Sleep::Watched> watched, const wall::State& wall, uint32_t strand);
// Whether only the wall holds the strand: it is in holes, and no hand or tool touches it, and no drape but at its tails.
bool only_in_wall(const Model& model, const State& state, const Sleep::Strand& strand, std::span<const thread::Hold> holds,
                  std::span<const thread::ToolCapsule> tools, const thread::Plane* drape);
// The nodes of a strand between its tails: those that touch thread, and those in holes. First and last.
std::pair<size_t, size_t> without_tails(const thread::State& thread, const Sleep::Strand& strand);
// Whether these nodes are higher than that over the drape [m].
bool is_above(const thread::State& thread, size_t first, size_t last, const thread::Plane& drape, float height);
// Whether a strand that sleeps may be carried: it was only in the wall when it fell asleep.
bool is_carried(const State& state, uint32_t strand);
// Takes a strand along; it keeps its shape.
void carry(const Model& model, State& state, uint32_t strand, const Carry& by);
// Before a carried strand is stepped again: it lies in the wall as that is now, and directions that contacts remember turn
// along.
void wake_carried(const Model& model, State& state, uint32_t strand);

}  // namespace catgut::physical
