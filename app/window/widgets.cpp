// SPDX-License-Identifier: Apache-2.0
// app/window: see widgets.h.
#include "window/widgets.h"

#include <algorithm>

#include "window/language.h"

namespace catgut {
namespace {

constexpr ImGuiWindowFlags kFixed = ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoSavedSettings;

}  // namespace

void style_panels(float scale) {
  ImGui::GetStyle() = ImGuiStyle();
  ImGui::StyleColorsDark();
  ImGuiStyle& style = ImGui::GetStyle();
  style.WindowPadding = {12, 10};
  style.FramePadding = {8, 4};
  style.ItemSpacing = {8, 5};
  style.CellPadding = {6, 2};
  style.WindowRounding = 8;
  style.FrameRounding = 4;
  style.GrabRounding = 4;
  style.ScrollbarSize = 12;
  style.WindowBorderSize = 0;
  style.ChildBorderSize = 0;
  style.Colors[ImGuiCol_Text] = kText;
  style.Colors[ImGuiCol_WindowBg] = {0.035f, 0.050f, 0.060f, 1};
  style.Colors[ImGuiCol_ChildBg] = {0, 0, 0, 0};
  style.Colors[ImGuiCol_Button] = {0.12f, 0.24f, 0.32f, 1};
  style.Colors[ImGuiCol_ButtonHovered] = {0.16f, 0.36f, 0.48f, 1};
  style.Colors[ImGuiCol_ButtonActive] = {0.20f, 0.46f, 0.62f, 1};
  style.Colors[ImGuiCol_Header] = style.Colors[ImGuiCol_Button];
  style.Colors[ImGuiCol_HeaderHovered] = style.Colors[ImGuiCol_ButtonHovered];
  style.Colors[ImGuiCol_FrameBg] = {0.10f, 0.15f, 0.18f, 1};
  style.Colors[ImGuiCol_FrameBgHovered] = {0.14f, 0.22f, 0.27f, 1};
  style.Colors[ImGuiCol_FrameBgActive] = {0.16f, 0.27f, 0.34f, 1};
  style.Colors[ImGuiCol_CheckMark] = kAccent;
  style.Colors[ImGuiCol_SliderGrab] = {0.35f, 0.65f, 0.82f, 1};
  style.Colors[ImGuiCol_SliderGrabActive] = kAccent;
  style.Colors[ImGuiCol_Separator] = {0.35f, 0.45f, 0.50f, 0.5f};
  style.Colors[ImGuiCol_TableRowBgAlt] = {1, 1, 1, 0.03f};
  style.ScaleAllSizes(scale);
  ImGui::GetIO().IniFilename = nullptr;
}

void text(const std::string& line) { ImGui::TextUnformatted(tr(line).c_str()); }

void text(const ImVec4& color, const std::string& line) {
  ImGui::PushStyleColor(ImGuiCol_Text, color);
  text(line);
  ImGui::PopStyleColor();
}

void bad_text(const std::string& line) {
  ImGui::PushStyleColor(ImGuiCol_Text, kBad);
  ImGui::TextWrapped("! %s", tr(line).c_str());
  ImGui::PopStyleColor();
}

void heading(const std::string& line) {
  text(kAccent, line);
  gap(0.1f);
}

void gap(float lines) { ImGui::Dummy({0, lines * em()}); }

float em() { return ImGui::GetFontSize(); }

bool begin_at(const char* name, float x, float y, float alpha, ImGuiWindowFlags more) {
  const ImVec2 size = ImGui::GetIO().DisplaySize;
  const float margin = 0.6f * em();
  const auto place = [&](float part, float whole) { return margin + part * (whole - 2 * margin); };
  ImGui::SetNextWindowPos({place(x, size.x), place(y, size.y)}, ImGuiCond_Always, {x, y});
  ImGui::SetNextWindowBgAlpha(alpha);
  return ImGui::Begin(name, nullptr, kFixed | ImGuiWindowFlags_AlwaysAutoResize | more);
}

bool begin_box(const char* name, ImVec2 place, ImVec2 size, float alpha, ImGuiWindowFlags more) {
  ImGui::SetNextWindowPos(place, ImGuiCond_Always);
  ImGui::SetNextWindowSize(size, ImGuiCond_Always);
  ImGui::SetNextWindowBgAlpha(alpha);
  return ImGui::Begin(name, nullptr, kFixed | ImGuiWindowFlags_NoResize | more);
}

void lines_at(const char* name, float x, float y, float alpha, const std::vector<Line>& lines, float above_bottom) {
  const ImGuiStyle& style = ImGui::GetStyle();
  ImVec2 size{0, -style.ItemSpacing.y};
  for (const Line& line : lines) {
    const ImVec2 one = ImGui::CalcTextSize(tr(line.second).c_str());
    size.x = std::max(size.x, one.x);
    size.y += one.y + style.ItemSpacing.y;
  }
  size.x += 2 * style.WindowPadding.x, size.y += 2 * style.WindowPadding.y;
  const ImVec2 screen = ImGui::GetIO().DisplaySize;
  const float margin = 0.6f * em();
  begin_box(name, {margin + x * (screen.x - 2 * margin - size.x), margin + y * (screen.y - 2 * margin - size.y) - above_bottom},
            size, alpha, kOverlay | ImGuiWindowFlags_NoScrollbar);
  for (const auto& [color, line] : lines) text(color, line);
  ImGui::End();
}

bool wide_button(const char* label, float ems) { return ImGui::Button(tr(label).c_str(), {ems * em(), 0}); }

bool radio(const char* label, bool on) { return ImGui::RadioButton(tr(label).c_str(), on); }

}  // namespace catgut
