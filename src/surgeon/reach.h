// SPDX-License-Identifier: Apache-2.0
// surgeon/reach: where jaws take the tail of a suture and from which direction they come, so that neither walls nor the strands
// and knots of other stitches get between them or are pushed aside. From the Snapshot alone.
#pragma once
#include <span>

#include "exchange/picture.h"
#include "exchange/snapshot.h"

namespace catgut {

// [m] from p to the nearest strand of another suture, or wall too. Nothing beyond `most` counts.
float room_at(const PictureModel& picture, const Snapshot& seen, Vec3 p, bool walls, float most);

// Of the directions from the tip of an instrument to its hand (unit), the number of the first along which its shaft is clear of
// walls and of other stitches when its tip is at `goal`; if none is, of the one with most room.
size_t clear_shaft(const PictureModel& picture, const Snapshot& seen, Vec3 goal, std::span<const Vec3> direction);

// Unit: away from the walls within 6 mm of p, on the side of each where p is; the nearest count most. Up where there are none.
Vec3 wall_normal(const PictureModel& picture, const Snapshot& seen, Vec3 p);

// Thread lies between the closed jaws of an instrument, behind the needle that they hold: it would be pulled along.
bool catches_thread(const PictureModel& picture, const Snapshot& seen, const ToolView& tool);
// The same of another suture's thread, anywhere between jaws that hold thread of the active one.
bool catches_other_thread(const PictureModel& picture, const Snapshot& seen, const ToolView& tool);

}  // namespace catgut
