// SPDX-License-Identifier: Apache-2.0
// render/image: see image.h.
#include "render/image.h"

#include <stb/stb_image.h>
#include <stb/stb_image_write.h>

#include <algorithm>
#include <cstring>
#include <stdexcept>

#include "core/file.h"
#include "render/font.h"

namespace catgut {
namespace {

constexpr int kLetterWidth = 6, kLetterHeight = 8;  // one empty column and row between letters

void blend_pixel(Image& image, int x, int y, Color c) {
  if (x < 0 || y < 0 || x >= image.width || y >= image.height) return;
  uint8_t* p = &image.rgba[(size_t(y) * size_t(image.width) + size_t(x)) * 4];
  for (size_t k = 0; k < 3; ++k) p[k] = uint8_t((p[k] * (255 - c[3]) + c[k] * c[3] + 127) / 255);
  p[3] = 255;
}

}  // namespace

Image make_image(int width, int height, Color fill) {
  Image image{width, height, std::vector<uint8_t>(size_t(width) * size_t(height) * 4)};
  for (size_t i = 0; i < image.rgba.size(); ++i) image.rgba[i] = fill[i % 4];
  return image;
}

Color pixel(const Image& image, int x, int y) {
  if (x < 0 || y < 0 || x >= image.width || y >= image.height) return {};
  const uint8_t* p = &image.rgba[(size_t(y) * size_t(image.width) + size_t(x)) * 4];
  return {p[0], p[1], p[2], p[3]};
}

int text_width(std::string_view text, int scale) { return int(text.size()) * kLetterWidth * scale; }

void draw_text(Image& image, int x, int y, std::string_view text, Color color, int scale) {
  for (const char letter : text) {
    static constexpr uint8_t box[5] = {0x7f, 0x41, 0x41, 0x41, 0x7f};
    const uint8_t* columns = letter >= 32 && letter <= 126 ? kFont5x7[letter - 32] : box;
    for (int i = 0; i < 5; ++i)
      for (int j = 0; j < 7; ++j)
        if (columns[i] >> j & 1)
          for (int a = 0; a < scale; ++a)
            for (int b = 0; b < scale; ++b) blend_pixel(image, x + i * scale + a, y + j * scale + b, color);
    x += kLetterWidth * scale;
  }
}

void draw_caption(Image& image, std::string_view text) {
  if (text.empty()) return;
  const int scale = std::max(1, image.height / 240), band = (kLetterHeight + 5) * scale;
  for (int y = image.height - band; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) blend_pixel(image, x, y, {8, 12, 14, 150});
  draw_text(image, 4 * scale, image.height - band + 3 * scale, text, {240, 244, 240, 255}, scale);
}

void paste(Image& to, const Image& from, int x, int y) {
  const int left = std::max(0, -x), right = std::min(from.width, to.width - x);
  if (right <= left) return;
  for (int j = std::max(0, -y); j < std::min(from.height, to.height - y); ++j)
    std::memcpy(&to.rgba[(size_t(y + j) * size_t(to.width) + size_t(x + left)) * 4],
                &from.rgba[(size_t(j) * size_t(from.width) + size_t(left)) * 4], size_t(right - left) * 4);
}

Image contact_sheet(std::span<const SheetCell> cells, int columns) {
  columns = std::clamp(columns, 1, std::max(1, int(cells.size())));
  int w = 1, h = 1;
  for (const SheetCell& cell : cells) w = std::max(w, cell.picture.width), h = std::max(h, cell.picture.height);
  // Letters that can be read where the sheet is shown at half its size.
  const int gap = 6, large = std::max(1, w / 240), caption = kLetterHeight * large + 8;
  const int rows = (int(cells.size()) + columns - 1) / columns;
  Image sheet = make_image(gap + columns * (w + gap), gap + rows * (h + caption + gap), {24, 28, 30, 255});
  for (int i = 0; i < int(cells.size()); ++i) {
    const int x = gap + i % columns * (w + gap), y = gap + i / columns * (h + caption + gap);
    paste(sheet, cells[size_t(i)].picture, x, y);
    // A caption wider than its image would overlap the next cell's.
    const std::string_view text = cells[size_t(i)].caption;
    int scale = large;
    while (scale > 1 && text_width(text, scale) > w - 4) --scale;
    draw_text(sheet, x + 2, y + h + 5, text.substr(0, size_t(w / (kLetterWidth * scale))), {235, 238, 232, 255}, scale);
  }
  return sheet;
}

void write_png(const Image& image, const std::string& path) {
  if (image.width <= 0 || image.height <= 0 || image.rgba.size() != size_t(image.width) * size_t(image.height) * 4)
    throw std::runtime_error(path + ": the picture to write is empty");
  std::string bytes;
  const auto append = [](void* to, void* data, int size) {
    static_cast<std::string*>(to)->append(static_cast<const char*>(data), static_cast<size_t>(size));
  };
  if (!stbi_write_png_to_func(append, &bytes, image.width, image.height, 4, image.rgba.data(), image.width * 4))
    throw std::runtime_error(path + ": the image cannot be encoded");
  write_file(path, bytes);
}

Image read_png(const std::string& path) {
  Image image;
  int channels = 0;
  uint8_t* data = stbi_load(path.c_str(), &image.width, &image.height, &channels, 4);
  if (!data) throw std::runtime_error(path + ": cannot read the picture: " + stbi_failure_reason());
  image.rgba.assign(data, data + size_t(image.width) * size_t(image.height) * 4);
  stbi_image_free(data);
  return image;
}

}  // namespace catgut
