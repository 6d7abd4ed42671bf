// SPDX-License-Identifier: Apache-2.0
// app/window: results: stitch map, thread tension, events, numbers.
#include <fmt/format.h>

#include <algorithm>

#include "procedure/manager.h"
#include "window/language.h"
#include "window/panels.h"
#include "window/widgets.h"
#include "window/window.h"

namespace catgut {
namespace {

std::vector<PanelRect> moments;  // the buttons of lost points, as drawn last

std::string millimeters(float meters) { return meters < 0 ? "-" : fmt::format("{:.1f}", 1000 * meters); }

// A number with the color of its bite in the map.
void swatch(const StitchBite& b, BiteColor by, const std::string& number) {
  bool known = false;
  const float part = bite_part(b, by, known);
  const ImVec2 at = ImGui::GetCursorScreenPos();
  const float s = 0.6f * em();
  if (known)
    ImGui::GetWindowDrawList()->AddRectFilled({at.x, at.y + 0.2f * em()}, {at.x + s, at.y + 0.2f * em() + s}, scale_color(part),
                                              2);
  ImGui::Dummy({s, s});
  ImGui::SameLine(0, 0.4f * em());
  text(number);
}

void bite_table(const StitchMap& map) {
  constexpr ImGuiTableFlags kFlags = ImGuiTableFlags_ScrollY | ImGuiTableFlags_RowBg;
  if (!ImGui::BeginTable("bites", 7, kFlags)) return;
  ImGui::TableSetupScrollFreeze(0, 1);
  // Widths are given: those that follow from the contents are unknown in the first picture.
  constexpr std::pair<const char*, float> kColumn[] = {{"", 1},      {"time", 2}, {"wall", 2},  {"spacing", 3},
                                                       {"depth", 3}, {"edge", 4}, {"length", 3}};
  for (const auto& [name, part] : kColumn) ImGui::TableSetupColumn(tr(name).c_str(), ImGuiTableColumnFlags_WidthStretch, part);
  ImGui::TableHeadersRow();
  for (size_t k = 0; k < map.bite.size(); ++k) {
    const StitchBite& b = map.bite[k];
    ImGui::TableNextRow();
    ImGui::TableNextColumn();
    text(fmt::format("{}", k + 1));
    ImGui::TableNextColumn();
    text(kQuiet, fmt::format("{}", clock_text(static_cast<double>(b.tick) * map.tick_s)));
    ImGui::TableNextColumn();
    text(kQuiet, fmt::format("{}", b.wall + 1));
    ImGui::TableNextColumn();
    swatch(b, BiteColor::spacing, millimeters(b.spacing));
    ImGui::TableNextColumn();
    swatch(b, BiteColor::depth, millimeters(b.depth));
    ImGui::TableNextColumn();
    text(millimeters(b.entry_edge) + " / " + millimeters(b.exit_edge));
    ImGui::TableNextColumn();
    text(millimeters(b.length));
  }
  ImGui::EndTable();
}

// The score, why points were lost, and the scores before. A lost point plays its moment, where there is a recording of it.
void score_list(const ResultView& v, Choice& choice) {
  const assess::Result& a = v.result->assessment;
  moments.clear();
  for (const assess::Score& s : a.score) {
    text(s.passed ? kAccent : kBad, fmt::format("{} {:.0f} %", s.passed ? "+" : "!", s.percent));
    ImGui::SameLine();
    ImGui::TextWrapped("%s", s.verdict.c_str());
    if (s.lost.empty()) continue;
    gap(0.3f);
    heading("Lost points");
    std::vector<const assess::LostPoint*> lost;
    for (const assess::LostPoint& l : s.lost) lost.push_back(&l);
    std::stable_sort(lost.begin(), lost.end(),
                     [](auto* l, auto* r) { return l->critical != r->critical ? l->critical : l->points > r->points; });
    for (size_t i = 0; i < lost.size(); ++i) {
      const assess::LostPoint& l = *lost[i];
      const std::string file = recording_of(*v.result, l.tick);
      const std::string name = fmt::format("{:>4.1f}  {}##{}", -l.points, clock_text(l.time_s), i);
      ImGui::PushStyleVar(ImGuiStyleVar_ButtonTextAlign, {0, 0.5f});
      if (file.empty() || v.from_recording) text(kQuiet, name.substr(0, name.find("##")));
      else if (ImGui::Button(name.c_str(), {8.5f * em(), 0})) choice = {Chosen::moment, static_cast<size_t>(l.tick), file};
      ImGui::PopStyleVar();
      const ImVec2 low = ImGui::GetItemRectMin(), high = ImGui::GetItemRectMax();
      if (!file.empty() && !v.from_recording && ImGui::IsItemVisible())
        moments.push_back({low.x, low.y, high.x - low.x, high.y - low.y});
      if (ImGui::IsItemHovered() && !file.empty()) ImGui::SetTooltip("play this moment");
      ImGui::SameLine();
      ImGui::PushStyleColor(ImGuiCol_Text, l.critical ? kBad : kText);
      ImGui::TextWrapped("%s%s", l.critical ? "! critical: " : "", l.why.c_str());
      ImGui::PopStyleColor();
    }
  }
  if (a.score.empty()) text(kQuiet, "no rubric for this technique");
  if (v.kept.curve.size() > 1) {
    gap();
    heading(fmt::format("Learning curve: {} sessions", v.kept.curve.size()));
    std::vector<float> curve(v.kept.curve.begin(), v.kept.curve.end());
    ImGui::PlotLines("##curve", curve.data(), static_cast<int>(curve.size()), 0, nullptr, 0, 100, {-1, 5 * em()});
    text(kQuiet, fmt::format("0 to 100 %; first {:.0f}, best {:.0f}, this one {:.0f}", curve.front(),
                             *std::max_element(curve.begin(), curve.end()), curve.back()));
  }
}

// Draws visible lines only: a long session has thousands.
void event_list(const std::vector<LogLine>& log) {
  ImGuiListClipper clipper;
  clipper.Begin(static_cast<int>(log.size()));
  while (clipper.Step())
    for (int i = clipper.DisplayStart; i < clipper.DisplayEnd; ++i) {
      const LogLine& line = log[static_cast<size_t>(i)];
      text(line.bad ? kBad : kQuiet, fmt::format("{:>7} {} {}", clock_text(line.time_s), line.bad ? '!' : ' ', tr(line.text)));
    }
}

}  // namespace

std::span<const PanelRect> drawn_moments() { return moments; }

std::string recording_of(const LiveResult& result, uint64_t tick) {
  std::string file;
  for (size_t k = 0; k < result.recorded.size() && k < result.recorded_from.size(); ++k)
    if (result.recorded_from[k] <= tick) file = result.recorded[k];
  return file;
}

std::vector<LogLine> event_log(const StitchMap& map) {
  std::vector<LogLine> out;
  for (size_t i = 0; i < map.event.size(); ++i) {
    if (repeated_exit(map.event, i)) continue;
    const Event& e = map.event[i];
    LogLine line;
    line.time_s = static_cast<double>(e.tick) * map.tick_s;
    line.text = words_for(e, line.bad);
    if (!line.text.empty()) out.push_back(line);
  }
  return out;
}

Choice result_panel(const ResultView& v, BiteColor& by) {
  Choice choice;
  const LiveResult& r = *v.result;
  const ImVec2 screen = ImGui::GetIO().DisplaySize;
  const float margin = 0.6f * em();
  const ImVec2 size{screen.x - 2 * margin, screen.y - 2 * margin};
  begin_box("results", {margin, margin}, size, 0.93f);
  text(kAccent, v.scene->title);
  ImGui::SameLine();
  text(kQuiet, v.from_recording ? "Recording results" : "Results");
  if (v.known < 1) {
    ImGui::SameLine();
    text(kBad, fmt::format("! Analyzing: {:.0f} %", 100 * v.known));
  }
  if (!r.fault.empty()) bad_text(r.fault);
  ImGui::Separator();

  const float foot = 2.8f * em();
  ImGui::BeginChild("numbers", {0.36f * size.x, -foot});
  if (!v.kept.line.empty()) {
    ImGui::PushStyleColor(ImGuiCol_Text, v.kept.bad ? kBad : kQuiet);
    ImGui::TextWrapped("%s%s", v.kept.bad ? "! " : "", v.kept.line.c_str());
    ImGui::PopStyleColor();
  }
  const bool tabs = ImGui::BeginTabBar("tabs");
  if (!v.from_recording && tabs && ImGui::BeginTabItem("Score")) {
    ImGui::BeginChild("score", {0, 0});
    score_list(v, choice);
    ImGui::EndChild();
    ImGui::EndTabItem();
  }
  const bool numbers = tabs && ImGui::BeginTabItem("Numbers");
  if (numbers) {
    if (ImGui::BeginTable("rows", 2)) {
      ImGui::TableSetupColumn("name", ImGuiTableColumnFlags_WidthFixed, 13 * em());
      ImGui::TableSetupColumn("value", ImGuiTableColumnFlags_WidthStretch);
      for (const ResultRow& row : result_rows(*v.scene, r.metrics)) {
        ImGui::TableNextRow();
        ImGui::TableNextColumn();
        text(row.name == "fault" ? kBad : kQuiet, (row.name == "fault" ? "! " : "") + row.name);
        ImGui::TableNextColumn();
        ImGui::TextWrapped("%s", tr(row.value).c_str());
      }
      ImGui::EndTable();
    }
    if (v.procedure && r.procedure.begun) {
      gap();
      heading(v.procedure->title);
      for (const Feedback& f : feedback(r.procedure, *v.procedure)) {
        ImGui::PushStyleColor(ImGuiCol_Text, f.well ? kAccent : kBad);
        ImGui::TextWrapped("%s", tr((f.well ? "+ " : "! repeat: ") + f.text).c_str());
        ImGui::PopStyleColor();
      }
    }
    gap();
    heading("Events");
    ImGui::BeginChild("events", {0, 0});
    event_list(v.log);
    ImGui::EndChild();
    ImGui::EndTabItem();
  }
  if (tabs) ImGui::EndTabBar();
  ImGui::EndChild();
  ImGui::SameLine(0, em());

  ImGui::BeginChild("charts", {0, -foot});
  const ImVec2 space = ImGui::GetContentRegionAvail();
  const std::pair<BiteColor, const char*> kBy[] = {
      {BiteColor::spacing, "spacing"}, {BiteColor::depth, "depth"}, {BiteColor::edge, "edge distance"}};
  ImGui::AlignTextToFramePadding();
  text(kAccent, "Bite color");
  for (const auto& [what, name] : kBy) {
    ImGui::SameLine();
    if (radio(name, by == what)) by = what;
  }
  ImGui::SameLine(0, 1.2f * em());
  scale_legend(by, std::max(4 * em(), ImGui::GetContentRegionAvail().x - 3.2f * em()));
  ImGui::SameLine(0, 0.6f * em());
  text(kQuiet, "mm");
  text(kQuiet, "filled: entry; ring: exit; value in mm");
  stitch_map_chart(r.map, by, {space.x, 0.35f * space.y});
  gap(0.1f);
  text(kAccent, "Thread tension");
  ImGui::SameLine();
  text(kQuiet, "blue: maximum; gray: at needle");
  const uint64_t first = r.map.tension.empty() ? 0 : r.map.tension.front().tick,
                 last = r.map.tension.empty() ? 1 : r.map.tension.back().tick;
  tension_chart(r.map, first, last, -1, {space.x, 0.23f * space.y}, true);
  mark_legend();
  gap(0.1f);
  bite_table(r.map);
  ImGui::EndChild();

  ImGui::Separator();
  if (v.from_recording) {
    if (wide_button("Back (Esc)", 11)) choice.what = Chosen::leave_results;
  } else {
    if (wide_button("Retry (Enter)", 11)) choice.what = Chosen::restart;
    ImGui::SameLine();
    if (wide_button("Scene menu (Esc)", 13)) choice.what = Chosen::leave_results;
    for (const std::string& file : r.recorded) {
      ImGui::SameLine();
      if (&file == &r.recorded.back() && wide_button("Replay", 12)) choice = {Chosen::recording, 0, file};
    }
  }
  ImGui::SameLine();
  if (v.can_answer && wide_button("Questions", 9)) choice.what = Chosen::survey;
  if (v.can_answer) ImGui::SameLine();
  if (wide_button("Save JSON (J)", 11)) choice.what = Chosen::save_json;
  ImGui::SameLine();
  if (wide_button("Quit", 6)) choice.what = Chosen::quit;
  ImGui::SameLine();
  if (!v.saved.empty()) text(kQuiet, v.saved);
  else if (!r.recorded.empty() && !v.from_recording) text(kQuiet, "Recorded: " + r.recorded.back());
  ImGui::End();
  return choice;
}

}  // namespace catgut
