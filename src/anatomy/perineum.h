// SPDX-License-Identifier: Apache-2.0
// anatomy/perineum: the surroundings of a prolapse in lithotomy position: perineal skin with cleft and anal folds, the dentate
// line, sterile drapes over thighs and abdomen, a self-retaining ring retractor with elastic stays. A still picture: nothing of
// it collides. Generated; needs no external mesh.
#pragma once
#include <vector>

#include "exchange/picture.h"

namespace catgut {

// Sizes are chosen at those of an adult and of a common ring retractor (Lone Star type); none is measured.
struct PerineumShape {
  Vec3 verge;               // [m] center of the anal verge
  Vec3 out{0, 0.6f, 0.8f};  // unit, out of the body toward the surgeon, who sits between the legs
  float radius = 0.020f;    // [m] outer radius of the bowel that comes through the verge
  int stays = 8;            // hooks on elastic cords round the ring
};
std::vector<Scenery> make_perineum(const PerineumShape& shape);

}  // namespace catgut
