// technique: chooses by kind; see technique.h.
#include "technique/technique.h"

namespace catgut {

void technique(const TechniqueModel& model, TechniqueState& state, const TechniqueView& view, ClosurePlan& plan,
               EventList& events) {
  switch (model.kind) {
    case TechniqueKind::none:
      return;
    case TechniqueKind::purse_string:
      return purse_string(model.purse_string, state.purse_string, view, plan, events);
    case TechniqueKind::connell:
    case TechniqueKind::stay:
      return seam(model.seam, state.seam, view, plan, events);
    case TechniqueKind::lembert:
      return lembert(model.lembert, state.lembert, view, plan, events);
  }
}

}  // namespace catgut
