// suture/closure: carries out a technique's ClosurePlan (paper 2.5: points are pulled together over time, all arriving at
// once). Reads the plan; keeps one world attachment per pulled point and one pin per pair.
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
  auto length_of = [](const ClosurePlan::Pair& p) { return p.start + p.progress * (p.end - p.start); };
  k = 0;
  for (TissuePin& pin : solver.pin) {
    if (pin.owner != PinOwner::plan) continue;
    if (k < plan.pair.size()) pin.length = length_of(plan.pair[k]);
    ++k;
  }
  for (; k < plan.pair.size(); ++k) {
    TissuePin pin;
    pin.a = plan.pair[k].a;
    pin.b = plan.pair[k].b;
    pin.length = length_of(plan.pair[k]);
    pin.compliance = plan.compliance;
    solver.pin.push_back(pin);
  }
}

}  // namespace catgut
