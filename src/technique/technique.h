// technique: which points close with which, and when (paper 2.5). A technique reads what happened in the tick (bites, suture
// points, knots, events) and answers with a ClosurePlan and with events that say what was wrong. It moves nothing itself.
// One struct of data per technique and one function each; `technique` below chooses by kind.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "suture/suture.h"
#include "technique/lembert.h"
#include "technique/purse_string.h"
#include "technique/seam.h"

namespace catgut {

enum class TechniqueKind : uint8_t { none, purse_string, connell, stay, lembert };

// Constant during a run.
struct TechniqueModel {
  TechniqueKind kind = TechniqueKind::none;
  PurseStringModel purse_string;
  SeamModel seam;  // connell and stay
  LembertModel lembert;
};

struct TechniqueState {
  PurseStringState purse_string;
  SeamState seam;
  LembertState lembert;
};

// Once a tick, after its substeps. events: those of the tick so far; the technique adds its own.
void technique(const TechniqueModel& model, TechniqueState& state, const TechniqueView& view, ClosurePlan& plan,
               EventList& events);

}  // namespace catgut
