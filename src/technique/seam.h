// SPDX-License-Identifier: Apache-2.0
// technique/seam: two bowel ends drawn together along a line (paper 2.5.2 Connell, 2.5.3 stay; figures 12 to 14). Where the
// thread crosses from one end to the other a midpoint is made and both points are drawn to it, as far as the needle has pulled
// the thread through; between two midpoints the edges follow. Reads suture points, lengths of thread and knots; answers with
// pairs of a ClosurePlan, and with events for what was out of order.
#pragma once
#include <array>
#include <span>
#include <vector>

#include "technique/view.h"

namespace catgut {

struct SeamModel {
  bool connell = true;                       // false: stay, one bite through each end
  std::array<std::vector<uint32_t>, 2> rim;  // particles round the two ends, on the outer side, in order
  float step = 0.003f;                       // [m] dist_threshold of 2.5.2: between the pairs in between
  float gap = 0.0005f;                       // [m] what is left between two points drawn together
  float compliance = 1e-5f;                  // [m/N]
  float fastest = 1.5f;                      // [1/s] of progress
};

// What leads a pair.
enum class SeamHold : uint32_t {
  thread,  // the length of thread between its two points
  knot,    // a knot was locked after it: it does not open again
  nothing  // its thread was cut or taken away untied: it opens
};

// What the technique remembers of a row of ClosurePlan::pair.
struct SeamRow {
  uint32_t leader = 0;  // row of the midpoint whose progress it has: itself for a midpoint, the later one for a pair in between
  uint32_t point = 0;   // midpoint: index of the first of its two suture points
  float from = 0;       // [m] midpoint: length of thread between the two at which closing begins
  SeamHold hold = SeamHold::thread;
  uint32_t reported = 0;  // 1: seam_closed was said
};

// How the bites of a suture follow each other, as the order rules see them.
struct Pass {
  uint32_t bite = 0, wall = 0;
  bool in_inside = false, out_inside = false;  // its entry, its exit lies on the mucosa
};

struct SeamState {
  std::vector<SeamRow> row;   // one per row of the plan
  uint32_t first_row = 0;     // of the suture in hand
  uint32_t suture_index = 0;  // sutures settled before it
  uint32_t points = 0;        // its suture points that were looked at for crossings
  uint32_t passes = 0;        // its bites that were judged
  uint32_t throws = 0;        // its locked throws
  uint32_t reported = 0;      // a bit per Fault
  std::vector<Pass> pass;     // working memory, not saved
};

// Once a tick.
void seam(const SeamModel& model, SeamState& state, const TechniqueView& view, ClosurePlan& plan, EventList& events);

Fault judge_connell(std::span<const Pass> pass);  // of the last pass; Fault::none when it is in order
Fault judge_stay(std::span<const Pass> pass);

}  // namespace catgut
