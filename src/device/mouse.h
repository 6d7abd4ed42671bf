// SPDX-License-Identifier: Apache-2.0
// device: hands by mouse and keyboard. The mouse moves the active tool in the view plane; wheel, or Shift and the mouse, along
// the view axis. The right button turns, the left one closes. Pure: input since the last frame in,
// motions out; the owner of the window fills a MouseInput.
#pragma once
#include <array>

#include "device/steer.h"

namespace catgut {

struct MouseInput {
  float right = 0, down = 0;        // [pixels] since the last call
  float wheel = 0;                  // [notches] positive: along the view axis, away from the user
  bool turn = false;                // right button: drive the needle, or turn the tool about its shaft
  bool free_turn = false;           // Control in addition: arcball rotation of the tool; the wheel rolls
  bool depth = false;               // Shift: the mouse moves along the view axis
  float roll = 0;                   // -1 .. 1, Q and E: about the line of sight
  bool both = false;                // W: both hands wind the strand, or pull the ends apart, as the mouse moves right or left
  int jaw_presses = 0;              // presses of left button or space
  bool jaw_down = false;            // and is pressed now
  bool cut = false, fresh = false;  // C, N are pressed
  int hand_changes = 0;             // Tab
};

struct MouseHand {
  size_t active = 0;           // hand that the mouse moves
  bool hold_to_close = false;  // the jaw is closed while the button is pressed; else each press toggles it, like a ratchet
  float speed = 1;             // of tool to mouse, 1: the tool stays under the pointer
  bool was_down = false;
};
constexpr std::array<float, 3> kMouseSpeeds{0.3f, 1.0f, 2.0f};

// Also sets jaws and buttons of `steering`. dt: [s] since the last call, for pressed keys.
std::array<HandMotion, 2> mouse_motion(MouseHand& mouse, Steering& steering, const MouseInput& input, const ViewFrame& view,
                                       float dt);

}  // namespace catgut
