// SPDX-License-Identifier: Apache-2.0
// procedure: the pose of each haptic device's workspace in the field, stored per user (the file) and per device (its serial
// number). Written by `catgut devices --calibrate` and `--register`, read when a scene opens.
#pragma once
#include <map>
#include <string>

#include "core/math.h"

namespace catgut {

struct ArmPlace {
  float scale = 1;  // meters in the field per meter of the stylus
  float turn = 0;   // [degrees] rotation of the device about the vertical, counter-clockwise from above
  Vec3 middle;      // [m] device frame: maps to the center of the hand's side of the field
  // Of `--register`: the device's axes in the user's, in place of `turn`; its residual [m], negative: not registered.
  Quat rotation;
  float residual = -1;
  int hand = -1;  // in which hand the device is: 0 right, 1 left; negative: as its driver lists it
};

// CATGUT_ARMS, else catgut/arms.toml in XDG_CONFIG_HOME or ~/.config.
std::string arm_places_file();
// By serial number. Empty if there is no file. Unreadable entries are never skipped, because calibration would overwrite
// them: InputError with file and line.
std::map<std::string, ArmPlace> read_arm_places(const std::string& path);
void write_arm_places(const std::string& path, const std::map<std::string, ArmPlace>& places);

}  // namespace catgut
