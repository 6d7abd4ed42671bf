// SPDX-License-Identifier: Apache-2.0
// assess: see motion.h.
#include "assess/motion.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/elementary.h"

namespace catgut::assess {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr double kTurn = 2 * 3.14159265358979323846;

// Coefficients of the bilinear transform, in direct form II transposed.
struct Biquad {
  double b0, b1, b2, a1, a2;
};

Biquad butterworth(double cutoff, double rate) {
  const double w = kTurn / 2 * cutoff / rate;
  const double k = portable::sin(w) / portable::cos(w), root2 = std::sqrt(2.0);
  const double norm = 1 / (1 + root2 * k + k * k);
  return {k * k * norm, 2 * k * k * norm, k * k * norm, 2 * (k * k - 1) * norm, (1 - root2 * k + k * k) * norm};
}

// One pass, started in the steady state of its first value.
void pass(const Biquad& f, std::vector<double>& v) {
  if (v.empty()) return;
  double s1 = (1 - f.b0) * v[0], s2 = (f.b2 - f.a2) * v[0];
  for (double& x : v) {
    const double y = f.b0 * x + s1;
    s1 = f.b1 * x - f.a1 * y + s2;
    s2 = f.b2 * x - f.a2 * y;
    x = y;
  }
}

}  // namespace

std::vector<double> low_pass(std::span<const double> value, double cutoff, double rate) {
  std::vector<double> v(value.begin(), value.end());
  if (v.size() < 3 || cutoff >= 0.5 * rate) return v;
  const Biquad f = butterworth(cutoff, rate);
  pass(f, v);
  std::reverse(v.begin(), v.end());
  pass(f, v);
  std::reverse(v.begin(), v.end());
  return v;
}

std::vector<Vec3> low_pass(std::span<const Vec3> value, double cutoff, double rate) {
  std::vector<Vec3> out(value.begin(), value.end());
  std::vector<double> one(value.size());
  for (int axis = 0; axis < 3; ++axis) {
    for (size_t i = 0; i < value.size(); ++i) one[i] = static_cast<double>(value[i][axis]);
    const std::vector<double> smooth = low_pass(one, cutoff, rate);
    for (size_t i = 0; i < value.size(); ++i)
      (axis == 0 ? out[i].x : axis == 1 ? out[i].y : out[i].z) = static_cast<float>(smooth[i]);
  }
  return out;
}

std::vector<double> speed_of(std::span<const Vec3> p, double rate) {
  std::vector<double> v(p.size(), 0);
  for (size_t i = 0; i < p.size(); ++i) {
    const size_t a = i > 0 ? i - 1 : i, b = i + 1 < p.size() ? i + 1 : i;
    if (b > a) v[i] = static_cast<double>(distance(p[a], p[b])) * rate / static_cast<double>(b - a);
  }
  return v;
}

double ldlj(std::span<const Vec3> p, double rate) {
  const size_t n = p.size();
  if (n < 5) return kNone;
  const std::vector<double> v = speed_of(p, rate);
  const double peak = *std::max_element(v.begin(), v.end());
  if (!(peak > 0)) return kNone;
  const auto at = [&](size_t i, int axis) { return static_cast<double>(p[i][axis]); };
  double sum = 0;
  for (size_t i = 0; i + 3 < n; ++i)
    for (int axis = 0; axis < 3; ++axis) {
      const double jerk = (at(i + 3, axis) - 3 * at(i + 2, axis) + 3 * at(i + 1, axis) - at(i, axis)) * rate * rate * rate;
      // Each difference stands for the interval in its middle; the first and the last also for the ones at the ends.
      const double intervals = 1 + static_cast<double>(i == 0) + static_cast<double>(i + 4 == n);
      sum += jerk * jerk * intervals / rate;
    }
  const double t = static_cast<double>(n - 1) / rate, jerkiness = t * t * t / (peak * peak) * sum;
  return jerkiness > 0 ? -portable::log(jerkiness) : kNone;
}

double sparc(std::span<const double> speed, double rate, double cutoff, double threshold) {
  const size_t n = speed.size();
  if (n < 4) return kNone;
  size_t bins = 1;
  while (bins < n) bins *= 2;
  bins *= 16;
  const double step = rate / static_cast<double>(bins);
  std::vector<double> spectrum;
  for (size_t k = 0; static_cast<double>(k) * step <= cutoff; ++k) {
    const double angle = kTurn * static_cast<double>(k) / static_cast<double>(bins);
    const double c = portable::cos(angle), s = portable::sin(angle);
    double re = 0, im = 0, x = 1, y = 0;
    for (const double v : speed) {
      re += v * x, im -= v * y;
      const double turned = x * c - y * s;
      y = x * s + y * c, x = turned;
    }
    spectrum.push_back(std::sqrt(re * re + im * im));
  }
  const double most = *std::max_element(spectrum.begin(), spectrum.end());
  if (!(most > 0)) return kNone;
  size_t last = 0;
  for (size_t k = 0; k < spectrum.size(); ++k)
    if (spectrum[k] / most >= threshold) last = k;
  if (last == 0) return kNone;
  double length = 0;
  const double along = 1 / static_cast<double>(last);
  for (size_t k = 0; k < last; ++k) {
    const double rise = (spectrum[k + 1] - spectrum[k]) / most;
    length += std::sqrt(along * along + rise * rise);
  }
  return -length;
}

Roughness roughness(std::span<const Vec3> p, double rate) {
  const size_t n = p.size();
  if (n < 5) return {kNone, kNone, kNone};
  const std::vector<double> v = speed_of(p, rate);
  double speed = 0, second = 0, third = 0;
  for (const double s : v) speed += s / static_cast<double>(n);
  for (size_t i = 0; i + 3 < n; ++i)
    for (int axis = 0; axis < 3; ++axis) {
      const auto at = [&](size_t k) { return static_cast<double>(p[k][axis]); };
      const double a = (at(i + 2) - 2 * at(i + 1) + at(i)) * rate * rate;
      const double j = (at(i + 3) - 3 * at(i + 2) + 3 * at(i + 1) - at(i)) * rate * rate * rate;
      second += a * a, third += j * j;
    }
  const double intervals = static_cast<double>(n - 3);
  return {speed, std::sqrt(second / intervals), std::sqrt(third / intervals)};
}

Course course_of(std::span<const Vec3> p, double rate) {
  const size_t n = p.size();
  if (n < 5) return {kNone, kNone};
  double path = 0;
  std::vector<double> curvature;
  using Row = std::array<double, 3>;
  const auto at = [&](size_t i) {
    return Row{static_cast<double>(p[i].x), static_cast<double>(p[i].y), static_cast<double>(p[i].z)};
  };
  for (size_t i = 0; i + 1 < n; ++i) path += static_cast<double>(distance(p[i], p[i + 1]));
  for (size_t i = 1; i + 1 < n; ++i) {
    const Row a = at(i - 1), b = at(i), c = at(i + 1);
    Row v, w;
    for (size_t k = 0; k < 3; ++k) v[k] = 0.5 * (c[k] - a[k]) * rate, w[k] = (c[k] - 2 * b[k] + a[k]) * rate * rate;
    const double speed = std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    if (speed < kIdleSpeed) continue;
    const Row turn{v[1] * w[2] - v[2] * w[1], v[2] * w[0] - v[0] * w[2], v[0] * w[1] - v[1] * w[0]};
    curvature.push_back(std::sqrt(turn[0] * turn[0] + turn[1] * turn[1] + turn[2] * turn[2]) / (speed * speed * speed));
  }
  if (curvature.empty() || !(path > 0)) return {kNone, kNone};
  const auto middle = curvature.begin() + static_cast<std::ptrdiff_t>(curvature.size() / 2);
  std::nth_element(curvature.begin(), middle, curvature.end());
  return {*middle, static_cast<double>(distance(p.front(), p.back())) / path};
}

double ellipsoid_of(std::span<const Vec3> p) {
  if (p.empty()) return kNone;
  const double n = static_cast<double>(p.size());
  std::array<double, 3> mean{};
  std::array<std::array<double, 3>, 3> c{};
  for (const Vec3& at : p)
    for (int k = 0; k < 3; ++k) mean[static_cast<size_t>(k)] += static_cast<double>(at[k]) / n;
  for (const Vec3& at : p)
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j)
        c[static_cast<size_t>(i)][static_cast<size_t>(j)] += (static_cast<double>(at[i]) - mean[static_cast<size_t>(i)]) *
                                                             (static_cast<double>(at[j]) - mean[static_cast<size_t>(j)]) / n;
  const double determinant = c[0][0] * (c[1][1] * c[2][2] - c[1][2] * c[2][1]) -
                             c[0][1] * (c[1][0] * c[2][2] - c[1][2] * c[2][0]) +
                             c[0][2] * (c[1][0] * c[2][1] - c[1][1] * c[2][0]);
  return 4.0 / 3.0 * kTurn / 2 * std::sqrt(std::max(0.0, determinant));
}

size_t peaks_of(std::span<const double> speed, double share) {
  if (speed.empty()) return 0;
  const double least = share * *std::max_element(speed.begin(), speed.end());
  size_t n = 0;
  bool rising = true;
  double high = speed[0], low = speed[0];
  for (const double v : speed) {
    high = std::max(high, v), low = std::min(low, v);
    if (rising && high - v > least) ++n, rising = false, low = v;
    if (!rising && v - low > least) rising = true, high = v;
  }
  return n;
}

std::vector<Stretch> movements(std::span<const double> speed, double rate) {
  std::vector<Stretch> out;
  const auto least = static_cast<size_t>(kShortest * rate + 0.5);
  for (size_t i = 0; i < speed.size();) {
    size_t end = i;
    while (end < speed.size() && speed[end] > kIdleSpeed) ++end;
    if (end - i >= std::max<size_t>(least, 5)) out.push_back({i, end});
    i = end + 1;
  }
  return out;
}

double correlation(std::span<const double> a, std::span<const double> b) {
  const size_t n = std::min(a.size(), b.size());
  if (n < 2) return kNone;
  double ma = 0, mb = 0;
  for (size_t i = 0; i < n; ++i) ma += a[i], mb += b[i];
  ma /= static_cast<double>(n), mb /= static_cast<double>(n);
  double aa = 0, bb = 0, ab = 0;
  for (size_t i = 0; i < n; ++i) {
    aa += (a[i] - ma) * (a[i] - ma);
    bb += (b[i] - mb) * (b[i] - mb);
    ab += (a[i] - ma) * (b[i] - mb);
  }
  return aa > 0 && bb > 0 ? ab / std::sqrt(aa * bb) : kNone;
}

}  // namespace catgut::assess
