// SPDX-License-Identifier: Apache-2.0
// app/xr: haptic arms and headset in one space. A controller touches the stylus of an arm at several places; each touch is one
// point in two frames: the room (controller) and the world (stylus). The fit places the field so that the picture of an
// instrument lies where the stylus is felt. Pure, except for the file.
#pragma once
#include <optional>
#include <span>
#include <string>

#include "xr/place.h"

namespace catgut::xr {

struct ArmFit {
  bool valid = false;        // three points or more that determine a rotation about the vertical
  Place place;               // focus and height as given
  float rms = 0, worst = 0;  // [m] residual, in the room
};
// Both frames are level: rotation about y, scale, shift. room, world: of equal length. place: supplies focus and height.
ArmFit fit_arms(std::span<const Vec3> room, std::span<const Vec3> world, const Place& place);
// Beyond 5 mm, or a scale beyond the loupe's range: a point was touched wrongly.
bool is_plausible(const ArmFit& fit);

// What is kept per room: rooms.toml in the folder of the settings.
struct RoomSettings {
  float height = -kBelow;  // [m] of the table relative to the eyes
  float reach = kAhead;    // [m] of the table ahead of the eyes
  float loupe = 1;
  std::optional<Place> arms;  // valid only while the runtime's floor frame is the same
  float arms_rms = 0;         // [m]
};
// Defaults where the file or the room is missing. Throws InputError for a damaged file.
RoomSettings load_room(const std::string& path, const std::string& room);
// Other rooms in the file are kept. Throws InputError where it cannot be written.
void save_room(const std::string& path, const std::string& room, const RoomSettings& settings);

}  // namespace catgut::xr
