// SPDX-License-Identifier: Apache-2.0
// device: 3D Systems Touch (and other arms of OpenHaptics' device library) by dlopen. Both arms are served by ONE scheduler
// callback: the library works on a current device, and callbacks of one arm each would write their force to the other.
#pragma once
#include "device/arm.h"

namespace catgut {

struct TouchOptions {
  // Empty: CATGUT_LIBHD when it is set, else the names the library is installed under.
  std::string library;
  // As they were named with the maker's setup program. Where neither is found, the default device becomes the right hand.
  std::array<std::string, 2> name{"Right Device", "Left Device"};
  int retries = 10;  // of an arm that a crashed program left open
};

// `reported` gets a line for whatever is missing. The port has no arms (any() is false) when there is nothing to work with.
ArmPort open_touch(const TouchOptions& options, std::vector<std::string>& messages);

}  // namespace catgut
