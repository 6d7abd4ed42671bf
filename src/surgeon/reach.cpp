// SPDX-License-Identifier: Apache-2.0
// surgeon/reach: see the header.
#include "surgeon/reach.h"

#include <algorithm>
#include <cmath>

namespace catgut {
namespace {

// Half the width of an instrument with open jaws: 3 mm at the tip, 6 mm at 50 mm from it. What it would push aside first lies
// beyond the jaws, near which there is tissue in any direction.
constexpr float kTipWidth = 3e-3f, kWidens = 0.06f, kBeyondJaws = 10e-3f, kShaftLength = 80e-3f;
constexpr float kClear = 2e-3f;      // [m] of room that is enough
constexpr float kNeighbors = 6e-3f;  // [m]: their faces tell the slope of a wall
// Thread nearer to an instrument's axis than this lies between its jaws: on them it is farther away. From the middle of the
// jaws along the shaft: their tips, what is behind a needle in them, and more than they are long.
constexpr float kBetween = 0.8e-3f, kTips = -2.5e-3f, kGrasp = 4e-3f, kLongest = 0.15f;

struct OtherThings {  // indices of particles: walls, then all strands but the active one's
  size_t tissue = 0, end = 0;
  uint32_t own_first = 0, own_last = 0;
  bool own(size_t i) const { return i >= own_first && i <= own_last; }
};
OtherThings other_things(const PictureModel& picture, const Snapshot& seen) {
  OtherThings o;
  o.tissue = o.end = 2 * size_t{picture.columns};
  for (const SutureView& s : seen.suture) o.end += s.thread_order.size();
  o.end = std::min(o.end, seen.particle.size());
  const auto own = std::minmax_element(seen.active().thread_order.begin(), seen.active().thread_order.end());
  o.own_first = *own.first, o.own_last = *own.second;
  return o;
}

bool between(const ToolView& tool, Vec3 particle, float behind) {
  const Vec3 p = to_local(tool.pose, particle);
  return p.z > behind && p.z < kLongest && p.x * p.x + p.y * p.y < kBetween * kBetween;
}

}  // namespace

float room_at(const PictureModel& picture, const Snapshot& seen, Vec3 p, bool walls, float most) {
  const OtherThings o = other_things(picture, seen);
  float room2 = most * most;
  for (size_t i = walls ? 0 : o.tissue; i < o.end; ++i)
    if (!o.own(i)) room2 = std::min(room2, length2(seen.particle[i] - p));
  return std::sqrt(room2);
}

size_t clear_shaft(const PictureModel& picture, const Snapshot& seen, Vec3 goal, std::span<const Vec3> direction) {
  const OtherThings o = other_things(picture, seen);
  size_t best = 0;
  float most = -1;
  for (size_t way = 0; way < direction.size(); ++way) {
    const Vec3 d = direction[way];
    float room = kClear;
    for (size_t i = 0; i < o.end; ++i) {
      if (o.own(i)) continue;
      const Vec3 r = seen.particle[i] - goal;
      const float along = dot(r, d);
      if (along < kBeyondJaws || along > kShaftLength) continue;
      room = std::min(room, length(r - d * along) - kTipWidth - kWidens * along);
    }
    if (room > most) best = way, most = room;
    if (room >= kClear) break;
  }
  return best;
}

Vec3 wall_normal(const PictureModel& picture, const Snapshot& seen, Vec3 p) {
  Vec3 sum{};
  for (size_t c = 0; c < picture.columns; ++c) {  // an outer and an inner particle each
    const Vec3 outer = seen.particle[2 * c], inner = seen.particle[2 * c + 1], up = normalized(outer - inner);
    const float side = dot(p - (outer + inner) * 0.5f, up) < 0 ? -1.0f : 1.0f;
    sum += up * side * std::max(0.0f, 1 - length2((side > 0 ? outer : inner) - p) / (kNeighbors * kNeighbors));
  }
  return normalized(sum, {0, 1, 0});
}

bool catches_thread(const PictureModel& picture, const Snapshot& seen, const ToolView& tool) {
  const OtherThings o = other_things(picture, seen);
  for (size_t i = o.tissue; i < o.end; ++i)
    if (between(tool, seen.particle[i], kGrasp)) return true;
  return false;
}

bool catches_other_thread(const PictureModel& picture, const Snapshot& seen, const ToolView& tool) {
  const OtherThings o = other_things(picture, seen);
  for (size_t i = o.tissue; i < o.end; ++i)
    if (!o.own(i) && between(tool, seen.particle[i], kTips)) return true;
  return false;
}

}  // namespace catgut
