// SPDX-License-Identifier: Apache-2.0
// surgeon/tie_geometry: directions and distances of an instrument tie, whose stitch is seen along x. For thread_tie.
#pragma once
#include <algorithm>

#include "core/elementary.h"
#include "core/math.h"
#include "exchange/snapshot.h"

namespace catgut {

// Unit: of the needle holder while it ties with the strand on this side (+1: right).
inline Vec3 shaft_from(float side) { return {side * 0.9063f, 0.4226f, 0}; }
// Unit, across the shaft; 0: toward the viewer, pi/2: above.
inline Vec3 around(float side, float angle, Vec3 shaft) {
  const Vec3 front = normalized(Vec3{0, 0, 1} - shaft * shaft.z), up = side * cross(front, shaft);
  return front * portable::cos(angle) + up * portable::sin(angle);
}
// The needle holder along a shaft; its jaws open along x as nearly as it allows.
inline Quat holder_turn(Vec3 z, Vec3 x = {0, 0, 1}) {
  x = normalized(x - z * dot(x, z));
  return from_axes(x, cross(z, x), z);
}
// [m] to `p` from the nearest point midway between the jaws, whose middle `along` of length counts.
inline Vec3 from_jaws(const ToolView& tool, Vec3 p, float along) {
  Vec3 at = to_local(tool.pose, p);
  at.z -= std::clamp(at.z, -0.5f * along, 0.5f * along);
  return rotate(tool.pose.q, at);
}
inline float smooth(float s) {
  s = std::clamp(s, 0.0f, 1.0f);
  return s * s * (3 - 2 * s);
}

}  // namespace catgut
