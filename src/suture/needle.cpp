// SPDX-License-Identifier: Apache-2.0
// suture/needle: reads the needle's shape, writes its rigid model. Textbook inertia of a uniform circular arc.
#include "suture/needle.h"

namespace catgut {

NeedleArc needle_arc(const NeedleShape& shape) {
  // The center of mass of an arc of half-angle a lies at radius * sin(a) / a from the circle's center, on its middle line.
  const float a = 0.5f * shape.arc, d = shape.radius * portable::sin(a) / a;
  return {shape.radius, shape.arc, Vec3{-d * portable::cos(a), -d * portable::sin(a), 0}};
}

RigidModel needle_body(const NeedleShape& shape) {
  const NeedleArc arc = needle_arc(shape);
  double xx = 0, yy = 0;
  constexpr int kSamples = 64;
  for (int i = 0; i < kSamples; ++i) {
    const Vec3 p = arc.point(shape.arc * (static_cast<float>(i) + 0.5f) / kSamples);
    xx += double{p.x} * p.x / kSamples;
    yy += double{p.y} * p.y / kSamples;
  }
  RigidModel m;
  m.inv_mass = 1 / shape.mass;
  // Products of inertia vanish for a half circle; for other arcs they are small and omitted. The lower bound keeps the thin
  // direction from spinning faster than a substep can resolve.
  const float least = 0.15f * shape.radius * shape.radius;
  m.inv_inertia = {1 / (shape.mass * std::max(least, static_cast<float>(yy))),
                   1 / (shape.mass * std::max(least, static_cast<float>(xx))), 1 / (shape.mass * static_cast<float>(xx + yy))};
  m.gravity = true;
  constexpr int kCapsules = 6;
  for (int i = 0; i < kCapsules; ++i)
    m.capsule.push_back({arc.point(0.8f * shape.arc * static_cast<float>(i) / kCapsules),
                         arc.point(0.8f * shape.arc * static_cast<float>(i + 1) / kCapsules), shape.wire_radius});
  return m;
}

}  // namespace catgut
