// SPDX-License-Identifier: Apache-2.0
// app/window: the profiler: stage times, constraint forces and live parameters.
#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "window/panels.h"
#include "window/widgets.h"

namespace catgut {

Choice developer_panel(const WorkView& v, bool can_touch) {
  Choice choice;
  const Measures& m = v.status->measures;
  begin_at("inside", 1, 1, 0.86f);
  text(kAccent, "Profiler (F3)");
  ImGui::SameLine();
  if (m.particles == 0) text(kQuiet, "measured while time runs: Esc");
  else {
    const std::string mechanics = m.physical ? fmt::format("thread, {} awake), {} columns of the wall", m.awake, m.columns)
                                             : fmt::format("thread), {} clusters", m.clusters);
    text(kQuiet, fmt::format("{} particles ({} {}, {} contacts, {} dropped ticks", m.particles, m.thread_particles, mechanics,
                             m.contacts, v.status->late));
    if (m.without_room > 0)
      bad_text(fmt::format("{} contacts found no room: what touched there could pass through", m.without_room));
  }
  float most = 0.05f, all = 0;
  for (float ms : m.stage_ms) most = std::max(most, ms), all += ms;
  if (ImGui::BeginTable("inside", 2, ImGuiTableFlags_SizingFixedFit)) {
    ImGui::TableNextColumn();
    text(kQuiet, fmt::format("stages, {:.2f} ms per tick", all));
    for (size_t k = 0; k < m.stage_ms.size(); ++k) {
      const ImVec2 at = ImGui::GetCursorScreenPos();
      const float wide = 13 * em();
      ImGui::GetWindowDrawList()->AddRectFilled({at.x, at.y + 1}, {at.x + wide * m.stage_ms[k] / most, at.y + em()},
                                                ImGui::GetColorU32(ImVec4{kAccent.x, kAccent.y, kAccent.z, 0.28f}), 2);
      text(fmt::format("{:<15}{:7.3f} ms", stage_name(static_cast<Stage>(k)), m.stage_ms[k]));
      ImGui::SameLine(0, 0);
      ImGui::Dummy({1.2f * em(), em()});
    }
    ImGui::TableNextColumn();
    text(kQuiet, "max force by type");
    for (const ForceMeasure& f : m.force) text(fmt::format("{:<19}{:8.3f} N  of {}", f.name, f.peak_n, f.count));
    gap(0.3f);
    text(kQuiet, can_touch ? "parameters" : "parameters (Esc to edit)");
    // A slider that is being dragged keeps its own value until release: every change rebuilds the model.
    static std::array<float, kLiveParameters> moved{};
    static int active = -1;
    for (size_t k = 0; k < kLiveParameters; ++k) {
      const LiveParameter& p = live_parameters()[k];
      if (active != static_cast<int>(k)) moved[k] = p.value(*v.scene);
      if (!can_touch) {
        text(fmt::format("{:<29}{:9.4g}", p.key, moved[k]));
        continue;
      }
      ImGui::SetNextItemWidth(8 * em());
      ImGui::SliderFloat(p.key, &moved[k], p.low, p.high, "%.4g",
                         ImGuiSliderFlags_AlwaysClamp | (p.low > 0 ? ImGuiSliderFlags_Logarithmic : 0));
      if (ImGui::IsItemActive()) active = static_cast<int>(k);
      else if (active == static_cast<int>(k)) active = -1;
      if (ImGui::IsItemDeactivatedAfterEdit()) choice = {Chosen::change, 0, fmt::format("{}={:.6g}", p.key, moved[k])};
    }
    ImGui::EndTable();
  }
  if (!v.status->refused.empty()) {
    ImGui::PushTextWrapPos(45 * em());
    bad_text(v.status->refused);
    ImGui::PopTextWrapPos();
  }
  ImGui::End();
  return choice;
}

}  // namespace catgut
