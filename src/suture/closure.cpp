// suture/closure: carries out a technique's ClosurePlan (paper 2.5.1: edge particles are pulled together over time, all
// arriving at once). Reads the plan; keeps one world attachment per pulled point.
#include "suture/suture.h"

namespace catgut {

void close(SolverState& solver, const ClosurePlan& plan) {
  size_t k = 0;
  for (Attachment& a : solver.attach) {
    if (a.body >= 0) continue;
    if (k < plan.pull.size()) a.target = lerp(plan.pull[k].from, plan.pull[k].to, plan.progress);
    ++k;
  }
  for (; k < plan.pull.size(); ++k) {
    Attachment a;
    a.point = plan.pull[k].point;
    a.target = lerp(plan.pull[k].from, plan.pull[k].to, plan.progress);
    a.compliance = plan.compliance;
    solver.attach.push_back(a);
  }
}

}  // namespace catgut
