// SPDX-License-Identifier: Apache-2.0
// render/room_shape: see room_shape.h.
#include "render/room_shape.h"

#include <functional>

namespace catgut {
namespace {

constexpr float kTable = 0.68f;                    // [m] radius of the draped table; the field's cloth overlaps it
constexpr float kEdge = -0.031f, kHang = 0.55f;    // [m] height of its edge from the field's cloth, and of what hangs down
constexpr float kFloor = -0.90f, kCeiling = 2.0f;  // [m] from the field's cloth
constexpr float kWall = 3.4f;                      // [m] radius
constexpr float kLamp = 1.15f;                     // [m] of the lamp from the field
constexpr float kHead = 0.055f, kDish = 0.27f;     // [m] radius of a lamp's head, and of the lamp

// A surface place(s, t) of rows x columns, s and t in 0..1, seen from both sides.
void add_surface(Shape& shape, int rows, int columns, const std::function<Vec3(float, float)>& place,
                 const std::function<Vec3(Vec3)>& color) {
  const auto first = uint32_t(shape.position.size());
  for (int i = 0; i <= rows; ++i)
    for (int j = 0; j <= columns; ++j) {
      const Vec3 p = place(float(i) / float(rows), float(j) / float(columns));
      shape.position.push_back(p);
      shape.normal.push_back({0, 1, 0});
      shape.tangent.push_back({1, 0, 0});
      shape.uv.push_back({p.x, p.z});
      shape.color.push_back(color(p));
    }
  for (uint32_t i = 0; i < uint32_t(rows); ++i)
    for (uint32_t j = 0; j < uint32_t(columns); ++j) {
      const uint32_t a = first + i * uint32_t(columns + 1) + j, b = a + uint32_t(columns + 1);
      shape.triangle.insert(shape.triangle.end(), {{a, b, a + 1}, {a + 1, b, b + 1}, {a, a + 1, b}, {a + 1, b + 1, b}});
    }
}

Vec3 around(float radius, float turn, float height) {
  return {radius * std::cos(2 * kPi * turn), height, -radius * std::sin(2 * kPi * turn)};
}

}  // namespace

Shape room_shape(Vec3 center, Vec3 lamp, bool cloth) {
  Shape shape;
  if (cloth) {
    // Folds deepen as the cloth hangs.
    const auto place = [&](float s, float t) {
      const float fold = std::sin(2 * kPi * 19 * t) + 0.6f * std::sin(2 * kPi * 31 * t + 1);
      return center + around(kTable + 0.03f * s + 0.018f * s * fold, t, kEdge - kHang * s);
    };
    add_surface(shape, 6, 192, place, [&](Vec3 p) {
      const Vec3 d = p - center;
      const float out = std::clamp((std::hypot(d.x, d.z) - kTable) / 0.05f, 0.0f, 1.0f), down = (kEdge - d.y) / kHang;
      return srgb(66, 138, 134) * ((0.50f - 0.30f * down) * (0.72f + 0.5f * out));
    });
  }
  // The lamp lights a pool on the floor; what hangs from the table shades its middle.
  const auto floor_color = [&](Vec3 p) {
    const float r = std::hypot(p.x - center.x, p.z - center.z);
    return srgb(116, 128, 126) * (0.16f + 0.30f * std::exp(-r * r / 2.2f) * std::clamp((r - 0.5f) / 0.5f, 0.0f, 1.0f));
  };
  add_surface(
      shape, 12, 48, [&](float s, float t) { return center + around(kWall * s, t, kFloor); }, floor_color);
  const auto wall_color = [&](Vec3 p) {
    const float h = (p.y - center.y - kFloor) / (kCeiling - kFloor);
    // A skirting, washable panels with joints, a pale upper part.
    const float joint = std::abs(std::sin(9 * std::atan2(p.z - center.z, p.x - center.x))) < 0.08f ? 0.8f : 1.0f;
    const Vec3 paint = h < 0.05f ? srgb(70, 80, 82) : h < 0.5f ? srgb(138, 170, 164) : srgb(190, 204, 202);
    return paint * (joint * (0.20f + 0.12f * h));
  };
  add_surface(
      shape, 20, 180, [&](float s, float t) { return center + around(kWall, t, kFloor + (kCeiling - kFloor) * s); },
      wall_color);
  add_surface(
      shape, 2, 48, [&](float s, float t) { return center + around(kWall * s, t, kCeiling); },
      [](Vec3) { return srgb(205, 212, 212) * 0.34f; });
  // The lamp: a dish with seven heads that face the work.
  const Pose at{center + lamp * kLamp, from_axes(any_perpendicular(lamp), cross(lamp, any_perpendicular(lamp)), lamp)};
  const auto disc = [&](Vec3 middle, float radius, Vec3 color) {
    add_surface(
        shape, 1, 24,
        [&](float s, float t) {
          const Vec3 on = around(radius * s, t, 0);
          return transform(at, middle + Vec3{on.x, on.z, 0});
        },
        [&](Vec3) { return color; });
  };
  disc({0, 0, 0.02f}, kDish, srgb(150, 156, 158) * 0.35f);
  for (int i = 0; i < 7; ++i) {
    const Vec3 middle = i == 6 ? Vec3{} : around(0.62f * kDish, float(i) / 6, 0);
    disc({middle.x, middle.z, 0}, kHead, {3.0f, 2.9f, 2.7f});
  }
  return shape;
}

}  // namespace catgut
