// SPDX-License-Identifier: Apache-2.0
// device: 3D Systems Touch (and other devices of OpenHaptics' device library) by dlopen. ONE scheduler callback serves both
// devices: the library works on a current device, and separate callbacks would write their force to the wrong one.
#pragma once
#include "device/arm.h"

namespace catgut {

struct TouchOptions {
  // Empty: CATGUT_LIBHD if set, else the library's usual names.
  std::string library;
  // As named with the maker's setup program. If neither is found, the default device becomes the right hand.
  std::array<std::string, 2> name{"Right Device", "Left Device"};
  int retries = 10;  // of a device that a crashed program left open
};

// `reported` receives a line per problem. The port has no devices (any() is false) if none is usable.
ArmPort open_touch(const TouchOptions& options, std::vector<std::string>& messages);

}  // namespace catgut
