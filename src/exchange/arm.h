// SPDX-License-Identifier: Apache-2.0
// exchange: the sample that a haptic device passes to the servo a thousand times per second. In the device's own frame (x
// right, y up, z toward the user, origin as defined by the maker), SI units.
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

// Limits reported by a device backend. Zero: unknown; a conservative value is used.
struct ArmLimits {
  float force = 3.3f;        // [N] peak
  float continuous = 0.88f;  // [N] for unlimited time
  float stiffness = 400;     // [N/m] maximum rendered stiffness
  float damping = 4;         // [N s/m]
};

}  // namespace catgut
