// SPDX-License-Identifier: Apache-2.0
// render: a small plot: curves over a common x axis, a logarithmic or linear y axis, shaded bands and level lines with a name.
// For reports of the program itself; needs neither a graphics card nor a font file.
#pragma once
#include <array>
#include <string>
#include <vector>

#include "render/image.h"

namespace catgut {

struct PlotCurve {
  std::string name;
  Color color{};
  std::vector<std::array<double, 2>> point;  // on a logarithmic axis only values above 0, others are omitted
  bool joined = true;                        // false: points only, as crosses
  bool dots = true;                          // on a joined curve: marks its points
};
struct PlotLevel {
  std::string name;
  double y = 0;
};
// The expected range between `from` and `to`, behind the curves: from `low` to `high` at either end. Its name is in the key.
struct PlotBand {
  std::string name;
  Color color{};
  double from = 0, to = 0;
  std::array<double, 2> low{}, high{};
};
enum class PlotAxis { logarithmic, linear };
struct Plot {
  std::string title, x_name, y_name;
  std::vector<PlotCurve> curve;
  std::vector<PlotLevel> level;
  std::vector<PlotBand> band;
  PlotAxis y_axis = PlotAxis::logarithmic;
  // Limits of the axes; 0: automatic. Beyond x_most nothing is drawn, beyond y_most along the edge.
  double x_most = 0, y_most = 0;
};

// The x axis starts at 0, and so does a linear y axis; a logarithmic one has whole decades, for any y_most.
Image draw_plot(const Plot& plot, int width = 720, int height = 420);

}  // namespace catgut
