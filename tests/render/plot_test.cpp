// SPDX-License-Identifier: Apache-2.0
// tests/render: positions in a plot. Plain pixels: no driver, no file.
#include "render/plot.h"

#include <gtest/gtest.h>

namespace catgut {
namespace {

constexpr Color kBlue{0, 0, 255, 255}, kRed{255, 0, 0, 255}, kGreen{0, 160, 0, 255};

// Position of the axes in plot.cpp: room for numbers at the left and below, a line of the key for every band.
struct Box {
  int left = 52, right = 0, top = 34, bottom = 0;
};
Box box_of(const Image& image, const Plot& plot) {
  Box box;
  box.right = image.width - 16;
  box.bottom = image.height - 56 - 14 * static_cast<int>(plot.band.size());
  return box;
}

size_t count(const Image& image, Color c, int x0, int x1, int y0, int y1) {
  size_t n = 0;
  for (int y = y0; y <= y1; ++y)
    for (int x = x0; x <= x1; ++x) n += pixel(image, x, y) == c;
  return n;
}

// The rows that hold the color in a column of the plot.
std::array<int, 2> rows(const Image& image, const Box& box, int x, Color c) {
  std::array<int, 2> found{-1, -1};
  for (int y = box.top; y <= box.bottom; ++y)
    if (pixel(image, x, y) == c) found = {found[0] < 0 ? y : found[0], y};
  return found;
}

TEST(Plot, a_logarithmic_axis_holds_whole_decades) {
  Plot plot;
  plot.curve = {{"flat", kBlue, {{0, 10}, {1, 0}, {10, 10}}}};
  plot.level = {{"limit", 30}};
  const Image image = draw_plot(plot);
  const Box box = box_of(image, plot);
  // From 10 to 100: the curve lies on the axis, the zero between its points is left out.
  for (const int x : {box.left + 20, (box.left + box.right) / 2, box.right - 20})
    EXPECT_EQ(rows(image, box, x, kBlue)[0], box.bottom) << x;
}

TEST(Plot, a_linear_axis_begins_at_zero_and_a_band_lies_behind_the_curve) {
  Plot plot;
  plot.y_axis = PlotAxis::linear;
  plot.curve = {{"half", kBlue, {{0, 2}, {10, 2}}, true, false}};
  plot.band = {{"expected", kGreen, 5, 10, {1, 2}, {3, 4}}};
  plot.y_most = 4;
  const Image image = draw_plot(plot);
  const Box box = box_of(image, plot);
  const auto at_x = [&](double x) { return box.left + static_cast<int>(x / 10 * (box.right - box.left)); };
  const auto at_y = [&](double y) { return box.bottom - y / 4 * (box.bottom - box.top); };
  EXPECT_NEAR(rows(image, box, at_x(2.2), kBlue)[0], at_y(2), 1);
  EXPECT_EQ(count(image, kGreen, box.left, at_x(5) - 2, box.top, box.bottom), 0u) << "no band before it begins";
  // Its height runs from 1..3 at one end to 2..4 at the other; the curve is drawn over it.
  const std::array<int, 2> begin = rows(image, box, at_x(5) + 2, kGreen), middle = rows(image, box, at_x(7.6), kGreen);
  EXPECT_NEAR(begin[0], at_y(3), 3);
  EXPECT_NEAR(begin[1], at_y(1), 3);
  EXPECT_NEAR(middle[0], at_y(3.5), 3);
  EXPECT_NEAR(middle[1], at_y(1.5), 3);
  EXPECT_NEAR(rows(image, box, at_x(7.6), kBlue)[0], at_y(2), 1);
  EXPECT_GT(count(image, kGreen, box.left, box.right, box.bottom + 1, image.height - 1), 50u) << "and it stands in the key";
}

TEST(Plot, nothing_is_drawn_beyond_the_axes) {
  Plot plot;
  plot.y_axis = PlotAxis::linear;
  plot.curve = {{"out and in again", kBlue, {{0, 1}, {4, 9}, {6, 1}, {20, 1}, {8, 1}, {9, 1}}, true, false},
                {"far out", kRed, {{11, 1}, {12, 1}}}};
  plot.band = {{"too long", kGreen, -5, 40, {1, 1}, {2, 2}}};
  plot.x_most = 10, plot.y_most = 4;
  const Image image = draw_plot(plot);
  const Box box = box_of(image, plot);
  for (const Color c : {kBlue, kRed, kGreen}) {
    EXPECT_EQ(count(image, c, box.right + 2, image.width - 1, 0, box.bottom), 0u);
    EXPECT_EQ(count(image, c, 0, image.width - 1, 0, box.top - 1), 0u);
    EXPECT_EQ(count(image, c, 0, box.left - 1, 0, box.bottom), 0u);
  }
  EXPECT_EQ(count(image, kRed, box.left, box.right, box.top, box.bottom), 0u);
  const auto at_x = [&](double x) { return box.left + static_cast<int>(x / 10 * (box.right - box.left)); };
  EXPECT_GE(rows(image, box, at_x(4), kBlue)[0], box.top) << "too high: along the edge";
  EXPECT_EQ(rows(image, box, at_x(7), kBlue)[0], -1) << "the way out and back is not drawn across";
  EXPECT_NE(rows(image, box, at_x(8.5), kBlue)[0], -1);
}

TEST(Plot, an_empty_one_is_a_picture_too) {
  for (const PlotAxis axis : {PlotAxis::logarithmic, PlotAxis::linear}) {
    Plot plot;
    plot.y_axis = axis;
    plot.curve = {{"nothing", kBlue, {}}};
    plot.band = {{"none", kGreen, 0, 0, {0, 0}, {0, 0}}};
    const Image image = draw_plot(plot, 300, 200);
    EXPECT_EQ(image.width, 300);
    EXPECT_EQ(image.height, 200);
  }
}

}  // namespace
}  // namespace catgut
