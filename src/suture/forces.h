// SPDX-License-Identifier: Apache-2.0
// suture: forces of a needle through bowel, as named numbers with their sources, and as a function of the needle's position.
// They act on the hand, not on the tissue. The simulated tissue responds to the tip with the paper's spring (2.2), which has
// neither wall stiffening before puncture nor friction along the shaft. Sources: docs/references.md;
// initial values for bowel and a 3-0 needle, to be calibrated with surgeons.
#pragma once
#include <algorithm>

namespace catgut {

// Before puncture the wall is a hardening spring, f = a1 z + a2 z^2 (Okamura, Simone & O'Leary 2004). It ends at the entry
// peak, where the paper's rule releases the tissue (release_distance, 2.2 mm). a1 leaves 0.62 N/mm there, within the 0.5
// to 1.2 N/mm of a point load in the wall (docs/references.md).
constexpr float kEntryStart = 200;  // [N/m] a1
constexpr float kEntryPeak = 0.9f;  // [N] 0.9 +- 0.3; rabbit cartilage: 0.61 to 0.90 (Maloney); colon, blunt spike: 1.6 to 1.8
constexpr float kExitPeak = 0.54f;  // [N] 0.6 of the entry's; two peaks, in and out (Frick et al. 2001)
constexpr float kExitReach = 0.0008f;  // [m] of wall before the tip, over which it rises (assumption)
constexpr float kPunctureKeep = 0.4f;  // fraction of the peak after the drop, in 3 to 5 ms
constexpr float kCutting = 0.2f;       // [N] while the tip is in the wall: 0.15 to 0.3
constexpr float kShaft = 45;           // [N/m] of embedded length: 0.03 to 0.06 N/mm
constexpr float kShaftMost = 0.5f;     // [N] for a bite of 10 mm
constexpr float kShaftViscous = 2;     // [N s/m] 1 to 3
constexpr float kTension = 0.3f;       // [1/N] relative increase of all forces in tissue under tension
constexpr float kPresliding = 0.001f;  // [m] friction builds up over 1 to 2 mm (Kim & Lee 2016: Dahl, RMS below 0.13 N)

struct NeedleResistance {
  float spring = 0, stiffness = 0;  // [N], [N/m] against further motion: the wall before puncture
  float drag = 0;                   // [N] cutting and shaft friction, against the motion
  float pierce = 0;                 // [N] at which the wall is punctured; 0: none ahead
};
// indented [m]: indentation of the wall by the tip, negative: punctured. release [m]: where that ends. to_exit [m]: wall left
// before the tip on its way out, negative: none ahead. embedded [m]: shaft length in tissue. tip_in: the tip cuts.
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
      cutting = std::max(0.0f, cutting - r.spring);  // tissue pushed out before the tip is not cut
    }
    r.drag += cutting;
  }
  return r;
}

}  // namespace catgut
