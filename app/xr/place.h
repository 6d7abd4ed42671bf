// SPDX-License-Identifier: Apache-2.0
// app/xr: where the operating field lies in the room of a headset's wearer. Pure. "Room" frame: the runtime's reference space
// [m], y up. "World": the frame of the physics. The map is a rotation about the vertical, a scale and a shift.
#pragma once
#include "core/math.h"

namespace catgut::xr {

constexpr float kAhead = 0.42f, kBelow = 0.38f;       // [m] of the field from the eyes after a recentre
constexpr float kNearest = 0.28f, kFarthest = 0.60f;  // [m] limits of its distance ahead of the eyes
constexpr float kLowest = -0.75f, kHighest = -0.15f;  // [m] limits of the table's height relative to the eyes
constexpr float kLoupe[] = {1.0f, 1.5f, 2.0f, 3.0f, 4.0f};

struct Place {
  Vec3 focus;              // [m] world: the center of the operating field
  Vec3 at;                 // [m] room: where it lies
  float yaw = 0;           // [rad] about y, from the room's axes to the world's
  float loupe = 1;         // magnification: room distance per world distance
  float height = -kBelow;  // [m] of the table relative to the eyes; kept by a recentre
  float reach = kAhead;    // [m] of the field ahead of the eyes; kept by a recentre

  Vec3 to_world(Vec3 room) const;
  Vec3 to_room(Vec3 world) const;
  Pose to_world(const Pose& room) const;
  Pose to_room(const Pose& world) const;
};

// The field ahead of the wearer, who then looks along the world's -z, and below the eyes by the table's height.
void recenter(Place& place, const Pose& head);
// Moves the table. step: [m] up. Returns false at a limit.
bool move_table(Place& place, float step, const Pose& head);
// Moves the table away from the wearer. step: [m]. Returns false at a limit.
bool move_reach(Place& place, float step);
// The wearer takes hold of the field and carries it: the point in the hand stays in the hand, and the field turns about the
// vertical only. from, to: poses of the hand in the room.
void carry(Place& place, const Pose& from, const Pose& to);
// The next or previous magnification; the field's center stays where it is.
bool change_loupe(Place& place, int step);

}  // namespace catgut::xr
