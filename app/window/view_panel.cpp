// SPDX-License-Identifier: Apache-2.0
// app/window: the replay viewer's panels: status, and a time line.
#include <fmt/format.h>

#include <algorithm>

#include "window/language.h"
#include "window/panels.h"
#include "window/widgets.h"

namespace catgut {
namespace {

constexpr float kSpeeds[] = {0.1f, 0.25f, 0.5f, 1, 2, 4, 8};
constexpr size_t kWordsShown = 7;

const char* kViewKeys =
    "space            play, pause\n"
    "left right       1 s back, forward\n"
    ",  .             1 tick back, forward\n"
    "- +              slower, faster\n"
    "drag, wheel      orbit, zoom\n"
    "Home  M          reset camera, suture points\n"
    "F5  Enter        to start, results\n"
    "F1  Esc          hide keys, back";

}  // namespace

Choice view_panel(const PlayedView& v, const Settings& settings) {
  Choice choice;
  const PlaybackStatus& s = *v.status;
  std::vector<Line> about{{kText, v.scene->title}, {kQuiet, v.file}};
  about.push_back({kQuiet, fmt::format("recorded by {}, {} ticks", v.version, s.ticks)});
  if (!v.cut.empty()) about.push_back({kBad, "! truncated: " + v.cut});
  if (!s.fault.empty()) about.push_back({kBad, "! " + s.fault});
  if (s.differs_at) {
    about.push_back({kBad, fmt::format("! diverges at tick {}", *s.differs_at)});
    about.push_back({kBad, "  other version or damaged file"});
  } else if (s.known < s.ticks) {
    const double part = static_cast<double>(s.known) / std::max<double>(1, static_cast<double>(s.ticks));
    about.push_back({kQuiet, fmt::format("verifying hashes: {:.0f} %", 100 * part)});
  } else {
    about.push_back({kAccent, "all hashes verified"});
  }
  for (const std::string& line : technique_lines(*v.scene, *v.seen, v.result->metrics))
    if (line.find(" N") != std::string::npos || line.find("needle in tissue") != std::string::npos)
      about.push_back({kText, line});
  lines_at("recording", 0, 0, 0.66f, about);
  if (v.gaze) {
    ImDrawList& over = *ImGui::GetBackgroundDrawList();
    const ImVec2 at{(*v.gaze)[0], (*v.gaze)[1]};
    over.AddCircle(at, 1.1f * em(), ImGui::GetColorU32(kAccent), 32, 2);
    over.AddText({at.x + 1.3f * em(), at.y - 0.5f * em()}, ImGui::GetColorU32(kAccent), "wearer looks here");
  }

  // Recent events, up to the shown moment.
  std::vector<Line> happened;
  const std::vector<Event>& events = v.result->map.event;
  auto e =
      std::upper_bound(events.begin(), events.end(), s.first + s.at, [](uint64_t at, const Event& o) { return at < o.tick; });
  while (e != events.begin() && happened.size() < kWordsShown) {
    --e;
    if (repeated_exit(events, static_cast<size_t>(e - events.begin()))) continue;
    bool bad = false;
    const std::string words = words_for(*e, bad);
    if (words.empty()) continue;
    happened.insert(happened.begin(),
                    {bad ? kBad : kQuiet, fmt::format("{:>7} {} {}", clock_text(static_cast<double>(e->tick) * s.tick_s),
                                                      bad ? '!' : ' ', tr(words))});
  }
  if (happened.empty()) happened.push_back({kQuiet, "no events yet"});
  lines_at("happened", 1, 0, 0.55f, happened);

  const ImVec2 screen = ImGui::GetIO().DisplaySize;
  const float margin = 0.6f * em(), high = 7.4f * em();
  if (settings.hints) lines_at("keys", 0, 1, 0.5f, {{kQuiet, kViewKeys}}, high + margin);

  begin_box("time", {margin, screen.y - high - margin}, {screen.x - 2 * margin, high}, 0.85f, ImGuiWindowFlags_NoScrollbar);
  // The time line: tension behind, marks on it, the part not scanned yet darker. Click or drag to seek.
  const ImVec2 at = ImGui::GetCursorScreenPos(), size{ImGui::GetContentRegionAvail().x, 2.6f * em()};
  const double all = std::max<double>(1, static_cast<double>(s.ticks));
  ImGui::InvisibleButton("line", size);
  if (ImGui::IsItemActive()) {
    const double part = std::clamp(static_cast<double>((ImGui::GetIO().MousePos.x - at.x) / size.x), 0.0, 1.0);
    choice = {Chosen::go_to, static_cast<size_t>(part * all + 0.5)};
  }
  ImGui::SetCursorScreenPos(at);
  tension_chart(v.result->map, s.first, s.first + s.ticks, static_cast<double>(s.first + s.at), size, false);
  if (s.known < s.ticks) {
    const float x = at.x + size.x * static_cast<float>(static_cast<double>(s.known) / all);
    ImGui::GetWindowDrawList()->AddRectFilled({x, at.y}, {at.x + size.x, at.y + size.y},
                                              ImGui::GetColorU32(ImVec4{0, 0, 0, 0.55f}));
  }
  mark_legend();
  ImGui::SameLine(0, 1.2f * em());
  text(kQuiet, "blue: thread tension");
  gap(0.05f);
  if (ImGui::Button(tr(s.playing ? "Pause (space)" : "Play (space)").c_str(), {9 * em(), 0}))
    choice.what = Chosen::play_or_hold;
  ImGui::SameLine();
  if (ImGui::Button("<< 5 s", {4.5f * em(), 0})) choice = {Chosen::go_by, 0, "", -static_cast<int64_t>(5 / s.tick_s)};
  ImGui::SameLine();
  if (ImGui::Button("5 s >>", {4.5f * em(), 0})) choice = {Chosen::go_by, 0, "", static_cast<int64_t>(5 / s.tick_s)};
  ImGui::SameLine(0, em());
  text(fmt::format("{} / {}", clock_text(static_cast<double>(s.first + s.at) * s.tick_s),
                   clock_text(static_cast<double>(s.first + s.ticks) * s.tick_s)));
  ImGui::SameLine(0, em());
  for (const float speed : kSpeeds) {
    const bool on = std::abs(s.speed - speed) < 0.01f;
    if (on) ImGui::PushStyleColor(ImGuiCol_Button, ImGui::GetStyle().Colors[ImGuiCol_ButtonActive]);
    if (ImGui::Button(fmt::format("{:g}x", speed).c_str())) choice = {Chosen::speed, 0, "", 0, speed};
    if (on) ImGui::PopStyleColor();
    ImGui::SameLine(0, 0.3f * em());
  }
  ImGui::SameLine(0, em());
  if (ImGui::Button(tr("Results (Enter)").c_str())) choice.what = Chosen::sewn;
  ImGui::SameLine();
  if (ImGui::Button(tr("Back (Esc)").c_str())) choice.what = Chosen::start_screen;
  ImGui::End();
  return choice;
}

}  // namespace catgut
