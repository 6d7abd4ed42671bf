// SPDX-License-Identifier: Apache-2.0
// validation: see swept.h.
#include "validation/swept.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace catgut::validation {
namespace {

Place operator+(Place a, Place b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
Place operator-(Place a, Place b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
Place operator*(Place a, double s) { return {a.x * s, a.y * s, a.z * s}; }
double dot(Place a, Place b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
Place cross(Place a, Place b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }

using Four = std::array<Place, 4>;  // both ends of one segment, both of another

Four at(const Four& from, const Four& to, double t) {
  Four p;
  for (size_t i = 0; i < 4; ++i) p[i] = from[i] + (to[i] - from[i]) * t;
  return p;
}
double volume(const Four& p) { return dot(p[1] - p[0], cross(p[2] - p[0], p[3] - p[0])); }

double distance_of_segments(const Four& p) {
  const Place u = p[1] - p[0], v = p[3] - p[2], r = p[0] - p[2];
  const double uu = dot(u, u), vv = dot(v, v), uv = dot(u, v), ur = dot(u, r), vr = dot(v, r), det = uu * vv - uv * uv;
  double s = det > 1e-14 * uu * vv ? std::clamp((uv * vr - vv * ur) / det, 0.0, 1.0) : 0.5, t = (uv * s + vr) / vv;
  if (t < 0) t = 0, s = std::clamp(-ur / uu, 0.0, 1.0);
  else if (t > 1) t = 1, s = std::clamp((uv - ur) / uu, 0.0, 1.0);
  const Place apart = r + u * s - v * t;
  return std::sqrt(dot(apart, apart));
}

bool passes(const Four& from, const Four& to) {
  constexpr double kParts = 8;
  constexpr double kMeet = 2e-6;  // [m] far below any diameter
  double before = volume(from);
  for (double k = 1; k <= kParts; ++k) {
    const double after = volume(at(from, to, k / kParts));
    if ((before < 0) != (after < 0)) {
      double low = (k - 1) / kParts, high = k / kParts;
      for (int i = 0; i < 50; ++i) {
        const double middle = 0.5 * (low + high);
        ((volume(at(from, to, middle)) < 0) == (before < 0) ? low : high) = middle;
      }
      if (distance_of_segments(at(from, to, low)) < kMeet) return true;
    }
    before = after;
  }
  return false;
}

}  // namespace

std::vector<Place> places(const thread::State& s) {
  std::vector<Place> p(s.nodes());
  for (size_t i = 0; i < p.size(); ++i)
    p[i] = {double{s.x.x[i]} + double{s.fine.x[i]}, double{s.x.y[i]} + double{s.fine.y[i]},
            double{s.x.z[i]} + double{s.fine.z[i]}};
  return p;
}

int count_passes(std::span<const Place> before, std::span<const Place> after, std::span<const uint8_t> broken) {
  const size_t segments = before.size() - 1;
  // A sphere about each segment's motion.
  std::vector<Place> middle(segments);
  std::vector<double> radius(segments);
  for (size_t i = 0; i < segments; ++i) {
    middle[i] = (before[i] + before[i + 1] + after[i] + after[i + 1]) * 0.25;
    for (const Place& p : {before[i], before[i + 1], after[i], after[i + 1]})
      radius[i] = std::max(radius[i], std::sqrt(dot(p - middle[i], p - middle[i])));
  }
  int count = 0;
  for (size_t i = 0; i < segments; ++i)
    for (size_t j = i + 2; j < segments; ++j) {
      const Place apart = middle[i] - middle[j];
      const double reach = radius[i] + radius[j];
      // Three segments in a row are a kink. Turned over, it changes no knot (Reidemeister's first move).
      if (dot(apart, apart) > reach * reach || broken[i] || broken[j] || (j == i + 2 && !broken[i + 1])) continue;
      count += passes({before[i], before[i + 1], before[j], before[j + 1]}, {after[i], after[i + 1], after[j], after[j + 1]});
    }
  return count;
}

}  // namespace catgut::validation
