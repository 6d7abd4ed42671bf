// SPDX-License-Identifier: Apache-2.0
// device: see paced_hands.h.
#include "device/paced_hands.h"

#include <algorithm>
#include <cmath>

namespace catgut {
namespace {

constexpr float kLongest = 30;  // [ticks] a longer interval is a pause, not a frame rate

// In every tick this fraction of the remainder, so that 86 % are applied when the next order arrives.
float share_of(float every) { return every <= 1.5f ? 1.0f : 1 - std::exp(-2 / every); }

void add(HandMotion& to, const HandMotion& m) {
  to = {to.right + m.right, to.up + m.up,     to.ahead + m.ahead, to.drive + m.drive, to.yaw + m.yaw,
        to.pitch + m.pitch, to.roll + m.roll, m.together,         to.both + m.both};
}

HandMotion take(HandMotion& from, float share) {
  const HandMotion& m = from;
  const HandMotion out{share * m.right, share * m.up,   share * m.ahead, share * m.drive, share * m.yaw,
                       share * m.pitch, share * m.roll, m.together,      share * m.both};
  from = {m.right - out.right, m.up - out.up,     m.ahead - out.ahead, m.drive - out.drive, m.yaw - out.yaw,
          m.pitch - out.pitch, m.roll - out.roll, m.together,          m.both - out.both};
  return out;
}

}  // namespace

void hear(PacedHands& hands, const HandOrder& order, const Snapshot& seen) {
  hands.every += 0.2f * (static_cast<float>(std::min(hands.unheard, 30)) - hands.every);
  hands.every = std::clamp(hands.every, 0.0f, kLongest);
  hands.unheard = 0;
  hands.heard = true;
  hands.view = order.view;
  hands.time_ns = order.time_ns;
  hands.steering.assist = order.assist;
  for (size_t k = 0; k < 2; ++k) {
    SteeredHand& hand = hands.steering.hand[k];
    // A gesture of both hands ends when its key is released.
    if (hands.left[k].together != order.motion[k].together) hands.left[k] = {};
    add(hands.left[k], order.motion[k]);
    hand.closed = order.closed[k], hand.opening = order.opening[k];
    hand.buttons |= order.buttons[k];
    if (hands.elsewhere[k] && !order.elsewhere[k]) {
      hand.pose = seen.tool[k].hand;
      hand.holds = hand.snapped = false;
      hand.sent.connected = 0;
    }
  }
  hands.elsewhere = order.elsewhere;
}

std::array<ToolInput, 2> tick(PacedHands& hands, const PictureModel& picture, const Snapshot& seen, float dt) {
  ++hands.unheard;
  const float share = share_of(hands.every);
  const std::array<HandMotion, 2> motion{take(hands.left[0], share), take(hands.left[1], share)};
  auto out = steer(hands.steering, motion, hands.view, picture, seen, dt, hands.time_ns);
  for (size_t k = 0; k < 2; ++k)
    if (!hands.heard || hands.elsewhere[k]) out[k].connected = 0;
  return out;
}

}  // namespace catgut
