// SPDX-License-Identifier: Apache-2.0
// core/elementary: sin, cos, atan2, asin, acos, exp, log, pow with the same bits everywhere. The C library's differ between
// versions, architectures and processors (glibc selects code with fused operations where available). One bit is enough to
// make two runs diverge. These use only operations that IEEE 754 defines exactly, in double precision. All code that affects
// a State or the hands of the scripted surgeon uses them; tests/layers refuses std::sin and the like there.
//
// Errors: at most two units in the last place of a double for arguments below 1e5, more for pow (the error of y log x). A float
// result is correctly rounded except for a few in a million. Method: argument reduction by constants in several parts (Cody and
// 1980), then Taylor series.
#pragma once
#include <cmath>
#include <cstddef>

namespace catgut::portable {
namespace detail {

// sum of c[k] s^k
template <size_t N>
constexpr double series(const double (&c)[N], double s) {
  double sum = c[N - 1];
  for (size_t k = N - 1; k-- > 0;) sum = c[k] + s * sum;
  return sum;
}
inline double sin_near_zero(double r) {  // |r| <= pi / 4
  constexpr double c[] = {-1.0 / 6,        1.0 / 120,        -1.0 / 5040,         1.0 / 362880,
                          -1.0 / 39916800, 1.0 / 6227020800, -1.0 / 1307674368000};
  const double s = r * r;
  return r + r * (s * series(c, s));
}
inline double cos_near_zero(double r) {
  constexpr double c[] = {1.0 / 24,        -1.0 / 720,         1.0 / 40320,         -1.0 / 3628800,
                          1.0 / 479001600, -1.0 / 87178291200, 1.0 / 20922789888000};
  const double s = r * r;
  return 1 - (0.5 * s - s * s * series(c, s));
}
// The angle less the nearest multiple of pi / 2, and that multiple modulo 4.
struct Reduced {
  double r;
  int quadrant;
};
inline Reduced reduce(double x) {
  constexpr double kTurn = 0x1.921fb54442d18p+2;
  if (!(x > -1e5 && x < 1e5)) x = std::remainder(x, kTurn);  // exact by definition; NaN stays NaN
  const double n = std::floor(x * 0x1.45f306dc9c883p-1 + 0.5);
  if (!(n > -1e6 && n < 1e6)) return {x, 0};
  return {((x - n * 0x1.921fb54400000p+0) - n * 0x1.0b4611a600000p-34) - n * 0x1.3198a2e037073p-69, static_cast<int>(n) & 3};
}
inline double atan_upto_one(double t) {  // 0 <= t <= 1
  constexpr double kEighth[] = {0.0,
                                0.12435499454676144,
                                0.24497866312686414,
                                0.35877067027057225,
                                0.4636476090008061,
                                0.5585993153435624,
                                0.6435011087932844,
                                0.7188299996216245,
                                0.7853981633974483};  // atan(k / 8)
  constexpr double c[] = {-1.0 / 3, 1.0 / 5, -1.0 / 7, 1.0 / 9, -1.0 / 11, 1.0 / 13};
  const int k = static_cast<int>(8 * t + 0.5);
  const double at = 0.125 * k, z = (t - at) / (1 + t * at), s = z * z;
  return kEighth[k] + (z + z * (s * series(c, s)));
}

}  // namespace detail

inline double sin(double x) {
  const detail::Reduced a = detail::reduce(x);
  const double v = a.quadrant & 1 ? detail::cos_near_zero(a.r) : detail::sin_near_zero(a.r);
  return a.quadrant & 2 ? -v : v;
}
inline double cos(double x) {
  const detail::Reduced a = detail::reduce(x);
  const double v = a.quadrant & 1 ? detail::sin_near_zero(a.r) : detail::cos_near_zero(a.r);
  return a.quadrant == 1 || a.quadrant == 2 ? -v : v;
}
inline double atan2(double y, double x) {
  constexpr double kPi = 0x1.921fb54442d18p+1, kHalf = 0x1.921fb54442d18p+0;
  const double ax = std::abs(x), ay = std::abs(y), least = ax < ay ? ax : ay, most = ax < ay ? ay : ax;
  double t = most > 0 ? least / most : 0;
  if (std::isinf(least)) t = 1;
  if (std::isnan(x) || std::isnan(y)) return x + y;
  double angle = detail::atan_upto_one(t);
  if (ay > ax) angle = kHalf - angle;
  if (std::signbit(x)) angle = kPi - angle;
  return std::copysign(angle, y);
}
inline double asin(double x) { return atan2(x, std::sqrt((1 - x) * (1 + x))); }
inline double acos(double x) { return atan2(std::sqrt((1 - x) * (1 + x)), x); }
inline double exp(double x) {
  constexpr double c[] = {
      1.0,        1.0,         1.0 / 2,      1.0 / 6,       1.0 / 24,       1.0 / 120,       1.0 / 720,
      1.0 / 5040, 1.0 / 40320, 1.0 / 362880, 1.0 / 3628800, 1.0 / 39916800, 1.0 / 479001600, 1.0 / 6227020800};
  if (x > 710) return HUGE_VAL;
  if (x < -750) return 0;
  if (std::isnan(x)) return x;
  const double n = std::floor(x * 0x1.71547652b82fep+0 + 0.5);
  const double r = (x - n * 0x1.62e42fee00000p-1) - n * 0x1.a39ef35793c76p-33;
  return std::ldexp(detail::series(c, r), static_cast<int>(n));
}
inline double log(double x) {
  constexpr double c[] = {1.0 / 3, 1.0 / 5, 1.0 / 7, 1.0 / 9, 1.0 / 11, 1.0 / 13, 1.0 / 15, 1.0 / 17, 1.0 / 19, 1.0 / 21};
  if (!(x > 0) || std::isinf(x)) return x == 0 ? -HUGE_VAL : x < 0 ? std::sqrt(-1.0) : x;
  int n = 0;
  double m = std::frexp(x, &n);  // 0.5 <= m < 1
  if (m < 0.70710678118654757) m *= 2, --n;
  const double f = (m - 1) / (m + 1), s = f * f;
  return n * 0x1.62e42fee00000p-1 + (2 * f + 2 * f * (s * detail::series(c, s)) + n * 0x1.a39ef35793c76p-33);
}
inline double pow(double x, double y) { return y == 0 ? 1 : exp(y * log(x)); }  // x >= 0

inline float sin(float x) { return static_cast<float>(sin(static_cast<double>(x))); }
inline float cos(float x) { return static_cast<float>(cos(static_cast<double>(x))); }
inline float atan2(float y, float x) { return static_cast<float>(atan2(static_cast<double>(y), static_cast<double>(x))); }
inline float asin(float x) { return static_cast<float>(asin(static_cast<double>(x))); }
inline float acos(float x) { return static_cast<float>(acos(static_cast<double>(x))); }
inline float exp(float x) { return static_cast<float>(exp(static_cast<double>(x))); }
inline float log(float x) { return static_cast<float>(log(static_cast<double>(x))); }
inline float pow(float x, float y) { return static_cast<float>(pow(static_cast<double>(x), static_cast<double>(y))); }

}  // namespace catgut::portable
