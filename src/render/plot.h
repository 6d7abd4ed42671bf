// render: a small plot: curves over a common x axis, a logarithmic y axis, level lines with a name. For reports of the program
// itself; needs neither a graphics card nor a font file.
#pragma once
#include <array>
#include <string>
#include <vector>

#include "render/image.h"

namespace catgut {

struct PlotCurve {
  std::string name;
  Colour colour{};
  std::vector<std::array<double, 2>> point;  // x ascending; y above 0, others are left out
  bool joined = true;                        // false: points alone, as crosses
};
struct PlotLevel {
  std::string name;
  double y = 0;
};
struct Plot {
  std::string title, x_name, y_name;
  std::vector<PlotCurve> curve;
  std::vector<PlotLevel> level;
};

// The axes hold every point and every level; y in whole decades.
Image draw_plot(const Plot& plot, int width = 720, int height = 420);

}  // namespace catgut
