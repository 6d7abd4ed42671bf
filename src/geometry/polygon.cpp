// SPDX-License-Identifier: Apache-2.0
// geometry/polygon: measures of closed loops in space (Newell).
#include "geometry/polygon.h"

namespace catgut {

namespace {

// Newell's vector: along the normal, twice the area long. Taken about the first point for accuracy far from the origin.
Vec3 newell(std::span<const Vec3> loop) {
  Vec3 sum;
  for (size_t i = 1; i + 1 < loop.size(); ++i) sum += cross(loop[i] - loop[0], loop[i + 1] - loop[0]);
  return sum;
}

}  // namespace

float loop_area(std::span<const Vec3> loop) { return 0.5f * length(newell(loop)); }

Vec3 loop_normal(std::span<const Vec3> loop) { return normalized(newell(loop)); }

float loop_length(std::span<const Vec3> loop) {
  float sum = 0;
  for (size_t i = 0; i < loop.size(); ++i) sum += distance(loop[i], loop[(i + 1) % loop.size()]);
  return sum;
}

Vec3 loop_center(std::span<const Vec3> loop) {
  if (loop.empty()) return {};
  Vec3 sum;
  float weight = 0;
  for (size_t i = 0; i < loop.size(); ++i) {
    const Vec3 a = loop[i] - loop[0], b = loop[(i + 1) % loop.size()] - loop[0];
    const float l = distance(a, b);
    sum += (a + b) * (0.5f * l);
    weight += l;
  }
  return weight > 0 ? loop[0] + sum / weight : loop[0];
}

}  // namespace catgut
