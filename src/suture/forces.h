// SPDX-License-Identifier: Apache-2.0
// suture: how hard it is to push a needle through bowel, as named numbers with their sources, and as a function of where the
// needle is. Felt by the hand, not by the tissue: the simulated tissue answers the tip with the paper's spring (2.2), which
// knows neither a wall that stiffens before it gives way nor what rubs along a shaft. Sources: docs/references.md;
// a starting set for bowel and a 3-0 needle, to be calibrated with surgeons.
#pragma once
#include <algorithm>

namespace catgut {

// Before the tip goes in the wall is a hardening spring, f = a1 z + a2 z^2 (Okamura, Simone & O'Leary 2004), which ends at the
// entry peak where the paper's rule lets the tissue go (release_distance, 2.2 mm): a1 leaves 0.62 N/mm there, within the 0.5
// to 1.2 N/mm of a point load in the wall (docs/references.md).
constexpr float kEntryStart = 200;  // [N/m] a1
constexpr float kEntryPeak = 0.9f;  // [N] 0.9 +- 0.3; skin, same needles: 0.5 to 1.0 (Maloney); colon 1.6 to 1.8 a blunt spike
constexpr float kExitPeak = 0.54f;  // [N] 0.6 of the entry's; two peaks, in and out (Frick et al. 2001)
constexpr float kExitReach = 0.0008f;  // [m] of wall before the tip over which it rises (assumption)
constexpr float kPunctureKeep = 0.4f;  // of the peak, after the drop, in 3 to 5 ms
constexpr float kCutting = 0.2f;       // [N] while the tip is in the wall: 0.15 to 0.3
constexpr float kShaft = 45;           // [N/m] of embedded length: 0.03 to 0.06 N/mm
constexpr float kShaftMost = 0.5f;     // [N] for a bite of 10 mm
constexpr float kShaftViscous = 2;     // [N s/m] 1 to 3
constexpr float kTension = 0.3f;       // [1/N] more of everything in tissue that is held under tension
constexpr float kPresliding = 0.001f;  // [m] friction builds up over 1 to 2 mm (Kim & Lee 2016: Dahl, RMS below 0.13 N)

struct NeedleResistance {
  float spring = 0, stiffness = 0;  // [N], [N/m] against continuing: the wall before it gives way
  float drag = 0;                   // [N] cutting and shaft, whichever way it moves
  float pierce = 0;                 // [N] at which the wall gives way; 0: nothing is ahead
};
// indented [m]: how far the tip has pushed the wall before it, negative: it is through. release [m]: where that ends. to_exit
// [m]: wall left before the tip on its way out, negative: none ahead. embedded [m]: shaft in the tissue. tip_in: the tip cuts.
// tension [N]: with which the tissue is held.
inline NeedleResistance needle_resistance(float indented, float release, float to_exit, float embedded, bool tip_in,
                                          float tension) {
  NeedleResistance r;
  const float more = 1 + kTension * std::max(0.0f, tension);
  r.drag = more * std::min(kShaftMost, kShaft * std::max(0.0f, embedded));
  if (indented >= 0) {
    const float a2 = std::max(0.0f, (kEntryPeak - kEntryStart * release) / (release * release)),
                z = std::min(indented, release);
    r.spring = more * (kEntryStart * z + a2 * z * z);
    r.stiffness = more * (kEntryStart + 2 * a2 * z);
    r.pierce = more * kEntryPeak;
  } else if (tip_in) {
    float cutting = more * kCutting;
    if (to_exit >= 0 && to_exit < kExitReach) {
      const float z = 1 - to_exit / kExitReach;
      r.spring = more * kExitPeak * z * z;
      r.stiffness = more * kExitPeak * 2 * z / kExitReach;
      r.pierce = more * kExitPeak;
      cutting = std::max(0.0f, cutting - r.spring);  // what is pushed out before the tip is not cut
    }
    r.drag += cutting;
  }
  return r;
}

}  // namespace catgut
