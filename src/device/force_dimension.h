// SPDX-License-Identifier: Apache-2.0
// device: Force Dimension's arms (omega, delta, lambda, sigma; Novint Falcon) by dlopen of libdhd. Each arm has a thread of its
// own: the library's calls wait for the device, and one that hangs must not take the other hand with it. The arm's own watchdog
// is set to 31.9 ms: a process that dies, or a thread that hangs, leaves no force behind.
//
// The stylus' button, or a gripper that is pressed together, is button 0.
#pragma once
#include "device/arm.h"

namespace catgut {

struct ForceDimensionOptions {
  std::string library;  // empty: CATGUT_LIBDHD when it is set, else the names the library is installed under
  bool paced = true;    // false: as fast as the library lets us, for doubles that keep time themselves
};

// The first two arms the library finds; left-handed ones are the left hand's. `reported` gets a line for whatever is missing.
ArmPort open_force_dimension(const ForceDimensionOptions& options, std::vector<std::string>& messages);

}  // namespace catgut
