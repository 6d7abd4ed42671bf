// SPDX-License-Identifier: Apache-2.0
// surgeon/throws: see the header.
#include "surgeon/throws.h"

#include <algorithm>

#include "thread/topology.h"

namespace catgut {
namespace {

constexpr float kFar = 3;  // [m]: beyond any thread
// [m] of an end that is left out, step by step, while the rest is not composed of throws.
constexpr float kStep = 1.5e-3f, kMostLeftOut = 9e-3f;

// Nodes at an end that are `out` [m] long.
size_t nodes_of(std::span<const Vec3> thread, float out, bool front) {
  size_t n = 0;
  for (float length = 0; length < out && n + 2 < thread.size(); ++n) {
    const size_t i = front ? n : thread.size() - 2 - n;
    length += distance(thread[i], thread[i + 1]);
  }
  return n;
}

bool count(std::span<const Vec3> thread, SeenThrows& seen) {
  const thread::KnotType type = thread::vote_knot(thread, kFar, true).type;
  for (const thread::KnotFactor& f : type.factors) {
    ++(f.hand > 0 ? seen.right : seen.left);
    seen.turns = std::max(seen.turns, int{f.wraps});
  }
  return type.known;
}

}  // namespace

int SeenThrows::alternating() const { return 2 * std::min(right, left) + (right != left ? 1 : 0); }

float SeenThrows::next(float first) const { return right > left ? -1.0f : right < left ? 1.0f : first; }

SeenThrows see_throws(std::span<const Vec3> thread) {
  SeenThrows seen;
  bool known = count(thread, seen);
  for (float out = kStep; !known && out < kMostLeftOut; out += kStep)
    for (const bool front : {true, false}) {
      const size_t n = nodes_of(thread, out, front);
      SeenThrows part;
      if (!count(front ? thread.subspan(n) : thread.first(thread.size() - n), part)) continue;
      if (!known || part.alternating() > seen.alternating()) seen = part;
      known = true;
    }
  return seen;
}

}  // namespace catgut
