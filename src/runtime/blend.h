// SPDX-License-Identifier: Apache-2.0
// runtime: a picture between two ticks. Reads two snapshots; writes a third.
#pragma once
#include "exchange/snapshot.h"

namespace catgut {

// Everything that moves, at `part` of the way from `before` (0) to `now` (1); everything else, and all of it when the two do
// not follow each other (another number of particles, another order of time), as in `now`. Reuses the memory of `out`.
void blend(const Snapshot& before, const Snapshot& now, float part, Snapshot& out);

}  // namespace catgut
