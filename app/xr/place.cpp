// SPDX-License-Identifier: Apache-2.0
// app/xr: see place.h.
#include "xr/place.h"

#include <iterator>

namespace catgut::xr {
namespace {

Quat turn(float yaw) { return axis_angle({0, 1, 0}, yaw); }

}  // namespace

Vec3 Place::to_world(Vec3 room) const { return focus + rotate(turn(yaw), room - at) / loupe; }
Vec3 Place::to_room(Vec3 world) const { return at + rotate(conjugate(turn(yaw)), (world - focus) * loupe); }
Pose Place::to_world(const Pose& room) const { return {to_world(room.p), normalized(turn(yaw) * room.q)}; }
Pose Place::to_room(const Pose& world) const { return {to_room(world.p), normalized(conjugate(turn(yaw)) * world.q)}; }

void recenter(Place& place, const Pose& head) {
  Vec3 ahead = rotate(head.q, {0, 0, -1});
  // A wearer who looks straight down at the table: the top of the head points ahead.
  if (std::hypot(ahead.x, ahead.z) < 0.3f) ahead = rotate(head.q, {0, ahead.y < 0 ? 1.0f : -1.0f, 0});
  ahead.y = 0;
  ahead = normalized(ahead, {0, 0, -1});
  place.yaw = std::atan2(ahead.x, -ahead.z);
  place.at = head.p + ahead * place.reach + Vec3{0, place.height, 0};
}

bool move_table(Place& place, float step, const Pose& head) {
  const float now = place.at.y - head.p.y, next = std::clamp(now + step, kLowest, kHighest);
  if ((next - now) * step <= 0) return false;
  place.at.y += next - now;
  place.height = next;
  return true;
}

bool move_reach(Place& place, float step) {
  const float next = std::clamp(place.reach + step, kNearest, kFarthest), moved = next - place.reach;
  if (moved * step <= 0) return false;
  place.at += rotate(conjugate(turn(place.yaw)), {0, 0, -moved});
  place.reach = next;
  return true;
}

void carry(Place& place, const Pose& from, const Pose& to) {
  const Quat turned = to.q * conjugate(from.q);
  const float angle = 2 * std::atan2(turned.y, turned.w);
  place.at = to.p + rotate(turn(angle), place.at - from.p);
  place.yaw -= angle;
}

bool change_loupe(Place& place, int step) {
  int now = 0;
  for (size_t i = 0; i < std::size(kLoupe); ++i)
    if (std::abs(kLoupe[i] - place.loupe) < std::abs(kLoupe[now] - place.loupe)) now = static_cast<int>(i);
  const int next = std::clamp(now + step, 0, static_cast<int>(std::size(kLoupe)) - 1);
  place.loupe = kLoupe[next];
  return next != now;
}

}  // namespace catgut::xr
