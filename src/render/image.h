// SPDX-License-Identifier: Apache-2.0
// render/image: finished pictures as plain pixels; captions, contact sheets and PNG files. Knows nothing of the scene.
// Reads and writes files only in write_png and read_png. Errors are std::runtime_error with one line to act on.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace catgut {

struct Image {
  int width = 0, height = 0;
  std::vector<uint8_t> rgba;  // sRGB, rows from the top, 4 bytes a pixel
};
using Color = std::array<uint8_t, 4>;

Image make_image(int width, int height, Color fill);
Color pixel(const Image& image, int x, int y);

// Draws `text` with its top left corner at (x, y); one letter is 6 x 8 pixels times `scale`. Letters outside the picture are
// clipped, characters the font lacks become a box.
void draw_text(Image& image, int x, int y, std::string_view text, Color color, int scale = 1);
int text_width(std::string_view text, int scale = 1);

// A caption on a darkened band along the bottom: readable on any picture.
void draw_caption(Image& image, std::string_view text);

// Copies `from` into `to` with its top left corner at (x, y).
void paste(Image& to, const Image& from, int x, int y);

struct SheetCell {
  Image picture;
  std::string caption;
};
// A grid of pictures with the caption under each, `columns` wide: one file that reports how a run went.
Image contact_sheet(std::span<const SheetCell> cells, int columns);

// Replaces the file as a whole (core/file). Throws std::runtime_error, InputError for what the disk or the path refuses.
void write_png(const Image& image, const std::string& path);
Image read_png(const std::string& path);

}  // namespace catgut
