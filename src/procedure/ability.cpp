// SPDX-License-Identifier: Apache-2.0
// procedure: see ability.h.
#include "procedure/ability.h"

#include <cmath>
#include <vector>

#include "core/check.h"
#include "core/elementary.h"
#include "core/random.h"
#include "procedure/scene_fields.h"

namespace catgut {
namespace {

// docs/assessment.md, "Scripted surgeons", explains every number.
constexpr AbilityRow kAbility[] = {
    {"tremor", &SurgeonSpec::tremor, 0.20e-3f, 0.10e-3f, 0.05e-3f, 0.25f,
     "hand at rest 0.05 to 0.2 mm: PMC3989364, Riviere 1997"},
    {"aim_error", &SurgeonSpec::aim_error, 1.2e-3f, 0.8e-3f, 0.4e-3f, 0.25f,
     "1.7 mm in a stride of 20 mm: Seki 1987, Jpn J Surg 17"},
    {"angle_error", &SurgeonSpec::angle_error, 0.25f, 0.16f, 0.08f, 0.25f,
     "9.4 deg of 22 tracks: Seki 1993, 10.1007/BF00311623"},
    {"speed", &SurgeonSpec::speed, 0.11f, 0.13f, 0.15f, 0.15f, "time 37.7 (7.1) to 25.5 (7.8) min: 10.1007/s00464-022-09584-1"},
    {"drive_speed", &SurgeonSpec::drive_speed, 0.02f, 0.025f, 0.03f, 0.15f, "as speed"},
    {"pause", &SurgeonSpec::pause, 1.1f, 0.6f, 0.2f, 0.30f, "as speed"},
    {"tension_error", &SurgeonSpec::tension_error, 0.4f, 0.25f, 0.1f, 0.25f,
     "3 N (SD 1.2 N): Horeman 2013, 10.1371/journal.pone.0084466"},
    {"grasp_error", &SurgeonSpec::grasp_error, 0.15f, 0.06f, 0.02f, 0.25f, "assumed"},
    {"order_error", &SurgeonSpec::order_error, 0.07f, 0.03f, 0.005f, 0.25f, "failure to cross hands 7 %: Rogers 2002"},
};

}  // namespace

std::span<const AbilityRow> abilities() { return kAbility; }

std::string apply_ability(SceneSpec& scene, const std::string& surgeon) {
  constexpr std::string_view kPrefix = "scripted:";
  if (surgeon.rfind(kPrefix, 0) != 0) return surgeon;
  const std::string level = surgeon.substr(kPrefix.size());
  size_t column = 0;
  while (column < std::size(kLevels) && kLevels[column] != level) ++column;
  if (column == std::size(kLevels)) {
    const std::string nearest = nearest_word(level, std::vector<std::string>(std::begin(kLevels), std::end(kLevels)));
    throw InputError("--surgeon " + surgeon, "there is no level \"" + level + "\"",
                     nearest.empty() ? "there are novice, intermediate and expert" : "did you mean \"" + nearest + "\"?");
  }
  Random random(scene.seed * 3 + column);
  for (const AbilityRow& row : kAbility) {
    const float mean = column == 0 ? row.novice : column == 1 ? row.intermediate : row.expert;
    const float draw = random.normal();
    scene.surgeon.*row.member = mean * portable::exp(row.spread * draw - 0.5f * row.spread * row.spread);
  }
  return "scripted";
}

}  // namespace catgut
