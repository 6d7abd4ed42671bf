// SPDX-License-Identifier: Apache-2.0
// technique/seam: joins two bowel ends along a line (paper 2.5.2 Connell, 2.5.3 stay; figures 12 to 14). Where the thread
// crosses from one end to the other, both points are pulled to a midpoint as far as the thread has been pulled through.
// Between two midpoints the edges follow. Reads suture points, lengths of thread and knots; returns pairs of a ClosurePlan, and
// events for faults.
#pragma once
#include <array>
#include <span>
#include <vector>

#include "technique/view.h"

namespace catgut {

struct SeamModel {
  bool connell = true;                       // false: stay, one bite through each end
  std::array<std::vector<uint32_t>, 2> rim;  // particles of the two rims, on the outer side, in order
  float step = 0.003f;                       // [m] dist_threshold of 2.5.2: distance of the interpolated pairs
  float gap = 0.0005f;                       // [m] gap that remains between two closed points
  float compliance = 1e-5f;                  // [m/N]
  float fastest = 1.5f;                      // [1/s] of progress
};

// What controls a pair.
enum class SeamHold : uint32_t {
  thread,  // the length of thread between its two points
  knot,    // a later knot is locked: it does not open again
  nothing  // its thread was cut, or removed without a knot: it opens
};

// The technique's own data for a row of ClosurePlan::pair.
struct SeamRow {
  uint32_t leader = 0;  // row of the midpoint that sets its progress: itself for a midpoint, the later one otherwise
  uint32_t point = 0;   // midpoint: index of the first of its two suture points
  float from = 0;       // [m] midpoint: length of thread between the two at which closing starts
  SeamHold hold = SeamHold::thread;
  uint32_t reported = 0;  // 1: seam_closed was reported
};

// One bite of a sequence, as input of the order rules.
struct Pass {
  uint32_t bite = 0, wall = 0;
  bool in_inside = false, out_inside = false;  // its entry, its exit lies on the mucosa
};

struct SeamState {
  std::vector<SeamRow> row;   // one per row of the plan
  uint32_t first_row = 0;     // of the current suture
  uint32_t suture_index = 0;  // sutures baked before it
  uint32_t points = 0;        // its suture points that were checked for crossings
  uint32_t passes = 0;        // its evaluated bites
  uint32_t throws = 0;        // its locked throws
  uint32_t reported = 0;      // a bit per Fault
  std::vector<Pass> pass;     // working memory, not saved
};

// Once per tick.
void seam(const SeamModel& model, SeamState& state, const TechniqueView& view, ClosurePlan& plan, EventList& events);

Fault judge_connell(std::span<const Pass> pass);  // of the last pass; Fault::none when it is in order
Fault judge_stay(std::span<const Pass> pass);

}  // namespace catgut
