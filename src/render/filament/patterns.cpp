// SPDX-License-Identifier: Apache-2.0
// render/filament/environment: the tissue's tileable patterns; see environment.h.
#include <cstdlib>
#include <cstring>
#include <vector>

#include "core/math.h"
#include "render/filament/environment.h"

namespace catgut {
namespace {

using filament::Texture;

constexpr int kSize = 1024;

size_t at(int x, int y) { return size_t(y & (kSize - 1)) * kSize + size_t(x & (kSize - 1)); }

// A separate random generator: textures must not change with the simulation's random numbers.
struct Dice {
  uint32_t state;
  float operator()() {
    state = state * 1664525u + 1013904223u;
    return float(state >> 8) / 16777216.0f;
  }
};

// Smooth noise in 0..1 that repeats after kSize pixels, `cells` cells across.
std::vector<float> noise(int cells, uint32_t seed) {
  Dice dice{seed};
  std::vector<float> corner(size_t(cells * cells));
  for (float& c : corner) c = dice();
  std::vector<float> out(size_t(kSize) * kSize);
  // Across first, one row of cells at a time: the rest is two multiplications per point.
  const auto smooth = [cells](int at, int& cell) {
    const float f = float(at) * float(cells) / kSize, t = f - std::floor(f);
    cell = int(f);
    return t * t * (3 - 2 * t);
  };
  std::vector<float> part(kSize), row(size_t(cells) + 1);
  std::vector<int> cell(kSize);
  for (int x = 0; x < kSize; ++x) part[size_t(x)] = smooth(x, cell[size_t(x)]);
  for (int y = 0; y < kSize; ++y) {
    int iy;
    const float ty = smooth(y, iy);
    for (int i = 0; i <= cells; ++i) {
      const float a = corner[size_t(iy % cells * cells + i % cells)], b = corner[size_t((iy + 1) % cells * cells + i % cells)];
      row[size_t(i)] = a + (b - a) * ty;
    }
    float* to = &out[at(0, y)];
    for (size_t x = 0; x < size_t(kSize); ++x) {
      const float a = row[size_t(cell[x])], b = row[size_t(cell[x]) + 1];
      to[x] = a + (b - a) * part[x];
    }
  }
  return out;
}

std::vector<float> octaves(int cells, int count, float falloff, uint32_t seed) {
  std::vector<float> sum(size_t(kSize) * kSize);
  float weight = 1, total = 0;
  for (int k = 0; k < count; ++k, cells *= 2, weight *= falloff) {
    const std::vector<float> n = noise(cells, seed + uint32_t(k) * 7919u);
    for (size_t i = 0; i < sum.size(); ++i) sum[i] += weight * n[i];
    total += weight;
  }
  for (float& s : sum) s /= total;
  return sum;
}

// One vessel: a meandering stroke that tapers and branches. `vein`: darker and bluer, drawn into its own channel.
struct Vessels {
  std::vector<float> there = std::vector<float>(size_t(kSize) * kSize), vein = std::vector<float>(size_t(kSize) * kSize);
};
void draw_vessel(Vessels& map, Dice& dice, float x, float y, float heading, float width, float reach, float vein, int depth) {
  const float first = heading;
  float turning = 0;
  for (float done = 0; done < reach; done += 1) {
    const float w = std::max(0.55f, width * (1 - 0.8f * done / reach));
    const int r = int(1.8f * w) + 2;
    // Features thinner than a texel are fainter instead.
    const float strength = std::min(1.0f, 0.10f + 0.40f * w) * std::min(1.0f, 4 * (1 - done / reach));
    for (int j = -r; j <= r; ++j)
      for (int i = -r; i <= r; ++i) {
        const float dx = std::floor(x) + float(i) - x, dy = std::floor(y) + float(j) - y;
        const float d2 = (dx * dx + dy * dy) / (w * w);
        if (d2 > 2.2f) continue;
        const float ink = strength * std::exp(-d2 * d2);
        const size_t k = at(int(std::floor(x)) + i, int(std::floor(y)) + j);
        if (ink > map.there[k]) map.there[k] = ink, map.vein[k] = vein;
      }
    x += std::cos(heading);
    y += std::sin(heading);
    turning = 0.90f * turning + 0.045f * (dice() - 0.5f);
    heading += turning + 0.025f * (first - heading);
    if (depth > 0 && done > 0.08f * reach && dice() < 0.020f) {
      const float side = dice() < 0.5f ? -1.0f : 1.0f;
      draw_vessel(map, dice, x, y, heading + side * (0.45f + 0.5f * dice()), 0.62f * w, (0.30f + 0.45f * dice()) * reach, vein,
                  depth - 1);
      heading -= side * 0.15f;
    }
  }
}

// Slopes of a height map, times `scale`.
void slopes(const std::vector<float>& height, float scale, int channel, std::vector<uint8_t>& out) {
  for (int y = 0; y < kSize; ++y)
    for (int x = 0; x < kSize; ++x) {
      const float dx = (height[at(x - 1, y)] - height[at(x + 1, y)]) * scale;
      const float dy = (height[at(x, y - 1)] - height[at(x, y + 1)]) * scale;
      out[at(x, y) * 4 + size_t(channel)] = uint8_t(std::clamp(127.5f + 127.5f * dx, 0.0f, 255.0f));
      out[at(x, y) * 4 + size_t(channel) + 1] = uint8_t(std::clamp(127.5f + 127.5f * dy, 0.0f, 255.0f));
    }
}

Texture* upload(filament::Engine& engine, const std::vector<uint8_t>& pixels) {
  Texture* texture =
      Texture::Builder().width(kSize).height(kSize).levels(0xff).format(Texture::InternalFormat::RGBA8).build(engine);
  void* copy = std::malloc(pixels.size());
  std::memcpy(copy, pixels.data(), pixels.size());
  texture->setImage(engine, 0,
                    Texture::PixelBufferDescriptor(copy, pixels.size(), Texture::Format::RGBA, Texture::Type::UBYTE,
                                                   [](void* p, size_t, void*) { std::free(p); }));
  texture->generateMipmaps(engine);
  return texture;
}

struct Patterns {
  std::vector<uint8_t> pattern, bumps;
};
Patterns make_patterns() {
  const std::vector<float> mottle = octaves(6, 5, 0.66f, 11), blood = octaves(5, 4, 0.55f, 23);
  Vessels vessel;
  Dice dice{5};
  // Straight vessels run round the organ (texture v) from both sides, an artery and its vein together, as they come from the
  // mesentery. Fine ones everywhere between them.
  for (int i = 0; i < 7; ++i) {
    const float x = (float(i) + 0.7f * dice()) * kSize / 7, y = kSize * dice(), way = i % 2 ? 1.57f : -1.57f;
    const float width = 1.9f + 1.6f * dice(), reach = kSize * (0.45f + 0.35f * dice());
    draw_vessel(vessel, dice, x, y, way, 1.25f * width, reach, 1, 2);
    draw_vessel(vessel, dice, x + 3.2f * width, y + 10, way, 0.8f * width, reach, 0, 3);
  }
  for (int i = 0; i < 60; ++i)
    draw_vessel(vessel, dice, kSize * dice(), kSize * dice(), 2 * kPi * dice(), 0.6f + 0.6f * dice(), 60 + 110 * dice(), 0, 2);

  Patterns made{std::vector<uint8_t>(size_t(kSize) * kSize * 4), std::vector<uint8_t>(size_t(kSize) * kSize * 4)};
  std::vector<uint8_t>& pattern = made.pattern;
  for (size_t i = 0; i < mottle.size(); ++i) {
    pattern[i * 4] = uint8_t(255 * std::clamp(1.7f * (mottle[i] - 0.5f) + 0.5f, 0.0f, 1.0f));
    pattern[i * 4 + 1] = uint8_t(255 * std::clamp(vessel.there[i], 0.0f, 1.0f));
    pattern[i * 4 + 2] = uint8_t(255 * std::clamp(2.6f * (blood[i] - 0.5f) + 0.45f, 0.0f, 1.0f));
    pattern[i * 4 + 3] = uint8_t(255 * vessel.vein[i]);
  }

  // Serosa: long soft swellings with a fine grain on them, its vessels a little raised. Mucosa: the folds and pits of a velvety
  // lining.
  const std::vector<float> swelling = octaves(14, 2, 0.5f, 37), grain = octaves(96, 2, 0.6f, 41);
  std::vector<float> serosa(size_t(kSize) * kSize), mucosa = octaves(22, 4, 0.55f, 53);
  for (size_t i = 0; i < serosa.size(); ++i) {
    serosa[i] = 5.0f * swelling[i] + 0.55f * grain[i] + 0.35f * vessel.there[i];
    const float ridge = 1 - std::abs(2 * mucosa[i] - 1);
    mucosa[i] = 4.0f * ridge * ridge;
  }
  slopes(serosa, 2.6f, 0, made.bumps);
  slopes(mucosa, 1.8f, 2, made.bumps);
  return made;
}

}  // namespace

TissueTextures make_tissue_textures(filament::Engine& engine) {
  static const Patterns made = make_patterns();  // shared by all renderers of the program
  return {upload(engine, made.pattern), upload(engine, made.bumps)};
}

}  // namespace catgut
