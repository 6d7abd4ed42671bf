// SPDX-License-Identifier: Apache-2.0
// tests/render: the camera of interactive sessions: organ and needle are in the image from the start.
#include "render/orbit.h"

#include <gtest/gtest.h>

#include <cmath>

#include "procedure/scene_file.h"
#include "sim/simulation.h"

namespace catgut {
namespace {

TEST(Orbit, organ_and_needle_are_in_the_first_picture_of_every_scene) {
  for (const char* name : {"purse_string", "stay", "connell", "lembert"}) {
    const auto model = build_model(read_scene(name));
    const auto state = initial_state(*model);
    Snapshot seen;
    publish(*model, *state, seen);
    const PictureModel picture = picture_model(*model);
    const Camera c = camera_of(start_orbit(picture, seen.active().needle.pose.p));
    const Vec3 ahead = normalized(c.target - c.eye), right = normalized(cross(ahead, c.up)), up = cross(right, ahead);
    for (const Vec3 p : {picture.focus, seen.active().needle.pose.p}) {
      const Vec3 d = p - c.eye;
      const float half = std::tan(0.5f * c.fov_deg * kPi / 180) * dot(d, ahead);
      EXPECT_LT(std::abs(dot(d, up)), 0.9f * half) << name;
      EXPECT_LT(std::abs(dot(d, right)), 0.9f * half * 4 / 3) << name;
    }
    EXPECT_LT(distance(c.eye, c.target), 0.5f) << name << ": and near enough to work";
  }
}

TEST(Orbit, stays_within_bounds) {
  Orbit o;
  for (int i = 0; i < 1000; ++i) turn_orbit(o, 0.3f, 0.2f, 0.1f);
  EXPECT_LE(o.elevation, 1.5f);
  EXPECT_GE(o.half_height, 0.008f);
  EXPECT_LE(std::abs(o.azimuth), kPi + 1e-4f);
  for (int i = 0; i < 1000; ++i) turn_orbit(o, -0.3f, -0.2f, -0.1f);
  EXPECT_GE(o.elevation, 0.1f);
  EXPECT_LE(o.half_height, 0.15f);
  EXPECT_TRUE(is_finite(camera_of(o).eye));
}

}  // namespace
}  // namespace catgut
