// SPDX-License-Identifier: Apache-2.0
// tests/assess: measures of motion against closed forms of the minimum-jerk movement (Flash and Hogan 1985).
#include "assess/motion.h"

#include <gtest/gtest.h>

#include <cmath>

namespace catgut::assess {
namespace {

constexpr double kTurn = 6.283185307179586;

// From 0 to `far` [m] in `seconds`: x = far (10 t^3 - 15 t^4 + 6 t^5).
std::vector<Vec3> minimum_jerk(double far, double seconds, double rate) {
  std::vector<Vec3> p;
  const auto n = static_cast<int>(std::lround(seconds * rate));
  for (int i = 0; i <= n; ++i) {
    const double t = static_cast<double>(i) / n, x = far * t * t * t * (10 - 15 * t + 6 * t * t);
    p.push_back({static_cast<float>(x), static_cast<float>(-2 * x), 0});
  }
  return p;
}
std::vector<double> minimum_jerk_speed(double seconds, double rate) {
  std::vector<double> v;
  const auto n = static_cast<int>(std::lround(seconds * rate));
  for (int i = 0; i <= n; ++i) {
    const double t = static_cast<double>(i) / n;
    v.push_back(30 * t * t * (1 - t) * (1 - t) / seconds);
  }
  return v;
}

// The spectral arc length of the continuous profile, its Fourier integral by Simpson's rule.
double sparc_by_quadrature(double seconds, double cutoff, double threshold) {
  const auto magnitude = [&](double f) {
    constexpr int kSteps = 4000;
    double re = 0, im = 0;
    for (int i = 0; i <= kSteps; ++i) {
      const double t = static_cast<double>(i) / kSteps, w = i == 0 || i == kSteps ? 1 : i % 2 ? 4 : 2;
      const double v = 30 * t * t * (1 - t) * (1 - t) * w / (3 * kSteps);
      re += v * std::cos(kTurn * f * t * seconds), im += v * std::sin(kTurn * f * t * seconds);
    }
    return std::hypot(re, im);
  };
  constexpr int kBins = 4000;
  std::vector<double> m;
  for (int k = 0; k <= kBins; ++k) m.push_back(magnitude(cutoff * k / kBins));
  int last = 0;
  for (int k = 0; k <= kBins; ++k)
    if (m[static_cast<size_t>(k)] >= threshold) last = k;
  double length = 0;
  for (int k = 0; k < last; ++k) length += std::hypot(1.0 / last, m[static_cast<size_t>(k) + 1] - m[static_cast<size_t>(k)]);
  return -length;
}

TEST(Motion, jerk_of_a_minimum_jerk_movement) {
  // T^3 / vpeak^2 * 720 A^2 / T^5 with vpeak = 15/8 A/T: 204.8, whatever its length and duration.
  const double expected = -std::log(720 / (1.875 * 1.875));
  EXPECT_NEAR(expected, -5.322, 0.001);
  for (const double seconds : {0.8, 1.0, 3.0})
    for (const double far : {0.01, 0.2}) EXPECT_NEAR(ldlj(minimum_jerk(far, seconds, 60), 60), expected, 0.06);
  EXPECT_NEAR(ldlj(minimum_jerk(0.1, 1, 120), 120), expected, 0.03);
}

TEST(Motion, arc_length_of_a_minimum_jerk_movement) {
  for (const double seconds : {0.5, 1.0, 2.0}) {
    const double expected = sparc_by_quadrature(seconds, 10, 0.05);
    EXPECT_NEAR(sparc(minimum_jerk_speed(seconds, 1000), 1000), expected, 0.01) << seconds;
    EXPECT_NEAR(sparc(minimum_jerk_speed(seconds, 60), 60), expected, 0.02) << seconds;
  }
  // Published: about -1.4 for one smooth movement, whatever its duration.
  EXPECT_NEAR(sparc(minimum_jerk_speed(1, 1000), 1000), -1.41, 0.03);
}

TEST(Motion, submovements_make_it_less_smooth) {
  std::vector<double> twice = minimum_jerk_speed(1, 60), thrice;
  for (const double v : minimum_jerk_speed(1, 60)) twice.push_back(v);
  thrice = twice;
  for (const double v : minimum_jerk_speed(1, 60)) thrice.push_back(v);
  const double one = sparc(minimum_jerk_speed(1, 60), 60);
  EXPECT_LT(sparc(twice, 60), one);
  EXPECT_LT(sparc(thrice, 60), sparc(twice, 60));
}

TEST(Motion, the_filter_passes_slow_and_stops_fast_motion_without_delay) {
  const double rate = 240;
  std::vector<double> slow, fast, at_cutoff;
  for (int i = 0; i < 2400; ++i) {
    slow.push_back(std::sin(kTurn * 1 * i / rate));
    fast.push_back(std::sin(kTurn * 40 * i / rate));
    at_cutoff.push_back(std::sin(kTurn * 10 * i / rate));
  }
  const auto s = low_pass(slow, 10, rate), f = low_pass(fast, 10, rate), c = low_pass(at_cutoff, 10, rate);
  double worst_slow = 0, most_fast = 0, most_cutoff = 0;
  for (size_t i = 600; i < 1800; ++i) {
    worst_slow = std::max(worst_slow, std::abs(s[i] - slow[i]));
    most_fast = std::max(most_fast, std::abs(f[i]));
    most_cutoff = std::max(most_cutoff, std::abs(c[i]));
  }
  EXPECT_LT(worst_slow, 0.001);          // neither amplitude nor phase changes
  EXPECT_LT(most_fast, 0.01);            // two passes of 12 dB per octave
  EXPECT_NEAR(most_cutoff, 0.5, 0.001);  // -3 dB twice: by definition of the cutoff
  for (const double v : low_pass(std::vector<double>(50, 3.0), 10, 60)) EXPECT_NEAR(v, 3, 1e-12);
}

TEST(Motion, roughness_of_a_circle_is_that_of_the_formula) {
  // Radius 50 mm, 1 turn per second: speed 2 pi r, acceleration and jerk each times 2 pi.
  std::vector<Vec3> p;
  for (int i = 0; i < 600; ++i) {
    const double a = 6.283185307179586 * i / 120;
    p.push_back({static_cast<float>(0.05 * std::cos(a)), static_cast<float>(0.05 * std::sin(a)), 0});
  }
  const Roughness r = roughness(p, 120);
  EXPECT_NEAR(r.speed, 0.05 * 6.2832, 0.002);
  EXPECT_NEAR(r.acceleration, 0.05 * 39.478, 0.02);
  EXPECT_NEAR(r.jerk, 0.05 * 248.05, 0.5);
}

TEST(Motion, course_of_a_circle_and_of_a_line) {
  std::vector<Vec3> half, line;  // half a circle of 50 mm in a second
  for (int i = 0; i <= 120; ++i) {
    const double a = 3.141592653589793 * i / 120;
    half.push_back({static_cast<float>(0.05 * std::cos(a)), static_cast<float>(0.05 * std::sin(a)), 0});
    line.push_back({static_cast<float>(0.001 * i), 0, static_cast<float>(0.002 * i)});
  }
  EXPECT_NEAR(course_of(half, 120).curvature, 20, 0.1);
  EXPECT_NEAR(course_of(half, 120).directness, 2 / 3.141592653589793, 1e-3);
  EXPECT_NEAR(course_of(line, 120).curvature, 0, 0.05);
  EXPECT_NEAR(course_of(line, 120).directness, 1, 1e-6);
}

TEST(Motion, volume_of_motion_is_an_ellipsoid_of_standard_deviations) {
  // The corners of a box: their standard deviations are half its edges. Turned and moved, it is the same.
  const Quat turn = axis_angle(normalized(Vec3{1, 2, 3}), 0.7f);
  std::vector<Vec3> box, turned, flat;
  for (int i = 0; i < 8; ++i) {
    const Vec3 p{i & 1 ? 0.01f : -0.01f, i & 2 ? 0.02f : -0.02f, i & 4 ? 0.03f : -0.03f};
    box.push_back(p), turned.push_back(rotate(turn, p) + Vec3{0.1f, 0.2f, -0.1f}), flat.push_back({p.x, p.y, 0});
  }
  const double volume = 4.0 / 3 * 3.141592653589793 * 0.01 * 0.02 * 0.03;
  EXPECT_NEAR(ellipsoid_of(box), volume, 1e-4 * volume);
  EXPECT_NEAR(ellipsoid_of(turned), volume, 1e-3 * volume);
  EXPECT_LT(ellipsoid_of(flat), 1e-6 * volume);
}

TEST(Motion, only_peaks_that_stand_out_are_counted) {
  std::vector<double> v;
  for (int i = 0; i < 300; ++i) {
    const double t = i / 100.0;
    // Three strokes; a ripple of 2 % of the peak, as of noise.
    v.push_back(std::abs(std::sin(3.14159265 * t)) + 0.02 * std::sin(6.2831853 * 12 * t));
  }
  EXPECT_EQ(peaks_of(v, 0.05), 3u);
  for (size_t i = 0; i < v.size(); ++i) v[i] += 0.1 * std::sin(6.2831853 * 8 * static_cast<double>(i) / 100);
  EXPECT_GT(peaks_of(v, 0.05), 15u);
  EXPECT_EQ(peaks_of({}, 0.05), 0u);
}

TEST(Motion, movements_are_separated_by_rest) {
  std::vector<double> v(300, 0);
  for (size_t i = 30; i < 90; ++i) v[i] = 0.1;
  for (size_t i = 120; i < 125; ++i) v[i] = 0.1;  // too short
  for (size_t i = 200; i < 300; ++i) v[i] = 0.02;
  const auto m = movements(v, 60);
  ASSERT_EQ(m.size(), 2u);
  EXPECT_EQ(m[0].first, 30u);
  EXPECT_EQ(m[0].end, 90u);
  EXPECT_EQ(m[1].first, 200u);
  EXPECT_EQ(m[1].end, 300u);
}

TEST(Motion, correlation_of_hands) {
  const std::vector<double> a{1, 2, 3, 4}, b{2, 4, 6, 8}, c{4, 3, 2, 1}, still{1, 1, 1, 1};
  EXPECT_DOUBLE_EQ(correlation(a, b), 1);
  EXPECT_DOUBLE_EQ(correlation(a, c), -1);
  EXPECT_TRUE(std::isnan(correlation(a, still)));
}

TEST(Motion, nothing_to_measure_is_not_zero) {
  EXPECT_TRUE(std::isnan(ldlj(std::vector<Vec3>(3), 60)));
  EXPECT_TRUE(std::isnan(ldlj(std::vector<Vec3>(30), 60)));
  EXPECT_TRUE(std::isnan(sparc(std::vector<double>(30, 0.0), 60)));
}

}  // namespace
}  // namespace catgut::assess
