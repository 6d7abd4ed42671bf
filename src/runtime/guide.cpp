// SPDX-License-Identifier: Apache-2.0
// runtime: see guide.h.
#include "runtime/guide.h"

#include <algorithm>
#include <stdexcept>

#include "runtime/hands.h"

namespace catgut {

BitePlaces bite_places(const SceneSpec& scene, const PictureModel& picture) {
  try {
    return {make_plan(plan_of(scene), picture, skill_of(scene)).place};
  } catch (const std::invalid_argument&) { return {}; }
}

std::optional<BiteGuide> next_bite(const BitePlaces& places, const PictureModel& picture, const Snapshot& seen) {
  auto made = std::count_if(seen.active().bite.begin(), seen.active().bite.end(), [](const BiteView& b) { return b.complete; });
  for (const BitePlace& p : places.place) {
    if (p.suture != seen.active_suture) continue;
    made -= p.walls;
    if (made >= 0) continue;
    const BiteFrame f = bite_frame(picture, seen, p);
    return BiteGuide{f.at, f.out, f.along, p.length, p.depth, p.suture};
  }
  return {};
}

}  // namespace catgut
