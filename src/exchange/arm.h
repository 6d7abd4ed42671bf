// SPDX-License-Identifier: Apache-2.0
// exchange: the sample that a haptic device passes to the servo a thousand times per second, and the force that it gets back.
// In the device's own frame (x right, y up, z toward the user, origin as defined by the maker), SI units.
#pragma once
#include <cstdint>

#include "core/math.h"

namespace catgut {

enum class ArmState : uint8_t {
  absent,  // not connected, or lost: samples are invalid, no force is written
  ready,
};

struct ArmSample {
  ArmState state = ArmState::absent;
  Pose pose;                // [m] of the stylus: -z is its pointing direction
  Vec3 velocity;            // [m/s] as filtered by the device's library
  uint32_t buttons = 0;     // bit 0: the one nearest to the tip
  float warmth = 0;         // of the warmest motor, 0 cold .. 1 too hot
  bool forced_off = false;  // the device cut the force (too fast, too warm); it will resume
  float jaw = -1;           // of a gripper: 0 closed .. 1 open; negative: the device has none
  uint64_t time_ns = 0;     // on the device's own clock, if it differs from the callback's; 0: it does not
  uint32_t sequence = 0;
};

constexpr float kGripTravel = 0.014f;  // [m] of a gripper's fingers while ArmSample::jaw goes from 0 to 1

// Command to the motors of a device. Devices without motors for torque or grip ignore those.
struct ArmForce {
  Vec3 force;      // [N] on the tip of the stylus
  Vec3 torque;     // [N m] about that tip
  float grip = 0;  // [N] on the fingers of a gripper; positive: opens them
};

// Limits reported by a device backend. Zero: unknown; a conservative value is used. For torque and grip, zero means that the
// device has no motor for it.
struct ArmLimits {
  float force = 3.3f;        // [N] peak
  float continuous = 0.88f;  // [N] for unlimited time; torque and grip have the same ratio of continuous to peak
  float stiffness = 400;     // [N/m] maximum rendered stiffness
  float damping = 4;         // [N s/m]
  float torque = 0;          // [N m] peak
  float turn_stiffness = 0;  // [N m/rad]
  float turn_damping = 0;    // [N m s/rad]
  float grip = 0;            // [N] peak
  float grip_stiffness = 0;  // [N/m]
};

}  // namespace catgut
