// SPDX-License-Identifier: Apache-2.0
// runtime: interpolates a picture between two ticks. Reads two snapshots; writes a third.
#pragma once
#include "exchange/snapshot.h"

namespace catgut {

// Interpolates all moving parts at `part` from `before` (0) to `now` (1). The rest is that of `now`, and so is everything if
// the two are not consecutive (different number of particles, different order of time). Reuses the memory of `out`.
void blend(const Snapshot& before, const Snapshot& now, float part, Snapshot& out);

}  // namespace catgut
