// SPDX-License-Identifier: Apache-2.0
// exchange/instrument: see the header.
#include "exchange/instrument.h"

namespace catgut {

const char* capability_name(uint32_t capability) {
  switch (capability) {
    case kHoldNeedle:
      return "hold_needle";
    case kHoldThread:
      return "hold_thread";
    case kHoldTissue:
      return "hold_tissue";
    case kClamp:
      return "clamp";
    case kCutThread:
      return "cut_thread";
    case kCutTissue:
      return "cut_tissue";
    case kCauterize:
      return "cauterize";
    case kRetract:
      return "retract";
    case kAbsorb:
      return "absorb";
    default:
      return "";
  }
}

}  // namespace catgut
