// SPDX-License-Identifier: Apache-2.0
// render/capsule_picture: an image of capsules (threads, tools) without a graphics card: parallel projection, one light from
// the viewer's upper left, depth and shade per pixel. What lies close behind something is in its shadow, so that over and under
// are distinguished. For close-ups in documents, reports and tests.
#pragma once
#include <span>

#include "core/math.h"
#include "render/image.h"

namespace catgut {

constexpr Color kPictureGround{238, 236, 231, 255};  // where there is nothing

struct DrawnCapsule {
  Vec3 a, b;         // [m]
  float radius = 0;  // [m]
  Color color{255, 255, 255, 255};
};
struct CapsuleView {
  Vec3 center;                           // [m] at the center of the image
  Vec3 toward{0, 0.3f, 1}, up{0, 1, 0};  // from the center to the viewer; up direction
  float width = 0.01f;                   // [m] from the left edge to the right
};

Image draw_capsules(std::span<const DrawnCapsule> capsules, const CapsuleView& view, int width = 480, int height = 360);

}  // namespace catgut
