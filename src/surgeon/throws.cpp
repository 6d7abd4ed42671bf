// SPDX-License-Identifier: Apache-2.0
// surgeon/throws: see the header.
#include "surgeon/throws.h"

#include <algorithm>

#include "thread/topology.h"

namespace catgut {

constexpr float kFar = 3;  // [m]: beyond any thread

int SeenThrows::alternating() const { return 2 * std::min(right, left) + (right != left ? 1 : 0); }

float SeenThrows::next(float first) const { return right > left ? -1.0f : right < left ? 1.0f : first; }

SeenThrows see_throws(std::span<const Vec3> thread) {
  SeenThrows seen;
  for (const thread::KnotFactor& f : thread::vote_knot(thread, kFar, true).type.factors) {
    ++(f.hand > 0 ? seen.right : seen.left);
    seen.turns = std::max(seen.turns, int{f.wraps});
  }
  return seen;
}

}  // namespace catgut
