// SPDX-License-Identifier: Apache-2.0
// surgeon/sight: what a surgeon can see of the field, from the Snapshot alone: where a place of the tissue is now. How long a
// piece of thread is and which strand lies where: exchange/strand.h.
#pragma once
#include <vector>

#include "exchange/picture.h"
#include "exchange/snapshot.h"
#include "exchange/strand.h"

namespace catgut {

// Where the place that was at `rest` [m] is now, by the nearest particles of wall `wall`; turned (may be null): how the tissue
// there has turned.
Vec3 live_place(const PictureModel& picture, const Snapshot& seen, Vec3 rest, uint32_t wall, Quat* turned);

// An opening at rest: center, the way out of it, mean radius, length round.
struct OpeningShape {
  Vec3 center, axis;
  float radius = 0, round = 0;  // [m]
};
OpeningShape opening_shape(const PictureModel& picture, uint32_t wall);

}  // namespace catgut
