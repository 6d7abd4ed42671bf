// SPDX-License-Identifier: Apache-2.0
// app/window: what the labels beside the stitches say in a headset: number, edge distances, depth, tension. Reads StitchMap and
// Snapshot; app/xr/labels places the labels.
#pragma once
#include <span>
#include <vector>

#include "assess/stitch_map.h"
#include "window/charts.h"
#include "xr/labels.h"

namespace catgut {

// Tissue at rest: of the scene that is shown, kept beyond it for its results.
struct RestTissue {
  std::vector<Vec3> particle;  // [m] PictureModel::particle_rest
  std::vector<uint8_t> wall;   // PictureModel::wall
};
RestTissue rest_tissue(const PictureModel& picture);

// One mark per bite that was complete at the snapshot's moment, in their order. Entry and exit lie where the tissue is now.
// First line: number, edge distances at entry and exit [mm]; second line: depth [mm], and the largest tension of the thread at
// its two suture points [N], where the thread still is.
std::vector<xr::StitchMark> stitch_marks(const StitchMap& map, const RestTissue& rest, const Snapshot& seen, BiteColor by);

}  // namespace catgut
