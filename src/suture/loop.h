// SPDX-License-Identifier: Apache-2.0
// suture/loop: is the thread laid round a tool (paper 2.4, figure 10)? A pure function of where thread and tool are; the stage
// that freezes the loop it finds is in suture.h.
#pragma once
#include <span>

#include "suture/suture.h"

namespace catgut {

// A tool as the detection sees it: the tool frame (origin between the jaw tips, +z along the shaft toward the hand) and its
// capsules in that frame.
struct LoopTool {
  Pose pose;
  std::span<const Capsule> capsule;
};

struct LoopVerdict {
  LoopReason reason = LoopReason::no_crossing;  // none: it is a loop, and the rest below says which
  size_t first = 0, last = 0;                   // nodes of the order list, both in the loop
  uint32_t wraps = 0;                           // whole turns
  // +1: walked in the order of the list, the thread turns round the tool counter-clockwise as seen from the hand; -1:
  // clockwise.
  int32_t turn = 0;
  size_t touching = 0;  // nodes of the longest run that touches the tool
  float round = 0;      // [rad] the furthest that a run goes round the tool, loop or not
};

// x: particle positions; order: slots, consecutive ones joined by thread; pair [m]: rest distance of neighbors, the deepest
// that a loop may be (the paper's "one particle pair"); reach [m]: how far off the tool's surface thread still counts as
// touching.
LoopVerdict find_loop(const Vec4* x, std::span<const uint32_t> order, const LoopTool& tool, float pair, float reach);

}  // namespace catgut
