// SPDX-License-Identifier: Apache-2.0
// anatomy/perineum: see perineum.h. Works in the frame of the verge: x to the patient's left as the surgeon sees it on the
// right, y toward the abdomen, z out of the body.
#include "anatomy/perineum.h"

#include <algorithm>
#include <cmath>
#include <functional>

namespace catgut {
namespace {

constexpr float mm = 0.001f;
constexpr float kSkin = 0.082f, kDrape = 0.074f, kEnd = 0.34f;  // [m] from the verge: where skin ends, drape begins and ends

// Linear color of 8-bit sRGB values, as in render/shapes.
Vec3 color(int r, int g, int b) {
  const auto linear = [](int v) { return portable::pow(static_cast<float>(v) / 255, 2.2f); };
  return {linear(r), linear(g), linear(b)};
}

float smooth_step(float a, float b, float x) {
  const float t = std::clamp((x - a) / (b - a), 0.0f, 1.0f);
  return t * t * (3 - 2 * t);
}

float radius_of(float x, float y) { return std::sqrt(x * x + y * y); }

// [m] height of the skin.
float skin_height(const PerineumShape& s, float x, float y) {
  const float r = radius_of(x, y), a = portable::atan2(y, x), away = r - s.radius;
  float h = -0.7f * r * r;
  // Buttocks on both sides, fuller toward the back; between them the cleft; toward the front the raphe.
  const float side = (std::abs(x) - 0.062f) / 0.034f, back = smooth_step(0.05f, -0.06f, y);
  h += (0.010f + 0.020f * back) * portable::exp(-side * side) * smooth_step(0, 0.03f, away);
  h -= 0.016f * portable::exp(-(x / 0.011f) * (x / 0.011f)) * smooth_step(s.radius + 4 * mm, s.radius + 34 * mm, -y);
  h += 0.0013f * portable::exp(-(x / 0.0018f) * (x / 0.0018f)) * smooth_step(s.radius + 5 * mm, s.radius + 18 * mm, y);
  // The anal folds radiate from the verge, which the bowel stretches.
  const float near = portable::exp(-std::max(0.0f, away) / (9 * mm));
  h += 0.9f * mm * near * portable::cos(19 * a + 2 * portable::sin(3 * a)) * smooth_step(0, 3 * mm, away);
  h -= 3.5f * mm * portable::exp(-std::max(0.0f, away) / (5 * mm));
  return h;
}

float drape_height(const PerineumShape& s, float x, float y) {
  float h = skin_height(s, std::clamp(x, -kSkin, kSkin), std::clamp(y, -kSkin, kSkin));
  // Thighs in stirrups to both sides, the abdomen in front; at the back the cloth hangs over the table's edge.
  h += 0.15f * smooth_step(0.10f, 0.21f, std::abs(x)) + 0.07f * smooth_step(0.10f, 0.22f, y) -
       0.10f * smooth_step(0.09f, 0.24f, -y);
  const float loose = smooth_step(kDrape, kDrape + 0.04f, radius_of(x, y));
  h += loose * (2.2f * mm * portable::sin(46 * x + 19 * y + 0.6f) * portable::sin(37 * y - 23 * x) +
                1.3f * mm * portable::sin(90 * x - 71 * y));
  return h + 2.2f * mm;
}

struct Maker {
  const PerineumShape& s;
  Vec3 x, y, z;

  Vec3 world(Vec3 p) const { return s.verge + x * p.x + y * p.y + z * p.z; }

  // A grid of (rows + 1) x (columns + 1) points; columns run counter-clockwise seen from outside.
  void grid(Scenery& to, int rows, int columns, const std::function<Vec3(float, float)>& at,
            const std::function<Vec3(Vec3)>& tint) const {
    const uint32_t first = static_cast<uint32_t>(to.position.size()), width = static_cast<uint32_t>(columns) + 1;
    for (int i = 0; i <= rows; ++i)
      for (int j = 0; j <= columns; ++j) {
        const float u = static_cast<float>(i) / static_cast<float>(rows),
                    v = static_cast<float>(j) / static_cast<float>(columns);
        constexpr float e = 1e-3f;
        const float u0 = std::max(0.0f, u - e), u1 = std::min(1.0f, u + e);
        const Vec3 p = at(u, v), n = normalized(cross(at(u1, v) - at(u0, v), at(u, v + e) - at(u, v - e)), {0, 0, 1});
        to.position.push_back(world(p));
        to.normal.push_back(x * n.x + y * n.y + z * n.z);
        to.color.push_back(tint(p));
        to.uv.push_back({100 * p.x, 100 * p.y});
      }
    for (uint32_t i = 0; i < static_cast<uint32_t>(rows); ++i)
      for (uint32_t j = 0; j < static_cast<uint32_t>(columns); ++j) {
        const uint32_t a = first + i * width + j, b = a + width;
        to.triangle.push_back({a, b, b + 1});
        to.triangle.push_back({a, b + 1, a + 1});
      }
  }

  // A tube through points of the verge's frame, its radius from r0 to r1.
  void tube(Scenery& to, const std::vector<Vec3>& path, float r0, float r1, Vec3 tint) const {
    constexpr uint32_t sides = 14;
    const uint32_t first = static_cast<uint32_t>(to.position.size()), n = static_cast<uint32_t>(path.size());
    Vec3 along = normalized(path[1] - path[0]), side = any_perpendicular(along);
    float u = 0;
    for (uint32_t i = 0; i < n; ++i) {
      along = normalized(path[std::min(i + 1, n - 1)] - path[i > 0 ? i - 1 : 0], along);
      side = normalized(side - along * dot(side, along), any_perpendicular(along));
      const Vec3 up = cross(along, side);
      if (i > 0) u += distance(path[i], path[i - 1]);
      const float r = r0 + (r1 - r0) * static_cast<float>(i) / static_cast<float>(n - 1);
      for (uint32_t k = 0; k <= sides; ++k) {
        const float a = 2 * kPi * static_cast<float>(k) / sides;
        const Vec3 q = side * portable::cos(a) + up * portable::sin(a), p = path[i] + q * r;
        to.position.push_back(world(p));
        to.normal.push_back(x * q.x + y * q.y + z * q.z);
        to.color.push_back(tint);
        to.uv.push_back({u, static_cast<float>(k) / sides});
      }
    }
    for (uint32_t i = 0; i + 1 < n; ++i)
      for (uint32_t k = 0; k < sides; ++k) {
        const uint32_t a = first + i * (sides + 1) + k, b = a + sides + 1;
        to.triangle.push_back({a, a + 1, b});
        to.triangle.push_back({a + 1, b + 1, b});
      }
  }
};

Vec3 skin_tint(const PerineumShape& s, Vec3 p) {
  const float r = radius_of(p.x, p.y), away = r - s.radius;
  // Prepared with iodine, unevenly; darker and redder round the verge.
  const float patch = 0.5f + 0.25f * portable::sin(70 * p.x + 31 * p.y) + 0.25f * portable::sin(53 * p.y - 44 * p.x + 1);
  Vec3 c = lerp(color(222, 166, 132), color(206, 138, 92), 0.6f * patch);
  c = lerp(c, color(150, 84, 70), portable::exp(-std::max(0.0f, away) / (11 * mm)));
  const float fold = portable::cos(19 * portable::atan2(p.y, p.x) + 2 * portable::sin(3 * portable::atan2(p.y, p.x)));
  return c * (1 - 0.16f * portable::exp(-std::max(0.0f, away) / (9 * mm)) * (0.5f - 0.5f * fold));
}

}  // namespace

std::vector<Scenery> make_perineum(const PerineumShape& s) {
  Maker make{s, {}, {}, normalized(s.out, {0, 0, 1})};
  make.x = normalized(Vec3{1, 0, 0} - make.z * make.z.x, any_perpendicular(make.z));
  make.y = cross(make.z, make.x);
  const auto round = [](float r, float v) { return Vec3{r * portable::cos(2 * kPi * v), r * portable::sin(2 * kPi * v), 0}; };
  std::vector<Scenery> all;

  Scenery skin;
  skin.kind = SceneryKind::skin;
  make.grid(
      skin, 70, 220,
      [&](float u, float v) {
        const float r = (s.radius - 0.6f * mm) + (kSkin - s.radius) * u * (0.55f + 0.45f * u);
        Vec3 p = round(r, v);
        p.z = skin_height(s, p.x, p.y);
        return p;
      },
      [&](Vec3 p) { return skin_tint(s, p); });
  all.push_back(std::move(skin));

  // The dentate line: anoderm covers the base of the everted rectum as far as the scalloped line of the anal columns. The bowel
  // is fixed there.
  Scenery anoderm;
  anoderm.kind = SceneryKind::anoderm;
  make.grid(
      anoderm, 14, 220,
      [&](float u, float v) {
        const float columns = 0.5f + 0.5f * portable::cos(2 * kPi * 11 * v), top = (5.2f + 2.2f * columns) * mm;
        Vec3 p = round(s.radius + (0.75f * (1 - u * u) + 0.12f) * mm, v);
        p.z = -4.5f * mm + (top + 4.5f * mm) * u;
        return p;
      },
      [&](Vec3 p) { return lerp(color(178, 100, 88), color(214, 136, 122), smooth_step(-4 * mm, 7 * mm, p.z)); });
  // Its columns run round the axis: the grid's outside faces away from it.
  for (auto& t : anoderm.triangle) std::swap(t[1], t[2]);
  for (Vec3& n : anoderm.normal) n = -n;
  all.push_back(std::move(anoderm));

  Scenery cloth;
  cloth.kind = SceneryKind::drape;
  make.grid(
      cloth, 60, 160,
      [&](float u, float v) {
        const float r = kDrape + (kEnd - kDrape) * u * (0.4f + 0.6f * u);
        Vec3 p = round(r, v);
        // The window's edge is turned in.
        p.z = drape_height(s, p.x, p.y) - 2.0f * mm * (1 - smooth_step(0, 0.02f, u));
        return p;
      },
      [](Vec3) { return color(36, 138, 128); });
  all.push_back(std::move(cloth));

  // The ring: an oval on small feet above the skin, with notches that hold the cords.
  // It bends over the buttocks, as the jointed plastic rings do.
  constexpr float wide = 0.066f, tall = 0.060f, above = 0.012f, clear = 0.006f;
  const auto on_ring = [&](float v, float out, float up) {
    const float px = (wide + out) * portable::cos(2 * kPi * v), py = (tall + out) * portable::sin(2 * kPi * v);
    return Vec3{px, py, std::max(above, skin_height(s, px, py) + clear) + up};
  };
  Scenery ring;
  ring.kind = SceneryKind::steel;
  const Vec3 steel = color(214, 217, 222);
  std::vector<Vec3> path;
  for (int i = 0; i <= 120; ++i) path.push_back(on_ring(static_cast<float>(i) / 120, 0, 0));
  make.tube(ring, path, 2.6f * mm, 2.6f * mm, steel);
  constexpr int notches = 24;
  for (int i = 0; i < notches; ++i) {
    const float v = (static_cast<float>(i) + 0.32f) / notches;
    for (const float d : {-0.0045f, 0.0045f}) {
      const Vec3 foot = on_ring(v + d, 0, 1.5f * mm);
      make.tube(ring, {foot, foot + Vec3{0, 0, 1.4f * mm}, foot + Vec3{0, 0, 2.6f * mm}}, 1.3f * mm, 0.9f * mm, steel);
    }
  }
  // Each stay: a hook in the verge, an elastic cord over the ring and its end beyond it.
  Scenery cord;
  cord.kind = SceneryKind::elastic;
  for (int i = 0; i < s.stays; ++i) {
    const float v = (static_cast<float>(i) + 0.5f) / static_cast<float>(std::max(1, s.stays));
    const Vec3 radial = round(1, v);
    const auto at = [&](float r, float h) { return radial * r + Vec3{0, 0, h}; };
    const float r = s.radius;
    const float skin_at = skin_height(s, at(r + 12 * mm, 0).x, at(r + 12 * mm, 0).y);
    make.tube(ring,
              {at(r + 1.2f * mm, -1.5f * mm), at(r + 2.2f * mm, -2.2f * mm), at(r + 4.5f * mm, 0.6f * mm),
               at(r + 8 * mm, std::max(skin_at, 0.0f) + 2.6f * mm), at(r + 16 * mm, std::max(skin_at, 0.0f) + 5.5f * mm)},
              0.45f * mm, 0.75f * mm, steel);
    const Vec3 from = at(r + 15 * mm, std::max(skin_at, 0.0f) + 5.2f * mm), over = on_ring(v, 0, 3.6f * mm);
    std::vector<Vec3> line;
    for (int k = 0; k <= 16; ++k) {
      Vec3 p = lerp(from, over, static_cast<float>(k) / 16);
      p.z = std::max(p.z, skin_height(s, p.x, p.y) + 2 * mm);
      line.push_back(p);
    }
    const Vec3 away = normalized(over - from);
    for (int k = 1; k <= 10; ++k) {
      const float t = static_cast<float>(k) / 10;
      Vec3 p = over + away * (24 * mm * t) + Vec3{2 * mm * portable::sin(5 * t + static_cast<float>(i)), 0, -9 * mm * t * t};
      const float under = radius_of(p.x, p.y) > kDrape ? drape_height(s, p.x, p.y) : skin_height(s, p.x, p.y);
      p.z = std::max(p.z, under + 2 * mm);
      line.push_back(p);
    }
    make.tube(cord, line, 1.15f * mm, 1.15f * mm, color(238, 214, 92));
  }
  all.push_back(std::move(ring));
  all.push_back(std::move(cord));
  return all;
}

}  // namespace catgut
