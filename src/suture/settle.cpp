// suture/settle: a fresh needle and thread; what is tied settles (paper 3.4: "This process replaces the thread with a 3D mesh
// when a knot is created ... so that physics is no longer performed on previous sutures"). Reads knots and anchors; writes
// settled stitches and their pins, and lays the thread out again as at the start. There is one thread however many sutures are
// made, so a tick costs the same for the fiftieth as for the first.
#include <algorithm>
#include <limits>

#include "suture/suture.h"

namespace catgut {
namespace {

constexpr float kTail = 0.012f;          // [m] of thread left on a stitch that was not cut
constexpr float kPinCompliance = 1e-5f;  // [m/N]

size_t node_of(const Thread& t, uint32_t slot) {
  return static_cast<size_t>(std::find(t.order.begin(), t.order.end(), slot) - t.order.begin());
}

// Bound to the nearest particle's cluster, in whose rest frame the offset is kept.
SettledNode bind(const SolverModel& model, const SolverState& solver, Vec3 at) {
  SettledNode n;
  float best = std::numeric_limits<float>::max();
  for (uint32_t i = 0; i < model.tissue; ++i)
    if (const float d = length2(xyz(solver.x[i]) - at); d < best) best = d, n.particle = i;
  const uint32_t c = model.shape.cluster_of[n.particle];
  const ClusterRotations& r = solver.rotation;
  n.offset = rotate(conjugate(Quat{r.x[c], r.y[c], r.z[c], r.w[c]}), at - xyz(solver.x[n.particle]));
  return n;
}

// The stitch that the thread's anchors and knots make, from one end of its piece of thread to the other.
void settle(const SolverModel& model, SolverState& solver, SutureState& state) {
  const Thread& t = solver.thread;
  struct Held {
    size_t node;
    const ThreadAnchor* anchor;
    uint32_t bite;
  };
  std::vector<Held> held;
  for (size_t k = 0; k < t.anchor.size(); ++k) {
    uint32_t bite = ~0u - static_cast<uint32_t>(k);
    for (const SuturePoint& p : state.point)
      if (p.anchor == k) bite = p.bite;
    held.push_back({node_of(t, t.anchor[k].slot), &t.anchor[k], bite});
  }
  std::sort(held.begin(), held.end(), [](const Held& a, const Held& b) { return a.node < b.node; });
  SettledStitch stitch;
  size_t first = held.front().node, last = held.back().node;
  for (float gone = 0; first > 0 && !t.cut[first - 1] && gone < kTail; --first) gone += t.rest[first - 1];
  for (float gone = 0; last + 1 < t.order.size() && !t.cut[last] && gone < kTail; ++last) gone += t.rest[last];
  for (size_t i = first; i <= last; ++i) stitch.node.push_back(bind(model, solver, xyz(solver.x[t.order[i]])));
  for (const Knot& k : state.knot)
    if (k.phase == KnotPhase::locked) stitch.knot.push_back(bind(model, solver, position_of(k.target, solver.x.data())));
  state.settled.push_back(std::move(stitch));
  // From anchor to anchor the thread goes on holding the tissue together, as a rope. Within a bite it runs through tissue.
  for (size_t k = 0; k + 1 < held.size(); ++k) {
    if (held[k].bite == held[k + 1].bite) continue;
    TissuePin pin;
    pin.a = held[k].anchor->point;
    pin.b = held[k + 1].anchor->point;
    for (size_t i = held[k].node; i < held[k + 1].node; ++i) pin.length += t.rest[i];
    pin.compliance = kPinCompliance;
    pin.owner = PinOwner::stitch;
    solver.pin.push_back(pin);
  }
}

void lay_out(const SolverModel& model, SolverState& solver, const FreshSuture& fresh) {
  Thread& t = solver.thread;
  t.anchor.clear();
  t.hold.clear();
  for (uint32_t i = 0; i < model.thread.count; ++i) {
    const uint32_t slot = model.thread.first_slot + i;
    t.order[i] = slot;
    solver.x[slot] = point(fresh.start[slot]);
    solver.v[slot] = {};
  }
  std::fill(t.rest.begin(), t.rest.end(), model.thread.spacing);
  std::fill(t.cut.begin(), t.cut.end(), uint8_t{0});
  std::fill(t.tension.begin(), t.tension.end(), 0.0f);
  t.hold.push_back({t.order.back(), static_cast<int>(kNeedle), model.needle_arc.point(0), HoldKind::swage});
  RigidBody& needle = solver.body[kNeedle];
  needle = {};
  needle.x = needle.prev_x = fresh.needle.p;
  needle.q = needle.prev_q = fresh.needle.q;
}

}  // namespace

void take_fresh_suture(const SolverModel& model, SolverState& solver, const SutureModel& suture, SutureState& state,
                       const FreshSuture& fresh, const std::array<uint32_t, 2>& pressed, std::vector<Event>& events) {
  if (!((pressed[0] | pressed[1]) & kButtonNewSuture)) return;
  const uint8_t who = pressed[0] & kButtonNewSuture ? 0 : 1;
  const Vec3 at = solver.body[who].x;
  const auto fault = [&](Fault what, uint32_t which) {
    events.push_back({0, EventKind::technique_fault, who, which, static_cast<float>(what), at});
  };
  if (!state.open.empty()) return fault(Fault::needle_in_tissue, state.open.back().bite);
  const bool tied =
      std::any_of(state.knot.begin(), state.knot.end(), [](const Knot& k) { return k.phase == KnotPhase::locked; });
  if (tied && !solver.thread.anchor.empty()) {
    settle(model, solver, state);
    events.push_back({0, EventKind::stitch_settled, who, static_cast<uint32_t>(state.settled.size() - 1), 0, at});
  } else if (!state.point.empty()) {
    fault(Fault::cut_before_knot, solver.thread.order.front());  // its thread is drawn out of the tissue again
  }
  for (uint8_t hand = 0; hand < 2; ++hand)
    if (state.hand[hand].held == Held::needle || state.hand[hand].held == Held::thread) release(solver, state, hand, 0, events);
  state.loop = {};
  state.knot.clear();
  state.point.clear();
  lay_out(model, solver, fresh);
  update_thread_collisions(model, solver, suture);
  events.push_back({0, EventKind::suture_taken, who, state.taken, 0, fresh.needle.p});
  ++state.taken;
}

}  // namespace catgut
