// SPDX-License-Identifier: Apache-2.0
// render/filament/environment: a theatre lamp, a ring of dimmer lamps, pale walls and a green floor. Reflections make wet
// tissue look wet and steel look like steel.
#include "render/filament/environment.h"

#include <array>
#include <cstdlib>
#include <cstring>
#include <vector>

#include <math/vec3.h>

#include "core/math.h"

namespace catgut {
namespace {

using filament::Texture;

constexpr Vec3 kCool{0.92f, 0.97f, 1.0f};

float smooth_step(float a, float b, float x) {
  const float t = std::clamp((x - a) / (b - a), 0.0f, 1.0f);
  return t * t * (3 - 2 * t);
}

// The main lamp's cluster of round heads, and a satellite. full, fade: cosines of the angles of full brightness and of the
// end of a head.
struct Head {
  Vec3 middle, light;
  float full, fade;
};
const std::vector<Head>& heads() {
  static const std::vector<Head> all = [] {
    std::vector<Head> made;
    const auto head = [&](Vec3 middle, float radius, float glow, Vec3 tint) {
      made.push_back({normalized(middle), tint * glow, std::cos(0.8f * radius), std::cos(1.1f * radius)});
    };
    const Vec3 warm{1.0f, 0.96f, 0.90f};
    for (int i = 0; i < 6; ++i) {
      const float a = 2 * kPi * float(i) / 6;
      head({0.30f + 0.27f * std::cos(a), 1, 0.50f + 0.27f * std::sin(a)}, 0.075f, 13, warm);
    }
    head({0.30f, 1, 0.50f}, 0.075f, 13, warm);
    head({-0.95f, 0.8f, -0.5f}, 0.16f, 6, kCool);
    return made;
  }();
  return all;
}

// Radiance from direction d, in units of the environment's intensity.
Vec3 radiance(Vec3 d) {
  // Walls: pale above the horizon, the drape's green from below.
  const Vec3 ceiling{0.92f, 0.96f, 1.00f}, wall{0.54f, 0.58f, 0.60f}, floor{0.20f, 0.26f, 0.25f};
  // Gowned people round the table: a dim band with gaps, at the height that instruments reflect.
  const float people = smooth_step(-0.15f, 0.05f, d.y) * (1 - smooth_step(0.25f, 0.45f, d.y)) *
                       smooth_step(-0.2f, 0.5f, std::sin(5 * std::atan2(d.x, d.z) + 0.6f));
  Vec3 c = d.y > 0 ? lerp(wall, ceiling, d.y) : lerp(wall * 0.75f, floor, smooth_step(0, 0.45f, -d.y));
  c = lerp(c, {0.10f, 0.16f, 0.17f}, 0.8f * people);
  for (const Head& h : heads()) {
    const float near = dot(d, h.middle);
    if (near > h.fade) c += h.light * smooth_step(h.fade, h.full, near);
  }
  // A light panel along the wall behind the surgeon: the long highlight on instruments.
  if (d.z > 0.3f) {
    const float up = std::abs(d.y / d.z - 0.55f), across = std::abs(d.x / d.z);
    c += kCool * (2.4f * (1 - smooth_step(0.03f, 0.14f, up)) * (1 - smooth_step(0.5f, 1.0f, across)));
  }
  return c;
}

Vec3 cube_direction(int face, float s, float t) {  // s, t in -1..1, rows from the top, OpenGL's convention
  switch (face) {
    case 0:
      return normalized(Vec3{1, -t, -s});
    case 1:
      return normalized(Vec3{-1, -t, s});
    case 2:
      return normalized(Vec3{s, 1, t});
    case 3:
      return normalized(Vec3{s, -1, -t});
    case 4:
      return normalized(Vec3{s, -t, 1});
    default:
      return normalized(Vec3{-s, -t, -1});
  }
}

float radical_inverse(uint32_t i) {
  i = (i << 16) | (i >> 16);
  i = ((i & 0x55555555u) << 1) | ((i & 0xAAAAAAAAu) >> 1);
  i = ((i & 0x33333333u) << 2) | ((i & 0xCCCCCCCCu) >> 2);
  i = ((i & 0x0F0F0F0Fu) << 4) | ((i & 0xF0F0F0F0u) >> 4);
  i = ((i & 0x00FF00FFu) << 8) | ((i & 0xFF00FF00u) >> 8);
  return float(i) * 2.3283064e-10f;
}

// Reflected radiance of a surface of that roughness toward n: the environment weighted by GGX (split-sum prefilter).
Vec3 blurred(Vec3 n, float roughness, uint32_t samples) {
  const Vec3 side = any_perpendicular(n), up = cross(n, side);
  const float a2 = roughness * roughness;
  Vec3 sum;
  float weight = 0;
  for (uint32_t i = 0; i < samples; ++i) {
    const float u = (float(i) + 0.5f) / float(samples), phi = 2 * kPi * radical_inverse(i);
    const float cos_h = std::sqrt((1 - u) / (1 + (a2 - 1) * u)), sin_h = std::sqrt(std::max(0.0f, 1 - cos_h * cos_h));
    const Vec3 h = side * (sin_h * std::cos(phi)) + up * (sin_h * std::sin(phi)) + n * cos_h;
    const Vec3 l = h * (2 * cos_h) - n;
    const float w = dot(l, n);
    if (w > 0) sum += radiance(normalized(l)) * w, weight += w;
  }
  return sum / std::max(weight, 1e-6f);
}

constexpr int levels = 5, base = 128;
using Mirrored = std::array<std::vector<float>, levels>;

// Filament looks up level (levels - 1) * q (2 - q) for perceptual roughness q: solved for q at each level.
Mirrored mirror_environment() {
  Mirrored all;
  for (int level = 0; level < levels; ++level) {
    const int size = base >> level;
    const float lod = float(level) / float(levels - 1), q = 1 - std::sqrt(1 - lod), roughness = std::max(q * q, 1e-4f);
    std::vector<float>& pixels = all[size_t(level)];
    pixels.reserve(size_t(6 * size * size * 3));
    for (int face = 0; face < 6; ++face)
      for (int y = 0; y < size; ++y)
        for (int x = 0; x < size; ++x) {
          const Vec3 d = cube_direction(face, 2 * (float(x) + 0.5f) / float(size) - 1, 2 * (float(y) + 0.5f) / float(size) - 1);
          const Vec3 c = level == 0 ? radiance(d) : blurred(d, roughness, level == 1 ? 48 : 128);
          pixels.insert(pixels.end(), {c.x, c.y, c.z});
        }
  }
  return all;
}

Texture::PixelBufferDescriptor floats(const std::vector<float>& data) {
  const size_t bytes = data.size() * sizeof(float);
  void* copy = std::malloc(bytes);
  std::memcpy(copy, data.data(), bytes);
  return {copy, bytes, Texture::Format::RGB, Texture::Type::FLOAT, [](void* p, size_t, void*) { std::free(p); }};
}

}  // namespace

Environment make_environment(filament::Engine& engine, float intensity) {
  Environment environment;
  environment.reflections = Texture::Builder()
                                .width(base)
                                .height(base)
                                .levels(levels)
                                .sampler(Texture::Sampler::SAMPLER_CUBEMAP)
                                .format(Texture::InternalFormat::R11F_G11F_B10F)
                                .build(engine);
  static const Mirrored mirrored = mirror_environment();  // shared by all renderers of the program
  for (int level = 0; level < levels; ++level)
    environment.reflections->setImage(engine, size_t(level), floats(mirrored[size_t(level)]),
                                      Texture::FaceOffsets(size_t((base >> level) * (base >> level) * 12)));

  // Diffuse light: the first nine spherical harmonics of the radiance. The lamps are excluded, because a shadow-casting lamp
  // represents them: radiance brighter than the walls is cut off.
  filament::math::float3 sh[9] = {};
  constexpr int n = 64;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < 2 * n; ++j) {
      const float y = 1 - 2 * (float(i) + 0.5f) / n, a = kPi * (float(j) + 0.5f) / n, r = std::sqrt(1 - y * y);
      const Vec3 d{r * std::cos(a), y, r * std::sin(a)};
      Vec3 c = radiance(d);
      c = {std::min(c.x, 1.6f), std::min(c.y, 1.6f), std::min(c.z, 1.6f)};
      const float w = 4 * kPi / float(2 * n * n);
      const float basis[9] = {0.282095f,
                              0.488603f * d.y,
                              0.488603f * d.z,
                              0.488603f * d.x,
                              1.092548f * d.x * d.y,
                              1.092548f * d.y * d.z,
                              0.315392f * (3 * d.z * d.z - 1),
                              1.092548f * d.x * d.z,
                              0.546274f * (d.x * d.x - d.y * d.y)};
      for (int k = 0; k < 9; ++k) sh[k] += filament::math::float3{c.x, c.y, c.z} * (basis[k] * w);
    }
  environment.light = filament::IndirectLight::Builder()
                          .reflections(environment.reflections)
                          .radiance(3, sh)
                          .intensity(intensity)
                          .build(engine);
  return environment;
}

}  // namespace catgut
