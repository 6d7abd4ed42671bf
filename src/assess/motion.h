// SPDX-License-Identifier: Apache-2.0
// assess: measures of hand motion. Pure functions of sampled positions or speeds; all bits are the same on every machine.
//
// Smoothness: Balasubramanian et al. 2012 (10.1109/TBME.2011.2179545) and 2015 (10.1186/s12984-015-0090-9).
#pragma once
#include <cstddef>
#include <span>
#include <vector>

#include "core/math.h"

namespace catgut::assess {

// Filter of all measured motion: second-order Butterworth, forward and backward, without delay.
constexpr double kMotionCutoff = 10;  // [Hz]
// Voluntary motion: 98.9 % of its power lies below 2 Hz (Riviere et al. 1997). Tremor does not make an idle hand busy.
constexpr double kVoluntaryCutoff = 2;  // [Hz]
constexpr double kIdleSpeed = 0.005;    // [m/s] of voluntary motion; below it a hand is idle
constexpr double kSettled = 0.1;        // [s] a hand is at rest when it is idle so long before and after
constexpr double kShortest = 0.3;       // [s] shorter stretches of motion are not judged
constexpr double kHesitation = 0.5;     // [s] shorter pauses of both hands are not counted

std::vector<double> low_pass(std::span<const double> value, double cutoff, double rate);
std::vector<Vec3> low_pass(std::span<const Vec3> value, double cutoff, double rate);
std::vector<double> speed_of(std::span<const Vec3> position, double rate);  // [m/s] central differences

// Log dimensionless jerk of one movement, -ln(T^3 / vpeak^2 * integral |jerk|^2 dt); nearer to zero is smoother. Not a number
// for fewer than 5 samples or without motion. A minimum-jerk movement has -ln(204.8). Positions are single precision: at rates
// far above 100 Hz their rounding dominates the jerk.
double ldlj(std::span<const Vec3> position, double rate);

// Spectral arc length of a speed profile up to `cutoff` [Hz], from where the normalized spectrum last exceeds `threshold`; the
// spectrum is interpolated sixteen-fold by zeros. Nearer to zero is smoother.
double sparc(std::span<const double> speed, double rate, double cutoff = 10, double threshold = 0.05);

// Mean speed, and root mean square of acceleration and jerk, by finite differences; not a number for fewer than 5 samples.
struct Roughness {
  double speed, acceleration, jerk;  // [m/s], [m/s^2], [m/s^3]
};
Roughness roughness(std::span<const Vec3> position, double rate);

// Median curvature where the motion is not idle, and distance of the ends over the path; not a number for fewer than 5 samples
// or without motion. A straight line has 0 and 1, a circle the inverse of its radius and 0.
struct Course {
  double curvature, directness;  // [1/m], 0..1
};
Course course_of(std::span<const Vec3> position, double rate);

// Volume of the ellipsoid whose half axes are the standard deviations of the places in three perpendicular directions [m^3].
double ellipsoid_of(std::span<const Vec3> position);

// Maxima that rise above the minima on both sides by at least `share` of the greatest value. Noise makes none.
constexpr double kPeakShare = 0.05;  // as the threshold of the spectral arc length
size_t peaks_of(std::span<const double> speed, double share);

// Stretches [first, end) in which the speed stays above kIdleSpeed for at least kShortest.
struct Stretch {
  size_t first = 0, end = 0;
};
std::vector<Stretch> movements(std::span<const double> speed, double rate);

double correlation(std::span<const double> a, std::span<const double> b);  // Pearson's; not a number without variation

}  // namespace catgut::assess
