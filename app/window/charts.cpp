// SPDX-License-Identifier: Apache-2.0
// app/window: see charts.h.
#include "window/charts.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "window/language.h"
#include "window/widgets.h"

namespace catgut {
namespace {

// Limits of the color scales [mm]; values beyond have the last color, and their number is printed.
constexpr float kMostSpacing = 8, kMostDepth = 2, kMostEdge = 8;
constexpr size_t kMostNumbered = 26;  // bites; with more the numbers would overlap
// Recommended bite spacing and edge distance in bowel [mm] (EAGLE module 5, docs/references.md).
constexpr float kGoodFrom = 3, kGoodTo = 5;

ImU32 color(const ImVec4& c, float alpha = 1) { return ImGui::GetColorU32({c.x, c.y, c.z, c.w * alpha}); }

float most(BiteColor by) { return by == BiteColor::spacing ? kMostSpacing : by == BiteColor::depth ? kMostDepth : kMostEdge; }

void label(ImDrawList& list, ImVec2 at, ImU32 c, const std::string& s, float x_part, float y_part, float scale = 1) {
  const ImVec2 size = ImGui::CalcTextSize(s.c_str());
  list.AddText(ImGui::GetFont(), em() * scale, {at.x - x_part * size.x * scale, at.y - y_part * size.y * scale}, c, s.c_str());
}

float bite_value_mm(const StitchBite& b, BiteColor by) {
  const float far = std::max(b.entry_edge, b.exit_edge);
  return 1000 * (by == BiteColor::spacing ? b.spacing : by == BiteColor::depth ? b.depth : far);
}

// A distance between grid lines that gives about four to eight of them.
double grid_step(double range) {
  double step = std::pow(10.0, std::floor(std::log10(std::max(range, 1e-9) / 4)));
  for (const double m : {2.0, 2.5, 2.0})
    if (range / step > 8) step *= m;
  return step;
}

}  // namespace

ImU32 scale_color(float part, float alpha) {
  static constexpr std::array<std::array<float, 3>, 9> kCividis{{{0.000f, 0.135f, 0.305f},
                                                                 {0.120f, 0.226f, 0.430f},
                                                                 {0.262f, 0.307f, 0.424f},
                                                                 {0.371f, 0.391f, 0.434f},
                                                                 {0.478f, 0.479f, 0.467f},
                                                                 {0.598f, 0.571f, 0.459f},
                                                                 {0.725f, 0.669f, 0.425f},
                                                                 {0.859f, 0.776f, 0.352f},
                                                                 {1.000f, 0.910f, 0.270f}}};
  // The darkest eighth would be invisible on a dark panel.
  const float at = (0.14f + 0.86f * std::clamp(part, 0.0f, 1.0f)) * 8;
  const size_t k = std::min<size_t>(static_cast<size_t>(at), 7);
  const float t = at - static_cast<float>(k);
  std::array<float, 3> c;
  for (size_t i = 0; i < 3; ++i) c[i] = kCividis[k][i] + t * (kCividis[k + 1][i] - kCividis[k][i]);
  return ImGui::GetColorU32({c[0] + 0.05f * (1 - part), c[1] + 0.08f * (1 - part), c[2] + 0.18f * (1 - part), alpha});
}

float bite_part(const StitchBite& b, BiteColor by, bool& known) {
  const float value = bite_value_mm(b, by);
  known = value >= 0;
  return std::clamp(value / most(by), 0.0f, 1.0f);
}

void scale_legend(BiteColor by, float width) {
  ImDrawList& list = *ImGui::GetWindowDrawList();
  ImVec2 at = ImGui::GetCursorScreenPos();
  at.y += 0.25f * em();  // room for the bracket
  const float high = 0.6f * em();
  constexpr int kSteps = 40;
  for (int i = 0; i < kSteps; ++i) {
    const float a = static_cast<float>(i) / kSteps, b = static_cast<float>(i + 1) / kSteps;
    list.AddRectFilled({at.x + a * width, at.y}, {at.x + b * width + 1, at.y + high}, scale_color((a + b) / 2));
  }
  if (by != BiteColor::depth) {  // a bracket round the recommended range
    const float a = at.x + width * kGoodFrom / most(by), b = at.x + width * kGoodTo / most(by);
    list.AddRect({a, at.y - 2}, {b, at.y + high + 2}, color(kAccent), 2, 0, std::max(1.5f, 0.1f * em()));
  }
  for (const float part : {0.0f, 0.25f, 0.5f, 0.75f, 1.0f})
    label(list, {at.x + part * width, at.y + high + 3}, color(kQuiet),
          fmt::format("{:.3g}{}", part * most(by), part == 1 ? "+" : ""), part, 0, 0.85f);
  ImGui::Dummy({width, high + 1.3f * em()});
}

void stitch_map_chart(const StitchMap& map, BiteColor by, ImVec2 size) {
  ImDrawList& list = *ImGui::GetWindowDrawList();
  const ImVec2 at = ImGui::GetCursorScreenPos();
  ImGui::Dummy(size);
  list.AddRectFilled(at, {at.x + size.x, at.y + size.y}, color({0, 0, 0, 0.35f}), 4);
  size_t walls = 0;
  float deepest = 0.006f, spread = 0;  // [m] of tissue shown
  for (const StitchEdge& e : map.edge) walls += e.length() > 0;
  for (const StitchBite& b : map.bite) {
    deepest = std::max({deepest, 1.45f * b.entry_edge, 1.45f * b.exit_edge});
    if (b.wall < map.edge.size()) spread = std::max(spread, map.edge[b.wall].length());
  }
  if (walls == 0) {
    label(list, {at.x + size.x / 2, at.y + size.y / 2}, color(kQuiet), tr("No edge data"), 0.5f, 0.5f);
    return;
  }
  // One wall below the edge line; of two the first below and the second above, in their arrangement during suturing.
  const float left = at.x + 3.2f * em(), right = at.x + size.x - 1.2f * em(), top = at.y + 0.7f * em(),
              bottom = at.y + size.y - 1.7f * em();
  const float middle = walls > 1 ? (top + bottom) / 2 : top + 0.7f * em();
  const float pixels = (bottom - middle - 0.4f * em()) / deepest;  // per meter from the edge
  const auto x_of = [&](float along, const StitchEdge& e) { return left + (right - left) * along / e.length(); };
  const float thin = std::max(1.0f, 0.06f * em());
  for (size_t w = 0; w < std::min<size_t>(map.edge.size(), 2); ++w) {
    const StitchEdge& e = map.edge[w];
    if (e.length() <= 0) continue;
    const float way = w == 0 ? 1.0f : -1.0f, line = middle + way * 0.25f * em();
    list.AddRectFilled({left, std::min(line, line + way * deepest * pixels)},
                       {right, std::max(line, line + way * deepest * pixels)}, color({0.55f, 0.36f, 0.33f, 0.16f}));
    for (float d = 0.0025f; d < deepest; d += 0.0025f) {
      list.AddLine({left, line + way * d * pixels}, {right, line + way * d * pixels}, color(kQuiet, 0.13f), thin);
      if (std::fmod(d + 1e-6f, 0.005f) < 1e-4f)
        label(list, {left - 0.4f * em(), line + way * d * pixels}, color(kQuiet), fmt::format("{:.0f}", 1000 * d), 1, 0.5f,
              0.85f);
    }
    list.AddRectFilled({left, line + way * kGoodFrom * 1e-3f * pixels}, {right, line + way * kGoodTo * 1e-3f * pixels},
                       color(kAccent, 0.10f));
    list.AddLine({left, line}, {right, line}, color(kText), 2 * thin);
  }
  label(list, {left - 0.4f * em(), middle}, color(kQuiet), tr("edge"), 1, walls > 1 ? 0.5f : 0.4f, 0.85f);
  const StitchEdge& first = map.edge[0].length() > 0 ? map.edge[0] : map.edge[1];
  const float step = static_cast<float>(grid_step(1000.0 * static_cast<double>(first.length())));
  for (float mm = 0; mm <= 1000 * first.length(); mm += step) {
    const float x = x_of(mm / 1000, first);
    if (x > right - 10 * em()) break;  // the unit label is there
    list.AddLine({x, bottom - 0.2f * em()}, {x, bottom}, color(kQuiet), thin);
    label(list, {x, bottom + 0.1f * em()}, color(kQuiet), fmt::format("{:.0f}", mm), 0.5f, 0, 0.85f);
  }
  label(list, {right, bottom + 0.1f * em()}, color(kQuiet), tr("mm along the edge"), 1, 0, 0.85f);

  for (size_t k = 0; k < map.bite.size(); ++k) {
    const StitchBite& b = map.bite[k];
    if (b.wall >= map.edge.size() || b.wall > 1 || map.edge[b.wall].length() <= 0) continue;
    const StitchEdge& e = map.edge[b.wall];
    const float way = b.wall == 0 ? 1.0f : -1.0f, line = middle + way * 0.25f * em();
    const ImVec2 in{x_of(b.entry_along, e), line + way * b.entry_edge * pixels};
    ImVec2 out{x_of(b.exit_along, e), line + way * b.exit_edge * pixels};
    bool known = false;
    const float part = bite_part(b, by, known);
    const ImU32 c = known ? scale_color(part) : color(kText);
    const float thick = std::max(3.0f, 0.24f * em()), dot = std::max(3.5f, 0.28f * em());
    const bool across = std::abs(out.x - in.x) > (right - left) / 2;  // across the point where the edge was cut open
    if (across) {
      const float whole = right - left, there = out.x < in.x ? out.x + whole : out.x - whole;
      list.PushClipRect({left, at.y}, {right, at.y + size.y}, true);
      list.AddLine(in, {there, out.y}, c, thick);
      list.AddLine({in.x + (out.x - there), in.y}, out, c, thick);
      list.PopClipRect();
    } else {
      list.AddLine(in, out, c, thick);
    }
    list.AddCircleFilled(in, dot, c);
    list.AddCircleFilled(out, dot, color({0.035f, 0.050f, 0.060f, 1}));
    list.AddCircle(out, dot, c, 0, 2 * thin);
    const float x = across ? in.x : (in.x + out.x) / 2;
    const float away = way * std::max(way * in.y, way * out.y) + way * (dot + 0.15f * em());
    label(list, {x, away}, color(kText), fmt::format("{}", k + 1), 0.5f, way > 0 ? 0.0f : 1.0f, 0.85f);
    if (known && map.bite.size() <= kMostNumbered)
      label(list, {x, away + way * 0.85f * em()}, color(kQuiet), fmt::format("{:.1f}", bite_value_mm(b, by)), 0.5f,
            way > 0 ? 0.0f : 1.0f, 0.85f);
  }
  if (map.bite.empty()) label(list, {(left + right) / 2, (middle + bottom) / 2}, color(kQuiet), tr("No bites"), 0.5f, 0.5f);
}

void tension_chart(const StitchMap& map, uint64_t from, uint64_t to, double now, ImVec2 size, bool labels) {
  ImDrawList& list = *ImGui::GetWindowDrawList();
  const ImVec2 at = ImGui::GetCursorScreenPos();
  ImGui::Dummy(size);
  list.AddRectFilled(at, {at.x + size.x, at.y + size.y}, color({0, 0, 0, 0.35f}), 4);
  float peak_n = 1;
  for (const TensionSample& t : map.tension) peak_n = std::max(peak_n, t.peak);
  const float left = at.x + (labels ? 3.2f * em() : 0), right = at.x + size.x - (labels ? 1.2f * em() : 0),
              top = at.y + (labels ? 0.9f * em() : 0.2f * em()), bottom = at.y + size.y - (labels ? 1.5f * em() : 0);
  const double span = std::max<double>(1, static_cast<double>(to - from));
  const auto x_of = [&](double tick) {
    return left + (right - left) * static_cast<float>((tick - static_cast<double>(from)) / span);
  };
  const auto y_of = [&](float n) { return bottom - (bottom - top) * n / (1.08f * peak_n); };
  const float thin = std::max(1.0f, 0.06f * em());
  if (labels) {
    const float step = static_cast<float>(grid_step(static_cast<double>(peak_n)));
    for (float n = 0; n <= peak_n; n += step) {
      list.AddLine({left, y_of(n)}, {right, y_of(n)}, color(kQuiet, n > 0 ? 0.15f : 0.6f), thin);
      label(list, {left - 0.4f * em(), y_of(n)}, color(kQuiet), fmt::format("{:.3g} N", n), 1, 0.5f, 0.85f);
    }
    const double seconds = span * map.tick_s, step_s = grid_step(seconds), begin = static_cast<double>(from) * map.tick_s;
    for (double s = std::ceil(begin / step_s) * step_s; s <= begin + seconds + 1e-9; s += step_s) {
      const float x = x_of(s / map.tick_s);
      list.AddLine({x, bottom}, {x, bottom + 0.2f * em()}, color(kQuiet), thin);
      label(list, {x, bottom + 0.2f * em()}, color(kQuiet), fmt::format("{:.0f} s", s), x > right - 2 * em() ? 1.0f : 0.5f, 0,
            0.85f);
    }
  }
  // One point per pixel: the maximum of its interval.
  const auto draw = [&](float TensionSample::*what, ImU32 c, float thick) {
    std::vector<ImVec2> line;
    for (const TensionSample& t : map.tension) {
      if (t.tick < from || t.tick > to) continue;
      const ImVec2 p{x_of(static_cast<double>(t.tick)), y_of(t.*what)};
      if (!line.empty() && p.x - line.back().x < 1) line.back().y = std::min(line.back().y, p.y);
      else line.push_back(p);
    }
    list.AddPolyline(line.data(), static_cast<int>(line.size()), c, 0, thick);
  };
  draw(&TensionSample::peak, color(kAccent, labels ? 1.0f : 0.55f), 1.5f * thin);
  if (labels) draw(&TensionSample::needle, color(kText, 0.55f), thin);
  for (const Event& e : map.event) {
    const Mark mark = mark_of(e);
    if (mark == Mark::none || e.tick < from || e.tick > to) continue;
    draw_mark(list, {x_of(static_cast<double>(e.tick)), labels ? at.y + 0.5f * em() : at.y + size.y / 2}, mark, 0.36f * em());
  }
  if (now >= 0) list.AddLine({x_of(now), at.y}, {x_of(now), at.y + size.y}, color(kText), 2 * thin);
}

Mark mark_of(const Event& e) {
  switch (e.kind) {
    case EventKind::bite_completed:
      return Mark::bite;
    case EventKind::throw_locked:
      return Mark::knot;
    case EventKind::thread_cut:
      return Mark::cut;
    case EventKind::suture_loaded:
      return Mark::suture;
    case EventKind::technique_fault:
    case EventKind::bite_out_of_order:
    case EventKind::thread_exhausted:
    case EventKind::throw_undone:
      return Mark::fault;
    case EventKind::needle_released:
      return e.value > 0 ? Mark::fault : Mark::none;
    default:
      return Mark::none;
  }
}

// By shape as well as by color.
void draw_mark(ImDrawList& list, ImVec2 p, Mark mark, float s) {
  const float thick = std::max(1.5f, 0.3f * s);
  switch (mark) {
    case Mark::bite:
      list.AddCircleFilled(p, 0.8f * s, color(kText));
      break;
    case Mark::knot:
      list.AddQuadFilled({p.x, p.y - s}, {p.x + s, p.y}, {p.x, p.y + s}, {p.x - s, p.y}, color({1, 0.91f, 0.35f, 1}));
      break;
    case Mark::cut:
      list.AddLine({p.x - s, p.y - s}, {p.x + s, p.y + s}, color(kText), thick);
      list.AddLine({p.x - s, p.y + s}, {p.x + s, p.y - s}, color(kText), thick);
      break;
    case Mark::suture:
      list.AddCircle(p, 0.8f * s, color(kQuiet), 0, thick);
      break;
    case Mark::fault:
      list.AddTriangleFilled({p.x, p.y - s}, {p.x + s, p.y + s}, {p.x - s, p.y + s}, color(kBad));
      break;
    case Mark::none:
      break;
  }
}

void mark_legend() {
  constexpr std::pair<Mark, const char*> kMarks[] = {{Mark::bite, "bite"},
                                                     {Mark::knot, "throw locked"},
                                                     {Mark::cut, "cut"},
                                                     {Mark::suture, "new suture"},
                                                     {Mark::fault, "fault"}};
  for (const auto& [mark, word] : kMarks) {
    const ImVec2 at = ImGui::GetCursorScreenPos();
    draw_mark(*ImGui::GetWindowDrawList(), {at.x + 0.5f * em(), at.y + 0.5f * em()}, mark, 0.36f * em());
    ImGui::Dummy({1.1f * em(), em()});
    ImGui::SameLine(0, 0);
    text(kQuiet, word);
    if (mark != Mark::fault) ImGui::SameLine(0, 1.2f * em());
  }
}

}  // namespace catgut
