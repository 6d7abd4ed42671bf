// SPDX-License-Identifier: Apache-2.0
// technique/lembert: interrupted stitches through both layers of a cut bowel. A locked knot closes inner and outer layer there
// and, by the angle rule, between it and its neighbors (paper 2.5.4, figure 15). Reads suture points and knots; returns pairs
// of a ClosurePlan, and events for faults.
#pragma once
#include <span>
#include <vector>

#include "technique/view.h"

namespace catgut {

struct LembertModel {
  std::vector<uint32_t> outer,
      inner;                 // pg_o and pg_i: particles of the two rims, in order, on the sides that face each other
  float gap = 0.0005f;       // [m]
  float compliance = 1e-5f;  // [m/N]
  float fastest = 1.0f;      // [1/s] of progress
  float widest = 2.2f;       // [rad] stitches further apart than this are not neighbors
  int throws = 2;            // a knot with fewer holds nothing
};

// A tied stitch.
struct LembertStitch {
  uint32_t row = 0;     // of the plan: its pair, shared by a neighbor nearer than the next particle
  uint32_t suture = 0;  // sutures baked before it
  uint32_t holds = 1;   // 0: it had too few throws, or was cut
};
// The technique's own data for a row of ClosurePlan::pair.
struct LembertRow {
  // The stitches between which it lies, the second one of any suture: it is closed while both hold, or one whose pair it is.
  uint32_t one = 0, other = 0, other_suture = 0;
  uint32_t reported = 0;  // 1: seam_closed was reported
};

struct LembertState {
  std::vector<LembertStitch> stitch;  // in the order of tying
  std::vector<LembertRow> row;        // one per row of the plan
  uint32_t suture_index = 0;          // sutures baked before the current one
  uint32_t throws = 0, knot = 0;      // its locked throws; its newest knot
  uint32_t tied = 0;                  // 1: its stitch is in the list
  uint32_t reported = 0;              // a bit per Fault
};

// Once per tick.
void lembert(const LembertModel& model, LembertState& state, const TechniqueView& view, ClosurePlan& plan, EventList& events);

// "If the angle between v1 and vp and the angle between v2 and vp equals the angle between v1 and v2, then the particle is
// between sp1 and sp2." All three as seen along `axis`.
bool is_between(Vec3 v1, Vec3 v2, Vec3 vp, Vec3 axis);

}  // namespace catgut
