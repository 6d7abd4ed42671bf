// SPDX-License-Identifier: Apache-2.0
// render/shapes: drape, wound and gauze; see shapes.h. Height fields, computed once.
#include <functional>

#include "render/shapes.h"

namespace catgut {
namespace {

constexpr float mm = 0.001f;

// Smooth noise without a table: a few waves of unrelated lengths and directions.
float cloth_height(float x, float z) {
  float h = 0;
  h += 0.9f * std::sin(31 * x + 17 * z + 0.4f) * std::sin(23 * z - 9 * x + 1.1f);
  h += 0.5f * std::sin(57 * x - 43 * z + 2.0f) * std::sin(19 * x + 61 * z);
  h += 0.25f * std::sin(131 * x + 37 * z) * std::sin(113 * z - 71 * x + 0.7f);
  return h;
}

// Folds of a pulled cloth: long creases with a round back and a sharp foot. 0 or less.
float folds(float x, float z) {
  const auto crease = [](float t) { return std::pow(std::sin(t) * std::sin(t) + 0.05f, 0.25f) - 1; };
  const float bend = 0.35f * std::sin(29 * x + 13 * z), sway = 0.4f * std::sin(17 * z - 23 * x + 1);
  return 0.62f * crease(43 * x + 19 * z + 2 * bend + 0.7f) + 0.5f * crease(24 * z - 37 * x + 2 * sway);
}

float random_at(int i, int j, int k) {
  uint32_t h = uint32_t(i) * 374761393u + uint32_t(j) * 668265263u + uint32_t(k) * 2246822519u;
  h = (h ^ (h >> 13)) * 1274126177u;
  return float((h ^ (h >> 16)) >> 8) / 16777216.0f;
}

// Round lobules, about `size` across: 1 on top of one, 0 in the crevices.
float lobules(float x, float z, float size) {
  const float gx = x / size, gz = z / size;
  const int ix = int(std::floor(gx)), iz = int(std::floor(gz));
  float best = 1e9f, second = 1e9f;
  for (int j = -1; j <= 1; ++j)
    for (int i = -1; i <= 1; ++i) {
      const float cx = float(ix + i) + 0.15f + 0.7f * random_at(ix + i, iz + j, 1),
                  cz = float(iz + j) + 0.15f + 0.7f * random_at(ix + i, iz + j, 2);
      const float d = (gx - cx) * (gx - cx) + (gz - cz) * (gz - cz);
      if (d < best) second = best, best = d;
      else second = std::min(second, d);
    }
  return std::clamp(1.6f * (std::sqrt(second) - std::sqrt(best)), 0.0f, 1.0f);
}

// A grid of (rows + 1) x (columns + 1) vertices at place(i, j), seen from where its normals point.
void add_grid(Shape& shape, int rows, int columns, float repeat, const std::function<Vec3(float, float)>& place,
              const std::function<Vec3(Vec3)>& color) {
  const uint32_t first = uint32_t(shape.position.size());
  for (int i = 0; i <= rows; ++i)
    for (int j = 0; j <= columns; ++j) {
      const float s = float(i) / float(rows), t = float(j) / float(columns), e = 0.2f / float(std::max(rows, columns));
      const Vec3 p = place(s, t);
      const float s0 = std::max(0.0f, s - e), s1 = std::min(1.0f, s + e);
      const Vec3 along = place(s1, t) - place(s0, t), across = place(s, t + e) - place(s, t - e);
      Vec3 n = normalized(cross(across, along), {0, 1, 0});
      if (n.y < 0) n = -n;
      shape.position.push_back(p);
      shape.normal.push_back(n);
      shape.tangent.push_back(normalized(Vec3{1, 0, 0} - n * n.x, {0, 0, 1}));
      shape.uv.push_back({p.x / repeat, p.z / repeat});
      shape.color.push_back(color(p));
    }
  for (uint32_t i = 0; i < uint32_t(rows); ++i)
    for (uint32_t j = 0; j < uint32_t(columns); ++j) {
      const uint32_t a = first + i * uint32_t(columns + 1) + j, b = a + uint32_t(columns + 1);
      const Vec3 n = cross(shape.position[b] - shape.position[a], shape.position[a + 1] - shape.position[a]);
      if (n.y >= 0) {
        shape.triangle.push_back({a, b, a + 1});
        shape.triangle.push_back({a + 1, b, b + 1});
      } else {
        shape.triangle.push_back({a, a + 1, b});
        shape.triangle.push_back({a + 1, b + 1, b});
      }
    }
}

}  // namespace

float hole_radius(float hole, float angle) {
  return hole * (1.10f + 0.10f * std::cos(2 * angle - 0.5f) + 0.015f * std::sin(5 * angle));
}

Shape drape_shape(Vec3 center, float hole, float size) {
  const auto place = [&](float s, float t) {
    const float a = 2 * kPi * t, edge = hole > 0 ? hole_radius(hole, a) : 0, r = edge + (size - edge) * s * (0.04f + 0.96f * s);
    const float x = r * std::cos(a), z = -r * std::sin(a), in = r - edge;
    // Folds only go down: objects on the drape in the physics lie on its highest level. The edge is a soft roll round the
    // hole.
    const float roll = hole > 0 ? 2.6f * mm * std::exp(-in * in / (0.004f * 0.004f)) : 0;
    const float out = hole > 0 ? std::clamp((in - 0.004f) / 0.03f, 0.0f, 1.0f) : 1;
    const float y =
        roll + out * (1.6f * mm * (cloth_height(x, z) - 1.4f) + 5.5f * mm * folds(x, z)) - 0.05f * std::max(0.0f, in - 0.06f);
    return center + Vec3{x, y, z};
  };
  Shape shape;
  add_grid(shape, 48, 96, 0.01f, place, [&](Vec3 p) {
    const float x = p.x - center.x, z = p.z - center.z, r = std::hypot(x, z),
                edge = hole > 0 ? hole_radius(hole, std::atan2(-z, x)) : -1;
    // Worn and damp near the wound, never quite even elsewhere.
    const float dry = std::clamp((r - edge) / 0.02f, 0.0f, 1.0f), wear = 0.04f * cloth_height(0.6f * x + 0.2f, 0.7f * z);
    return lerp(srgb(48, 116, 114), srgb(66, 138, 134), dry) * (1 + wear);
  });
  return shape;
}

Shape wound_bed_shape(Vec3 center, float radius) {
  const auto height = [](float x, float z) {
    const float big = lobules(x, z, 7.5f * mm), small = lobules(x + 0.31f, z, 3.0f * mm);
    return 2.6f * mm * std::sqrt(big) + 0.7f * mm * std::sqrt(small);
  };
  const auto place = [&](float s, float t) {
    // On under the drape, as far as one can look below its edge.
    const float a = 2 * kPi * t, edge = hole_radius(radius, a), r = 0.45f * edge + (0.55f * edge + 18 * mm) * s;
    const float x = r * std::cos(a), z = -r * std::sin(a), under = std::max(0.0f, r - edge);
    return center + Vec3{x, height(x, z) - 2.5f * mm - 0.2f * under, z};
  };
  Shape shape;
  add_grid(shape, 30, 110, 0.04f, place, [&](Vec3 p) {
    const float x = p.x - center.x, z = p.z - center.z;
    const float top = std::sqrt(lobules(x, z, 7.5f * mm)),
                blush = std::clamp(0.45f + 0.4f * cloth_height(1.7f * x, 1.9f * z + 0.1f), 0.0f, 1.0f);
    const Vec3 fat = lerp(srgb(252, 228, 168), srgb(244, 198, 150), blush);
    return lerp(srgb(206, 112, 84), fat, 0.35f + 0.65f * top);
  });
  return shape;
}

Shape swab_shape(std::span<const Vec3> body, Vec3 away, float ground) {
  const Vec3 side{-away.z, 0, away.x};
  float end = -1e9f, middle = 0;
  for (const Vec3 p : body) end = std::max(end, dot(p, away));
  size_t count = 0;
  for (const Vec3 p : body)
    if (dot(p, away) > end - 0.004f) middle += dot(p, side), ++count;
  middle /= float(std::max<size_t>(1, count));
  // The organ's profile where the swab lies: its height for every 2 mm across.
  constexpr int bins = 48;
  constexpr float bin = 2 * mm;
  std::array<float, bins> top;
  top.fill(ground);
  for (const Vec3 p : body) {
    const int k = int(std::floor((dot(p, side) - middle) / bin)) + bins / 2;
    if (dot(p, away) > end - 0.028f && k >= 0 && k < bins) top[size_t(k)] = std::max(top[size_t(k)], p.y);
  }
  const auto lie = [&](float across) {  // over the organ, then steeply down
    float h = ground;
    for (int k = 0; k < bins; ++k) {
      const float off = std::max(0.0f, std::abs((float(k) - bins / 2 + 0.5f) * bin - across) - 0.5f * bin);
      h = std::max(h, top[size_t(k)] + 1.2f * mm - (3.2f * off + 60 * off * off));
    }
    return h;
  };
  const auto place = [&](float s, float t) {
    const float across = 0.044f * (2 * t - 1), lap = 0.0016f * std::sin(120 * across);
    const float from = end - 0.022f + lap, to = end + 0.030f, along = from + (to - from) * s;
    const float past = std::max(0.0f, along - (end + 0.002f));
    float h = lie(across) - 2.6f * past;
    const float hang = std::clamp((lie(0) - h) / 0.02f, 0.0f, 1.0f);
    h += hang * 1.6f * mm * std::sin(520 * along + 2 * std::sin(190 * across)) * std::cos(130 * across);
    // The hem toward the work is folded under: a roll.
    const float in = along - from;
    h += (1 - hang) * (1 - hang) * 0.9f * mm * std::exp(-in * in / (2.2f * mm * 2.2f * mm));
    h = std::max(h, ground + 0.8f * mm + 0.6f * mm * std::sin(140 * across) * std::sin(190 * along));
    return away * along + side * (middle + across) + Vec3{0, h, 0};
  };
  Shape shape;
  add_grid(shape, 40, 72, 0.01f, place, [&](Vec3 p) {
    const float in = dot(p, away) - (end - 0.022f),
                blood = std::clamp(cloth_height(2.2f * p.x, 2.5f * p.z) - 0.25f, 0.0f, 1.0f);
    return lerp(srgb(226, 226, 214), srgb(196, 96, 84), 0.75f * blood * std::exp(-std::max(0.0f, in) / 0.014f));
  });
  return shape;
}

Shape cushion_shape(Vec3 middle, Vec3 away, float from, float to, float top, float ground) {
  const Vec3 side{-away.z, 0, away.x};
  const auto place = [&](float s, float t) {
    const float across = 0.022f * (2 * t - 1), along = from + (to - from) * s;
    const float a = across / 0.021f, end = std::clamp(std::min(s, 1 - s) * (to - from) / 0.006f, 0.0f, 1.0f);
    const float round = std::sqrt(std::max(0.0f, 1 - a * a)) * std::sqrt(end * (2 - end));
    const float h = ground + (top - ground) * std::pow(round, 0.5f) +
                    0.5f * mm * std::sin(430 * along + 3 * std::sin(200 * across)) * round;
    return Vec3{middle.x, 0, middle.z} + away * along + side * across + Vec3{0, h, 0};
  };
  Shape shape;
  add_grid(shape, 24, 28, 0.01f, place, [&](Vec3 p) {
    const float blood = std::clamp(cloth_height(1.9f * p.x + 0.2f, 2.1f * p.z) - 0.45f, 0.0f, 1.0f);
    return lerp(srgb(220, 220, 206), srgb(190, 90, 78), 0.6f * blood);
  });
  return shape;
}

}  // namespace catgut
