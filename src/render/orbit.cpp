// SPDX-License-Identifier: Apache-2.0
// render/orbit: see orbit.h.
#include "render/orbit.h"

#include <cmath>

namespace catgut {

Orbit start_orbit(const PictureModel& picture, Vec3 needle) {
  Orbit o;
  // Between the two, nearer to the organ: the expected site of work.
  const Vec3 off = is_finite(needle) ? needle - picture.focus : Vec3{};
  o.target = picture.focus + off * (0.35f * std::min(1.0f, 1.2f * picture.field / std::max(length(off), 1e-6f)));
  o.half_height = 0.7f * picture.field;
  // Back until the needle's whole circle is in the image, with a margin.
  for (int i = 0; i < 12; ++i) {
    const Camera c = camera_of(o);
    const Vec3 ahead = normalized(c.target - c.eye), right = normalized(cross(ahead, c.up)), d = needle - c.eye;
    const float half = std::tan(0.5f * c.fov_deg * kPi / 180) * dot(d, ahead);
    if (std::abs(dot(d, cross(right, ahead))) + picture.suture[0].needle_radius < 0.9f * half) break;
    o.half_height *= 1.08f;
  }
  return o;
}

void turn_orbit(Orbit& orbit, float right, float up, float closer) {
  orbit.azimuth = std::remainder(orbit.azimuth + right, 2 * kPi);
  orbit.elevation = std::clamp(orbit.elevation + up, 0.1f, 1.5f);
  orbit.half_height = std::clamp(orbit.half_height * std::exp(-closer), 0.008f, 0.15f);
}

Camera camera_of(const Orbit& o) {
  Camera c;
  const float d = o.half_height / std::tan(0.5f * c.fov_deg * kPi / 180);
  c.target = o.target;
  c.eye = o.target + d * Vec3{std::cos(o.elevation) * std::sin(o.azimuth), std::sin(o.elevation),
                              std::cos(o.elevation) * std::cos(o.azimuth)};
  return c;
}

}  // namespace catgut
