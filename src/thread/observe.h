// SPDX-License-Identifier: Apache-2.0
// thread/observe: names knots and throws as a surgeon would. Reads the crossings of a State; the mechanics do not depend on it.
// For teaching and scoring, at any moment.
//
// Two strands leave a bite; A is the thread before it, B behind it. Within a throw both strands run side by side, so the thread
// between the two partners of a crossing has the same length everywhere in that throw, and each further throw adds to it.
// Throws are therefore the clusters of crossings over that length. The signs of the crossings give the chirality; their number
// and the turning of both strands about each other give the half turns.
#pragma once
#include <array>
#include <cstdint>
#include <string_view>

#include "thread/thread.h"

namespace catgut::thread {

enum class KnotName : uint8_t { none, single_throw, granny, square, surgeons, sliding, mixed };
std::string_view name_of(KnotName name);

struct SeenThrow {
  uint32_t half_turns = 0;  // 3: single throw, 5: double throw; 1: only crossed
  int hand = 0;             // +1 right-handed, -1 left-handed
  float loop = 0;           // [m] of thread between the partners: the loop including everything below
  float sliding = 0;        // 0: both strands bend alike; 1: one is straight and the other wound on it
  float gap = 0;            // [m] of free thread between this throw and the one below, or the bite: air
  float confidence = 0;     // 0..1
};
constexpr size_t kMaxThrows = 12;
struct SeenKnot {
  std::array<SeenThrow, kMaxThrows> item;  // from the bite upward
  uint32_t throws = 0;
  uint32_t wraps = 0;  // of all throws: (half turns - 1) / 2
  KnotName name = KnotName::none;
  bool air = false;      // a gap above 1 mm between throws, or to the loop given by the caller
  float confidence = 0;  // 0..1, of the name: the minimum over its throws
};

// tight_loop [m]: the length of thread that a tight first throw leaves between its partners, 0 if unknown (then the first
// throw is never reported as an air knot).
SeenKnot observe(const Settings& settings, const State& state, float tight_loop = 0);

}  // namespace catgut::thread
