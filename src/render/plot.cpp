// SPDX-License-Identifier: Apache-2.0
// render/plot: see plot.h.
#include "render/plot.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace catgut {
namespace {

constexpr Color kPaper{252, 252, 250, 255}, kInk{40, 44, 48, 255}, kFaint{226, 228, 226, 255}, kLevel{150, 60, 50, 255};
constexpr int kKeyLine = 14;  // [pixels] a line of the key

void dot(Image& image, int x, int y, Color c) {
  if (x < 0 || y < 0 || x >= image.width || y >= image.height) return;
  std::copy(c.begin(), c.end(), image.rgba.begin() + (std::ptrdiff_t{y} * image.width + x) * 4);
}

// dash: number of pixels drawn, then not drawn; 0: solid.
void line(Image& image, int x0, int y0, int x1, int y1, Color c, int thick = 1, int dash = 0) {
  const int steps = std::max({std::abs(x1 - x0), std::abs(y1 - y0), 1});
  for (int i = 0; i <= steps; ++i) {
    if (dash > 0 && i / dash % 2 != 0) continue;
    const double part = static_cast<double>(i) / steps;
    const int x = static_cast<int>(std::lround(x0 + part * (x1 - x0))),
              y = static_cast<int>(std::lround(y0 + part * (y1 - y0)));
    for (int a = 0; a < thick; ++a)
      for (int b = 0; b < thick; ++b) dot(image, x + a, y + b, c);
  }
}

// 1, 2 or 5 times a power of ten, giving `most` steps at most.
double step_of(double range, int most) {
  double step = std::pow(10.0, std::floor(std::log10(range / most)));
  for (int k = 0; range / step > most; ++k) step *= k % 3 == 1 ? 2.5 : 2;
  return step;
}

std::string number(double v) {
  char text[32];
  std::snprintf(text, sizeof text, "%g", v);
  return text;
}

}  // namespace

Image draw_plot(const Plot& plot, int width, int height) {
  Image image = make_image(width, height, kPaper);
  const bool linear = plot.y_axis == PlotAxis::linear;
  double x_seen = 0, least = 1e300, most = 0;
  const auto see = [&](double y) {
    if (y > 0) least = std::min(least, y), most = std::max(most, y);
  };
  for (const PlotCurve& c : plot.curve)
    for (const auto& p : c.point) x_seen = std::max(x_seen, p[0]), see(p[1]);
  for (const PlotLevel& l : plot.level) see(l.y);
  for (const PlotBand& b : plot.band) {
    x_seen = std::max(x_seen, b.to);
    for (const auto& y : {b.low, b.high}) see(y[0]), see(y[1]);
  }
  if (most <= 0) least = most = 1;
  const double x_most = plot.x_most > 0 ? plot.x_most : x_seen > 0 ? x_seen : 1, y_most = plot.y_most > 0 ? plot.y_most : most;
  const int low = static_cast<int>(std::floor(std::log10(least))),
            high = std::max(low + 1, static_cast<int>(std::ceil(std::log10(most))));

  const int left = 52, right = width - 16, top = 34, bottom = height - 56 - kKeyLine * static_cast<int>(plot.band.size());
  const auto at_x = [&](double x) { return left + static_cast<int>(std::lround(x / x_most * (right - left))); };
  const auto at_y = [&](double y) {
    const double part =
        linear ? std::clamp(y / y_most, 0.0, 1.0) : (std::log10(std::max(y, std::pow(10.0, low))) - low) / (high - low);
    return bottom - static_cast<int>(std::lround(part * (bottom - top)));
  };

  int key = height - 18 - kKeyLine * static_cast<int>(plot.band.size());
  for (const PlotBand& b : plot.band) {
    for (int x = std::max(left, at_x(b.from)); x <= std::min(right, at_x(b.to)); ++x) {
      const double part = (x - at_x(b.from)) / std::max(1.0, static_cast<double>(at_x(b.to) - at_x(b.from)));
      const auto along = [&](const std::array<double, 2>& y) { return at_y(y[0] + part * (y[1] - y[0])); };
      for (int y = along(b.high); y <= along(b.low); ++y) dot(image, x, y, b.color);
    }
    line(image, left, key, left + 12, key, b.color, 8);
    draw_text(image, left + 28, key, b.name, kInk);
    key += kKeyLine;
  }
  const auto rule = [&](double y, bool named) {
    line(image, left, at_y(y), right, at_y(y), kFaint);
    if (!named) return;
    const std::string text = number(y);
    draw_text(image, left - 6 - text_width(text), at_y(y) - 3, text, kInk);
  };
  if (linear) {
    const double up = step_of(y_most, 8);
    for (int k = 0; k * up <= y_most * (1 + 1e-9); ++k) rule(k * up, true);
  } else {
    for (int decade = low; decade <= high; ++decade)
      for (int k = 1; k < (decade == high ? 2 : 10); ++k) rule(k * std::pow(10.0, decade), k == 1 || k == 2 || k == 5);
  }
  const double step = std::max(1.0, step_of(x_most, 12));  // whole numbers for counts
  for (double x = 0; x <= x_most; x += step) {
    line(image, at_x(x), top, at_x(x), bottom, kFaint);
    const std::string text = number(x);
    draw_text(image, at_x(x) - text_width(text) / 2, bottom + 6, text, kInk);
  }
  line(image, left, top, left, bottom, kInk);
  line(image, left, bottom, right, bottom, kInk);

  for (const PlotLevel& l : plot.level) {
    line(image, left, at_y(l.y), right, at_y(l.y), kLevel, 1, 5);
    draw_text(image, right - 4 - text_width(l.name), at_y(l.y) - 10, l.name, kLevel);
  }
  for (const PlotCurve& c : plot.curve) {
    const std::array<double, 2>* before = nullptr;
    for (const auto& p : c.point) {
      if (!linear && p[1] <= 0) continue;
      if (p[0] > x_most) {
        before = nullptr;
        continue;
      }
      const int x = at_x(p[0]), y = at_y(p[1]);
      if (!c.joined) {
        line(image, x - 3, y - 3, x + 3, y + 3, c.color, 2);
        line(image, x - 3, y + 3, x + 3, y - 3, c.color, 2);
      } else {
        if (before) line(image, at_x((*before)[0]), at_y((*before)[1]), x, y, c.color, 2);
        for (int a = -1; c.dots && a <= 2; ++a)
          for (int b = -1; b <= 2; ++b) dot(image, x + a, y + b, c.color);
      }
      before = &p;
    }
  }

  draw_text(image, left, 12, plot.title, kInk);
  draw_text(image, 6, top - 12, plot.y_name, kInk);
  draw_text(image, (left + right - text_width(plot.x_name)) / 2, bottom + 20, plot.x_name, kInk);
  int x = left;
  for (const PlotCurve& c : plot.curve) {
    line(image, x, height - 16, x + 12, height - 16, c.color, 3);
    draw_text(image, x + 18, height - 18, c.name, kInk);
    x += 18 + text_width(c.name) + 18;
  }
  return image;
}

}  // namespace catgut
