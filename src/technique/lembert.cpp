// technique/lembert: see lembert.h.
#include "technique/lembert.h"

namespace catgut {

void lembert(const LembertModel&, LembertState&, const TechniqueView&, ClosurePlan&, std::vector<Event>&) {}

}  // namespace catgut
