// SPDX-License-Identifier: Apache-2.0
// tests/suture: the force law of a needle through bowel, at the published values.
#include "suture/forces.h"

#include <gtest/gtest.h>

namespace catgut {
namespace {

constexpr float kRelease = 0.0022f;  // [m] default of mechanics.release_distance

TEST(NeedleForces, the_wall_hardens_up_to_the_entry_peak) {
  float last = 0, slope = 0;
  for (float z = 0; z <= kRelease; z += kRelease / 50) {
    const NeedleResistance r = needle_resistance(z, kRelease, -1, z, true, 0);
    EXPECT_GE(r.spring, last);
    EXPECT_GE(r.stiffness, slope);
    EXPECT_LE(r.stiffness, 1200) << "a point load in the wall: 500 to 1200 N/m at the end";
    last = r.spring, slope = r.stiffness;
  }
  const NeedleResistance end = needle_resistance(kRelease, kRelease, -1, kRelease, true, 0);
  EXPECT_NEAR(end.spring, 0.9f, 1e-4f);
  EXPECT_GT(end.stiffness, 500);
  EXPECT_FLOAT_EQ(end.pierce, 0.9f);
}

// The spring's slope is the derivative of its force: the servo follows it between two ticks.
TEST(NeedleForces, stiffness_is_the_slope) {
  for (const float z : {0.0004f, 0.0011f, 0.002f}) {
    const float d = 1e-5f;
    const float slope = (needle_resistance(z + d, kRelease, -1, 0, true, 0).spring -
                         needle_resistance(z - d, kRelease, -1, 0, true, 0).spring) /
                        (2 * d);
    EXPECT_NEAR(needle_resistance(z, kRelease, -1, 0, true, 0).stiffness, slope, 0.01f * slope);
  }
  for (const float left : {0.0002f, 0.0005f}) {
    const float d = 1e-5f;
    const float slope = (needle_resistance(-1, kRelease, left - d, 0, true, 0).spring -
                         needle_resistance(-1, kRelease, left + d, 0, true, 0).spring) /
                        (2 * d);
    EXPECT_NEAR(needle_resistance(-1, kRelease, left, 0, true, 0).stiffness, slope, 0.01f * slope);
  }
}

TEST(NeedleForces, drops_and_drags) {
  // Through the first surface: the remainder is below half of the peak, from cutting and a little shaft friction.
  const NeedleResistance in = needle_resistance(-1, kRelease, -1, 0.003f, true, 0);
  EXPECT_EQ(in.spring, 0);
  EXPECT_LT(in.drag, 0.45f * kEntryPeak);
  EXPECT_GT(in.drag, 0.15f);
  // A bite of 10 mm has 0.3 to 0.6 N of friction, a longer one no more; zero without a needle in it.
  const NeedleResistance through = needle_resistance(-1, kRelease, -1, 0.010f, false, 0);
  EXPECT_GE(through.drag, 0.3f);
  EXPECT_LE(through.drag, 0.6f);
  EXPECT_LE(needle_resistance(-1, kRelease, -1, 0.026f, false, 0).drag, kShaftMost);
  EXPECT_EQ(needle_resistance(-1, kRelease, -1, 0, false, 0).drag, 0);
  // Exit: 0.6 of the entry.
  EXPECT_NEAR(needle_resistance(-1, kRelease, 0, 0.005f, true, 0).spring, 0.6f * kEntryPeak, 1e-4f);
  // Tissue held with one newton has 30 % more resistance.
  EXPECT_NEAR(needle_resistance(kRelease, kRelease, -1, 0, true, 1).spring, 1.3f * kEntryPeak, 1e-4f);
}

}  // namespace
}  // namespace catgut
