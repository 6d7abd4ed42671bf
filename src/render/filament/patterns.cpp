// render/filament/environment: the tissue's tileable patterns; see environment.h.
#include <cstdlib>
#include <cstring>
#include <vector>

#include "core/math.h"
#include "render/filament/environment.h"

namespace catgut {
namespace {

using filament::Texture;

constexpr int kSize = 512;

size_t at(int x, int y) { return size_t(y & (kSize - 1)) * kSize + size_t(x & (kSize - 1)); }

// A small generator of its own: the pictures' patterns must not move when the simulation's random numbers do.
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
  for (int y = 0; y < kSize; ++y)
    for (int x = 0; x < kSize; ++x) {
      const float fx = float(x) * float(cells) / kSize, fy = float(y) * float(cells) / kSize;
      const int ix = int(fx), iy = int(fy);
      float tx = fx - float(ix), ty = fy - float(iy);
      tx = tx * tx * (3 - 2 * tx);
      ty = ty * ty * (3 - 2 * ty);
      const auto c = [&](int i, int j) { return corner[size_t((iy + j) % cells * cells + (ix + i) % cells)]; };
      out[at(x, y)] = (c(0, 0) * (1 - tx) + c(1, 0) * tx) * (1 - ty) + (c(0, 1) * (1 - tx) + c(1, 1) * tx) * ty;
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

// One vessel: a wandering stroke that thins and throws off branches.
void draw_vessel(std::vector<float>& map, Dice& dice, float x, float y, float heading, float width, float reach, int depth) {
  const float first = heading;
  for (float done = 0; done < reach; done += 1) {
    const float w = width * (1 - 0.75f * done / reach);
    const int r = int(w) + 2;
    for (int j = -r; j <= r; ++j)
      for (int i = -r; i <= r; ++i) {
        const float dx = std::floor(x) + float(i) - x, dy = std::floor(y) + float(j) - y;
        const float d2 = (dx * dx + dy * dy) / (w * w);
        float& m = map[at(int(std::floor(x)) + i, int(std::floor(y)) + j)];
        m = std::max(m, std::min(1.0f, 0.30f + 0.42f * w) * std::exp(-d2));
      }
    x += std::cos(heading);
    y += std::sin(heading);
    heading += 0.28f * (dice() - 0.5f) + 0.04f * (first - heading);
    if (depth > 0 && dice() < 0.022f) {
      const float side = dice() < 0.5f ? -1.0f : 1.0f;
      draw_vessel(map, dice, x, y, heading + side * (0.5f + 0.6f * dice()), 0.68f * w, (0.25f + 0.4f * dice()) * reach,
                  depth - 1);
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

}  // namespace

TissueTextures make_tissue_textures(filament::Engine& engine) {
  const std::vector<float> mottle = octaves(4, 6, 0.62f, 11), blood = octaves(3, 4, 0.55f, 23);
  std::vector<float> vessel(size_t(kSize) * kSize);
  Dice dice{5};
  // Trunks run round the organ (texture v) from both sides, as they come from the mesentery; fine ones everywhere.
  for (int i = 0; i < 5; ++i)
    draw_vessel(vessel, dice, (float(i) + 0.6f * dice()) * kSize / 5, kSize * dice(), dice() < 0.5f ? 1.57f : -1.57f,
                2.0f + 1.4f * dice(), kSize * (0.6f + 0.4f * dice()), 3);
  for (int i = 0; i < 26; ++i)
    draw_vessel(vessel, dice, kSize * dice(), kSize * dice(), 2 * kPi * dice(), 0.7f + 0.5f * dice(), 90 + 80 * dice(), 1);

  std::vector<uint8_t> pattern(size_t(kSize) * kSize * 4, 255);
  for (size_t i = 0; i < mottle.size(); ++i) {
    pattern[i * 4] = uint8_t(255 * std::clamp(1.6f * (mottle[i] - 0.5f) + 0.5f, 0.0f, 1.0f));
    pattern[i * 4 + 1] = uint8_t(255 * std::clamp(vessel[i], 0.0f, 1.0f));
    pattern[i * 4 + 2] = uint8_t(255 * std::clamp(2.4f * (blood[i] - 0.5f) + 0.4f, 0.0f, 1.0f));
  }

  // Serosa: fine grain, its vessels a little raised. Mucosa: the folds and pits of a velvety lining.
  std::vector<float> serosa = octaves(7, 4, 0.5f, 37), mucosa = octaves(12, 4, 0.5f, 53);
  for (size_t i = 0; i < serosa.size(); ++i) {
    serosa[i] = 3.2f * serosa[i] + 0.25f * vessel[i];
    const float ridge = 1 - std::abs(2 * mucosa[i] - 1);
    mucosa[i] = 4.0f * ridge * ridge;
  }
  std::vector<uint8_t> bumps(size_t(kSize) * kSize * 4);
  slopes(serosa, 2.2f, 0, bumps);
  slopes(mucosa, 1.6f, 2, bumps);
  return {upload(engine, pattern), upload(engine, bumps)};
}

}  // namespace catgut
