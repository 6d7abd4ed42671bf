// SPDX-License-Identifier: Apache-2.0
// render/capsule_picture: see the header.
#include "render/capsule_picture.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace catgut {

Image draw_capsules(std::span<const DrawnCapsule> capsules, const CapsuleView& view, int width, int height) {
  Image image = make_image(width, height, {238, 236, 231, 255});
  const Vec3 w = normalized(view.toward, {0, 0, 1}), u = normalized(cross(view.up, w), {1, 0, 0}), v = cross(w, u);
  const float scale = static_cast<float>(width) / view.width;
  auto placed = [&](Vec3 p) {
    const Vec3 d = p - view.center;
    return Vec3{0.5f * static_cast<float>(width) + scale * dot(d, u), 0.5f * static_cast<float>(height) - scale * dot(d, v),
                scale * dot(d, w)};
  };
  const Vec3 light = normalized(Vec3{-0.5f, -0.7f, 0.8f});  // in the image: x right, y down, z to the viewer
  std::vector<float> depth(static_cast<size_t>(width) * static_cast<size_t>(height), -1e30f);
  for (const DrawnCapsule& c : capsules) {
    const Vec3 a = placed(c.a), b = placed(c.b), d = b - a;
    const float r = std::max(0.6f, scale * c.radius), flat = d.x * d.x + d.y * d.y;
    const int left = std::max(0, static_cast<int>(std::min(a.x, b.x) - r)),
              right = std::min(width - 1, static_cast<int>(std::max(a.x, b.x) + r + 1));
    const int top = std::max(0, static_cast<int>(std::min(a.y, b.y) - r)),
              bottom = std::min(height - 1, static_cast<int>(std::max(a.y, b.y) + r + 1));
    for (int y = top; y <= bottom; ++y)
      for (int x = left; x <= right; ++x) {
        const float px = static_cast<float>(x) + 0.5f - a.x, py = static_cast<float>(y) + 0.5f - a.y;
        // The sphere of the capsule that is nearest to the viewer over this pixel lies near the closest point of the axis.
        const float t = flat > 1e-12f ? std::clamp((px * d.x + py * d.y) / flat, 0.0f, 1.0f) : 0.0f;
        const float qx = px - t * d.x, qy = py - t * d.y, rest = r * r - qx * qx - qy * qy;
        if (rest < 0) continue;
        const float rise = std::sqrt(rest), z = a.z + t * d.z + rise;
        const size_t k = static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x);
        if (z <= depth[k]) continue;
        depth[k] = z;
        const Vec3 normal = Vec3{qx, qy, rise} / r;
        const float shade = 0.30f + 0.70f * std::max(0.0f, dot(normal, light)), edge = rise / r < 0.25f ? 0.45f : 1.0f;
        for (size_t i = 0; i < 3; ++i)
          image.rgba[4 * k + i] = static_cast<uint8_t>(std::min(255.0f, shade * edge * static_cast<float>(c.color[i])));
      }
  }
  return image;
}

}  // namespace catgut
