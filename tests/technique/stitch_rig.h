// SPDX-License-Identifier: Apache-2.0
// tests/technique: a synthetic view: particles anywhere, bites through them, any length of thread, any knots.
#pragma once
#include <gtest/gtest.h>

#include "technique/technique.h"

namespace catgut {

constexpr float kTick = 1.0f / 60;
constexpr bool kIn = true, kOut = false;  // on the mucosa, on the serosa

struct StitchRig {
  std::vector<Vec4> x;
  std::vector<StitchPoint> point;
  std::vector<Bite> bite;
  std::vector<Knot> knot;
  std::vector<Event> events;  // all so far
  EventList now;              // those of the next tick that come before the technique
  ClosurePlan plan;
  uint32_t taken = 0;
  bool needle_in_tissue = false;
  uint32_t own_suture = 0;  // of several, with
  std::vector<ClosurePlan> plan_of;
  std::vector<TechniqueState> state_of;

  uint32_t particle(Vec3 p) {
    x.push_back(catgut::point(p));
    return static_cast<uint32_t>(x.size()) - 1;
  }
  // A complete bite: in at `entry`, out at `exit`. `slack` [m] of thread lies before it.
  void pass(uint32_t wall, uint32_t entry, bool entry_inside, uint32_t exit, bool exit_inside, float slack = 0.1f) {
    if (!point.empty()) point.back().span = slack;
    Bite b;
    b.complete = b.has_exit = true;
    bite.push_back(b);
    const uint32_t which = static_cast<uint32_t>(bite.size()) - 1;
    for (const auto& [at, inside, out] : {std::tuple{entry, entry_inside, false}, std::tuple{exit, exit_inside, true}}) {
      StitchPoint p;
      p.point = particle_point(at);
      p.bite = which, p.wall = wall, p.inside = inside, p.exit = out, p.span = out ? 0.0f : 0.005f;
      point.push_back(p);
    }
  }
  void begin_knot(uint32_t which = 0) { now.add({EventKind::throw_started, 0, which, 1, {}}); }
  // One more throw of the newest knot locks.
  void lock(bool new_knot = false) {
    if (knot.empty() || new_knot) knot.push_back({});
    knot.back().phase = KnotPhase::locked;
    ++knot.back().throws;
    now.add({EventKind::throw_locked, 0, static_cast<uint32_t>(knot.size()) - 1, 1, {}});
  }
  void fresh_suture() {
    ++taken;
    point.clear();
    knot.clear();
    now.add({EventKind::suture_loaded, 0, taken - 1, 0, {}});
  }
  template <typename Model, typename State, typename Technique>
  void tick(const Model& model, State& state, Technique&& technique) {
    for (StitchPoint& p : point) p.at = position_of(p.point, x.data());
    TechniqueView view;
    view.point = point, view.bite = bite, view.knot = knot, view.x = x.data();
    view.needle_in_tissue = needle_in_tissue, view.suture_index = taken, view.dt = kTick;
    view.suture = own_suture, view.plan_of = plan_of, view.state_of = state_of;
    technique(model, state, view, plan, now);
    events.insert(events.end(), now.begin(), now.end());
    now.clear();
  }
  // Tissue that follows the plan at once: each pair moves toward its midpoint.
  void follow() {
    for (const ClosurePlan::Pair& p : plan.pair) {
      const Vec3 apart = position_of(p.b, x.data()) - position_of(p.a, x.data());
      const float want = p.start + p.progress * (p.end - p.start), l = length(apart);
      if (l <= want || l == 0) continue;
      const Vec3 way = apart * (0.5f * (l - want) / l);
      for (uint32_t k = 0; k < p.a.count; ++k) add(x[p.a.particle[k]], way);
      for (uint32_t k = 0; k < p.b.count; ++k) add(x[p.b.particle[k]], -way);
    }
  }
  size_t count(EventKind kind) const {
    return static_cast<size_t>(std::count_if(events.begin(), events.end(), [&](const Event& e) { return e.kind == kind; }));
  }
  // Bites and knots named by the faults of this kind.
  std::vector<uint32_t> faults(Fault fault) const {
    std::vector<uint32_t> which;
    for (const Event& e : events)
      if (e.kind == EventKind::technique_fault && e.fault == fault) which.push_back(e.which);
    return which;
  }
  float gap(size_t row) const {
    return distance(position_of(plan.pair[row].a, x.data()), position_of(plan.pair[row].b, x.data()));
  }
};

using Bites = std::vector<uint32_t>;

}  // namespace catgut
