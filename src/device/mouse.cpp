// SPDX-License-Identifier: Apache-2.0
// device: see mouse.h.
#include "device/mouse.h"

#include <cmath>

namespace catgut {
namespace {

constexpr float kTurnPerPixel = 0.006f;  // [rad] half a turn is about the width of a small window
constexpr float kNotch = 0.002f;         // [m] along the view axis
constexpr float kRollRate = 1.5f;        // [rad/s]
constexpr float kRollNotch = 0.08f;      // [rad]
constexpr float kBothPerPixel = 0.015f;  // [rad] a full turn is two thirds of a small window

}  // namespace

std::array<HandMotion, 2> mouse_motion(MouseHand& mouse, Steering& steering, const MouseInput& input, const ViewFrame& view,
                                       float dt) {
  std::array<HandMotion, 2> motion;
  if (input.hand_changes % 2 != 0) mouse.active = 1 - mouse.active;
  SteeredHand& hand = steering.hand[mouse.active];
  HandMotion& m = motion[mouse.active];
  const float per_pixel = std::max(0.02f, dot(hand.pose.p - view.eye, view.ahead)) * view.pixel * mouse.speed;
  if (input.both) {
    m.together = true;
    m.both = input.right * kBothPerPixel * mouse.speed;
  } else if (input.turn && input.free_turn) {
    m.yaw = input.right * kTurnPerPixel * mouse.speed;
    m.pitch = input.down * kTurnPerPixel * mouse.speed;
  } else if (input.turn) {
    m.drive = input.right * kTurnPerPixel * mouse.speed;
  } else if (input.depth) {
    m.right = input.right * per_pixel;
    m.ahead = -input.down * per_pixel;
  } else {
    m.right = input.right * per_pixel;
    m.up = -input.down * per_pixel;
  }
  const bool ball = input.turn && input.free_turn;
  m.ahead += ball ? 0 : input.wheel * kNotch * mouse.speed;
  m.roll = (input.roll * kRollRate * dt + (ball ? input.wheel * kRollNotch : 0)) * mouse.speed;

  if (mouse.hold_to_close) {
    if (input.jaw_down != mouse.was_down) hand.closed = input.jaw_down;
  } else if (input.jaw_presses % 2 != 0) {
    hand.closed = !hand.closed;
  }
  mouse.was_down = input.jaw_down;
  hand.buttons |= (input.cut ? kButtonCut : 0) | (input.fresh ? kButtonNewSuture : 0);
  return motion;
}

}  // namespace catgut
