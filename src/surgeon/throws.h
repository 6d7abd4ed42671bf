// SPDX-License-Identifier: Apache-2.0
// surgeon/throws: the throws that a thread shows, wide or drawn tight, however they lie. By topology (thread/topology), not by
// how far the strands have turned about each other: that changes with every bend of a wide loop.
#pragma once
#include <span>

#include "core/math.h"

namespace catgut {

struct SeenThrows {
  int right = 0, left = 0;  // handed
  int turns = 0;            // of the throw that has most
  friend bool operator==(const SeenThrows&, const SeenThrows&) = default;
  // Throws of the longest knot that they can make with every throw of the other hand than the one below.
  int alternating() const;
  // Hand of the next one, +1 right; `first`: hand of the knot's first throw.
  float next(float first) const;
};
// An end that has passed back through its own last throw makes another knot of the whole: then the throws below it are counted,
// with up to 9 mm of either end left out.
// The thread from end to end; whatever lies beyond (needle, hands) leads away from the knot. Some milliseconds: once or twice a
// throw, not every tick.
SeenThrows see_throws(std::span<const Vec3> thread);

}  // namespace catgut
