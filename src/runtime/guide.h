// SPDX-License-Identifier: Apache-2.0
// runtime: where the next bite of a technique should go, for people: the places are those of the surgeon's plan, where the
// tissue has carried them by now.
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

// The first place that has no bite yet, counted along the plan; none when all are made.
std::optional<BiteGuide> next_bite(const BitePlaces& places, const PictureModel& picture, const Snapshot& seen);

}  // namespace catgut
