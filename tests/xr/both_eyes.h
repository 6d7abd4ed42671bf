// SPDX-License-Identifier: Apache-2.0
// tests/xr: the two pictures of a session against geometry: what the runtime received, and the disparity of the field's center.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "at_the_headset.h"

namespace catgut {

// [pixels] from the left edge and from the top of the eye's picture.
inline std::array<float, 2> place_in_picture(const Pose& eye, const Frustum& f, Vec3 p, const Image& image) {
  const Vec3 d = to_local(eye, p);
  const float tx = d.x / -d.z, ty = d.y / -d.z;
  return {static_cast<float>(image.width) * (tx - f.left) / (f.right - f.left),
          static_cast<float>(image.height) * (f.up - ty) / (f.up - f.down)};
}

inline float luma(const Image& image, int x, int y) {
  const uint8_t* p = &image.rgba[4 * (size_t(y) * size_t(image.width) + size_t(x))];
  return 0.3f * p[0] + 0.6f * p[1] + 0.1f * p[2];
}

// [pixels] from a patch of the left picture to where it is found in the right one, by the least squared difference.
inline int found_shift(const Image& left, const Image& right, int x, int y, int half, int reach) {
  double least = 1e30;
  int best = 0;
  for (int shift = -reach; shift <= reach; ++shift) {
    double sum = 0;
    int count = 0;
    for (int dy = -half; dy <= half; ++dy)
      for (int dx = -half; dx <= half; ++dx) {
        const int xl = x + dx, xr = x + dx + shift, yy = y + dy;
        if (std::min({xl, xr, yy}) < 0 || std::max(xl, xr) >= left.width || yy >= left.height) continue;
        const double d = static_cast<double>(luma(left, xl, yy) - luma(right, xr, yy));
        sum += d * d, ++count;
      }
    if (count > half * half && sum / count < least) least = sum / count, best = shift;
  }
  return best;
}

inline float mean_luma(const Image& image) {
  double sum = 0;
  for (int y = 0; y < image.height; y += 2)
    for (int x = 0; x < image.width; x += 2) sum += static_cast<double>(luma(image, x, y));
  return static_cast<float>(4 * sum / (image.width * image.height));
}

// look: of the frame that drew `picture`. head: as the wearer streamed it.
inline void expect_both_eyes_right(const XrLayerState& layer, const xr::WearerLook& look, const std::array<Image, 2>& picture,
                                   const Pose& head, const std::string& name) {
  if (const char* folder = std::getenv("CATGUT_PICTURES"))
    for (size_t i = 0; i < 2; ++i) write_png(picture[i], std::string(folder) + "/" + name + (i ? "_right.png" : "_left.png"));
  // Room and driver have one frame: the head is where it was streamed.
  EXPECT_LT(distance(look.frame.head.p, head.p), 0.01f);
  EXPECT_LT(length(rotation_vector(look.frame.head.q * conjugate(head.q))), 0.02f);
  const Vec3 between = rotate(conjugate(look.frame.head.q), look.frame.eye[1].p - look.frame.eye[0].p);
  EXPECT_GT(between.x, 0.05f) << "the first view is the left eye";
  EXPECT_LT(between.x, 0.08f);

  // What the runtime received is what the picture was drawn for.
  for (size_t i = 0; i < 2; ++i) {
    const XrLayerState::Eye& e = layer.eye[i];
    EXPECT_NEAR(std::tan(e.fov[0]), look.frame.frustum[i].left, 1e-4f);
    EXPECT_NEAR(std::tan(e.fov[3]), look.frame.frustum[i].down, 1e-4f);
    EXPECT_LT(distance({e.position[0], e.position[1], e.position[2]}, look.frame.eye[i].p), 0.01f);
    EXPECT_EQ(e.rect[2], picture[i].width);
    EXPECT_EQ(e.rect[3], picture[i].height);
  }

  // The field's center: the patch of the left picture lies in the right one where geometry puts it.
  const auto in_both = [&](Vec3 world) {
    std::array<std::array<float, 2>, 2> at;
    for (size_t i = 0; i < 2; ++i)
      at[i] = place_in_picture(look.place.to_world(look.frame.eye[i]), look.frame.frustum[i], world, picture[i]);
    return at;
  };
  const auto at = in_both(look.place.focus);
  const float expected = at[1][0] - at[0][0];
  const Pose eye = look.place.to_world(look.frame.head);
  const auto far_away = in_both(eye.p + rotate(eye.q, {0, 0, -1000}));
  const int found = found_shift(picture[0], picture[1], static_cast<int>(at[0][0]), static_cast<int>(at[0][1]), 20, 60);
  std::fprintf(stderr, "%s: disparity of the field's center: %d pixels, by geometry %.1f; at infinity %.1f\n", name.c_str(),
               found, static_cast<double>(expected), static_cast<double>(far_away[1][0] - far_away[0][0]));
  EXPECT_NEAR(static_cast<float>(found), expected, 2.0f);
}

}  // namespace catgut
