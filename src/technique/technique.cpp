// SPDX-License-Identifier: Apache-2.0
// technique: the table of techniques; see technique.h.
#include "technique/technique.h"

#include <algorithm>
#include <stdexcept>

namespace catgut {
namespace {

const TechniqueRow* const kBuiltIn[] = {&kPurseString, &kStay, &kConnell, &kLembert};

std::vector<const TechniqueRow*>& table() {
  static std::vector<const TechniqueRow*> rows(std::begin(kBuiltIn), std::end(kBuiltIn));
  return rows;
}

bool is_built_in(const TechniqueRow* row) {
  return std::find(std::begin(kBuiltIn), std::end(kBuiltIn), row) != std::end(kBuiltIn);
}

}  // namespace

void register_technique(const TechniqueRow& row) {
  const auto refuse = [&](const std::string& why) {
    throw std::invalid_argument("technique \"" + std::string(row.name) + "\" " + why);
  };
  if (row.name == kNoTechnique || find_technique(row.name)) refuse("is there already");
  if (!row.begin || !row.tick || !row.fits) refuse("lacks begin, tick or fits");
  table().push_back(&row);
}

std::span<const TechniqueRow* const> techniques() { return table(); }

const TechniqueRow* find_technique(std::string_view name) {
  const auto at = std::find_if(table().begin(), table().end(), [&](const TechniqueRow* r) { return r->name == name; });
  return at != table().end() ? *at : nullptr;
}

std::string technique_choices() {
  std::string all;
  for (const TechniqueRow* r : techniques()) all += std::string(r->name) + "|";
  return all.append(kNoTechnique);
}

void technique(const TechniqueModel& model, TechniqueState& state, const TechniqueView& view, ClosurePlan& plan,
               EventList& events) {
  if (model.row) model.row->tick(model, state, view, plan, events);
}

bool technique_fits(const TechniqueModel& model, const TechniqueState& state, size_t rows, size_t points) {
  const bool others_empty = std::all_of(std::begin(kBuiltIn), std::end(kBuiltIn), [&](const TechniqueRow* r) {
    const bool own = model.row && r->fits == model.row->fits;  // connell and stay share their state
    return r->fits(state, own ? rows : 0, points);
  });
  if (model.row && !is_built_in(model.row)) return others_empty && model.row->fits(state, rows, points);
  return others_empty && state.own.index.empty() && state.own.value.empty();
}

}  // namespace catgut
