// SPDX-License-Identifier: Apache-2.0
// technique: which points close with which, and when (paper 2.5). A technique reads the events and geometry of the tick (bites,
// suture points, knots) and returns a ClosurePlan and fault events. It moves nothing itself.
// A technique is one row of `techniques()` and one file, which ends in its row. No other code compares its name.
#pragma once
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "anatomy/body.h"
#include "suture/suture.h"
#include "technique/lembert.h"
#include "technique/purse_string.h"
#include "technique/seam.h"

namespace catgut {

struct TechniqueRow;

// Constant during a run.
struct TechniqueModel {
  const TechniqueRow* row = nullptr;  // null: none
  PurseStringModel purse_string;
  SeamModel seam;  // connell and stay
  LembertModel lembert;
  std::shared_ptr<const void> own;  // of a registered technique: what its `begin` makes
};

// Memory of a registered technique: numbers of its own, saved and hashed as they are.
struct OwnTechniqueState {
  std::vector<uint32_t> index;
  std::vector<float> value;
};

struct TechniqueState {
  PurseStringState purse_string;
  SeamState seam;
  LembertState lembert;
  OwnTechniqueState own;
};

// Inputs of a technique from the scene.
struct TechniqueSetup {
  std::span<const Rim> rim;  // of the walls, in order
  float wall = 0;            // [m] thickness
  Vec3 anvil;                // [m] relative to the rim's center
  float anvil_radius = 0;    // [m]
  float compliance = 0;      // [m/N] of the closing constraint
  float gap = 0, step = 0;   // [m] gap of closed points, distance of interpolated pairs
  int min_bites = 0, throws = 0;
};

struct TechniqueRow {
  const char* name;              // in scene files
  const char* title;             // on screens
  const char* description;       // one sentence, for the scene reference
  const char* hint;              // on the practice screen: what to do
  const char* plan;              // of the scripted surgeon (plan_names() in surgeon/plan.h); "": none
  size_t walls;                  // number of open rims that it needs
  const char *missing, *remedy;  // message for a scene with fewer, and its remedy
  bool interrupted;              // every stitch is a suture of its own
  bool closes_opening;           // with min_bites bites at least: screens show the opening and the bites that are missing
  void (*begin)(const TechniqueSetup& setup, TechniqueModel& model);
  // Once per tick, after its substeps. events: those of the tick so far; the technique adds its own.
  void (*tick)(const TechniqueModel& model, TechniqueState& state, const TechniqueView& view, ClosurePlan& plan,
               EventList& events);
  // Whether a loaded state is consistent with a plan of so many rows and so many suture points.
  bool (*fits)(const TechniqueState& state, size_t rows, size_t points);
};
extern const TechniqueRow kPurseString, kConnell, kStay, kLembert;  // each at the end of its file

// A technique of the host program. Call it before the first scene is read; `row` stays where it is from then on. Its state is
// TechniqueState::own. Throws std::invalid_argument where the name is taken or a function is missing.
void register_technique(const TechniqueRow& row);
// Simplest first, registered ones last.
std::span<const TechniqueRow* const> techniques();
constexpr std::string_view kNoTechnique = "none";           // nothing is judged or closed
const TechniqueRow* find_technique(std::string_view name);  // null: kNoTechnique, or unknown
std::string technique_choices();                            // "purse_string|stay|...|none": the valid values of a scene's key

void technique(const TechniqueModel& model, TechniqueState& state, const TechniqueView& view, ClosurePlan& plan,
               EventList& events);
// Rows of a technique other than the scene's are empty.
bool technique_fits(const TechniqueModel& model, const TechniqueState& state, size_t rows, size_t points);

}  // namespace catgut
