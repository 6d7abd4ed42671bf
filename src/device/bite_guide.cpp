// SPDX-License-Identifier: Apache-2.0
// device: see bite_guide.h.
#include "device/bite_guide.h"

namespace catgut {

float half_bite(const PictureModel& picture, const BiteGuide& g) {
  return std::asin(std::min(0.9f, 0.5f * g.length / picture.suture[g.suture].needle_radius));
}

Pose needle_on(const PictureModel& picture, const BiteGuide& g, float psi, float away) {
  const Vec3 center = g.at + g.out * (picture.suture[g.suture].needle_radius - g.depth + away), up = cross(g.along, g.out);
  const Vec3 x = g.out * std::cos(psi) - g.along * std::sin(psi);
  // The tip is at the end of the arc: arcs other than a half circle are rotated back by the difference.
  return Pose{center, from_axes(x, cross(up, x), up)} *
         Pose{{}, axis_angle({0, 0, 1}, kPi - picture.suture[g.suture].needle_arc)};
}

Vec3 on_needle(const PictureModel& picture, const Pose& needle, float s, size_t suture) {
  const float phi = s * picture.suture[suture].needle_arc;
  return transform(needle, Vec3{std::cos(phi), std::sin(phi), 0} * picture.suture[suture].needle_radius);
}

}  // namespace catgut
