// SPDX-License-Identifier: Apache-2.0
// app/xr: labels around the stitches, so that a wearer reads the results where the stitches are. Pure. The labels stand on a
// ring around the suture points: fixed in the world while the wearer walks around them, and turned toward the eyes.
#pragma once
#include <array>
#include <span>
#include <string>
#include <vector>

#include "render/eyes.h"
#include "xr/place.h"

namespace catgut::xr {

struct StitchMark {
  std::array<Vec3, 2> at;           // [m] world: entry, exit
  std::array<std::string, 2> text;  // two lines
  uint32_t color = 0xffffffffu;     // as of a Label
};

// One label per mark, in their order; of more than EyeRenderer::kMostLabels the last ones. eyes: [m] world.
std::vector<Label> place_labels(std::span<const StitchMark> marks, const Place& place, Vec3 eyes);

}  // namespace catgut::xr
