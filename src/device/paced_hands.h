// SPDX-License-Identifier: Apache-2.0
// device: two steered hands whose input arrives once per frame and whose tools move every tick. A window without a graphics
// card draws a few frames per second; assists that read a force or a tension only then would pull too far and tear. Here they
// read every snapshot, and the motion of a frame is spread over the following ticks. Pure: reads the orders and the last
// Snapshot, writes the ToolInputs of a tick.
#pragma once
#include <array>
#include <cstdint>

#include "device/steer.h"

namespace catgut {

// What one frame reports of both hands.
struct HandOrder {
  std::array<HandMotion, 2> motion;  // since the last order
  ViewFrame view;
  std::array<bool, 2> closed{};        // requested state of the jaws
  std::array<float, 2> opening{1, 1};  // of a jaw that is not closed
  std::array<uint32_t, 2> buttons{};   // pressed since the last order
  std::array<bool, 2> elsewhere{};     // another device moves that hand; afterward it continues from the tool
  bool assist = true;
  uint32_t epoch = 0;    // of the session, see runtime/live
  uint64_t time_ns = 0;  // of the newest motion
};

struct PacedHands {
  Steering steering;
  std::array<HandMotion, 2> left;  // not applied yet
  std::array<bool, 2> elsewhere{};
  ViewFrame view;
  uint64_t time_ns = 0;
  int unheard = 0;  // [ticks] since the last order
  float every = 1;  // [ticks] recent interval of orders
  bool heard = false;
};

void hear(PacedHands& hands, const HandOrder& order, const Snapshot& seen);

// The hands of the next tick. dt: [s] of a tick. The caller sets steering.guide.
std::array<ToolInput, 2> tick(PacedHands& hands, const PictureModel& picture, const Snapshot& seen, float dt);

}  // namespace catgut
