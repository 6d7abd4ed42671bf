// SPDX-License-Identifier: Apache-2.0
// runtime: `catgut devices --calibrate`, and `--test`: a slow, small push of each arm along each axis, through the same limits
// as in a scene, and what the stylus does under it.
#pragma once
#include <array>
#include <atomic>
#include <functional>
#include <string>
#include <vector>

#include "device/arm.h"

namespace catgut {

struct ArmTestOptions {
  float force = 0.5f;   // [N] at most
  float countdown = 3;  // [s] for the hands to take hold
  float push = 2;       // [s] per axis: up, a moment, down
  float far = 0.05f;    // [m] a stylus that runs further off ends its arm's test: no one holds it
};
struct ArmTestResult {
  bool ok = true;
  std::vector<std::string> line;  // per arm, for people
};
// say: the countdown and what comes next. stop: ends it; force goes down by the slew. Blocks for some ten seconds.
ArmTestResult test_arms(ArmPort port, const ArmTestOptions& options, const std::function<void(const std::string&)>& say,
                        const std::atomic<bool>& stop);

// Where each stylus is held once `countdown` [s] is over, arm frame [m]; for arms that are there and gave a sample. No force.
std::array<Vec3, 2> held_places(ArmPort port, float countdown, const std::function<void(const std::string&)>& say,
                                const std::atomic<bool>& stop, std::array<bool, 2>& known);

}  // namespace catgut
