// SPDX-License-Identifier: Apache-2.0
// validation: did a thread pass through itself between two states? From positions alone, in double precision, so that it
// judges the contact of src/thread without using it.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "thread/thread.h"

namespace catgut::validation {

struct Place {
  double x = 0, y = 0, z = 0;  // [m]
};
std::vector<Place> places(const thread::State& state);

// Pairs of segments that pass through each other while every node moves in a straight line from `before` to `after`: their four
// nodes lie in one plane at a time at which the segments meet. For short steps: a pair that passes and returns counts as none.
// broken: per segment, 1: not a segment. The first and the last of three segments in a row do not count.
int count_passes(std::span<const Place> before, std::span<const Place> after, std::span<const uint8_t> broken);

}  // namespace catgut::validation
