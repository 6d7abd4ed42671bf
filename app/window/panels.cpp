// SPDX-License-Identifier: Apache-2.0
// app/window: see panels.h. Start, settings, work and pause; the others have their own files.
#include "window/panels.h"

#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <filesystem>

#include "window/language.h"
#include "window/widgets.h"

namespace catgut {
namespace {

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

void feedback_choice(Settings& s) {
  const std::pair<FeedbackLevel, const char*> kLevels[] = {
      {FeedbackLevel::silent, "none"}, {FeedbackLevel::stitch, "after each stitch"}, {FeedbackLevel::live, "live cues"}};
  for (const auto& [level, words] : kLevels) {
    if (level != FeedbackLevel::silent) ImGui::SameLine();
    if (radio(words, s.feedback == level)) s.feedback = level;
  }
}

// The pseudonym under which sessions are stored. Only valid letters can be typed.
void trainee_field(Settings& s, float width) {
  char typed[65]{};
  s.trainee.copy(typed, sizeof typed - 1);
  ImGui::SetNextItemWidth(width);
  const auto only_plain = [](ImGuiInputTextCallbackData* data) {
    const ImWchar c = data->EventChar;
    return c < 128 && is_pseudonym(std::string(1, static_cast<char>(c))) ? 0 : 1;
  };
  if (ImGui::InputTextWithHint("##trainee", "pseudonym", typed, sizeof typed, ImGuiInputTextFlags_CallbackCharFilter,
                               only_plain))
    s.trainee = typed;
}

void hand_choice(Settings& s) {
  if (radio("right-handed", !s.left_handed)) s.left_handed = false;
  ImGui::SameLine();
  if (radio("left-handed", s.left_handed)) s.left_handed = true;
}

void language_choice(Settings& s) {
  static const std::vector<std::string> names = language_names();
  if (radio("of the system", s.language.empty())) s.language.clear();
  for (const std::string& name : names) {
    ImGui::SameLine();
    if (radio(name.c_str(), s.language == name)) s.language = name;
  }
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
  if (ImGui::Button(tr("T  First lesson: a stitch in skin").c_str(), {-1.0f, 1.75f * em()})) choice = {Chosen::teach, 0};
  if (ImGui::Button(tr("   Next lesson: two bowel ends").c_str(), {-1.0f, 1.75f * em()})) choice = {Chosen::teach, 1};
  gap(0.3f);
  heading("Scenes");
  for (size_t i = 0; i < v.scenes->size(); ++i) {
    const SceneChoice& s = (*v.scenes)[i];
    ImGui::PushStyleVar(ImGuiStyleVar_ButtonTextAlign, {0, 0.5f});
    if (ImGui::Button(fmt::format("{}  {}##{}", i + 1, tr(s.title), s.name).c_str(), {-1.0f, 1.75f * em()}))
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
  if (settings.guidance != Guidance::exam) {
    text(kQuiet, "feedback on quality");
    feedback_choice(settings);
  }
  if (v.can_keep) {
    gap();
    heading("Trainee");
    trainee_field(settings, 14 * em());
    ImGui::SameLine();
    text(kQuiet, settings.trainee.empty() ? "sessions are not stored" : "sessions are stored");
  }
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
  if (v.headset_offered || v.headset_on) {
    bool on = v.headset_on;
    if (ImGui::Checkbox("headset (OpenXR)", &on)) choice.what = Chosen::headset;
  }
  ImGui::PushStyleColor(ImGuiCol_Text, kQuiet);
  if (!v.headset.empty()) ImGui::TextWrapped("%s", tr(v.headset).c_str());
  ImGui::TextWrapped("%s", v.pad.empty() ? tr("mouse, keyboard or gamepad").c_str() : tr("mouse, keyboard, " + v.pad).c_str());
  ImGui::PopStyleColor();
  gap();
  heading("Graphics quality");
  quality_choice(settings);
  gap();
  heading("Recordings");
  if (v.recordings->empty()) {
    text(kQuiet, "none yet");
    ImGui::PushStyleColor(ImGuiCol_Text, kQuiet);
    ImGui::TextWrapped("%s", tr(settings.record ? "every session is kept" : "sessions are not recorded").c_str());
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

Choice settings_panel(Settings& s, const std::string& file, const std::string& folder, const std::string& message,
                      bool working) {
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
    row("feedback");
    feedback_choice(s);
    row("trainee");
    trainee_field(s, 16 * em());
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
    ImGui::SliderFloat("##mouse", &s.mouse_speed, 0.2f, 4, tr("%.2f x pointer").c_str(),
                       ImGuiSliderFlags_AlwaysClamp | ImGuiSliderFlags_Logarithmic);
    row("hands");
    hand_choice(s);
    row("arm force");
    ImGui::SetNextItemWidth(14 * em());
    ImGui::SliderFloat("##right", &s.force_right, 0.2f, 2, tr("right %.2f x").c_str(), ImGuiSliderFlags_AlwaysClamp);
    ImGui::SameLine();
    ImGui::SetNextItemWidth(14 * em());
    ImGui::SliderFloat("##left", &s.force_left, 0.2f, 2, tr("left %.2f x").c_str(), ImGuiSliderFlags_AlwaysClamp);
    row("headset");
    ImGui::Checkbox(tr("remove tremor").c_str(), &s.steady_hands);
    ImGui::SameLine();
    ImGui::SetNextItemWidth(14 * em());
    ImGui::SliderFloat("##scale", &s.hand_scale, 0.2f, 1, tr("motion %.2f x").c_str(), ImGuiSliderFlags_AlwaysClamp);
    row("jaws");
    ImGui::Checkbox(tr("hold button to close").c_str(), &s.hold_to_close);
    row("grasp assist");
    ImGui::Checkbox(tr("snap to target (H)").c_str(), &s.assist);
    row("recording");
    ImGui::Checkbox(tr("every session").c_str(), &s.record);
    ImGui::SameLine();
    text(kQuiet, folder);
    row("language");
    language_choice(s);
    row("show");
    ImGui::Checkbox(tr("suture points (M)").c_str(), &s.suture_points);
    ImGui::SameLine();
    ImGui::Checkbox(tr("keys (F1)").c_str(), &s.hints);
    ImGui::SameLine();
    ImGui::Checkbox(tr("magnifier").c_str(), &s.inset);
    row("sound");
    ImGui::Checkbox(tr("tone of the active pen").c_str(), &s.sound);
    ImGui::EndTable();
  }
  if (working) text(kQuiet, "hands: from next scene");
  text(kQuiet, file.empty() ? "not saved: no config directory" : "Saved in " + file);
  ImGui::Separator();
  if (wide_button("Done (Esc)", 11)) choice.what = Chosen::leave_settings;
  ImGui::SameLine();
  if (wide_button("Defaults", 11)) {
    Settings fresh;
    fresh.trainee = s.trainee, fresh.survey = s.survey;  // who works here is not a matter of taste
    s = fresh;
  }
  ImGui::End();
  return choice;
}

void draw_panels(std::span<const PlacedPanel> panels) {
  static const ImVec4 kTone[] = {kText, kQuiet, kAccent, kBad};
  for (const PlacedPanel& p : panels) {
    begin_box(p.name.c_str(), {p.rect.x, p.rect.y}, {p.rect.w, p.rect.h}, p.alpha, kOverlay | ImGuiWindowFlags_NoScrollbar);
    if (p.progress >= 0) ImGui::ProgressBar(p.progress, {-1, 0.35f * em()}, "");
    for (const PanelLine& line : p.line) text(kTone[static_cast<size_t>(line.tone)], line.text);
    ImGui::End();
  }
}

TextSize panel_text_size() {
  const ImGuiStyle& style = ImGui::GetStyle();
  return {ImGui::CalcTextSize("0000000000").x / 10, ImGui::GetTextLineHeight() + style.ItemSpacing.y, style.WindowPadding.x,
          style.WindowPadding.y};
}

Choice pause_panel(const WorkView& view) {
  Choice choice;
  // Beside the profiler, which fills the lower right corner.
  if (view.inside) begin_at("pause", 0, 0, 0.94f);
  else begin_at("pause", 0.5f, 0.42f, 0.94f);
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
  if (wide_button(view.status->recording ? "Stop recording (R)" : "Record (R)", 20)) choice.what = Chosen::record;
  if (wide_button("Finish and review (F10)", 20)) choice.what = Chosen::finish;
  gap(0.3f);
  if (wide_button("Settings (F2)", 20)) choice.what = Chosen::settings;
  if (wide_button("Scene menu", 20)) choice.what = Chosen::start_screen;
  if (wide_button("Quit", 20)) choice.what = Chosen::quit;
  ImGui::End();
  return choice;
}

}  // namespace catgut
