// SPDX-License-Identifier: Apache-2.0
// render/capsule_picture: see the header.
#include "render/capsule_picture.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace catgut {
namespace {

constexpr int kFiner = 2;           // drawn at this many times the size and averaged: smooth outlines
constexpr float kNothing = -1e30f;  // depth of the ground

// Darkens what lies close behind something nearer, over the width of the finest capsule.
void add_shadows(Image& image, const std::vector<float>& depth, const std::vector<Vec3>& normal, float fine) {
  struct Offset {
    int x, y;
  };
  std::vector<Offset> around;
  for (const float ring : {0.4f, 0.7f, 1.0f, 1.3f, 1.6f})
    for (int k = 0; k < 12; ++k) {
      const float angle = kPi / 6 * (static_cast<float>(k) + ring);
      around.push_back({static_cast<int>(std::lround(ring * fine * std::cos(angle))),
                        static_cast<int>(std::lround(ring * fine * std::sin(angle)))});
    }
  const std::vector<uint8_t> lit = image.rgba;
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      const size_t k = static_cast<size_t>(y) * static_cast<size_t>(image.width) + static_cast<size_t>(x);
      if (depth[k] == kNothing) continue;
      float nearer = 0;
      for (const Offset& o : around) {
        const int i = std::clamp(x + o.x, 0, image.width - 1), j = std::clamp(y + o.y, 0, image.height - 1);
        const size_t other = static_cast<size_t>(j) * static_cast<size_t>(image.width) + static_cast<size_t>(i);
        if (depth[other] == kNothing) continue;
        // Above the plane that touches here: a slope does not shade itself.
        const Vec3 n = normal[k];
        const float plane = -(n.x * static_cast<float>(i - x) + n.y * static_cast<float>(j - y)) / std::max(0.15f, n.z);
        nearer += std::clamp((depth[other] - depth[k] - plane) / fine - 0.4f, 0.0f, 1.0f);
      }
      // Where a surface turns away from the viewer, the plane says little.
      const float facing = std::clamp(2.5f * normal[k].z - 0.3f, 0.0f, 1.0f);
      const float shade = 1 - 0.75f * facing * std::min(1.0f, 2.2f * nearer / static_cast<float>(around.size()));
      for (size_t i = 0; i < 3; ++i) image.rgba[4 * k + i] = static_cast<uint8_t>(shade * static_cast<float>(lit[4 * k + i]));
    }
}

Image averaged(const Image& from) {
  Image to = make_image(from.width / kFiner, from.height / kFiner, kPictureGround);
  for (int y = 0; y < to.height; ++y)
    for (int x = 0; x < to.width; ++x)
      for (size_t i = 0; i < 3; ++i) {
        int sum = 0;
        for (int v = 0; v < kFiner; ++v)
          for (int u = 0; u < kFiner; ++u)
            sum += from.rgba[4 * (static_cast<size_t>(y * kFiner + v) * static_cast<size_t>(from.width) +
                                  static_cast<size_t>(x * kFiner + u)) +
                             i];
        to.rgba[4 * (static_cast<size_t>(y) * static_cast<size_t>(to.width) + static_cast<size_t>(x)) + i] =
            static_cast<uint8_t>(sum / (kFiner * kFiner));
      }
  return to;
}

}  // namespace

Image draw_capsules(std::span<const DrawnCapsule> capsules, const CapsuleView& view, int width, int height) {
  width *= kFiner, height *= kFiner;
  Image image = make_image(width, height, kPictureGround);
  const Vec3 w = normalized(view.toward, {0, 0, 1}), u = normalized(cross(view.up, w), {1, 0, 0}), v = cross(w, u);
  const float scale = static_cast<float>(width) / view.width;
  auto placed = [&](Vec3 p) {
    const Vec3 d = p - view.center;
    return Vec3{0.5f * static_cast<float>(width) + scale * dot(d, u), 0.5f * static_cast<float>(height) - scale * dot(d, v),
                scale * dot(d, w)};
  };
  const Vec3 light = normalized(Vec3{-0.5f, -0.7f, 0.8f});  // in the image: x right, y down, z to the viewer
  std::vector<float> depth(static_cast<size_t>(width) * static_cast<size_t>(height), kNothing);
  std::vector<Vec3> normals(depth.size());
  float fine = 1e30f;
  for (const DrawnCapsule& c : capsules) {
    const Vec3 a = placed(c.a), b = placed(c.b), d = b - a;
    const float r = std::max(0.6f * kFiner, scale * c.radius), flat = d.x * d.x + d.y * d.y,
                whole = std::max(1e-12f, flat + d.z * d.z);
    fine = std::min(fine, r);
    const int left = std::max(0, static_cast<int>(std::min(a.x, b.x) - r)),
              right = std::min(width - 1, static_cast<int>(std::max(a.x, b.x) + r + 1));
    const int top = std::max(0, static_cast<int>(std::min(a.y, b.y) - r)),
              bottom = std::min(height - 1, static_cast<int>(std::max(a.y, b.y) + r + 1));
    for (int y = top; y <= bottom; ++y)
      for (int x = left; x <= right; ++x) {
        const float px = static_cast<float>(x) + 0.5f - a.x, py = static_cast<float>(y) + 0.5f - a.y;
        // Nearest point of the capsule over this pixel: of its cylinder, or of the sphere at either end.
        float z = kNothing, at = 0;
        auto hit = [&](float near_z, float t) {
          if (near_z > z) z = near_z, at = t;
        };
        const float along = (px * d.x + py * d.y) / whole, free = flat / whole;
        const float rest = r * r - px * px - py * py + along * along * whole, half = along * d.z;
        if (free > 1e-6f && half * half + free * rest >= 0) {
          const float near_z = (half + std::sqrt(half * half + free * rest)) / free, t = along + near_z * d.z / whole;
          if (t >= 0 && t <= 1) hit(near_z, t);
        }
        const float bx = px - d.x, by = py - d.y, from_a = r * r - px * px - py * py, from_b = r * r - bx * bx - by * by;
        if (from_a >= 0) hit(std::sqrt(from_a), 0);
        if (from_b >= 0) hit(d.z + std::sqrt(from_b), 1);
        const size_t k = static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x);
        if (z == kNothing || a.z + z <= depth[k]) continue;
        depth[k] = a.z + z;
        const Vec3 normal = (Vec3{px, py, z} - d * at) / r;
        normals[k] = normal;
        const float lit = 0.5f + 0.5f * dot(normal, light), shade = 0.3f + 0.8f * lit * lit;
        // A dark outline, thin on thick capsules; none on one that fills the image.
        const float edge = r < 60 * kFiner && normal.z < std::min(0.25f, 6 * kFiner / r) ? 0.45f : 1.0f;
        for (size_t i = 0; i < 3; ++i)
          image.rgba[4 * k + i] = static_cast<uint8_t>(std::min(255.0f, shade * edge * static_cast<float>(c.color[i])));
      }
  }
  if (!capsules.empty()) add_shadows(image, depth, normals, fine);
  return averaged(image);
}

}  // namespace catgut
