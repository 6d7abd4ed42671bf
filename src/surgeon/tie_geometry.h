// SPDX-License-Identifier: Apache-2.0
// surgeon/tie_geometry: directions and distances of an instrument tie, whose stitch is seen along x. For thread_tie.
#pragma once
#include <algorithm>
#include <array>

#include "core/elementary.h"
#include "core/math.h"
#include "exchange/snapshot.h"

namespace catgut {

inline constexpr float kTailEnd = 6e-3f, kNearer = 2e-3f;  // [m] from the tail's end, where it is taken; more after a miss
inline constexpr float kKnot = 5e-3f;  // [m] from the middle of the stitch: thread nearer than this belongs to the knot

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
// Unit, from its tip to the hand, of a needle holder that comes for a tail on a wall with this normal; the first that is clear
// is taken. Square to the wall, or one jaw meets it before the other one; and steep, or both lie on it beside the tail.
inline std::array<Vec3, 4> ways_to_tail(float side, Vec3 normal) {
  const float lean = std::clamp(normal.z / std::max(normal.y, 0.1f), -0.8f, 0.8f);
  return {normalized(Vec3{side, 2, 2 * lean}), normalized(Vec3{side, 3, 3 * lean}), normalized(Vec3{side, 3, -3 * lean}),
          normalized(Vec3{0.5f * side, 3, 0})};
}
// The same in a lumen, `aside` [m] nearer to the viewer than the stitch. Along the tail as far as walls allow: it hangs free
// there, and steep jaws reach other stitches.
inline std::array<Vec3, 5> ways_into_lumen(float side, float aside) {
  const float lean = std::clamp(60 * aside, -0.8f, 0.8f);
  return {normalized(Vec3{side, 1, lean}), normalized(Vec3{side, 2, lean}), normalized(Vec3{side, 3, lean}),
          normalized(Vec3{side, 3, -lean}), normalized(Vec3{0.5f * side, 3, 0})};
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
