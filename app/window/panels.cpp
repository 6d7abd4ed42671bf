// app/window: see panels.h. Start, settings, work and pause; the others have files of their own.
#include "window/panels.h"

#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <filesystem>

#include "window/widgets.h"

namespace catgut {
namespace {

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
    "F2  F3  F12      settings, inside, picture\n"
    "Esc              pause     F1 hide this";

void quality_choice(Settings& s) {
  for (const Quality q : {Quality::draft, Quality::medium, Quality::good}) {
    if (q != Quality::draft) ImGui::SameLine();
    if (radio(quality_name(q), s.quality == q)) s.quality = q;
  }
}

void guidance_choice(Settings& s) {
  const std::pair<Guidance, const char*> kLevels[] = {{Guidance::learn, "learn: where the needle should go is shown"},
                                                      {Guidance::practise, "practise: what happens is told in words"},
                                                      {Guidance::exam, "exam: no help and no word until the end"}};
  for (const auto& [level, words] : kLevels)
    if (radio(words, s.guidance == level)) s.guidance = level;
}

void hand_choice(Settings& s) {
  if (radio("right-handed", !s.left_handed)) s.left_handed = false;
  ImGui::SameLine();
  if (radio("left-handed", s.left_handed)) s.left_handed = true;
}

}  // namespace

Choice start_panel(const StartView& v, Settings& settings, bool& watch) {
  Choice choice;
  const ImVec2 screen = ImGui::GetIO().DisplaySize;
  const float wide = std::min(screen.x - em(), 58 * em()), high = std::min(screen.y - em(), 36 * em());
  begin_box("start", {(screen.x - wide) / 2, (screen.y - high) / 2}, {wide, high}, 0.92f);
  text(kAccent, "Catgut");
  ImGui::SameLine();
  text(kQuiet, "open surgery, stitch by stitch");
  ImGui::Separator();
  if (!v.message.empty()) bad_text(v.message);
  const float foot = 3.0f * em();
  ImGui::BeginChild("procedures", {0.53f * wide, -foot});
  if (ImGui::Button("T  Teach me: a first stitch", {-1.0f, 1.75f * em()})) choice.what = Chosen::teach;
  gap(0.3f);
  heading("Procedure and technique");
  for (size_t i = 0; i < v.scenes->size(); ++i) {
    const SceneChoice& s = (*v.scenes)[i];
    ImGui::PushStyleVar(ImGuiStyleVar_ButtonTextAlign, {0, 0.5f});
    if (ImGui::Button(fmt::format("{}  {}##{}", i + 1, s.title, s.name).c_str(), {-1.0f, 1.75f * em()}))
      choice = {Chosen::scene, i};
    ImGui::PopStyleVar();
    ImGui::Indent(1.6f * em());
    text(kQuiet,
         fmt::format("{}; on {}", s.technique == "none" ? "no technique: free practice" : "technique: " + s.technique, s.body));
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
    text(kQuiet, "as the command line says");
  } else {
    if (radio("mine", !watch)) watch = false;
    ImGui::SameLine();
    if (radio("watch the scripted surgeon", watch)) watch = true;
  }
  hand_choice(settings);
  ImGui::PushStyleColor(ImGuiCol_Text, kQuiet);
  ImGui::TextWrapped("%s",
                     v.pad.empty() ? "mouse and keyboard; a gamepad may be plugged in" : ("mouse, keyboard, " + v.pad).c_str());
  ImGui::PopStyleColor();
  gap();
  heading("Picture");
  quality_choice(settings);
  gap();
  heading("Recordings in this folder");
  if (v.recordings->empty()) text(kQuiet, "none yet: catgut play --record FILE.cgrec");
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
  text(kQuiet, " 1 .. 9, Enter: begin");
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
    row("picture");
    quality_choice(s);
    row("text size");
    ImGui::SetNextItemWidth(16 * em());
    // Only when it is let go: a panel that grows under the pointer runs away from it.
    static float wanted = 0;
    if (wanted == 0) wanted = s.text_size;
    ImGui::SliderFloat("##text", &wanted, 0.7f, 2, "%.2f x", ImGuiSliderFlags_AlwaysClamp);
    if (ImGui::IsItemDeactivatedAfterEdit()) s.text_size = wanted;
    if (!ImGui::IsItemActive()) wanted = s.text_size;
    row("mouse");
    ImGui::SetNextItemWidth(16 * em());
    ImGui::SliderFloat("##mouse", &s.mouse_speed, 0.2f, 4, "%.2f x of the pointer",
                       ImGuiSliderFlags_AlwaysClamp | ImGuiSliderFlags_Logarithmic);
    row("hands");
    hand_choice(s);
    row("jaw");
    ImGui::Checkbox("closes only while the button is down", &s.hold_to_close);
    row("help");
    ImGui::Checkbox("an open jaw finds the needle (H)", &s.assist);
    row("show");
    ImGui::Checkbox("suture points (M)", &s.suture_points);
    ImGui::SameLine();
    ImGui::Checkbox("keys (F1)", &s.hints);
    ImGui::EndTable();
  }
  if (working) text(kQuiet, "picture and hands change with the next scene");
  text(kQuiet, file.empty() ? "not kept: this user has no folder for settings" : "kept in " + file);
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
    state.push_back({kQuiet, "the tissue comes to rest"});
  } else {
    const int seconds = static_cast<int>(s.practice.time_s);
    const bool slow = s.time_factor > 0 && s.time_factor < 0.93f * s.speed && !s.paused;
    state.push_back({kQuiet, fmt::format("{}:{:02}   time x {:.2f}{}", seconds / 60, seconds % 60,
                                         s.paused ? 0.0f : s.time_factor, s.speed < 1 && !slow ? "  slow motion" : "")});
    if (slow) state.push_back({kBad, "! this machine is too slow"});
    state.push_back({kQuiet, fmt::format("tick {:.1f} ms, {:.1f} pictures/s", s.tick_ms, v.pictures_per_s)});
    if (silent) state.push_back({kQuiet, "exam: no word until the end"});
    else
      for (const std::string& line : technique_lines(*v.scene, *v.seen, s.practice)) state.push_back({kText, line});
    if (!s.doing.empty()) state.push_back({kQuiet, "surgeon: " + s.doing});
  }
  if (!s.fault.empty()) state.push_back({kBad, "! " + s.fault});
  lines_at("state", 0, 0, 0.62f, state);

  if (!v.watching && !s.settling && !v.inside) {
    const size_t k = v.mouse->active;
    const char* speed = v.speed < 1 ? "  fine" : v.speed > 1 ? "  fast" : "";
    std::vector<Line> hand{{kText, fmt::format("{} ({} hand){}", k == 0 ? "needle driver" : "forceps",
                                               (k == 0) != settings.left_handed ? "right" : "left", speed)}};
    if (v.steering->hand[k].snapped) {
      const HelpAt at = v.steering->hand[k].at;
      hand.push_back({kAccent, at == HelpAt::needle ? "at the needle: close the jaw"
                               : at == HelpAt::tail ? "at the tail: close the jaw"
                                                    : "at the bite: drive the needle"});
    }
    if (!v.pad.empty()) hand.push_back({kQuiet, v.pad});
    lines_at("hand", 1, 1, 0.62f, hand);
  }

  if ((settings.hints || settings.guidance == Guidance::learn) && !v.watching && !v.inside)
    lines_at("keys", 0, 1, 0.5f, {{kQuiet, kHints}});

  if (!v.log->empty() && !silent) {
    std::vector<Line> log;
    for (const LogLine& line : *v.log)
      log.push_back({line.bad ? kBad : kQuiet, fmt::format("{:6.1f} {} {}", line.time_s, line.bad ? '!' : ' ', line.text)});
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
  if (fault.empty() && wide_button("Go on (Esc)", 20)) choice.what = Chosen::resume;
  if (fault.empty() && wide_button("One tick (.)", 20)) choice.what = Chosen::single_step;
  const uint32_t bites = view.status->to_take_back;
  if (bites > 0 && wide_button(fmt::format("Take back the last bite ({})", bites).c_str(), 20)) choice.what = Chosen::take_back;
  if (wide_button("Begin again (F5)", 20)) choice.what = Chosen::restart;
  if (wide_button("Finish and look back (F10)", 20)) choice.what = Chosen::finish;
  gap(0.3f);
  if (wide_button("Settings (F2)", 20)) choice.what = Chosen::settings;
  if (wide_button("Another scene", 20)) choice.what = Chosen::start_screen;
  if (wide_button("Quit", 20)) choice.what = Chosen::quit;
  ImGui::End();
  return choice;
}

}  // namespace catgut
