// SPDX-License-Identifier: Apache-2.0
// app/window: see layout.h.
#include "window/layout.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "exchange/strand.h"
#include "exchange/tying.h"

namespace catgut {
namespace {

constexpr float kJaw = 0.015f;  // [m] of a tool, from its tip, that stays uncovered

PanelRect box(const std::vector<PanelLine>& lines, bool bar, const TextSize& text) {
  size_t columns = 0;
  for (const PanelLine& l : lines) columns = std::max(columns, letters(l.text));
  const float rows = static_cast<float>(lines.size()) + (bar ? 0.6f : 0);
  return {0, 0, std::ceil(static_cast<float>(columns) * text.character + 2 * text.pad_x),
          std::ceil(rows * text.line + 2 * text.pad_y)};
}

struct Candidate {
  PanelRect rect;
  std::vector<PanelLine> line;
  float score = std::numeric_limits<float>::max();
};

}  // namespace

size_t letters(const std::string& utf8) {
  return static_cast<size_t>(std::count_if(utf8.begin(), utf8.end(), [](char c) { return (c & 0xc0) != 0x80; }));
}

std::vector<PanelLine> wrapped(std::span<const PanelLine> lines, size_t columns) {
  std::vector<PanelLine> out;
  for (const PanelLine& l : lines) {
    if (columns == 0 || letters(l.text) <= columns) {
      out.push_back(l);
      continue;
    }
    std::string row;
    for (size_t at = 0; at < l.text.size();) {
      size_t end = l.text.find(' ', at);
      if (end == std::string::npos) end = l.text.size();
      const std::string word = l.text.substr(at, end - at);
      if (!row.empty() && letters(row) + 1 + letters(word) > columns) {
        out.push_back({l.tone, row});
        row.clear();
      }
      row += (row.empty() ? "" : " ") + word;
      at = end + 1;
    }
    if (!row.empty()) out.push_back({l.tone, row});
  }
  return out;
}

bool on_screen(Vec3 p, const ViewFrame& view, float width, float height, ScreenPoint& out) {
  const Vec3 d = p - view.eye;
  const float deep = dot(d, view.ahead);
  if (deep < 0.01f) return false;
  const float scale = 1 / (view.pixel * deep);
  out = {0.5f * width + dot(d, view.right) * scale, 0.5f * height - dot(d, view.up) * scale};
  return out[0] >= 0 && out[0] <= width && out[1] >= 0 && out[1] <= height;
}

std::vector<ScreenPoint> work_points(const Snapshot& seen, const PictureModel& picture, const ViewFrame& view, float width,
                                     float height, const BiteGuide* guide) {
  std::vector<ScreenPoint> out;
  const auto add = [&](Vec3 p) {
    ScreenPoint at;
    if (on_screen(p, view, width, height, at)) out.push_back(at);
  };
  const SutureView& suture = seen.active();
  for (const float s : {1.0f, 0.65f, 0.3f}) add(on_needle(picture, suture.needle.pose, s, seen.active_suture));
  for (const SuturePointView& p : suture.suture_point) add(p.position);
  add(stitch_place(picture, seen));
  for (size_t k = 0; k < 2; ++k)
    for (const float back : {0.0f, 0.5f, 1.0f}) add(seen.tool[k].pose.p + rotate(seen.tool[k].pose.q, {0, 0, back * kJaw}));
  if (!suture.suture_point.empty() && !suture.thread_order.empty()) add(node_at(seen, 0));  // the tail's free end
  if (guide) add(entry_of(*guide)), add(exit_of(*guide));
  return out;
}

std::vector<PlacedPanel> place_panels(std::span<const Panel> panels, float width, float height, const TextSize& text,
                                      std::span<const ScreenPoint> clear, std::span<const PlacedPanel> before) {
  std::vector<PlacedPanel> out;
  const float edge = 0.4f * text.line, margin = 0.6f * text.line;
  const auto widest = static_cast<size_t>(std::max(8.0f, (width - 2 * edge - 2 * text.pad_x) / text.character));
  for (const Panel& p : panels) {
    if (p.line.empty() || std::any_of(out.begin(), out.end(), [&](const PlacedPanel& o) { return o.name == p.name; })) continue;
    const auto was = std::find_if(before.begin(), before.end(), [&](const PlacedPanel& b) { return b.name == p.name; });
    Candidate best;
    // All lines, or the first ones; in several widths if it may be wrapped.
    for (int part = 0; part < (p.keep ? 4 : 1) && best.line.empty(); ++part) {
      const size_t shown = part == 0 ? p.line.size() : part < 3 ? std::min(p.keep, p.line.size()) : 1;
      std::vector<size_t> columns{std::min(widest, p.columns ? p.columns : widest)};
      if (p.columns)
        columns = {std::min(widest, p.columns), std::min(widest, p.columns * 2 / 3), std::min(widest, p.columns / 2),
                   std::min(widest, p.columns / 3), widest};
      for (size_t c = 0; c < columns.size(); ++c) {
        std::vector<PanelLine> line = wrapped({p.line.data(), shown}, columns[c]);
        PanelRect r = box(line, p.progress >= 0, text);
        const float free_x = width - 2 * edge - r.w, free_y = height - 2 * edge - r.h;
        if (free_x < 0 || free_y < 0) continue;
        const auto consider = [&](float x, float y, float score) {
          r.x = x, r.y = y;
          if (score >= best.score) return;
          if (std::any_of(out.begin(), out.end(), [&](const PlacedPanel& o) { return r.meets(o.rect, 0.3f * edge); })) return;
          if (std::any_of(clear.begin(), clear.end(), [&](const ScreenPoint& s) { return r.holds(s[0], s[1], margin); }))
            return;
          best = {r, line, score};
        };
        // Along the borders of the window, the preferred place first; the last place before that.
        constexpr int kSteps = 12;
        const float narrow = 0.25f * static_cast<float>(c);
        for (int i = 0; i <= kSteps; ++i)
          for (int j = 0; j <= kSteps; ++j) {
            const bool border = i == 0 || j == 0 || i == kSteps || j == kSteps;
            if (!border && part < 2) continue;
            const float u = static_cast<float>(i) / kSteps, v = static_cast<float>(j) / kSteps;
            consider(edge + u * free_x, edge + v * free_y, narrow + std::abs(u - p.x) + std::abs(v - p.y));
          }
        if (was != before.end()) {
          // Its corner or border stays where it was; a longer text grows from there.
          const float u = (was->rect.x - edge) / std::max(1.0f, width - 2 * edge - was->rect.w);
          const float v = (was->rect.y - edge) / std::max(1.0f, height - 2 * edge - was->rect.h);
          const float stay = std::min(0.0f, -0.5f + 0.5f * (std::abs(u - p.x) + std::abs(v - p.y))) - 0.01f;
          consider(edge + std::clamp(u, 0.0f, 1.0f) * free_x, edge + std::clamp(v, 0.0f, 1.0f) * free_y, narrow + stay);
        }
      }
    }
    if (!best.line.empty()) out.push_back({p.name, best.rect, best.line, p.progress, p.alpha});
  }
  return out;
}

std::optional<PanelRect> place_inset(float side, float width, float height, ScreenPoint tip, std::span<const ScreenPoint> clear,
                                     std::span<const PlacedPanel> panels, const std::optional<PanelRect>& before) {
  constexpr int kSteps = 16;
  const float edge = 0.012f * height, margin = 0.06f * side;
  const float free_x = width - 2 * edge - side, free_y = height - 2 * edge - side;
  if (free_x < 0 || free_y < 0) return {};
  const auto fits = [&](const PanelRect& r) {
    return std::none_of(panels.begin(), panels.end(), [&](const PlacedPanel& p) { return r.meets(p.rect, 0.5f * edge); }) &&
           std::none_of(clear.begin(), clear.end(), [&](const ScreenPoint& s) { return r.holds(s[0], s[1], margin); });
  };
  if (before && before->w == side && before->x + side <= width && before->y + side <= height && fits(*before)) return before;
  std::optional<PanelRect> best;
  float least = std::numeric_limits<float>::max();
  for (int i = 0; i <= kSteps; ++i)
    for (int j = 0; j <= kSteps; ++j) {
      if (i != 0 && j != 0 && i != kSteps && j != kSteps) continue;
      const PanelRect r{std::floor(edge + free_x * static_cast<float>(i) / kSteps),
                        std::floor(edge + free_y * static_cast<float>(j) / kSteps), side, side};
      const float away = std::hypot(r.x + 0.5f * side - tip[0], r.y + 0.5f * side - tip[1]);
      if (away < least && fits(r)) least = away, best = r;
    }
  return best;
}

}  // namespace catgut
