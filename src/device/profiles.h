// SPDX-License-Identifier: Apache-2.0
// device: limits of each kind of device. A backend fills ArmLimits with the values of the maker's library and the profile of
// the model; the smaller of the two applies. An unknown device is treated like a Touch.
#pragma once
#include <span>
#include <string>

#include "exchange/arm.h"

namespace catgut {

struct ArmProfile {
  const char* model;  // part of the name reported by the backend, lower case
  ArmLimits limits;
  const char* source;
};
std::span<const ArmProfile> arm_profiles();
// says: the values known to the backend; 0: unknown. Torque and grip are the model's; the backend clears what a device lacks.
ArmLimits limits_of(const std::string& model, const ArmLimits& says);

}  // namespace catgut
