// SPDX-License-Identifier: Apache-2.0
// runtime: each stitch as it is, measured on the form and the tension of its thread: not on what was counted while it was tied.
#pragma once
#include <cstdint>
#include <vector>

#include "exchange/snapshot.h"

namespace catgut {

struct StitchMeasures {
  uint32_t suture = 0;       // index in Snapshot::suture
  uint32_t points = 0;       // suture points that hold it
  bool finished = false;     // its thread is cut between its last hole and the needle
  int right = 0, left = 0;   // throws of either hand that the piece of thread through its holes shows
  int alternating = 0;       // throws of the longest knot that they can make, each of the other hand than the one below
  double tension = 0;        // [N] largest between its first and its last hole
  double first_to_last = 0;  // [m] from its first to its last hole
  int throws() const { return right + left; }
};
// Of every suture with two suture points or more. Some milliseconds each.
std::vector<StitchMeasures> measure_stitches(const Snapshot& seen);
// The fewest throws of all finished stitches; 0 without one.
int throws_held(const std::vector<StitchMeasures>& stitches);
// How many are finished: one that was left without its knot, on its needle, is not.
int stitches_finished(const std::vector<StitchMeasures>& stitches);

}  // namespace catgut
