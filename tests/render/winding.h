// SPDX-License-Identifier: Apache-2.0
// tests/render: whether a point is inside a drawn shape.
#pragma once
#include <cmath>

#include "render/shapes.h"

namespace catgut {

// Winding number: how often closed surfaces enclose p, from the solid angles of their triangles: 0 outside, 1 or more inside.
inline float winding(const Shape& shape, Vec3 p) {
  double sum = 0;
  for (const auto& t : shape.triangle) {
    const Vec3 a = shape.position[t[0]] - p, b = shape.position[t[1]] - p, c = shape.position[t[2]] - p;
    const float la = length(a), lb = length(b), lc = length(c);
    const float above = dot(a, cross(b, c)), below = la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb;
    sum += 2 * std::atan2(double(above), double(below));
  }
  return float(sum / (4 * double(kPi)));
}

}  // namespace catgut
