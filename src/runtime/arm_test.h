// SPDX-License-Identifier: Apache-2.0
// runtime: `catgut devices --calibrate`, and `--test`. A slow, small push of each device along each axis, through the limits
// of a scene, and the resulting motion of the stylus.
#pragma once
#include <array>
#include <atomic>
#include <functional>
#include <string>
#include <vector>

#include "device/arm.h"

namespace catgut {

struct ArmTestOptions {
  float force = 0.5f;   // [N] maximum
  float countdown = 3;  // [s] for the user to take hold
  float push = 2;       // [s] per axis: up, a moment, down
  float far = 0.05f;    // [m] a stylus that moves further ends its device's test: it is not held
};
struct ArmTestResult {
  bool ok = true;
  std::vector<std::string> line;  // per device, for display
};
// say: receives the countdown and the next step. stop: ends it; force decreases at the slew rate. Blocks for about ten seconds.
ArmTestResult test_arms(ArmPort port, const ArmTestOptions& options, const std::function<void(const std::string&)>& say,
                        const std::atomic<bool>& stop);

// Position of each stylus when `countdown` [s] is over, device frame [m]; for connected devices with a sample. No force.
std::array<Vec3, 2> held_places(ArmPort port, float countdown, const std::function<void(const std::string&)>& say,
                                const std::atomic<bool>& stop, std::array<bool, 2>& known);

}  // namespace catgut
