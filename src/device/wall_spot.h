// SPDX-License-Identifier: Apache-2.0
// device: the place of the wall that a pointer is at. A flat screen does not show how deep an instrument is: pen, swab and
// scissors go to the tissue under the pointer, the jaws of clamps and forceps to the rim beside it. Pure functions. Physical
// mechanics only, whose wall consists of columns.
#pragma once
#include <optional>

#include "exchange/picture.h"
#include "exchange/snapshot.h"

namespace catgut {

struct ViewFrame;

struct WallSpot {
  Vec3 at;          // [m] on the outer face
  Vec3 out, up;     // unit: away from the wall; along it, toward the rim
  float thick = 0;  // [m] of the wall
};
// Under the pointer, on an outer face that is turned to the eye. pointer: [m] any place on its line of sight.
std::optional<WallSpot> wall_under(const ViewFrame& view, Vec3 pointer, const PictureModel& picture, const Snapshot& seen);
// The place of a rim that is nearest to the pointer in the picture, within `reach` [m].
std::optional<WallSpot> rim_beside(const ViewFrame& view, Vec3 pointer, float reach, const PictureModel& picture,
                                   const Snapshot& seen);

// Where an instrument works there. Tool frames as in exchange/tool_input.
Pose tip_on(const WallSpot& spot, float above);  // square to the wall, the shaft a little toward the rim
Pose blades_at(const WallSpot& spot);            // one blade on each side, up to this place
Pose jaws_at(const WallSpot& rim);               // likewise jaws, over the rim

}  // namespace catgut
