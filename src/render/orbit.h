// SPDX-License-Identifier: Apache-2.0
// render/orbit: a camera that goes round the operating field and stays where it was left: hands that are moved as they are seen
// need a picture that does not move under them.
#pragma once
#include "render/camera.h"

namespace catgut {

struct Orbit {
  float azimuth = 0.35f, elevation = 0.8f;  // [rad]
  float half_height = 0.05f;                // [m] of the picture at the target
  Vec3 target;                              // [m]
};

// Organ and needle are in the picture. needle: [m] where it lies.
Orbit start_orbit(const PictureModel& picture, Vec3 needle);
void turn_orbit(Orbit& orbit, float right, float up, float closer);  // [rad], [rad], factor's logarithm
Camera camera_of(const Orbit& orbit);

}  // namespace catgut
