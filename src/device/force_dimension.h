// SPDX-License-Identifier: Apache-2.0
// device: Force Dimension's devices (omega, delta, lambda, sigma; Novint Falcon) by dlopen of libdhd. Each device has its own
// thread: the library's calls wait for the device, and a hanging one must not stop the other hand. The device's own watchdog
// is set to 31.9 ms: after a crash of the process, or with a hanging thread, the force is switched off.
//
// Button 0 is the stylus' button, or a gripper that is pressed.
#pragma once
#include "device/arm.h"

namespace catgut {

struct ForceDimensionOptions {
  std::string library;  // empty: CATGUT_LIBDHD if set, else the library's usual names
  bool paced = true;    // false: as fast as the library allows, for test doubles with their own timing
};

// The first two devices that the library finds; left-handed ones are the left hand's. `reported` receives a line per problem.
ArmPort open_force_dimension(const ForceDimensionOptions& options, std::vector<std::string>& messages);

}  // namespace catgut
