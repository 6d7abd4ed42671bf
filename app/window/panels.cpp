// SPDX-License-Identifier: Apache-2.0
// app/window: see panels.h. Start, settings, work and pause; the others have their own files.
#include "window/panels.h"

#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <filesystem>

#include "technique/technique.h"
#include "window/widgets.h"

namespace catgut {
namespace {

const char* kHints =
    "mouse            move instrument\n"
    "wheel, Shift     depth\n"
    "left, space      close or open jaws\n"
    "right            drive needle, roll instrument\n"
    "Ctrl+right, Q E  arcball rotation\n"
    "W                both hands: wrap, pull apart\n"
    "Tab              other hand\n"
    "C  N             cut thread, new suture\n"
    "I  K             next instrument, park clamp\n"
    "1 2 3            fine, normal, fast\n"
    "middle, arrows   orbit; Ctrl+wheel: zoom\n"
    "- +              slow motion\n"
    "Backspace        undo bite\n"
    "F2  F3  F12      settings, profiler, screenshot\n"
    "F9               haptic force on or off\n"
    "Esc              pause     F1 hide keys";

void quality_choice(Settings& s) {
  for (const Quality q : {Quality::low, Quality::medium, Quality::high}) {
    if (q != Quality::low) ImGui::SameLine();
    if (radio(quality_name(q), s.quality == q)) s.quality = q;
  }
}

void guidance_choice(Settings& s) {
  const std::pair<Guidance, const char*> kLevels[] = {{Guidance::learn, "learn: needle path"},
                                                      {Guidance::practice, "practice: event messages"},
                                                      {Guidance::exam, "exam: results only"}};
  for (const auto& [level, words] : kLevels)
    if (radio(words, s.guidance == level)) s.guidance = level;
}

void hand_choice(Settings& s) {
  if (radio("right-handed", !s.left_handed)) s.left_handed = false;
  ImGui::SameLine();
  if (radio("left-handed", s.left_handed)) s.left_handed = true;
}

std::string instrument_in_hand(const WorkView& v, size_t hand) {
  const int i = v.seen->tool[hand].instrument;
  return i < 0 ? "empty" : v.picture->instrument[static_cast<size_t>(i)].title;
}

}  // namespace

Choice start_panel(const StartView& v, Settings& settings, bool& watch) {
  Choice choice;
  const ImVec2 screen = ImGui::GetIO().DisplaySize;
  const float wide = std::min(screen.x - em(), 58 * em()), high = std::min(screen.y - em(), 44 * em());
  begin_box("start", {(screen.x - wide) / 2, (screen.y - high) / 2}, {wide, high}, 0.92f);
  text(kAccent, "Catgut");
  ImGui::SameLine();
  text(kQuiet, "open-surgery suturing");
  ImGui::Separator();
  if (!v.message.empty()) bad_text(v.message);
  const float foot = 3.0f * em();
  ImGui::BeginChild("procedures", {0.53f * wide, -foot});
  if (ImGui::Button("T  Tutorial: first stitch", {-1.0f, 1.75f * em()})) choice.what = Chosen::teach;
  gap(0.3f);
  heading("Scenes");
  for (size_t i = 0; i < v.scenes->size(); ++i) {
    const SceneChoice& s = (*v.scenes)[i];
    ImGui::PushStyleVar(ImGuiStyleVar_ButtonTextAlign, {0, 0.5f});
    if (ImGui::Button(fmt::format("{}  {}##{}", i + 1, s.title, s.name).c_str(), {-1.0f, 1.75f * em()}))
      choice = {Chosen::scene, i};
    ImGui::PopStyleVar();
    ImGui::Indent(1.6f * em());
    text(kQuiet, fmt::format("{}; {}", s.technique.empty() ? "free practice" : "technique: " + s.technique, s.body));
    ImGui::Unindent(1.6f * em());
    gap(0.15f);
  }
  ImGui::EndChild();
  ImGui::SameLine(0, 1.5f * em());
  ImGui::BeginChild("rest", {0, -foot});
  heading("Guidance");
  guidance_choice(settings);
  gap();
  heading("Hands");
  if (v.watch_only) {
    text(kQuiet, "set by command line");
  } else {
    if (radio("manual", !watch)) watch = false;
    ImGui::SameLine();
    if (radio("scripted surgeon", watch)) watch = true;
  }
  hand_choice(settings);
  ImGui::PushStyleColor(ImGuiCol_Text, kQuiet);
  ImGui::TextWrapped("%s", v.pad.empty() ? "mouse, keyboard or gamepad" : ("mouse, keyboard, " + v.pad).c_str());
  ImGui::PopStyleColor();
  gap();
  heading("Graphics quality");
  quality_choice(settings);
  gap();
  heading("Recordings");
  if (v.recordings->empty()) {
    text(kQuiet, "none yet");
    ImGui::PushStyleColor(ImGuiCol_Text, kQuiet);
    ImGui::TextWrapped("catgut play --record FILE.cgrec");
    ImGui::PopStyleColor();
  }
  ImGui::BeginChild("files", {0, 0});
  for (const std::string& file : *v.recordings) {
    ImGui::PushStyleVar(ImGuiStyleVar_ButtonTextAlign, {0, 0.5f});
    if (ImGui::Button(fmt::format("{}##{}", std::filesystem::path(file).filename().string(), file).c_str(), {-1.0f, 0}))
      choice = {Chosen::recording, 0, file};
    ImGui::PopStyleVar();
  }
  ImGui::EndChild();
  ImGui::EndChild();
  ImGui::Separator();
  if (wide_button("Settings (F2)", 11)) choice.what = Chosen::settings;
  ImGui::SameLine();
  if (wide_button("Quit (Esc)", 11)) choice.what = Chosen::quit;
  ImGui::SameLine();
  if (const size_t n = std::min<size_t>(9, v.scenes->size()); n > 0)
    text(kQuiet, n > 1 ? fmt::format(" 1-{}, Enter: start", n) : " Enter: start");
  ImGui::End();
  return choice;
}

Choice settings_panel(Settings& s, const std::string& file, const std::string& message, bool working) {
  Choice choice;
  begin_at("settings", 0.5f, 0.5f, 0.94f);
  text(kAccent, "Settings");
  ImGui::Separator();
  if (!message.empty()) {
    ImGui::PushTextWrapPos(44 * em());
    bad_text(message);
    ImGui::PopTextWrapPos();
  }
  if (ImGui::BeginTable("rows", 2)) {
    ImGui::TableSetupColumn("name", ImGuiTableColumnFlags_WidthFixed, 11 * em());
    ImGui::TableSetupColumn("value", ImGuiTableColumnFlags_WidthFixed, 31 * em());
    const auto row = [](const char* name) {
      ImGui::TableNextRow();
      ImGui::TableNextColumn();
      ImGui::AlignTextToFramePadding();
      text(kQuiet, name);
      ImGui::TableNextColumn();
    };
    row("guidance");
    guidance_choice(s);
    row("graphics");
    quality_choice(s);
    row("text size");
    ImGui::SetNextItemWidth(16 * em());
    // Only on release: a panel that grows under the pointer would move away from it.
    static float wanted = 0;
    if (wanted == 0) wanted = s.text_size;
    ImGui::SliderFloat("##text", &wanted, 0.7f, 2, "%.2f x", ImGuiSliderFlags_AlwaysClamp);
    if (ImGui::IsItemDeactivatedAfterEdit()) s.text_size = wanted;
    if (!ImGui::IsItemActive()) wanted = s.text_size;
    row("mouse");
    ImGui::SetNextItemWidth(16 * em());
    ImGui::SliderFloat("##mouse", &s.mouse_speed, 0.2f, 4, "%.2f x pointer",
                       ImGuiSliderFlags_AlwaysClamp | ImGuiSliderFlags_Logarithmic);
    row("hands");
    hand_choice(s);
    row("arm force");
    ImGui::SetNextItemWidth(14 * em());
    ImGui::SliderFloat("##right", &s.force_right, 0.2f, 2, "right %.2f x", ImGuiSliderFlags_AlwaysClamp);
    ImGui::SameLine();
    ImGui::SetNextItemWidth(14 * em());
    ImGui::SliderFloat("##left", &s.force_left, 0.2f, 2, "left %.2f x", ImGuiSliderFlags_AlwaysClamp);
    row("jaws");
    ImGui::Checkbox("hold button to close", &s.hold_to_close);
    row("grasp assist");
    ImGui::Checkbox("snap to target (H)", &s.assist);
    row("show");
    ImGui::Checkbox("suture points (M)", &s.suture_points);
    ImGui::SameLine();
    ImGui::Checkbox("keys (F1)", &s.hints);
    ImGui::EndTable();
  }
  if (working) text(kQuiet, "graphics and hands: from next scene");
  text(kQuiet, file.empty() ? "not saved: no config directory" : "Saved in " + file);
  ImGui::Separator();
  if (wide_button("Done (Esc)", 11)) choice.what = Chosen::leave_settings;
  ImGui::SameLine();
  if (wide_button("Defaults", 11)) s = {};
  ImGui::End();
  return choice;
}

void work_panel(const WorkView& v, const Settings& settings) {
  const LiveStatus& s = *v.status;
  const bool silent = settings.guidance == Guidance::exam && !v.watching;
  std::vector<Line> state{{kText, v.scene->title}};
  if (s.settling) {
    state.push_back({kQuiet, "Settling..."});
  } else {
    const bool slow = s.time_factor > 0 && s.time_factor < 0.93f * s.speed && !s.paused;
    state.push_back({kQuiet, fmt::format("{}   real-time factor {:.2f}{}", clock_text(s.metrics.time_s),
                                         s.paused ? 0.0f : s.time_factor, s.speed < 1 && !slow ? "  slow motion" : "")});
    if (slow) state.push_back({kBad, "! below real time"});
    state.push_back({kQuiet, fmt::format("tick {:.1f} ms, {:.1f} fps", s.tick_ms, v.pictures_per_s)});
    if (silent) state.push_back({kQuiet, "exam: no feedback"});
    else
      for (const std::string& line : technique_lines(*v.scene, *v.seen, s.metrics)) state.push_back({kText, line});
    if (!s.doing.empty()) state.push_back({kQuiet, "surgeon: " + s.doing});
    const TechniqueRow* technique = find_technique(v.scene->technique.name);
    if (technique && settings.guidance == Guidance::learn && !v.watching) state.push_back({kAccent, technique->hint});
  }
  for (size_t k = 0; k < 2; ++k) {
    const ArmView& arm = s.arm_view[k];
    if (arm.most <= 0) continue;  // no such device
    const size_t bars = arm.most > 0 ? static_cast<size_t>(std::clamp(20 * arm.force / arm.most, 0.0f, 20.0f)) : 0;
    state.push_back(
        {*arm.off ? kBad : kQuiet,
         fmt::format("{} arm {:.1f} N {:<20}{}{}{}", arm.side == 0 ? "right" : "left", arm.force, std::string(bars, '|'),
                     arm.strength == 1 ? "" : fmt::format(" x{:.2g}", arm.strength), *arm.off ? "  no force: " : "", arm.off)});
  }
  if (!s.fault.empty()) state.push_back({kBad, "! " + s.fault});
  lines_at("state", 0, 0, 0.62f, state);

  if (!v.watching && !s.settling && !v.inside) {
    const size_t k = v.mouse->active;
    const char* speed = v.speed < 1 ? "  fine" : v.speed > 1 ? "  fast" : "";
    std::vector<Line> hand{{kText, fmt::format("{} ({} hand){}", instrument_in_hand(v, k),
                                               (k == 0) != settings.left_handed ? "right" : "left", speed)}};
    for (const std::string& line : tray_lines(*v.seen, *v.picture, k)) hand.push_back({kQuiet, line});
    if (v.steering->hand[k].snapped) {
      const HelpAt at = v.steering->hand[k].at;
      hand.push_back({kAccent, at == HelpAt::needle ? "needle: close jaws"
                               : at == HelpAt::tail ? "tail: close jaws"
                                                    : "bite: drive needle"});
    }
    if (!v.pad.empty()) hand.push_back({kQuiet, v.pad});
    lines_at("hand", 1, 1, 0.62f, hand);
  }

  if ((settings.hints || settings.guidance == Guidance::learn) && !v.watching && !v.inside)
    lines_at("keys", 0, 1, 0.5f, {{kQuiet, kHints}});

  if (!v.log->empty() && !silent) {
    std::vector<Line> log;
    for (const LogLine& line : *v.log)
      log.push_back(
          {line.bad ? kBad : kQuiet, fmt::format("{:>7} {} {}", clock_text(line.time_s), line.bad ? '!' : ' ', line.text)});
    lines_at("log", 1, 0, 0.5f, log);
  }
}

Choice pause_panel(const WorkView& view) {
  Choice choice;
  begin_at("pause", 0.5f, 0.42f, 0.94f);
  text(kAccent, "Pause");
  const std::string& fault = view.status->fault;
  if (!fault.empty()) {
    ImGui::PushTextWrapPos(32 * em());
    bad_text(fault);
    ImGui::PopTextWrapPos();
  }
  gap(0.2f);
  if (fault.empty() && wide_button("Resume (Esc)", 20)) choice.what = Chosen::resume;
  if (fault.empty() && wide_button("Step (.)", 20)) choice.what = Chosen::single_step;
  const uint32_t bites = view.status->to_take_back;
  if (bites > 0 && wide_button(fmt::format("Undo bite ({})", bites).c_str(), 20)) choice.what = Chosen::take_back;
  if (wide_button("Restart (F5)", 20)) choice.what = Chosen::restart;
  if (wide_button("Finish and review (F10)", 20)) choice.what = Chosen::finish;
  gap(0.3f);
  if (wide_button("Settings (F2)", 20)) choice.what = Chosen::settings;
  if (wide_button("Scene menu", 20)) choice.what = Chosen::start_screen;
  if (wide_button("Quit", 20)) choice.what = Chosen::quit;
  ImGui::End();
  return choice;
}

}  // namespace catgut
