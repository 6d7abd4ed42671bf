// SPDX-License-Identifier: Apache-2.0
// render/orbit: an orbit camera that stays where the user left it. Hands moved in the view frame
// need a camera that does not move on its own.
#pragma once
#include "render/camera.h"

namespace catgut {

struct Orbit {
  float azimuth = 0.35f, elevation = 0.8f;  // [rad]
  float half_height = 0.05f;                // [m] of the image at the target
  Vec3 target;                              // [m]
};

// Organ and needle are in the image. needle: [m] its position.
Orbit start_orbit(const PictureModel& picture, Vec3 needle);
void turn_orbit(Orbit& orbit, float right, float up, float closer);  // [rad], [rad], factor's logarithm
Camera camera_of(const Orbit& orbit);

}  // namespace catgut
