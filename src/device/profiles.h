// SPDX-License-Identifier: Apache-2.0
// device: what each kind of arm can render. A driver fills ArmLimits with what the maker's library says and with the profile of
// the model; the smaller of the two holds. An arm that is not in the list is treated like a Touch.
#pragma once
#include <span>
#include <string>

#include "exchange/arm.h"

namespace catgut {

struct ArmProfile {
  const char* model;  // part of the name that the driver gives, lower case
  ArmLimits limits;
  const char* source;
};
std::span<const ArmProfile> arm_profiles();
// says: what the driver knows; 0: nothing.
ArmLimits limits_of(const std::string& model, const ArmLimits& says);

}  // namespace catgut
