// technique/seam: two bowel ends drawn together along a line (paper 2.5.2 Connell, 2.5.3 stay; figures 12 to 14).
#pragma once
#include <array>
#include <span>
#include <vector>

#include "technique/view.h"

namespace catgut {

struct SeamModel {
  bool connell = true;                       // false: stay, one bite through each end
  std::array<std::vector<uint32_t>, 2> rim;  // particles round the two ends, on the outer side, in order
  float step = 0.003f;                       // [m] dist_threshold of 2.5.2: between the pairs in between
  float gap = 0.0005f;                       // [m] what is left between two points drawn together
  float compliance = 1e-5f;                  // [m/N]
  float fastest = 1.5f;                      // [1/s] of progress
};

struct SeamState {
  uint32_t checked = 0;  // bites already judged
};

void seam(const SeamModel& model, SeamState& state, const TechniqueView& view, ClosurePlan& plan, std::vector<Event>& events);

}  // namespace catgut
