// SPDX-License-Identifier: Apache-2.0
// render/image: finished images as plain pixels; captions, contact sheets and PNG files. Independent of the scene.
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

// Draws `text` with its top left corner at (x, y); one letter is 6 x 8 pixels times `scale`. Letters outside the image are
// clipped; unknown characters become a box.
void draw_text(Image& image, int x, int y, std::string_view text, Color color, int scale = 1);
int text_width(std::string_view text, int scale = 1);

// A caption on a darkened band along the bottom: readable on any image.
void draw_caption(Image& image, std::string_view text);

// Copies `from` into `to` with its top left corner at (x, y).
void paste(Image& to, const Image& from, int x, int y);

struct SheetCell {
  Image picture;
  std::string caption;
};
// A grid of images with a caption under each, `columns` wide: one file that summarizes a run.
Image contact_sheet(std::span<const SheetCell> cells, int columns);

// Replaces the file atomically (core/file). Throws std::runtime_error, or InputError for an invalid path or a full disk.
void write_png(const Image& image, const std::string& path);
Image read_png(const std::string& path);

}  // namespace catgut
