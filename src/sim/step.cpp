// SPDX-License-Identifier: Apache-2.0
// sim/step: THE stage list; physical mechanics have theirs in sim/physical_step. Reads one TickInput, advances the state by one
// tick, leaves the tick's events in it.
#include <algorithm>

#include "sim/hands.h"
#include "sim/model.h"
#include "sim/simulation.h"
#include "sim/state.h"

namespace catgut {
namespace {

// Input of the technique: its view of a suture in this tick.
TechniqueView look(const Model& model, State& state, size_t which) {
  const Strand& thread = state.solver.strand[which];
  const Suture& suture = state.suture.suture[which];
  state.stitch.clear();
  for (const SuturePoint& p : suture.point) {
    StitchPoint s;
    const BiteEnd& end = p.exit ? suture.bite[p.bite].exit : suture.bite[p.bite].entry;
    s.point = thread.anchor[p.anchor].point;
    s.at = position_of(s.point, state.solver.x.data());
    s.bite = p.bite;
    s.exit = p.exit;
    const uint32_t corner = model.solver.collision.surface[end.triangle][0];
    s.wall = model.wall[corner];
    s.inside = model.layer[corner] == static_cast<uint8_t>(TissueLayer::mucosa);
    state.stitch.push_back(s);
  }
  spans(thread, suture, state.solver.x.data(), state.stitch_span);
  for (size_t k = 0; k < state.stitch.size(); ++k) state.stitch[k].span = state.stitch_span[k];
  TechniqueView view;
  view.point = state.stitch;
  view.bite = suture.bite;
  view.knot = suture.knot;
  view.x = state.solver.x.data();
  view.loop = length_between_ends(thread, suture);
  view.needle_in_tissue = !suture.open.empty();
  view.suture_index = suture.suture_index;
  view.dt = model.dt;
  view.suture = static_cast<uint32_t>(which);
  view.plan_of = state.plan;
  view.state_of = state.technique;
  return view;
}

// Every suture is evaluated and closed independently, from its own events.
void follow_technique(const Model& model, State& state) {
  const size_t before = state.event.size();
  EventList& own = state.suture_event;
  for (size_t k = 0; k < state.technique.size(); ++k) {
    own.start(state.tick);
    for (size_t i = 0; i < before; ++i)
      if (state.event[i].suture == k) own.add(state.event[i]);
    const size_t seen = own.size();
    technique(model.technique, state.technique[k], look(model, state, k), state.plan[k], own);
    for (size_t i = seen; i < own.size(); ++i) {
      Event e = own[i];
      e.suture = static_cast<uint16_t>(k);
      state.event.add(e);
    }
  }
  close(state.solver, state.plan);
}

}  // namespace

void step(const Model& built, State& state, const TickInput& input, Jobs& jobs, StageTimes* times) {
  const Model& model = current_model(built, state);
  const SolverModel& solver = model.solver;
  state.event.start(state.tick);
  if (model.physical) return step_physical(model, state, input, jobs, times);
  find_boxes(solver, state.solver, state.scratch, jobs, times);
  meet_hands(state, input);
  handle_instruments(model, state, input);
  SutureContext sewing{solver, state.solver, state.scratch, model.suture, state.suture, state.event};
  grasp(sewing, input.hand);
  {
    StageTimer timer(times, Stage::loop);
    find_loops(sewing);
    tie(sewing);
    cut(sewing, input);
    new_suture(sewing, model.start, model.needle_start, input);
  }
  // Margin: the distance that thread and tools can approach in a tick at 0.5 m/s, but at least the jump of a knot's thread
  // when it slips.
  const float margin = std::clamp(0.5f * model.dt, 0.002f, 0.008f);
  find_candidates(solver, state.solver, state.scratch, margin, times);
  begin_haptics(state);
  for (int i = 1; i <= model.substeps; ++i) {
    follow_hands(model, state, input, static_cast<float>(i) / static_cast<float>(model.substeps));
    substep(solver, state.solver, state.scratch, jobs, times);
    accumulate_haptics(model, state, i);
    slip(sewing);
    {
      StageTimer timer(times, Stage::puncture);
      puncture(sewing);
    }
    {
      StageTimer timer(times, Stage::pull);
      pull(sewing);
      tighten(sewing);
    }
  }
  {
    StageTimer timer(times, Stage::closure);
    follow_technique(model, state);
  }
  remember_hands(state, input);
  ++state.tick;
  finish_haptics(model, state);
}

}  // namespace catgut
