// SPDX-License-Identifier: Apache-2.0
// app/window: building blocks of all panels: style, positions, lines of text, buttons.
#pragma once
#include <imgui.h>

#include <string>
#include <utility>
#include <vector>

namespace catgut {

// One accent, and orange for errors: distinguishable with color blindness; errors also have a mark.
const ImVec4 kText{0.93f, 0.95f, 0.95f, 1}, kQuiet{0.70f, 0.77f, 0.79f, 1}, kAccent{0.45f, 0.80f, 0.98f, 1},
    kBad{1.0f, 0.66f, 0.30f, 1};

void style_panels(float scale);  // once, and after a change of the window or the text size

void text(const std::string& line);
void text(const ImVec4& color, const std::string& line);
void bad_text(const std::string& line);  // orange, after an exclamation mark
void heading(const std::string& line);
void gap(float lines = 0.5f);
float em();  // [pixels] of a line's height

// A panel at a position of the window. x, y: 0 left or top, 0.5 center, 1 right or bottom.
bool begin_at(const char* name, float x, float y, float alpha, ImGuiWindowFlags more = 0);
// A panel of a size, in pixels.
bool begin_box(const char* name, ImVec2 place, ImVec2 size, float alpha, ImGuiWindowFlags more = 0);
constexpr ImGuiWindowFlags kOverlay = ImGuiWindowFlags_NoInputs | ImGuiWindowFlags_NoFocusOnAppearing | ImGuiWindowFlags_NoNav;

// Lines over the image, positioned as above. The size is computed from the lines, because ImGui's automatic size is
// one frame late, which is visible at low frame rates.
using Line = std::pair<ImVec4, std::string>;
void lines_at(const char* name, float x, float y, float alpha, const std::vector<Line>& lines, float above_bottom = 0);

bool wide_button(const char* label, float ems = 15);
bool radio(const char* label, bool on);  // one option of a row; true when it was selected

}  // namespace catgut
