// render/orbit: see orbit.h.
#include "render/orbit.h"

#include <cmath>

namespace catgut {

Orbit start_orbit(const PictureModel& picture) {
  Orbit o;
  // Organ and needle are in the picture: the needle lies beside the organ, lower down, on the right or in front.
  o.target = picture.focus + Vec3{0.2f, -0.15f, 0.1f} * picture.field;
  o.half_height = 0.75f * picture.field;
  return o;
}

void turn_orbit(Orbit& orbit, float right, float up, float closer) {
  orbit.azimuth = std::remainder(orbit.azimuth + right, 2 * kPi);
  orbit.elevation = std::clamp(orbit.elevation + up, 0.1f, 1.5f);
  orbit.half_height = std::clamp(orbit.half_height * std::exp(-closer), 0.008f, 0.15f);
}

Camera camera_of(const Orbit& o) {
  Camera c;
  const float d = o.half_height / std::tan(0.5f * c.fov_deg * kPi / 180);
  c.target = o.target;
  c.eye = o.target + d * Vec3{std::cos(o.elevation) * std::sin(o.azimuth), std::sin(o.elevation),
                              std::cos(o.elevation) * std::cos(o.azimuth)};
  return c;
}

}  // namespace catgut
