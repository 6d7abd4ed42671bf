// SPDX-License-Identifier: Apache-2.0
// surgeon/sight: see sight.h.
#include "surgeon/sight.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace catgut {

Vec3 live_place(const PictureModel& picture, const Snapshot& seen, Vec3 rest, uint32_t wall, Quat* turned) {
  std::array<uint32_t, 4> near{};
  std::array<float, 4> d;
  d.fill(std::numeric_limits<float>::max());
  for (uint32_t i = 0; i < picture.particle_rest.size(); ++i) {
    if (i < picture.wall.size() && picture.wall[i] != wall) continue;
    const float d2 = length2(picture.particle_rest[i] - rest);
    for (size_t k = 0; k < 4; ++k)
      if (d2 < d[k]) {
        for (size_t j = 3; j > k; --j) d[j] = d[j - 1], near[j] = near[j - 1];
        d[k] = d2, near[k] = i;
        break;
      }
  }
  Vec3 sum{};
  float weight = 0;
  for (size_t k = 0; k < 4; ++k) {
    const float w = 1 / (d[k] + 1e-7f);
    sum += w * (seen.particle[near[k]] + rotate(seen.rotation[near[k]], rest - picture.particle_rest[near[k]]));
    weight += w;
  }
  if (turned) *turned = seen.rotation[near[0]];
  return sum / weight;
}

OpeningShape opening_shape(const PictureModel& picture, uint32_t wall) {
  const std::vector<uint32_t>& rim = picture.rim[wall];
  const std::vector<Vec3>& rest = picture.particle_rest;
  OpeningShape o;
  const float n = static_cast<float>(rim.size());
  Vec3 normal{}, body{};
  for (uint32_t i : rim) o.center += rest[i] / n;
  for (size_t i = 0; i < rim.size(); ++i) {
    const Vec3 a = rest[rim[i]], b = rest[rim[(i + 1) % rim.size()]];
    normal += cross(a - o.center, b - o.center);
    o.round += distance(a, b);
    o.radius += distance(a, o.center) / n;
  }
  float count = 0;
  for (size_t i = 0; i < rest.size(); ++i)
    if (i >= picture.wall.size() || picture.wall[i] == wall) body += rest[i], ++count;
  o.axis = normalized(normal);
  if (dot(o.axis, o.center - body / count) < 0) o.axis = -o.axis;  // out of the opening
  return o;
}

}  // namespace catgut
