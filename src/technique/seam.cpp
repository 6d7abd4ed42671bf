// technique/seam: see seam.h.
#include "technique/seam.h"

namespace catgut {

void seam(const SeamModel&, SeamState&, const TechniqueView&, ClosurePlan&, std::vector<Event>&) {}

}  // namespace catgut
