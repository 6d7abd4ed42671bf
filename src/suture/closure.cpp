// SPDX-License-Identifier: Apache-2.0
// suture/closure: carries out a technique's ClosurePlan (paper 2.5: points are pulled together over time, all arriving at
// once). Reads the plan; keeps one world attachment per pulled point and one tether per pair.
#include "suture/suture.h"

namespace catgut {

namespace {

void close(SolverState& solver, uint32_t suture, const ClosurePlan& plan) {
  const auto target = [&](size_t k) { return lerp(plan.pull[k].from, plan.pull[k].to, plan.progress); };
  size_t k = 0;
  for (Attachment& a : solver.attach) {
    if (a.body >= 0 || a.suture != suture) continue;
    if (k < plan.pull.size()) a.target = target(k);
    ++k;
  }
  for (; k < plan.pull.size(); ++k) {
    Attachment a;
    a.point = plan.pull[k].point;
    a.suture = suture;
    a.target = target(k);
    a.compliance = plan.compliance;
    solver.attach.push_back(a);
  }
  const auto length_of = [](const ClosurePlan::Pair& p) { return p.start + p.progress * (p.end - p.start); };
  k = 0;
  for (Tether& pin : solver.pin) {
    if (pin.owner != TetherOwner::plan || pin.suture != suture) continue;
    if (k < plan.pair.size()) pin.length = length_of(plan.pair[k]);
    ++k;
  }
  for (; k < plan.pair.size(); ++k) {
    Tether pin;
    pin.a = plan.pair[k].a;
    pin.b = plan.pair[k].b;
    pin.length = length_of(plan.pair[k]);
    pin.compliance = plan.compliance;
    pin.suture = suture;
    solver.pin.push_back(pin);
  }
}

}  // namespace

void close(SolverState& solver, std::span<const ClosurePlan> plan) {
  for (size_t k = 0; k < plan.size(); ++k) close(solver, static_cast<uint32_t>(k), plan[k]);
}

}  // namespace catgut
