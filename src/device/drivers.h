// SPDX-License-Identifier: Apache-2.0
// device: the drivers of haptic arms there are. The one list: the command line, `catgut devices` and the help read it.
#pragma once
#include <span>

#include "device/arm.h"

namespace catgut {

struct ArmDriver {
  const char* word;   // as people choose it
  const char* arms;   // what it drives, for people
  const char* where;  // what may follow the word after a colon, for people; "": the driver takes nothing
  // `reported` gets a line for whatever is missing; the port has no arms when there is nothing to work with.
  ArmPort (*open)(const std::string& where, std::vector<std::string>& messages);
};
std::span<const ArmDriver> arm_drivers();

}  // namespace catgut
