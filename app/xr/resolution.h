// SPDX-License-Identifier: Apache-2.0
// app/xr: resolution of the eyes' images by the time that frames take, and which frames are late. Pure.
#pragma once
#include <algorithm>

namespace catgut::xr {

struct Resolution {
  float part = 1;  // 0.5 .. 1 of the recommended size in each direction
  int calm = 0;    // frames with time to spare in a row

  // work, period: [s]. A frame that took more than 85 % of its period reduces the resolution at once; ninety easy ones in a row
  // raise it: pixels grow with the square, so steps are small.
  void note(float work, float period) {
    if (work > 0.85f * period) part = std::max(0.5f, 0.9f * part), calm = 0;
    else if (work > 0.6f * period) calm = 0;
    else if (++calm >= 90) part = std::min(1.0f, 1.05f * part), calm = 0;
  }
};

// A picture that is submitted after the display time it was drawn for, or before which the runtime left out a period.
// step: between its display time and the previous one's. All in [s].
inline bool is_late(double submitted, double shown, double step, double period) {
  return submitted > shown || step > 1.5 * period;
}

}  // namespace catgut::xr
