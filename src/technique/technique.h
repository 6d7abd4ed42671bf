// SPDX-License-Identifier: Apache-2.0
// technique: which points close with which, and when (paper 2.5). A technique reads the events and geometry of the tick (bites,
// suture points, knots) and returns a ClosurePlan and fault events. It moves nothing itself.
// A technique is one row of `techniques()` and one file, which ends in its row. No other code compares its name.
#pragma once
#include <cstdint>
#include <span>
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
};

struct TechniqueState {
  PurseStringState purse_string;
  SeamState seam;
  LembertState lembert;
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
  const char* name;
  size_t walls;                  // number of open rims that it needs
  const char *missing, *remedy;  // message for a scene with fewer, and its remedy
  bool interrupted;              // every stitch is a suture of its own
  void (*begin)(const TechniqueSetup& setup, TechniqueModel& model);
  // Once per tick, after its substeps. events: those of the tick so far; the technique adds its own.
  void (*tick)(const TechniqueModel& model, TechniqueState& state, const TechniqueView& view, ClosurePlan& plan,
               EventList& events);
  // Whether a loaded state is consistent with a plan of so many rows and so many suture points.
  bool (*fits)(const TechniqueState& state, size_t rows, size_t points);
};
extern const TechniqueRow kPurseString, kConnell, kStay, kLembert;  // each at the end of its file

std::span<const TechniqueRow* const> techniques();
const TechniqueRow* find_technique(std::string_view name);  // null: unknown name
// "purse_string|connell|...|none": the valid values of a scene's key.
const char* technique_choices();

void technique(const TechniqueModel& model, TechniqueState& state, const TechniqueView& view, ClosurePlan& plan,
               EventList& events);
// Rows of a technique other than the scene's are empty.
bool technique_fits(const TechniqueModel& model, const TechniqueState& state, size_t rows, size_t points);

}  // namespace catgut
