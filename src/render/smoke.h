// SPDX-License-Identifier: Apache-2.0
// render/smoke: the plume above the tip of a pen that burns tissue. A function of the Snapshot alone: a still shows the same as
// a film. The simulation does not know it.
#pragma once
#include <vector>

#include "exchange/snapshot.h"

namespace catgut {

struct Puff {
  Vec3 at;           // [m]
  float radius = 0;  // [m]
  float alpha = 0;   // 0 clear .. 1
};
constexpr size_t kMostPuffs = 40;

// At most kMostPuffs. `out` is replaced.
void smoke_of(const Snapshot& seen, std::vector<Puff>& out);

}  // namespace catgut
