// SPDX-License-Identifier: Apache-2.0
// assess: what an electrosurgical pen has done to a wall: how far from the rim it was divided, where bridges of tissue were
// left, and how long the pen was switched on. Reads PictureModel, Snapshots and commands; docs/assessment.md, "Cuts".
#pragma once
#include <span>
#include <vector>

#include "assess/result.h"
#include "assess/stitch_map.h"
#include "assess/surface.h"
#include "exchange/picture.h"
#include "exchange/snapshot.h"
#include "exchange/tool_input.h"

namespace catgut::assess {

// The pen that is switched on. Commands of its hand switch it, as in docs/wall.md: `cut`, and `new_suture` for coagulation.
struct PenFacts {
  int tool = -1;  // of Snapshot::instrument; -1: none is on
  CommandKind mode = CommandKind::none;
  double seconds = 0;  // switched on
};
bool has_pen(const PictureModel& picture);
// After every tick.
void note_pen(PenFacts& pen, const PictureModel& picture, const Snapshot& seen, const TickInput& input, double tick_s);

struct CutPlaces {
  std::vector<Sample> distance;  // [mm] of the cut from the rim at rest, one per millimeter of rim beside which there is a cut
  // [mm] of rim beside which the wall is not divided, one per stretch; a single 0 when it is divided all round.
  std::vector<Sample> bridge;
};
// Of all walls that a cut has touched; nothing where no pen has touched the tissue.
CutPlaces cut_places(std::span<const StitchEdge> edge, const RestSurface& rest, const Snapshot& seen);

}  // namespace catgut::assess
