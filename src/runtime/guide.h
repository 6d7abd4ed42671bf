// SPDX-License-Identifier: Apache-2.0
// runtime: planned position of the next bite, for display: the positions of the surgeon's plan, carried by the
// tissue.
#pragma once
#include <optional>
#include <vector>

#include "device/bite_guide.h"
#include "sim/scene.h"
#include "surgeon/plan.h"

namespace catgut {

struct BitePlaces {
  std::vector<BitePlace> place;  // empty: the scene has no plan
};
BitePlaces bite_places(const SceneSpec& scene, const PictureModel& picture);

// The first place of the active suture without a bite, in the order of the plan; none when all are complete.
std::optional<BiteGuide> next_bite(const BitePlaces& places, const PictureModel& picture, const Snapshot& seen);

}  // namespace catgut
