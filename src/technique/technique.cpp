// SPDX-License-Identifier: Apache-2.0
// technique: the table of techniques; see technique.h.
#include "technique/technique.h"

#include <algorithm>
#include <array>
#include <string>

namespace catgut {
namespace {

constexpr std::array<const TechniqueRow*, 4> kTechnique{&kPurseString, &kConnell, &kStay, &kLembert};

}  // namespace

std::span<const TechniqueRow* const> techniques() { return kTechnique; }

const TechniqueRow* find_technique(std::string_view name) {
  const auto at = std::find_if(kTechnique.begin(), kTechnique.end(), [&](const TechniqueRow* r) { return r->name == name; });
  return at != kTechnique.end() ? *at : nullptr;
}

const char* technique_choices() {
  static const std::string choices = [] {
    std::string all;
    for (const TechniqueRow* r : kTechnique) all += std::string(r->name) + "|";
    return all + "none";
  }();
  return choices.c_str();
}

void technique(const TechniqueModel& model, TechniqueState& state, const TechniqueView& view, ClosurePlan& plan,
               EventList& events) {
  if (model.row) model.row->tick(model, state, view, plan, events);
}

bool technique_fits(const TechniqueModel& model, const TechniqueState& state, size_t rows, size_t points) {
  return std::all_of(kTechnique.begin(), kTechnique.end(), [&](const TechniqueRow* r) {
    const bool own = model.row && r->fits == model.row->fits;  // connell and stay share their state
    return r->fits(state, own ? rows : 0, points);
  });
}

}  // namespace catgut
