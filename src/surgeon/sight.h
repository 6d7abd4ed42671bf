// SPDX-License-Identifier: Apache-2.0
// surgeon/sight: the surgeon's view of the field, from the Snapshot alone: the current position of a point of tissue. Length
// and arrangement of strands: exchange/strand.h.
#pragma once
#include <vector>

#include "exchange/picture.h"
#include "exchange/snapshot.h"
#include "exchange/strand.h"

namespace catgut {

// Current position of the point that was at `rest` [m], from the nearest particles of wall `wall`; turned (may be null):
// rotation of the tissue there.
Vec3 live_place(const PictureModel& picture, const Snapshot& seen, Vec3 rest, uint32_t wall, Quat* turned);

// An opening at rest: center, outward axis, mean radius, perimeter.
struct OpeningShape {
  Vec3 center, axis;
  float radius = 0, round = 0;  // [m]
};
OpeningShape opening_shape(const PictureModel& picture, uint32_t wall);

}  // namespace catgut
