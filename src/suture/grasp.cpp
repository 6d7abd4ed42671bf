// suture/grasp: jaws that hold needle, thread or tissue. Reads jaws and poses; adds and removes welds, thread holds and
// attachments of tissue.
#include <algorithm>

#include "suture/suture.h"

namespace catgut {
void release(SolverState& solver, SutureState& state, uint8_t who, float force, EventList& events) {
  InstrumentState& hand = state.instrument[who];
  const int body = who;
  const uint8_t by = hand_of(state, who);
  if (hand.held == Held::needle) {
    std::erase_if(solver.weld, [&](const Weld& w) { return w.b == body; });
    events.add({EventKind::needle_released, by, 0, force, solver.body[static_cast<size_t>(body)].x});
  } else if (hand.held == Held::thread) {
    release_holds(solver.strand[0], body, HoldKind::jaw);
    events.add({EventKind::thread_released, by, hand.slot, force, solver.body[static_cast<size_t>(body)].x});
  }
  if (hand.held == Held::tissue) {
    std::erase_if(solver.attach, [&](const Attachment& a) { return a.body == body; });
    events.add({EventKind::tissue_released, by, hand.slot, force, solver.body[static_cast<size_t>(body)].x});
  }
  hand.held = Held::nothing;
}

namespace {

// The jaws close on the wall: its place nearest to them, with the neighbourhood that moves with it, is held where it is.
void take_tissue(const SolverModel& model, SolverState& solver, const SolverScratch& scratch, const SutureModel& suture,
                 InstrumentState& hand, uint8_t who, EventList& events) {
  const RigidBody& tool = solver.body[who];
  SurfaceHit hit;
  if (!nearest_surface(model, scratch.candidates, solver.x.data(), tool.x, suture.grasp_reach, hit)) return;
  if (std::abs(hit.distance) > suture.tissue_reach) return;
  spread(model, hit.end);
  const Triangle& corner = model.collision.surface[hit.end.triangle];
  const size_t nearest =
      static_cast<size_t>(std::max_element(hit.end.weight.begin(), hit.end.weight.end()) - hit.end.weight.begin());
  Attachment a;
  a.point = hit.end.point;
  a.body = who;
  a.target = to_local(tool.pose(), hit.point);
  a.compliance = suture.tissue_compliance;
  solver.attach.push_back(a);
  hand.held = Held::tissue;
  hand.slot = corner[nearest];
  events.add({EventKind::tissue_grasped, hand.hand, hand.slot, 0, hit.point});
}

}  // namespace

void grasp(const SolverModel& model, SolverState& solver, const SolverScratch& scratch, const SutureModel& suture,
           SutureState& state, const HandInputs& input, EventList& events) {
  for (uint8_t who = 0; who < state.instrument.size(); ++who) {
    InstrumentState& hand = state.instrument[who];
    const InstrumentModel& kind = suture.instrument[who];
    if (hand.place != InstrumentPlace::hand) continue;
    const float jaw = input[hand.hand].connected ? input[hand.hand].jaw : hand.jaw;
    const bool closing = hand.jaw > kind.jaw.closed && jaw <= kind.jaw.closed;
    hand.jaw = jaw;
    if (hand.held != Held::nothing) {
      if (jaw >= kind.jaw.open) { release(solver, state, who, 0, events); }
      continue;
    }
    if (!closing) continue;
    const RigidBody& tool = solver.body[who];
    const RigidBody& needle = solver.body[model.needle_body(0)];
    const float phi = model.needle_arc[0].nearest(to_local(needle.pose(), tool.x));
    if (kind.can(kHoldNeedle) && distance(needle_point(model.needle_arc[0], needle, phi), tool.x) <= suture.grasp_reach) {
      Weld w;
      w.a = static_cast<int>(model.needle_body(0));
      w.b = who;
      // Held where and as it was caught: the same world frame seen from both bodies.
      w.local_a = inverse(needle.pose()) * tool.pose();
      w.compliance = suture.grasp_compliance;
      w.angular_compliance = suture.grasp_angular_compliance;
      solver.weld.push_back(w);
      hand.held = Held::needle;
      hand.at = phi / model.needle_arc[0].arc;
      events.add({EventKind::needle_grasped, hand.hand, 0, hand.at, tool.x});
      continue;
    }
    float best = suture.grasp_reach;
    int32_t found = -1;
    for (uint32_t slot : solver.strand[0].order) {
      if (!kind.can(kHoldThread)) break;
      const bool taken = is_locked(solver.strand[0], slot) || beside_loop(solver.strand[0], state.loop[who], slot);
      const float d = distance(xyz(solver.x[slot]), tool.x);
      if (!taken && d < best) best = d, found = static_cast<int32_t>(slot);
    }
    if (found >= 0) {
      hand.held = Held::thread;
      hand.slot = static_cast<uint32_t>(found);
      solver.strand[0].hold.push_back({hand.slot, who, to_local(tool.pose(), xyz(solver.x[hand.slot])), HoldKind::jaw});
      hold_other_strands(solver, suture, state, who);
      events.add({EventKind::thread_grasped, hand.hand, hand.slot, 0, tool.x});
    } else if (kind.can(kHoldTissue)) {
      take_tissue(model, solver, scratch, suture, hand, who, events);
    }
  }
}

void slip(const SolverModel& model, SolverState& solver, const SutureModel& suture, SutureState& state, EventList& events) {
  for (uint8_t who = 0; who < state.instrument.size(); ++who) {
    const InstrumentState& hand = state.instrument[who];
    const InstrumentModel& kind = suture.instrument[who];
    float force = 0, most = 1;
    if (hand.held == Held::needle) {
      most = kind.needle_grip;
      for (const Weld& w : solver.weld)
        if (w.b == who) force = length(w.lambda) / (model.h * model.h);
    } else if (hand.held == Held::thread) {
      most = kind.thread_grip;
      force = tension_at(solver.strand[0], node_of(solver.strand[0], hand.slot));
    }
    if (hand.held == Held::tissue) {
      most = kind.tissue_grip;
      for (const Attachment& a : solver.attach)
        if (a.body == who) force = length(a.lambda) / (model.h * model.h);
    }
    if (force <= most) continue;
    release(solver, state, who, force, events);
  }
}

}  // namespace catgut
