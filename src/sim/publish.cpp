// sim/publish: reads the state after a tick, writes the Snapshot that pictures, surgeon and host see. Changes nothing.
#include <algorithm>

#include "sim/model.h"
#include "sim/state.h"

namespace catgut {

PictureModel picture_model(const Model& model) { return model.picture; }

void publish(const Model& model, const State& state, Snapshot& out) {
  const SolverModel& m = model.solver;
  const SolverState& s = state.solver;
  const float inv_h2 = 1.0f / (m.h * m.h);
  out.tick = state.tick;
  out.time_s = static_cast<double>(state.tick) / model.scene.solver.tick_rate;
  out.particle.resize(m.count);
  for (uint32_t i = 0; i < m.count; ++i) out.particle[i] = xyz(s.x[i]);
  out.rotation.resize(m.tissue);
  for (uint32_t i = 0; i < m.tissue; ++i) {
    const uint32_t c = m.shape.cluster_of[i];
    out.rotation[i] = {s.rotation.x[c], s.rotation.y[c], s.rotation.z[c], s.rotation.w[c]};
  }
  out.thread_order = s.thread.order;
  out.thread_tension = s.thread.tension;
  for (size_t k = 0; k < 2; ++k) {
    ToolView& t = out.tool[k];
    const HandState& hand = state.suture.hand[k];
    t.pose = s.body[k].pose();
    t.hand = state.hand[k];
    t.jaw = hand.jaw;
    t.held = hand.held;
    t.held_at = hand.at;
    t.held_slot = hand.slot;
    // The weld's multiplier acts on the tool; the hand feels its opposite.
    t.force = s.weld[k].lambda * -inv_h2;
    t.torque = s.weld[k].angular_lambda * -inv_h2;
  }
  // Published at the circle's centre, which is what pictures and plans turn about.
  out.needle.pose = {transform(s.body[kNeedle].pose(), m.needle_arc.centre), s.body[kNeedle].q};
  out.needle.in_tissue = state.suture.phase != NeedlePhase::outside;
  out.needle.bite = state.suture.current;
  out.suture_point.clear();
  for (const SuturePoint& p : state.suture.point) {
    const ThreadAnchor& a = s.thread.anchor[p.anchor];
    out.suture_point.push_back({position_of(a.point, s.x.data()), p.bite, p.exit, a.slot, a.tension_needle, a.tension_free});
  }
  out.bite.clear();
  for (const Bite& b : state.suture.bite)
    out.bite.push_back(
        {position_of(b.entry.point, s.x.data()), position_of(b.exit.point, s.x.data()), b.depth, b.has_exit, b.complete});
  out.opening_area = model.purse_string.rim_inner.empty() ? 0 : opening_area(model.purse_string.rim_inner, s.x.data());
  out.closure = state.plan.progress;
  out.event = state.event;
}

}  // namespace catgut
