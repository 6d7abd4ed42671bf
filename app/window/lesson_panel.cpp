// SPDX-License-Identifier: Apache-2.0
// app/window: see lesson_panel.h.
#include "window/lesson_panel.h"

#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

namespace catgut {
namespace {

constexpr double kLinger = 1.2;                  // [s] that a demonstration's result stays visible
constexpr float kAside = 0.0015f, kDeep = 0.4f;  // [m] from the target, fraction of the wanted depth: within tolerance
// Distinguishable with red-green color blindness.
const ImVec4 kBlue{0.45f, 0.75f, 1.0f, 1}, kOrange{1.0f, 0.66f, 0.25f, 1}, kQuiet{0.78f, 0.84f, 0.83f, 1}, kWhite{1, 1, 1, 1};

void line(const ImVec4& color, const std::string& text) {
  ImGui::PushStyleColor(ImGuiCol_Text, color);
  ImGui::TextWrapped("%s", text.c_str());
  ImGui::PopStyleColor();
}

}  // namespace

bool LessonRun::look(Live& live, const Snapshot& seen, double wall_s) {
  const std::vector<Event> happened = std::exchange(happened_, {});
  const LiveStatus& status = live.status();
  if (!lesson_ || status.settling) return false;
  const size_t was = step_;
  const bool first = !std::exchange(begun_, true);
  if (showing_) {
    if (status.demonstrating) started_ = true;
    if (started_ && !status.demonstrating) {  // it has ended, and the previous state is restored
      showing_ = false;
      epoch_ = status.epoch;
      return false;
    }
    const bool done = started_ && !all_done() && step_done(lesson_->step[step_], seen, happened);
    if (shown_at_ < 0 && (done || status.shown)) {
      shown_at_ = wall_s;
      gave_up_ = !done;
    }
    if (shown_at_ >= 0 && wall_s - shown_at_ > kLinger && live.command(LiveCommand::end_demonstration)) shown_at_ = 1e300;
    return false;
  }
  if (status.epoch != epoch_) {  // a bite was undone, or the scene restarted
    epoch_ = status.epoch;
    step_ = step_from(*lesson_, seen);
  } else {
    step_ = next_step(*lesson_, step_, seen, happened);
  }
  if (step_ != was) gave_up_ = false;
  // A demonstration of this step may start here.
  const auto begins_here = [&](size_t k) { return k < lesson_->step.size() && lesson_->step[k].shown_from == k; };
  if ((first || step_ != was) && begins_here(step_)) live.command(LiveCommand::mark);
  return first || step_ != was;
}

void LessonRun::show(Live& live) {
  if (!lesson_ || all_done()) return;
  if (showing_) {
    shown_at_ = live.command(LiveCommand::end_demonstration) ? 1e300 : shown_at_;
    return;
  }
  const LessonStep& s = lesson_->step[step_];
  if (!live.demonstrate(s.shown_by, s.shown_from != step_)) return;
  showing_ = true;
  started_ = gave_up_ = false;
  shown_at_ = -1;
}

void lesson_panel(const LessonRun& run, bool hints) {
  const ImVec2 size = ImGui::GetIO().DisplaySize;
  const float font = ImGui::GetFontSize(), wide = std::min(44 * font, 0.5f * size.x);  // between the panels of the corners
  ImGui::SetNextWindowPos({0.5f * size.x, 8}, ImGuiCond_Always, {0.5f, 0});
  ImGui::SetNextWindowSizeConstraints({wide, 0}, {wide, size.y});
  ImGui::SetNextWindowBgAlpha(0.8f);
  ImGui::Begin("lesson", nullptr,
               ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_AlwaysAutoResize |
                   ImGuiWindowFlags_NoInputs | ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoFocusOnAppearing |
                   ImGuiWindowFlags_NoNav);
  const Lesson& lesson = run.lesson();
  const size_t n = lesson.step.size();
  ImGui::ProgressBar(static_cast<float>(run.step()) / static_cast<float>(n), {-1, 0.35f * font}, "");
  if (run.all_done()) {
    line(kBlue, lesson.title + ": complete");
    line(kQuiet, "Knot locked. Continue, or press Esc.");
  } else {
    const LessonStep& s = lesson.step[run.step()];
    line(kBlue, fmt::format("{} of {}  {}", run.step() + 1, n, s.title));
    line(kWhite, s.text);
    if (run.showing()) line(kOrange, "Demonstration: watch, then repeat (S stops)");
    else if (run.gave_up()) line(kOrange, "No demonstration from here. Grasp the needle, or undo the bite (Backspace).");
    else {
      if (hints) line(kQuiet, s.hint);
      line(kQuiet, "S  demonstration");
    }
  }
  ImGui::End();
}

void guide_overlay(const BiteGuide& g, const ViewFrame& view, const PictureModel& picture, const Snapshot& seen, float width,
                   float height) {
  ImDrawList* draw = ImGui::GetBackgroundDrawList();
  const auto at = [&](Vec3 p) -> std::optional<ImVec2> {
    const Vec3 d = p - view.eye;
    const float deep = dot(d, view.ahead);
    if (deep < 0.01f) return {};
    const float scale = 1 / (view.pixel * deep);
    return ImVec2(0.5f * width + dot(d, view.right) * scale, 0.5f * height - dot(d, view.up) * scale);
  };
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
  if (!inside) return;
  // Direction of the error: toward the edge or from it, by how much, in millimeters, as text.
  const float depth = seen.active().bite.back().depth;
  const bool deep_enough = std::abs(depth - g.depth) < kDeep * g.depth + 0.0003f;
  ImGui::SetNextWindowPos({width - 8, 0.5f * height}, ImGuiCond_Always, {1, 0.5f});
  ImGui::SetNextWindowBgAlpha(0.7f);
  ImGui::Begin("bite", nullptr,
               ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_AlwaysAutoResize |
                   ImGuiWindowFlags_NoInputs | ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoFocusOnAppearing |
                   ImGuiWindowFlags_NoNav);
  const auto say = [](bool ok, const std::string& text) {
    ImGui::TextColored(ok ? kBlue : kOrange, "%s", ((ok ? "+ " : "! ") + text).c_str());
  };
  say(good, fmt::format("entry {:.1f} mm from target", 1000 * aside));
  say(deep_enough, fmt::format("depth {:.1f} mm, target {:.1f} mm", 1000 * depth, 1000 * g.depth));
  ImGui::End();
}

}  // namespace catgut
