// SPDX-License-Identifier: Apache-2.0
// thread/observe: names knots and throws as a surgeon would. Reads the positions of a State; the mechanics do not depend on it.
// For teaching and scoring, at any moment.
//
// Which throws there are is topology: the thread, its ends led away and joined, is a composition of one torus knot per throw
// (thread/topology), however it is bent or drawn. The result is the same for most ways of leading the ends away; their share is
// the confidence. In which order they lie is found by shortening the thread from either end (knot fingerprint: Sulkowska et
// al. 2012, 10.1073/pnas.1205918109): the outermost throw comes undone first. Where they lie gives loop, air and sliding.
#pragma once
#include <array>
#include <cstdint>
#include <string_view>

#include "thread/thread.h"

namespace catgut::thread {

enum class KnotName : uint8_t { none, single_throw, granny, square, surgeons, mixed, other };
std::string_view name_of(KnotName name);  // "surgeon's"; other: a knot that no sequence of throws makes

struct SeenThrow {
  uint32_t half_turns = 0;  // 3: single throw, 5: double throw
  int hand = 0;             // +1 right-handed, -1 left-handed
  float loop =
      0;  // [m] of thread from where one strand enters it to where the other leaves it: everything below included; 0: not seen
  float sliding = 0;     // 0: both strands bend alike; 1: one is straight and the other wound on it
  float gap = 0;         // [m] of free thread between this throw and the one below, or the bite: air
  float confidence = 0;  // 0..1
};
constexpr size_t kMaxThrows = 12;
struct SeenKnot {
  std::array<SeenThrow, kMaxThrows> item;  // from the bite upward
  uint32_t throws = 0;
  uint32_t wraps = 0;  // of all throws: (half turns - 1) / 2
  KnotName name = KnotName::none;
  bool sliding = false;  // half hitches: one strand is straight and the other wound on it, as laid or because it capsized
  bool air = false;      // a gap above 1 mm between throws, or to the loop given by the caller
  float confidence = 0;  // 0..1, of the name: share of the closures that agree, less where another order explains as much
};

// tight_loop [m]: the length of thread that a tight first throw leaves between its partners, 0 if unknown (then the first
// throw is never reported as an air knot). Takes tens of milliseconds: for once a throw, not for every tick.
SeenKnot observe(const Settings& settings, const State& state, float tight_loop = 0);

}  // namespace catgut::thread
