// SPDX-License-Identifier: Apache-2.0
// app/window: panels of the work as data, and their places round the work: never over another panel, never over the points that
// the user looks at. Pure: the window draws the result, a headset may draw it in space, tests compare rectangles.
#pragma once
#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "device/steer.h"
#include "exchange/picture.h"

namespace catgut {

enum class Tone { normal, quiet, accent, bad };

struct PanelLine {
  Tone tone = Tone::normal;
  std::string text;
};

struct Panel {
  std::string name;
  std::vector<PanelLine> line;
  size_t keep = 0;      // first lines, shown alone where there is no room for all; 0: then the panel is hidden
  float progress = -1;  // 0..1: a bar above the lines; below 0: none
  float x = 0, y = 0;   // preferred place: 0 left or top, 1 right or bottom
  size_t columns = 0;   // lines are wrapped to so many characters; 0: not wrapped
  float alpha = 0.6f;
};

struct TextSize {
  float character = 8;           // [pixels] width
  float line = 20;               // [pixels] from one line to the next
  float pad_x = 12, pad_y = 10;  // [pixels] between border and text
};

struct PanelRect {
  float x = 0, y = 0, w = 0, h = 0;  // [pixels]
  bool holds(float px, float py, float margin = 0) const {
    return px > x - margin && px < x + w + margin && py > y - margin && py < y + h + margin;
  }
  bool meets(const PanelRect& o, float gap = 0) const {
    return x < o.x + o.w + gap && o.x < x + w + gap && y < o.y + o.h + gap && o.y < y + h + gap;
  }
};

struct PlacedPanel {
  std::string name;
  PanelRect rect;
  std::vector<PanelLine> line;  // wrapped
  float progress = -1, alpha = 0.6f;
};

// Points of the work on the screen [pixels]: needle tip, suture points, the jaws of both tools, the stitch, the tail, the
// planned bite.
using ScreenPoint = std::array<float, 2>;
std::vector<ScreenPoint> work_points(const Snapshot& seen, const PictureModel& picture, const ViewFrame& view, float width,
                                     float height, const BiteGuide* guide);
// A point of space on the screen; false: behind the eye or outside the window.
bool on_screen(Vec3 p, const ViewFrame& view, float width, float height, ScreenPoint& out);

// Places panels in the order of their importance; of several with one name the first that fits. clear: points that stay
// uncovered. before: the last result; a panel stays in its place as long as it covers nothing.
std::vector<PlacedPanel> place_panels(std::span<const Panel> panels, float width, float height, const TextSize& text,
                                      std::span<const ScreenPoint> clear, std::span<const PlacedPanel> before = {});

// Place of the square magnifier: at the window's border, near the needle's tip, over no panel and no point of `clear`. It keeps
// its last place while that is free. Empty if no place is free.
std::optional<PanelRect> place_inset(float side, float width, float height, ScreenPoint tip, std::span<const ScreenPoint> clear,
                                     std::span<const PlacedPanel> panels, const std::optional<PanelRect>& before = {});

std::vector<PanelLine> wrapped(std::span<const PanelLine> lines, size_t columns);
size_t letters(const std::string& utf8);  // characters, not bytes

}  // namespace catgut
