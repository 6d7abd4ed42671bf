// SPDX-License-Identifier: Apache-2.0
// exchange: the only input of a tick. A device (or the scripted surgeon, or a recording) publishes one complete ToolInput per
// hand; the host adds commands. Together they are the TickInput.
#pragma once
#include <array>
#include <cstdint>

#include "core/math.h"
#include "exchange/command.h"

namespace catgut {

constexpr size_t kMaxHands = 4;  // of a scene

// Bits of ToolInput::buttons, as devices report them. The physics does not read them: exchange/buttons makes commands of them.
constexpr uint32_t kButtonCut = 1u << 0;        // CommandKind::cut
constexpr uint32_t kButtonNewSuture = 1u << 1;  // CommandKind::new_suture

// Tool frame: origin at the grasp point between the jaw tips, -z the pointing direction (the shaft runs along +z toward the
// hand), x the direction in which the jaws open.
struct ToolInput {
  Pose pose;              // of the hand's tool frame, in world [m]
  Vec3 velocity;          // [m/s]
  Vec3 angular_velocity;  // [rad/s]
  float jaw = 1;          // 0 closed .. 1 open
  uint32_t buttons = 0;   // bit per button: never read by the physics
  uint64_t time_ns = 0;   // device clock, only for latency tables: never read by the physics
  uint32_t sequence = 0;
  uint32_t connected = 1;  // 0: no device; the tool stays where it is, without contact
};

// A hand that is not connected.
inline ToolInput no_hand() {
  ToolInput input;
  input.connected = 0;
  return input;
}

// One input per hand. Hands 0 and 1 are the surgeon's right and left; 2 and 3 an assistant's, not connected unless set.
struct HandInputs : std::array<ToolInput, kMaxHands> {
  HandInputs() {
    for (size_t k = 2; k < size(); ++k) (*this)[k].connected = 0;
  }
};

inline HandInputs no_hands() {
  HandInputs hands;
  hands.fill(no_hand());
  return hands;
}

struct TickInput {
  uint64_t tick = 0;
  HandInputs hand;
  CommandList commands;
};

}  // namespace catgut
