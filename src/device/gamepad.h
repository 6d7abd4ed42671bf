// SPDX-License-Identifier: Apache-2.0
// device: both hands by one gamepad. Each stick moves its hand in the view plane; its trigger closes the jaw in proportion.
// With the shoulder button above it, the stick drives the needle (sideways) and moves along the view axis (up and
// down). Pure, like device/mouse.
#pragma once
#include <array>

#include "device/steer.h"

namespace catgut {

struct GamepadSide {
  float x = 0, y = 0;     // stick, -1 .. 1, right and down
  float trigger = 0;      // 0 released .. 1 pressed
  bool shoulder = false;  // pressed
  bool press = false;     // the stick itself is pressed: arcball rotation of the tool
};

struct GamepadInput {
  GamepadSide left, right;
  bool cut = false, fresh = false;  // A, Y: of the first hand, or of the second with the shoulder above its stick
  bool slow = false;                // X: a third of the speed
  bool both = false;                // B: the needle holder's stick, sideways, controls both hands (device/both_hands)
};

struct GamepadHand {
  bool left_handed = false;        // the needle holder (hand 0) is on the left stick
  std::array<float, 2> trigger{};  // of each hand, last
};

// Also sets jaws and buttons of `steering` when a trigger or a button was used. dt: [s] since the last call.
std::array<HandMotion, 2> gamepad_motion(GamepadHand& pad, Steering& steering, const GamepadInput& input, float dt);

}  // namespace catgut
