// SPDX-License-Identifier: Apache-2.0
// suture/loop: detects thread wrapped round a tool (paper 2.4, figure 10). A pure function of the positions of thread and tool;
// the stage that freezes the loop is in suture.h.
#pragma once
#include <span>

#include "suture/suture.h"

namespace catgut {

// A tool as input of the detection: the tool frame (origin between the jaw tips, +z along the shaft toward the hand) and its
// capsules in that frame.
struct LoopTool {
  Pose pose;
  std::span<const Capsule> capsule;
};

struct LoopVerdict {
  LoopReason reason = LoopReason::no_crossing;  // none: it is a loop, described below
  size_t first = 0, last = 0;                   // nodes of the order list, both in the loop
  uint32_t wraps = 0;                           // complete turns
  // +1: in list order, the thread turns round the tool counter-clockwise as seen from the hand; -1:
  // clockwise.
  int32_t turn = 0;
  size_t touching = 0;  // nodes of the longest run that touches the tool
  float round = 0;      // [rad] largest angle of a run round the tool, loop or not
};

// x: particle positions; order: slots, consecutive ones joined by thread; pair [m]: rest distance of neighbors, the maximum
// depth of a loop (the paper's "one particle pair"); reach [m]: maximum distance off the tool's surface that counts as
// touching.
LoopVerdict find_loop(const Vec4* x, std::span<const uint32_t> order, const LoopTool& tool, float pair, float reach);

}  // namespace catgut
