// sim/step: THE stage list. Reads one TickInput, moves the state by one tick, leaves the tick's events in it.
#include "sim/model.h"
#include "sim/simulation.h"
#include "sim/state.h"

namespace catgut {
namespace {

// A tool follows its hand through a spring. Between two ticks the hand is taken to move evenly, so substeps see no jumps.
void follow_hands(const Model& model, State& state, const TickInput& input, float part) {
  for (size_t k = 0; k < 2; ++k) {
    const Pose& from = state.hand[k];
    const Pose& to = input.hand[k].connected ? input.hand[k].pose : from;
    state.solver.weld[k].target = {lerp(from.p, to.p, part), nlerp(from.q, to.q, part)};
    state.solver.weld[k].compliance = model.hand_compliance;
    state.solver.weld[k].angular_compliance = model.hand_angular_compliance;
  }
}

// A hand that appears is taken over where it is: its tool is placed there, not dragged there through the tissue.
void meet_hands(State& state, const TickInput& input) {
  for (size_t k = 0; k < 2; ++k) {
    state.solver.body_collides[k] = input.hand[k].connected != 0;
    if (!input.hand[k].connected || state.hand_known[k]) continue;
    state.hand_known[k] = 1;
    state.hand[k] = input.hand[k].pose;
    RigidBody& tool = state.solver.body[k];
    tool = {};
    tool.x = tool.prev_x = input.hand[k].pose.p;
    tool.q = tool.prev_q = input.hand[k].pose.q;
  }
}

}  // namespace

void step(const Model& model, State& state, const TickInput& input, Jobs& jobs, StageTimes* times) {
  const SolverModel& solver = model.solver;
  state.event.clear();
  meet_hands(state, input);
  grasp(solver, state.solver, model.suture, state.suture, input.hand, state.event);
  find_candidates(solver, state.solver, state.scratch, 0.008f, times);
  for (int i = 1; i <= model.substeps; ++i) {
    follow_hands(model, state, input, static_cast<float>(i) / static_cast<float>(model.substeps));
    substep(solver, state.solver, state.scratch, jobs, times);
    slip(solver, state.solver, model.suture, state.suture, state.event);
    {
      StageTimer timer(times, Stage::puncture);
      puncture(solver, state.solver, state.scratch, model.suture, state.suture, state.event);
    }
    {
      StageTimer timer(times, Stage::pull);
      pull(solver, state.solver, model.suture, state.suture, state.event);
    }
  }
  if (model.has_technique) {
    StageTimer timer(times, Stage::closure);
    std::vector<Vec3> where;
    std::vector<TissuePoint> point;
    for (const SuturePoint& p : state.suture.point) {
      point.push_back(state.solver.thread.anchor[p.anchor].point);
      where.push_back(position_of(point.back(), state.solver.x.data()));
    }
    purse_string(model.purse_string, state.purse_string, where, point, state.solver.x.data(), length_between_ends(state.solver),
                 model.dt, state.plan, state.event);
    close(state.solver, state.plan);
  }
  for (size_t k = 0; k < 2; ++k)
    if (input.hand[k].connected) state.hand[k] = input.hand[k].pose;
  for (Event& e : state.event) e.tick = state.tick;
  ++state.tick;
}

}  // namespace catgut
