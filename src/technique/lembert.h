// technique/lembert: interrupted stitches through both layers of a cut bowel; a locked knot draws inner and outer layer
// together there and, by the angle rule, between it and its neighbours (paper 2.5.4, figure 15).
#pragma once
#include <span>
#include <vector>

#include "technique/view.h"

namespace catgut {

struct LembertModel {
  std::vector<uint32_t> outer, inner;  // pg_o and pg_i: particles round the two rims, in order
  float gap = 0.0005f;                 // [m]
  float compliance = 1e-5f;            // [m/N]
  float fastest = 1.0f;                // [1/s] of progress
  float widest = 2.2f;                 // [rad] neighbouring stitches further apart than this are not neighbours
  int throws = 2;                      // fewer than this hold nothing
};

struct LembertState {
  std::vector<float> angle;  // [rad] round the centre, of every tied stitch in the order in which they were tied
  uint32_t checked = 0;
};

void lembert(const LembertModel& model, LembertState& state, const TechniqueView& view, ClosurePlan& plan,
             std::vector<Event>& events);

}  // namespace catgut
