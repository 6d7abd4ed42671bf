// SPDX-License-Identifier: Apache-2.0
// app/window: a questionnaire: every question with its scale, a group to choose, free texts. The same panel is drawn on the
// headset's board, where a ray points.
#include <fmt/format.h>

#include <algorithm>

#include "window/panels.h"
#include "window/widgets.h"

namespace catgut {

Choice survey_panel(SurveyForm& form, const std::string& message) {
  Choice choice;
  const ImVec2 screen = ImGui::GetIO().DisplaySize;
  const float wide = std::min(screen.x - em(), 56 * em()), high = std::min(screen.y - em(), 42 * em()), foot = 2.8f * em();
  begin_box("survey", {(screen.x - wide) / 2, (screen.y - high) / 2}, {wide, high}, 0.95f);
  text(kAccent, form.title);
  ImGui::PushTextWrapPos(wide - 2 * em());
  if (!form.intro.empty()) ImGui::TextWrapped("%s", form.intro.c_str());
  if (!message.empty()) bad_text(message);
  ImGui::Separator();
  ImGui::BeginChild("questions", {0, -foot});
  if (!form.groups.empty()) {
    text(kQuiet, "Experience");
    for (const std::string& group : form.groups) {
      ImGui::SameLine();
      if (radio((group + "##group").c_str(), form.group == group)) form.group = group;
    }
    gap();
  }
  for (SurveyForm::Question& q : form.question) {
    ImGui::TextWrapped("%s", q.text.c_str());
    if (q.free) {
      char typed[1000]{};
      q.words.copy(typed, sizeof typed - 1);
      if (ImGui::InputTextMultiline(("##" + q.key).c_str(), typed, sizeof typed, {-1, 4 * em()})) q.words = typed;
    } else {
      for (int k = form.low; k <= form.high; ++k) {
        const auto label = form.label.find(k);
        if (k > form.low) ImGui::SameLine();
        const std::string name = label == form.label.end() ? fmt::format("{}", k) : fmt::format("{} {}", k, label->second);
        if (radio(fmt::format("{}##{}", name, q.key).c_str(), q.rating == k)) q.rating = k;
      }
    }
    gap();
  }
  ImGui::EndChild();
  ImGui::PopTextWrapPos();
  ImGui::Separator();
  if (form.complete() && wide_button("Store the answers", 16)) choice.what = Chosen::keep_answers;
  if (!form.complete()) text(kQuiet, "every question has one answer   ");
  ImGui::SameLine();
  if (wide_button("Leave out (Esc)", 14)) choice.what = Chosen::leave_survey;
  ImGui::End();
  return choice;
}

}  // namespace catgut
