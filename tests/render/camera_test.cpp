// SPDX-License-Identifier: Apache-2.0
// tests/render: the close-up shows the decisive thing and no instrument stands before it. No graphics driver is needed.
#include "render/camera.h"

#include <gtest/gtest.h>

#include <cmath>

#include "scene.h"

namespace catgut {
namespace {

// Direction of the needle's middle from the eye, and the angle of each tool's shaft to it, as seen.
Vec3 needle_middle(const TestField& field) {
  const SuturePicture& suture = field.model.suture[0];
  const float a = 0.5f * suture.needle_arc;
  return transform(field.snapshot.active().needle.pose,
                   {suture.needle_radius * std::cos(a), suture.needle_radius * std::sin(a), 0});
}

// [m] Least distance of a tool's shaft from the line of sight to `point`, over the part of the shaft before the point.
float clearance(const TestField& field, const Camera& camera, Vec3 point) {
  const Vec3 ray = normalized(camera.eye - point);
  float least = 1;
  for (const ToolView& tool : field.snapshot.tool) {
    if (tool.instrument < 0) continue;
    for (float z = 0.01f; z < 0.16f; z += 0.002f) {
      const Vec3 d = transform(tool.pose, {0, 0, z}) - point;
      const float toward = dot(d, ray);
      if (toward > 0) least = std::min(least, length(d - ray * toward));
    }
  }
  return least;
}

TEST(CloseUp, NeedleInTheWallIsInViewAndNoShaftIsBeforeIt) {
  TestField field = make_test_field();
  field.snapshot.active().needle.in_tissue = true;
  const Vec3 middle = needle_middle(field);
  // From wherever a hand holds the driver.
  for (int i = 0; i < 12; ++i) {
    const float a = 2 * kPi * static_cast<float>(i) / 12;
    const Vec3 back = normalized(Vec3{std::sin(a), 0.8f, std::cos(a)}), open = normalized(cross(Vec3{0, 1, 0}, back));
    field.snapshot.tool[0].pose.q = from_axes(open, cross(back, open), back);
    const Camera camera = close_up(field.model, field.snapshot);
    EXPECT_GT(clearance(field, camera, middle), 0.004f) << "driver held from direction " << i;
    const Vec3 ahead = normalized(camera.target - camera.eye);
    const float off = std::acos(std::min(1.0f, dot(ahead, normalized(middle - camera.eye)))) * 180 / kPi;
    EXPECT_LT(off, 0.4f * camera.fov_deg);
    // Close: the needle's diameter covers at least a fifth of the picture's height.
    EXPECT_GT(2 * field.model.suture[0].needle_radius,
              0.2f * 2 * distance(camera.eye, camera.target) * std::tan(0.5f * camera.fov_deg * kPi / 180));
  }
}

TEST(FixedCamera, NamesAndNumbers) {
  const TestField field = make_test_field();
  for (const char* name : {"overview", "front", "left", "right", "top"}) {
    const auto camera = fixed_camera(name, field.model);
    ASSERT_TRUE(camera) << name;
    EXPECT_GT(distance(camera->eye, camera->target), 0.02f);
  }
  const auto given = fixed_camera("0.1,0.2,0.3,0,0,0.01", field.model);
  ASSERT_TRUE(given);
  EXPECT_FLOAT_EQ(given->eye.y, 0.2f);
  EXPECT_FLOAT_EQ(given->target.z, 0.01f);
  for (const char* wrong : {"", "behind", "1,2,3", "0,0,0,0,0,0", "nan,0,0,0,0,1", "0,0,1,0,0,0x"})
    EXPECT_FALSE(fixed_camera(wrong, field.model)) << wrong;
}

}  // namespace
}  // namespace catgut
