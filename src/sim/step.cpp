// sim/step: THE stage list. Reads one TickInput, moves the state by one tick, leaves the tick's events in it.
#include <algorithm>

#include "sim/hands.h"
#include "sim/model.h"
#include "sim/simulation.h"
#include "sim/state.h"

namespace catgut {
namespace {

// What the technique may see of the tick.
TechniqueView look(const Model& model, State& state) {
  const Strand& thread = state.solver.strand[0];
  state.stitch.clear();
  for (const SuturePoint& p : state.suture.point) {
    StitchPoint s;
    const BiteEnd& end = p.exit ? state.suture.bite[p.bite].exit : state.suture.bite[p.bite].entry;
    s.point = thread.anchor[p.anchor].point;
    s.at = position_of(s.point, state.solver.x.data());
    s.bite = p.bite;
    s.exit = p.exit;
    const uint32_t corner = model.solver.collision.surface[end.triangle][0];
    s.wall = model.wall[corner];
    s.inside = model.layer[corner] == static_cast<uint8_t>(TissueLayer::mucosa);
    state.stitch.push_back(s);
  }
  spans(state.solver, state.suture, state.stitch_span);
  for (size_t k = 0; k < state.stitch.size(); ++k) state.stitch[k].span = state.stitch_span[k];
  TechniqueView view;
  view.point = state.stitch;
  view.bite = state.suture.bite;
  view.knot = state.suture.knot;
  view.x = state.solver.x.data();
  view.loop = length_between_ends(state.solver, state.suture);
  view.needle_in_tissue = !state.suture.open.empty();
  view.taken = state.suture.taken;
  view.dt = model.dt;
  return view;
}

}  // namespace

void step(const Model& model, State& state, const TickInput& input, Jobs& jobs, StageTimes* times) {
  const SolverModel& solver = model.solver;
  state.event.start(state.tick);
  find_boxes(solver, state.solver, state.scratch, jobs, times);
  meet_hands(state, input);
  handle_instruments(model, state, input);
  const std::array<uint32_t, kMaxHands> pressed = pressed_buttons(state.suture, input.hand);
  grasp(solver, state.solver, state.scratch, model.suture, state.suture, input.hand, state.event);
  {
    StageTimer timer(times, Stage::loop);
    find_loops(solver, state.solver, model.suture, state.suture, state.event);
    tie(solver, state.solver, model.suture, state.suture, state.event);
    cut(solver, state.solver, model.suture, state.suture, pressed, state.event);
    new_suture(solver, state.solver, model.suture, state.suture, model.start, model.needle_start, pressed, state.event);
  }
  // As far as thread and tools may come nearer to anything in a tick, at half a metre a second; but no less than what a knot's
  // thread jumps when it slips.
  const float margin = std::clamp(0.5f * model.dt, 0.002f, 0.008f);
  find_candidates(solver, state.solver, state.scratch, margin, times);
  begin_feeling(state);
  for (int i = 1; i <= model.substeps; ++i) {
    follow_hands(model, state, input, static_cast<float>(i) / static_cast<float>(model.substeps));
    substep(solver, state.solver, state.scratch, jobs, times);
    feel_substep(model, state, i);
    slip(solver, state.solver, model.suture, state.suture, state.event);
    {
      StageTimer timer(times, Stage::puncture);
      puncture(solver, state.solver, state.scratch, model.suture, state.suture, state.event);
    }
    {
      StageTimer timer(times, Stage::pull);
      pull(solver, state.solver, model.suture, state.suture, state.event);
      tighten(solver, state.solver, state.scratch, model.suture, state.suture, state.event);
    }
  }
  {
    StageTimer timer(times, Stage::closure);
    technique(model.technique, state.technique, look(model, state), state.plan, state.event);
    close(state.solver, state.plan);
  }
  remember_hands(state, input);
  ++state.tick;
  end_feeling(model, state);
}

}  // namespace catgut
