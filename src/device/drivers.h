// SPDX-License-Identifier: Apache-2.0
// device: the list of backends for haptic devices. The command line, `catgut devices` and the help read it.
#pragma once
#include <span>

#include "device/arm.h"

namespace catgut {

struct ArmDriver {
  const char* word;   // on the command line
  const char* arms;   // supported devices, for display
  const char* where;  // optional part after a colon, for display; "": none
  // `reported` receives a line for each missing prerequisite; the port then has no devices.
  ArmPort (*open)(const std::string& where, std::vector<std::string>& messages);
};
std::span<const ArmDriver> arm_drivers();

}  // namespace catgut
