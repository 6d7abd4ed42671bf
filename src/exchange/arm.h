// SPDX-License-Identifier: Apache-2.0
// exchange: what a haptic arm reports the servo a thousand times a second. In the arm's own frame (x right, y up, z toward the
// user, origin where the maker put it), SI units.
#pragma once
#include <cstdint>

#include "core/math.h"

namespace catgut {

enum class ArmState : uint8_t {
  absent,  // not connected, or lost: no sample is to be believed, no force is taken
  ready,
};

struct ArmSample {
  ArmState state = ArmState::absent;
  Pose pose;                // [m] of the stylus: -z the way it points
  Vec3 velocity;            // [m/s] as the driver filters it
  uint32_t buttons = 0;     // bit 0: the one nearest to the tip
  float warmth = 0;         // of the warmest motor, 0 cold .. 1 too hot
  bool forced_off = false;  // the driver cut the force on its own (too fast, too warm); it will come back
  float jaw = -1;           // of a gripper: 0 closed .. 1 open; negative: the arm has none
  uint64_t time_ns = 0;     // on the clock of the arm's end, where that is not the callback's; 0: it is
  uint32_t sequence = 0;
};

// What a driver knows of its arm. Zero: it does not say, and a careful value stands for it.
struct ArmLimits {
  float force = 3.3f;        // [N] peak
  float continuous = 0.88f;  // [N] for as long as one likes
  float stiffness = 400;     // [N/m] that may be rendered
  float damping = 4;         // [N s/m]
};

}  // namespace catgut
