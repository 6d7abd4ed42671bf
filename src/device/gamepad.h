// SPDX-License-Identifier: Apache-2.0
// device: both hands by one gamepad. Each stick moves its hand on the screen, its trigger closes the jaw as far as it is
// pulled, and with the shoulder button above it the stick drives the needle (sideways) and moves into the picture (up and
// down). Pure, like device/mouse.
#pragma once
#include <array>

#include "device/steer.h"

namespace catgut {

struct GamepadSide {
  float x = 0, y = 0;     // stick, -1 .. 1, right and down
  float trigger = 0;      // 0 .. 1
  bool shoulder = false;  // down
  bool press = false;     // the stick itself is down: the stick turns the tool as a ball
};

struct GamepadInput {
  GamepadSide left, right;
  bool cut = false, fresh = false;  // A, Y
  bool slow = false;                // X: a third of the speed
  bool both = false;                // B: the driver's stick, sideways, is both hands' (device/both_hands)
};

struct GamepadHand {
  bool left_handed = false;        // the driver (hand 0) is the left stick's
  std::array<float, 2> trigger{};  // of each hand, last
};

// Also sets jaws and buttons of `steering`, where a trigger or a button was touched. dt: [s] since the last call.
std::array<HandMotion, 2> gamepad_motion(GamepadHand& pad, Steering& steering, const GamepadInput& input, float dt);

}  // namespace catgut
