// SPDX-License-Identifier: Apache-2.0
// thread/topology: see the header. Coloring matrix of the projection, its minor's determinant modulo a large prime.
#include "thread/topology.h"

#include <algorithm>
#include <cmath>

namespace catgut::thread {
namespace {

constexpr uint64_t kPrime = 2147483647;

uint64_t power(uint64_t b, uint64_t e) {
  uint64_t r = 1;
  for (; e; e >>= 1, b = b * b % kPrime)
    if (e & 1) r = r * b % kPrime;
  return r;
}

struct Point2 {
  double x, y, z;
};

}  // namespace

std::vector<Projected> project(std::span<const Vec3> closed, Vec3 view) {
  const Vec3 w = normalized(view), u = any_perpendicular(w), v = cross(w, u);
  const size_t n = closed.size();
  std::vector<Point2> p(n);
  for (size_t i = 0; i < n; ++i) p[i] = {double{dot(closed[i], u)}, double{dot(closed[i], v)}, double{dot(closed[i], w)}};
  std::vector<Projected> found;
  for (size_t i = 0; i < n; ++i) {
    const Point2 &a = p[i], &b = p[(i + 1) % n];
    const double left = std::min(a.x, b.x), right = std::max(a.x, b.x), low = std::min(a.y, b.y), high = std::max(a.y, b.y);
    for (size_t j = i + 2; j < n; ++j) {
      if (i == 0 && j + 1 == n) continue;
      const Point2 &c = p[j], &d = p[(j + 1) % n];
      if (std::max(c.x, d.x) < left || std::min(c.x, d.x) > right || std::max(c.y, d.y) < low || std::min(c.y, d.y) > high)
        continue;
      const double ex = b.x - a.x, ey = b.y - a.y, fx = d.x - c.x, fy = d.y - c.y, det = ex * fy - ey * fx;
      if (det == 0) continue;
      const double s = ((c.x - a.x) * fy - (c.y - a.y) * fx) / det, t = ((c.x - a.x) * ey - (c.y - a.y) * ex) / det;
      if (s < 0 || s >= 1 || t < 0 || t >= 1) continue;
      const bool first_over = a.z + s * (b.z - a.z) > c.z + t * (d.z - c.z);
      Projected x;
      x.over = first_over ? static_cast<double>(i) + s : static_cast<double>(j) + t;
      x.under = first_over ? static_cast<double>(j) + t : static_cast<double>(i) + s;
      x.sign = (det > 0) == first_over ? 1 : -1;
      found.push_back(x);
    }
  }
  return found;
}

uint64_t knot_determinant(std::span<const Vec3> closed) {
  std::vector<Projected> x = project(closed, {0.137f, 0.211f, 0.968f});
  std::sort(x.begin(), x.end(), [](const Projected& a, const Projected& b) { return a.under < b.under; });
  const size_t n = x.size();
  if (n < 3) return 1;
  // Arc k runs from undercrossing k - 1 to undercrossing k. Each crossing: 2 over - incoming - outgoing = 0.
  std::vector<std::vector<uint64_t>> m(n, std::vector<uint64_t>(n, 0));
  for (size_t k = 0; k < n; ++k) {
    size_t over = 0;
    while (over < n && x[over].under < x[k].over) ++over;
    m[k][over % n] = (m[k][over % n] + 2) % kPrime;
    m[k][k] = (m[k][k] + kPrime - 1) % kPrime;
    m[k][(k + 1) % n] = (m[k][(k + 1) % n] + kPrime - 1) % kPrime;
  }
  uint64_t det = 1;
  for (size_t c = 0; c + 1 < n; ++c) {
    size_t pivot = c;
    while (pivot + 1 < n && m[pivot][c] == 0) ++pivot;
    if (pivot + 1 == n) return 0;
    if (pivot != c) std::swap(m[pivot], m[c]), det = (kPrime - det) % kPrime;
    det = det * m[c][c] % kPrime;
    const uint64_t inverse = power(m[c][c], kPrime - 2);
    for (size_t r = c + 1; r + 1 < n; ++r) {
      if (m[r][c] == 0) continue;
      const uint64_t f = m[r][c] * inverse % kPrime;
      for (size_t k = c; k + 1 < n; ++k) m[r][k] = (m[r][k] + kPrime - f * m[c][k] % kPrime) % kPrime;
    }
  }
  return std::min(det, kPrime - det);
}

double mean_writhe(std::span<const Vec3> closed) {
  const Vec3 views[] = {{0.1f, 0.2f, 1}, {1, 0.15f, 0.1f}, {0.2f, 1, 0.1f}, {1, 1, 0.2f},
                        {-1, 1, 0.3f},   {1, 0.1f, 1},     {-1, 0.2f, 1}};
  double sum = 0;
  for (Vec3 view : views)
    for (const Projected& x : project(closed, view)) sum += x.sign;
  return sum / std::size(views);
}

std::vector<Vec3> close_curve(std::span<const Vec3> thread, Vec3 first_away, Vec3 last_away) {
  std::vector<Vec3> c(thread.begin(), thread.end());
  c.push_back(thread.back() + last_away);
  c.push_back(thread.back() + last_away - Vec3{0, 3, 0});
  c.push_back(thread.front() + first_away - Vec3{0, 3, 0});
  c.push_back(thread.front() + first_away);
  return c;
}

}  // namespace catgut::thread
