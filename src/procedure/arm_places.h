// SPDX-License-Identifier: Apache-2.0
// procedure: where each haptic arm's workspace lies in the field, kept per user (the file) and per arm (its serial number).
// Written by `catgut devices --calibrate`, read when a scene opens.
#pragma once
#include <map>
#include <string>

#include "core/math.h"

namespace catgut {

struct ArmPlace {
  float scale = 1;  // meters in the field per meter of the stylus
  float turn = 0;   // [degrees] of the arm about the vertical, counter-clockwise from above
  Vec3 middle;      // [m] arm frame: what becomes the middle of the hand's side of the field
};

// CATGUT_ARMS, else catgut/arms.toml in XDG_CONFIG_HOME or ~/.config.
std::string arm_places_file();
// By serial number. Empty when there is no file. What cannot be read or understood is never passed over, because calibrating
// would write over it: InputError with file and line.
std::map<std::string, ArmPlace> read_arm_places(const std::string& path);
void write_arm_places(const std::string& path, const std::map<std::string, ArmPlace>& places);

}  // namespace catgut
