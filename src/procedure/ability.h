// SPDX-License-Identifier: Apache-2.0
// procedure: the abilities of scripted surgeons: novices, intermediates and experts, drawn from published spreads. They are
// keys of the scene, so a recording contains them.
#pragma once
#include <span>
#include <string>
#include <string_view>

#include "sim/scene.h"

namespace catgut {

// Means of the levels and the spread between surgeons of one level (relative standard deviation, log-normal).
struct AbilityRow {
  const char* key;  // of [surgeon]
  float SurgeonSpec::*member;
  float novice, intermediate, expert;
  float spread;
  const char* source;
};
std::span<const AbilityRow> abilities();
constexpr std::string_view kLevels[] = {"novice", "intermediate", "expert"};

// "scripted:novice" sets the abilities of `scene` to those of a surgeon drawn with the scene's seed and returns "scripted"; any
// other word is returned unchanged. Throws InputError for an unknown level.
std::string apply_ability(SceneSpec& scene, const std::string& surgeon);

}  // namespace catgut
