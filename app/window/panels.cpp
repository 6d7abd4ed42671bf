// app/window: see panels.h.
#include "window/panels.h"

#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>

namespace catgut {
namespace {

const ImVec4 kBad{1.0f, 0.62f, 0.45f, 1}, kQuiet{0.72f, 0.80f, 0.78f, 1}, kGood{0.62f, 0.92f, 0.78f, 1};
constexpr ImGuiWindowFlags kFixed = ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_AlwaysAutoResize |
                                    ImGuiWindowFlags_NoSavedSettings;

void text(const std::string& line) { ImGui::TextUnformatted(line.c_str()); }
void text(const ImVec4& colour, const std::string& line) {
  ImGui::PushStyleColor(ImGuiCol_Text, colour);
  text(line);
  ImGui::PopStyleColor();
}

// x, y: 0 left or top, 0.5 middle, 1 right or bottom.
bool begin_at(const char* name, float x, float y, float alpha, ImGuiWindowFlags more = 0) {
  const ImVec2 size = ImGui::GetIO().DisplaySize;
  constexpr float kMargin = 8;
  const auto place = [](float part, float whole) { return kMargin + part * (whole - 2 * kMargin); };
  ImGui::SetNextWindowPos({place(x, size.x), place(y, size.y)}, ImGuiCond_Always, {x, y});
  ImGui::SetNextWindowBgAlpha(alpha);
  return ImGui::Begin(name, nullptr, kFixed | more);
}

constexpr ImGuiWindowFlags kOverlay = ImGuiWindowFlags_NoInputs | ImGuiWindowFlags_NoFocusOnAppearing | ImGuiWindowFlags_NoNav;

bool wide_button(const char* label) { return ImGui::Button(label, {15 * ImGui::GetFontSize(), 0}); }

void show_settings(Settings& s, bool at_start) {
  ImGui::Checkbox("jaw closes only while the button is down", &s.hold_to_close);
  ImGui::Checkbox("help at the needle (H)", &s.assist);
  ImGui::Checkbox("show suture points (M)", &s.suture_points);
  text("guidance");
  const std::pair<const char*, Guidance> kLevels[] = {
      {"full", Guidance::full}, {"hints only", Guidance::hints}, {"none", Guidance::none}};
  for (const auto& [name, level] : kLevels) {
    ImGui::SameLine();
    if (ImGui::RadioButton(name, s.guidance == level)) s.guidance = level;
  }
  if (!at_start) return;
  ImGui::Checkbox("left-handed", &s.left_handed);
  text("picture");
  const std::pair<const char*, Quality> kQualities[] = {
      {"low", Quality::draft}, {"medium", Quality::medium}, {"high", Quality::good}};
  for (const auto& [name, quality] : kQualities) {
    ImGui::SameLine();
    if (ImGui::RadioButton(name, s.quality == quality)) s.quality = quality;
  }
}

const char* kHints =
    "mouse            move the tool\n"
    "wheel, Shift     into the picture\n"
    "left, space      close or open the jaw\n"
    "right            drive the needle, turn the tool\n"
    "Ctrl+right, Q E  turn the tool as a ball\n"
    "W                both hands: wind, draw apart\n"
    "Tab              the other hand\n"
    "C  N             cut, fresh needle\n"
    "1 2 3            fine, normal, fast\n"
    "middle, arrows   look round; Ctrl+wheel: closer\n"
    "- +              slow motion\n"
    "Backspace        take back the last bite\n"
    "F12              save a picture\n"
    "Esc              pause     F1 hide this";

}  // namespace

void style_panels(float scale) {
  ImGui::GetStyle() = ImGuiStyle();
  ImGui::StyleColorsDark();
  ImGuiStyle& style = ImGui::GetStyle();
  style.WindowRounding = 6;
  style.FrameRounding = 4;
  style.WindowBorderSize = 0;
  style.Colors[ImGuiCol_WindowBg] = {0.03f, 0.07f, 0.07f, 1};
  style.Colors[ImGuiCol_Button] = {0.10f, 0.36f, 0.34f, 1};
  style.Colors[ImGuiCol_ButtonHovered] = {0.14f, 0.48f, 0.45f, 1};
  style.Colors[ImGuiCol_ButtonActive] = {0.18f, 0.58f, 0.54f, 1};
  style.Colors[ImGuiCol_FrameBg] = {0.08f, 0.20f, 0.20f, 1};
  style.Colors[ImGuiCol_CheckMark] = {0.45f, 0.90f, 0.75f, 1};
  style.ScaleAllSizes(scale);
  ImGui::GetIO().FontGlobalScale = scale;
  ImGui::GetIO().IniFilename = nullptr;
}

Choice start_panel(const std::vector<SceneChoice>& scenes, Settings& settings, const std::string& message) {
  Choice choice;
  begin_at("start", 0.5f, 0.5f, 0.9f);
  text(kGood, "Catgut");
  ImGui::SameLine();
  text(kQuiet, "open surgery, stitch by stitch");
  ImGui::Separator();
  if (ImGui::Button("T  Teach me: a first stitch", {24 * ImGui::GetFontSize(), 0})) choice.what = Chosen::teach;
  for (size_t i = 0; i < scenes.size(); ++i)
    if (ImGui::Button(fmt::format("{}  {}##{}", i + 1, scenes[i].title, scenes[i].name).c_str(),
                      {24 * ImGui::GetFontSize(), 0}))
      choice = {Chosen::scene, i};
  if (!message.empty()) text(kBad, message);
  ImGui::Separator();
  show_settings(settings, true);
  ImGui::Separator();
  if (wide_button("Quit (Esc)")) choice.what = Chosen::quit;
  ImGui::End();
  return choice;
}

void work_panel(const WorkView& v, const Settings& settings) {
  const LiveStatus& s = *v.status;
  begin_at("state", 0, 0, 0.55f, kOverlay);
  text(v.scene->title);
  if (s.settling) {
    text(kQuiet, "the tissue comes to rest");
  } else {
    const int seconds = static_cast<int>(s.practice.time_s);
    const bool slow = s.time_factor > 0 && s.time_factor < 0.93f * s.speed && !s.paused;
    text(slow ? kBad : kQuiet,
         fmt::format("{}:{:02}   time x {:.2f}{}", seconds / 60, seconds % 60, s.paused ? 0.0f : s.time_factor,
                     slow          ? "  this machine is too slow"
                     : s.speed < 1 ? "  slow motion"
                                   : ""));
    text(kQuiet, fmt::format("tick {:.1f} ms, {:.0f} pictures/s", s.tick_ms, v.pictures_per_s));
    for (const std::string& line : technique_lines(*v.scene, *v.seen, s.practice)) text(line);
    if (!s.doing.empty()) text(kQuiet, "surgeon: " + s.doing);
  }
  if (!s.fault.empty()) text(kBad, s.fault);
  ImGui::End();

  if (s.doing.empty() && !s.settling) {
    const size_t k = v.mouse->active;
    const bool help = v.steering->hand[k].snapped;
    begin_at("hand", 1, 1, 0.55f, kOverlay);
    text(
        fmt::format("{} ({} hand)", k == 0 ? "needle driver" : "forceps", (k == 0) != settings.left_handed ? "right" : "left"));
    if (v.mouse->speed != 1) ImGui::SameLine(), text(kQuiet, v.mouse->speed < 1 ? "fine" : "fast");
    const HelpAt at = v.steering->hand[k].at;
    if (help)
      text(kGood, at == HelpAt::needle ? "at the needle: close the jaw"
                  : at == HelpAt::tail ? "at the tail: close the jaw"
                                       : "at the bite: drive the needle");
    if (!v.pad.empty()) text(kQuiet, v.pad);
    ImGui::End();
  }

  if (settings.hints && s.doing.empty()) {
    begin_at("keys", 0, 1, 0.45f, kOverlay);
    text(kQuiet, kHints);
    ImGui::End();
  }

  if (!v.log->empty()) {
    begin_at("log", 1, 0, 0.45f, kOverlay);
    for (const LogLine& line : *v.log) text(line.bad ? kBad : kQuiet, fmt::format("{:6.1f}  {}", line.time_s, line.text));
    ImGui::End();
  }
}

Choice pause_panel(const WorkView& view, Settings& settings) {
  Choice choice;
  begin_at("pause", 0.5f, 0.45f, 0.9f);
  text(kGood, "Pause");
  if (!view.status->fault.empty()) text(kBad, view.status->fault);
  if (view.status->fault.empty() && wide_button("Go on (Esc)")) choice.what = Chosen::resume;
  if (view.status->fault.empty() && wide_button("One tick (.)")) choice.what = Chosen::single_step;
  const uint32_t bites = view.status->to_take_back;
  if (bites > 0 && wide_button(fmt::format("Take back the last bite ({})", bites).c_str())) choice.what = Chosen::take_back;
  if (wide_button("Begin again (F5)")) choice.what = Chosen::restart;
  if (wide_button("Finish (F10)")) choice.what = Chosen::finish;
  if (wide_button("Another scene")) choice.what = Chosen::start_screen;
  if (wide_button("Quit")) choice.what = Chosen::quit;
  ImGui::Separator();
  show_settings(settings, false);
  ImGui::End();
  return choice;
}

Choice result_panel(const SceneSpec& scene, const Practice& practice, const std::vector<std::string>& recorded,
                    const std::string& fault) {
  Choice choice;
  begin_at("results", 0.5f, 0.5f, 0.9f);
  text(kGood, scene.title);
  if (!fault.empty()) text(kBad, fault);
  if (ImGui::BeginTable("rows", 2)) {
    for (const ResultRow& row : result_rows(scene, practice)) {
      ImGui::TableNextColumn();
      text(row.name == "fault" ? kBad : kQuiet, row.name);
      ImGui::TableNextColumn();
      text(row.value);
    }
    ImGui::EndTable();
  }
  for (const std::string& file : recorded) text(kQuiet, "recorded: " + file);
  ImGui::Separator();
  if (wide_button("Once more (Enter)")) choice.what = Chosen::restart;
  if (wide_button("Another scene (Esc)")) choice.what = Chosen::start_screen;
  if (wide_button("Quit")) choice.what = Chosen::quit;
  ImGui::End();
  return choice;
}

}  // namespace catgut
