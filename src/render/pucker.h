// SPDX-License-Identifier: Apache-2.0
// render/pucker: the folds of an opening that a purse-string gathers. The simulated wall is too coarse to buckle: it only gets
// shorter round the opening. The drawn wall keeps its length instead, in one fold per stitch: out where the thread is in the
// wall, in where the thread runs over it. Plain geometry, no graphics library.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "exchange/picture.h"

namespace catgut {

// Of a visible mesh at rest, per vertex.
struct RoundOrgan {
  static constexpr uint32_t kNone = 0xffffffffu;
  std::vector<uint32_t> next;  // neighbor on the way round the organ; kNone: there is none
  std::vector<float> step;     // [m] to it
  std::vector<float> angle;    // position round the organ, 0..1
  std::vector<Vec3> outward;   // unit, from the lumen to the outside, on either side of the wall
  float length = 0;            // [m] once round
};
RoundOrgan round_organ(const VisibleMesh& mesh);

// A piece of thread along the opening, between two neighboring suture points.
struct Gather {
  float from = 0, to = 0;  // of RoundOrgan::angle; to may exceed 1 where it crosses the seam
  bool in_wall = false;
};

struct Fold {
  float out = 0;    // [m] displacement along the vertex's outward direction
  float slope = 0;  // its change per meter on the way to the next vertex
};
// Fold at a vertex at `angle` where the wall has `ratio` of its length round the organ at rest. No fold from a ratio of 1 up.
Fold fold_at(std::span<const Gather> gather, float angle, float ratio, float round);

}  // namespace catgut
