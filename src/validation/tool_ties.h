// SPDX-License-Identifier: Apache-2.0
// validation: scripted hands that tie throws with instruments. Wind the long strand round the needle holder,
// grasp the tail with its jaws, pull it through, pull the ends apart. The tools are capsules that the thread cannot pass; their
// outline is the one that src/render draws. The hands act on what a surgeon sees and feels: the tension of the strand and the
// place of the tail. There are no retries: what goes wrong shows in the knot.
#pragma once
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/random.h"
#include "thread/thread.h"

namespace catgut::validation {

// One throw as it is tied: how often the strand is wound round the needle holder, and whether in the sense that makes a square
// knot with the throw before it (true) or a granny (false).
struct TiedThrow {
  int wraps = 1;
  bool alternating = true;
};
using Tie = std::vector<TiedThrow>;

struct TieSettings {
  float speed = 0.3f;       // [m/s] maximum of the hands
  float pull = 2.5f;        // [N] at which the hands pull a throw tight; their grip slips at twice this
  float segment = 0.7e-3f;  // [m]
  float tail = 42e-3f;      // [m]
  uint64_t seed = 0;        // of the tremor of the way points, 1 mm; 0: none
};

struct TiedKnot {
  thread::State state;
  uint32_t bite_a = 0, bite_b = 0;  // nodes that the tissue holds
  uint64_t determinant = 0;
  double writhe = 0;
  float nearest = 1;   // smallest distance between strands that touch, in diameters
  double seconds = 0;  // simulated
  float tension = 0;   // [N] of the hands at the end, mean
  float fastest = 0;   // [m/s] of either hand
  int missed = 0;      // throws whose tail was not between the jaws when they closed
  int rewound = 0;     // turns and throws made again because a turn had slid off the jaws
};

// `each_tick`, if given, receives every state and the tools (for pictures): capsules of the needle holder, then the forceps,
// whose to_a is kForcepsReach behind the strand that it holds, then the rod.
constexpr float kForcepsReach = 1.6e-3f;  // [m]
using TieWatcher =
    std::function<void(const thread::State&, std::span<const thread::ToolCapsule>, double time, const std::string& phase)>;
TiedKnot tie_with_tools(const thread::Settings& settings, const Tie& tie, const TieSettings& how,
                        const TieWatcher& each_tick = {});

}  // namespace catgut::validation
