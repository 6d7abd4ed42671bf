// SPDX-License-Identifier: Apache-2.0
// app/window: see guide_overlay.h.
#include "window/guide_overlay.h"

#include <imgui.h>

#include <optional>

namespace catgut {
namespace {

constexpr float kAside = 0.0015f;  // [m] from the target: within tolerance

std::optional<ImVec2> on_area(Vec3 p, const ViewFrame& view, const PanelRect& area) {
  const Vec3 d = p - view.eye;
  const float deep = dot(d, view.ahead);
  if (deep < 0.01f) return {};
  const float scale = 1 / (view.pixel * deep);
  return ImVec2(area.x + 0.5f * area.w + dot(d, view.right) * scale, area.y + 0.5f * area.h - dot(d, view.up) * scale);
}

}  // namespace

void guide_overlay(const BiteGuide& g, const ViewFrame& view, const PictureModel& picture, const Snapshot& seen,
                   const PanelRect& area) {
  ImDrawList* draw = ImGui::GetBackgroundDrawList();
  draw->PushClipRect({area.x, area.y}, {area.x + area.w, area.y + area.h});
  const auto at = [&](Vec3 p) { return on_area(p, view, area); };
  // Path of the tip: dashed above the tissue and below it, drawn over the tissue.
  const float half = half_bite(picture, g), from = -half - 0.5f, to = half + 0.6f;
  constexpr int kDashes = 24;
  for (int i = 0; i < kDashes; ++i) {
    const auto tip = [&](float part) {
      return at(on_needle(picture, needle_on(picture, g, from + (to - from) * part), 1, g.suture));
    };
    const auto a = tip(static_cast<float>(i) / kDashes), b = tip((static_cast<float>(i) + 0.6f) / kDashes);
    if (a && b) draw->AddLine(*a, *b, IM_COL32(115, 190, 255, 200), 2);
  }
  const Vec3 tip = on_needle(picture, seen.active().needle.pose, 1, seen.active_suture);
  const bool inside = seen.active().needle.in_tissue && !seen.active().bite.empty();
  const Vec3 in = inside ? seen.active().bite.back().entry : tip;
  const Vec3 off = in - entry_of(g);
  const float aside = length(off - g.out * dot(off, g.out));
  const bool good = aside < kAside;
  if (const auto p = at(entry_of(g)))
    draw->AddCircle(*p, 7, good ? IM_COL32(115, 190, 255, 255) : IM_COL32(255, 168, 64, 255), 20, 2);
  if (const auto p = at(exit_of(g))) draw->AddCircleFilled(*p, 3, IM_COL32(115, 190, 255, 255));
  draw->PopClipRect();
}

void line_overlay(std::span<const LinePiece> line, const ViewFrame& view, const PanelRect& area) {
  ImDrawList* draw = ImGui::GetBackgroundDrawList();
  draw->PushClipRect({area.x, area.y}, {area.x + area.w, area.y + area.h});
  for (const LinePiece& piece : line) {
    if (dot(piece.out, piece.a - view.eye) >= 0) continue;  // on the far side
    const auto a = on_area(piece.a, view, area), b = on_area(piece.b, view, area);
    if (a && b) draw->AddLine(*a, *b, IM_COL32(115, 190, 255, 200), 2);
  }
  draw->PopClipRect();
}

}  // namespace catgut
