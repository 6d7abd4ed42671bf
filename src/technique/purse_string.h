// SPDX-License-Identifier: Apache-2.0
// technique/purse_string: paper 2.5.1. Bites in and out round an opening. Nothing closes until the ring is complete; then, as
// the thread is tightened, every edge particle moves to the anvil, all arriving together. Its only interface to the mechanics:
// events (in) and a ClosurePlan (out).
#pragma once
#include <span>
#include <vector>

#include "technique/view.h"

namespace catgut {

struct PurseStringModel {
  std::vector<uint32_t> rim_outer, rim_inner;  // particles round the opening, in order; partners share an index
  Vec3 anvil;                                  // [m] relative to the rim's center at the start of the closure
  float anvil_radius = 0.004f;                 // [m]
  float wall = 0.0025f;                        // [m]
  float compliance = 5e-4f;                    // [m/N]
  int min_bites = 10;
  float fastest = 0.7f;  // [1/s] maximum progress: tissue needs time to gather
};

struct PurseStringState {
  bool ring_complete = false, closing = false, finished = false;
  float path_start = 0, path_end = 0;  // [m] path from the first to the last suture point, open and closed
  uint32_t checked = 0;                // suture points already checked for order
  float area_start = 0;                // [m^2]
  std::vector<Vec3> where;             // working memory, not saved
};

// The adjacency rule of 2.5.1: sp[i + 1] is the nearest to sp[i] among the three that follow it; past the end, sp[0..2] follow.
// Returns the first i (from `from` on) whose successor is not, or -1.
int first_out_of_order(std::span<const Vec3> sp, size_t from = 0);

// Once per tick. Fills `plan` when there is something to close, and reports faults through `events`.
void purse_string(const PurseStringModel& model, PurseStringState& state, const TechniqueView& view, ClosurePlan& plan,
                  EventList& events);

// Area of the opening [m^2]: the inner edge projected on its best-fit plane.
float opening_area(std::span<const uint32_t> rim, const Vec4* x);

}  // namespace catgut
