// SPDX-License-Identifier: Apache-2.0
// device: see gamepad.h.
#include "device/gamepad.h"

#include <cmath>

namespace catgut {
namespace {

constexpr float kDead = 0.15f;      // fraction of a stick's range: worn sticks do not settle at zero
constexpr float kSpeed = 0.08f;     // [m/s] at full deflection
constexpr float kTurnSpeed = 2.0f;  // [rad/s]
constexpr float kBothSpeed = 4.0f;  // [rad/s]

// Zero inside the dead zone, then rising from zero; squared, for fine control.
float eased(float x) {
  const float far = std::clamp((std::abs(x) - kDead) / (1 - kDead), 0.0f, 1.0f);
  return std::copysign(far * far, x);
}

}  // namespace

std::array<HandMotion, 2> gamepad_motion(GamepadHand& pad, Steering& steering, const GamepadInput& input, float dt) {
  std::array<HandMotion, 2> motion;
  const float slow = input.slow ? 0.33f : 1.0f, far = kSpeed * slow * dt, turn = kTurnSpeed * slow * dt;
  for (size_t k = 0; k < 2; ++k) {
    const GamepadSide& side = (k == 0) != pad.left_handed ? input.right : input.left;
    const float x = eased(side.x), y = eased(side.y);
    HandMotion& m = motion[k];
    if (input.both) {
      m.together = true;
      if (k == 0) m.both = x * kBothSpeed * slow * dt;
    } else if (side.shoulder) {
      m.drive = x * turn;
      m.ahead = -y * far;
    } else if (side.press) {
      m.yaw = x * turn;
      m.pitch = y * turn;
    } else {
      m.right = x * far;
      m.up = -y * far;
    }
    SteeredHand& hand = steering.hand[k];
    // Only a trigger that moves counts: a mouse may control the jaws meanwhile.
    const float pulled = side.trigger > kDead ? side.trigger : 0.0f;
    if (pulled != pad.trigger[k]) {
      hand.opening = 1 - pulled;
      hand.closed = pulled > 0.8f;
      pad.trigger[k] = pulled;
    }
  }
  SteeredHand& meant = steering.hand[(pad.left_handed ? input.right : input.left).shoulder ? 1 : 0];
  if (input.cut) meant.buttons |= kButtonCut;
  if (input.fresh) meant.buttons |= kButtonNewSuture;
  return motion;
}

}  // namespace catgut
