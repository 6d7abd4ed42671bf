// suture/knot: knots (paper 2.4). A tool with a loop of thread round it takes the other strand: the loop leaves the tool and
// its two ends are held by the knot. As the tool moves away the knot travels to the tissue; there it locks, lets go of the
// loop's ends and holds a particle of both strands instead, at one point of the tissue, where nothing slides any more. Letting
// go of the strand before that undoes the throw. Further throws travel to the knot that is there.
#include <algorithm>

#include "suture/suture.h"

namespace catgut {
namespace {

constexpr float kFastest = 0.25f;   // [m/s] of the travelling knot
constexpr float kArrived = 1e-4f;   // [m]
constexpr float kTaut = 0.3f;       // [N]
constexpr float kShortest = 5e-4f;  // [m] of thread between a hole and its knot

size_t node_of(const Thread& t, uint32_t slot) {
  return static_cast<size_t>(std::find(t.order.begin(), t.order.end(), slot) - t.order.begin());
}
bool is_locked(const Thread& t, uint32_t slot) {
  return std::any_of(t.anchor.begin(), t.anchor.end(), [&](const ThreadAnchor& a) { return a.slot == slot; }) ||
         std::any_of(t.hold.begin(), t.hold.end(), [&](const ThreadHold& h) { return h.slot == slot; });
}

// [N] of the tighter of the two pairs at a particle.
float tension_at(const Thread& t, uint32_t slot) {
  const size_t node = node_of(t, slot);
  float most = 0;
  if (node > 0) most = std::max(most, t.tension[node - 1]);
  if (node < t.tension.size()) most = std::max(most, t.tension[node]);
  return most;
}

// The middle between two points of tissue, as one point: eight particles of each, so that it still follows both exactly in
// every affine motion.
TissuePoint middle(const SolverModel& model, const TissuePoint& a, const TissuePoint& b) {
  const Vec4* rest = model.shape.rest.data();
  TissuePoint m;
  for (const TissuePoint* p : {&a, &b}) {
    const Vec3 at = position_of(*p, rest);
    std::array<uint32_t, TissuePoint::kMost> near = p->particle;
    const auto last = near.begin() + static_cast<long>(p->count);
    std::sort(near.begin(), last, [&](uint32_t i, uint32_t k) {
      const float di = length2(xyz(rest[i]) - at), dk = length2(xyz(rest[k]) - at);
      return di != dk ? di < dk : i < k;
    });
    const TissuePoint half = spread_point({near.data(), std::min(p->count, TissuePoint::kMost / 2)}, rest, at);
    for (uint32_t k = 0; k < half.count; ++k) {
      m.particle[m.count] = half.particle[k];
      m.weight[m.count++] = 0.5f * half.weight[k];
    }
  }
  return m;
}

// Takes away the anchors by which the throw in hand travels: those of the knot's loop ends.
void drop_loop_ends(SolverState& solver, SutureState& state, const Knot& k) {
  for (const uint32_t slot : k.loop)
    for (size_t i = solver.thread.anchor.size(); i-- > 0;)
      if (solver.thread.anchor[i].knotted && solver.thread.anchor[i].slot == slot)
        erase_anchor(solver, state, static_cast<uint32_t>(i));
}

// The suture point's node nearest along the order to `node`; state.point is not empty.
const SuturePoint& nearest_point(const SolverState& solver, const SutureState& state, size_t node) {
  const SuturePoint* best = nullptr;
  size_t least = ~size_t{0};
  for (const SuturePoint& p : state.point) {
    const size_t at = node_of(solver.thread, solver.thread.anchor[p.anchor].slot), away = at > node ? at - node : node - at;
    if (away < least) least = away, best = &p;
  }
  return *best;
}

void begin(const SolverModel& model, SolverState& solver, const SutureModel& suture, SutureState& state, uint8_t who,
           std::vector<Event>& events) {
  const Thread& t = solver.thread;
  const ToolLoop loop = state.loop[who];
  const uint32_t strand = state.hand[who].slot;
  const size_t first = node_of(t, loop.first), last = node_of(t, loop.last), held = node_of(t, strand);
  if (held >= first && held <= last) return;  // a jaw on the loop itself ties nothing
  const Vec3 tool = solver.body[who].x;
  Vec3 at{};
  for (size_t i = first; i <= last; ++i) at += xyz(solver.x[t.order[i]]) / static_cast<float>(last - first + 1);
  take_off_loop(model, solver, suture, state, who);
  if (state.point.empty()) {
    events.push_back({0, EventKind::technique_fault, who, static_cast<uint32_t>(state.knot.size()),
                      static_cast<float>(Fault::knot_without_bite), at});
    return;
  }
  // A throw adds to the knot that is there when no suture point lies between them along the thread.
  const SuturePoint& by_loop = nearest_point(solver, state, first);
  const size_t hole = node_of(t, t.anchor[by_loop.anchor].slot);
  Knot* knot = nullptr;
  for (Knot& k : state.knot)
    for (uint32_t i = 0; i < k.slots; ++i) {
      const size_t node = node_of(t, k.slot[i]);
      if ((node > hole) == (first > hole) && node != hole) knot = &k;
    }
  if (!knot) {
    Knot fresh;
    const SuturePoint& by_strand = nearest_point(solver, state, held);
    // "If more than one suture point has been created, the knot object will move toward the midpoint of the last two": of the
    // two ends of its stitch. With the paper's one point a bite these are the last two; a bite of ours makes two.
    const SuturePoint& other =
        held > hole && first > hole && state.point.size() > 1 ? state.point[state.point.size() - 2] : by_strand;
    const TissuePoint &a = t.anchor[by_loop.anchor].point, &b = t.anchor[other.anchor].point;
    fresh.target = &by_loop == &other ? a : middle(model, a, b);
    state.knot.push_back(fresh);
    knot = &state.knot.back();
  }
  knot->phase = KnotPhase::tightening;
  knot->begun = knot->throws;
  knot->hand = who;
  knot->strand = strand;
  knot->loop = {loop.first, loop.last};
  knot->from = at - position_of(knot->target, solver.x.data());
  knot->offset = knot->from;
  knot->hand_from = tool;
  knot->throws = std::min<uint32_t>(knot->throws + 1, KnotView::kMostThrows);
  KnotThrow& thrown = knot->thrown[knot->throws - 1];
  thrown = {};
  thrown.wraps = loop.wraps;
  thrown.handed = loop.handed;
  thrown.needle_end = first > hole;
  for (const uint32_t slot : knot->loop) {
    ThreadAnchor a;
    a.slot = slot;
    a.point = knot->target;
    a.offset = knot->offset;
    a.knotted = true;
    solver.thread.anchor.push_back(a);
  }
  update_thread_collisions(model, solver, suture);
  events.push_back(
      {0, EventKind::knot_begun, who, static_cast<uint32_t>(knot - state.knot.data()), static_cast<float>(loop.wraps), at});
}

void cancel(const SolverModel& model, SolverState& solver, const SutureModel& suture, SutureState& state, size_t which,
            std::vector<Event>& events) {
  const Knot k = state.knot[which];
  drop_loop_ends(solver, state, k);
  if (k.begun == 0) {
    state.knot.erase(state.knot.begin() + static_cast<long>(which));
  } else {
    state.knot[which].phase = KnotPhase::locked;
    state.knot[which].thrown[k.begun] = {};
    state.knot[which].throws = k.begun;
  }
  update_thread_collisions(model, solver, suture);
  events.push_back({0, EventKind::knot_cancelled, static_cast<uint8_t>(k.hand), static_cast<uint32_t>(which), 0,
                    position_of(k.target, solver.x.data()) + k.offset});
}

// Ties the strand that leaves the tissue at node `hole` in direction `way` (+1 toward the needle) to the knot at `at`: the
// first free particle that reaches it comes to stand there, and what thread there is too much between hole and knot is drawn
// out. False: the strand ends before it could.
bool tie_strand(SolverState& solver, Knot& k, size_t hole, int way, Vec3 at) {
  Thread& t = solver.thread;
  const Vec3 from = xyz(solver.x[t.order[hole]]);
  const float wanted = std::max(kShortest, distance(from, at));
  auto pair_of = [&](size_t node) { return way > 0 ? node : node - 1; };  // the pair from `node` outward
  size_t node = hole;
  float length = 0;
  while (true) {
    if ((way > 0 && node + 2 >= t.order.size()) || (way < 0 && node < 2) || t.cut[pair_of(node)]) return false;
    length += t.rest[pair_of(node)];
    node = way > 0 ? node + 1 : node - 1;
    if (is_locked(t, t.order[node])) return false;
    if (length >= wanted) break;
  }
  const size_t inner = pair_of(way > 0 ? node - 1 : node + 1), outer = pair_of(node);
  const float excess = std::min(length - wanted, t.rest[inner] - 0.1f * kShortest);
  t.rest[inner] -= excess;
  t.rest[outer] += excess;
  ThreadAnchor a;
  a.slot = t.order[node];
  a.point = k.target;
  a.knotted = true;
  set(solver.x[a.slot], at);
  solver.v[a.slot] = {};
  t.anchor.push_back(a);
  k.slot[k.slots++] = a.slot;
  return true;
}

void lock(const SolverModel& model, SolverState& solver, const SutureModel& suture, SutureState& state,
          const SolverScratch& scratch, size_t which, std::vector<Event>& events) {
  Knot& k = state.knot[which];
  Thread& t = solver.thread;
  const size_t strand = node_of(t, k.strand), wound = node_of(t, k.loop[0]);
  drop_loop_ends(solver, state, k);
  const Vec3 at = position_of(k.target, solver.x.data());
  if (k.begun == 0) {
    size_t lo = t.order.size(), hi = 0;
    for (const SuturePoint& p : state.point) {
      const size_t node = node_of(t, t.anchor[p.anchor].slot);
      lo = std::min(lo, node);
      hi = std::max(hi, node);
    }
    if (strand < lo || wound < lo) tie_strand(solver, k, lo, -1, at);
    if (strand > hi || wound > hi) tie_strand(solver, k, hi, 1, at);
  }
  KnotThrow& thrown = k.thrown[k.throws - 1];
  thrown.tension = tension_at(t, k.strand);
  SurfaceHit hit;
  thrown.gap =
      nearest_surface(model, scratch.candidates, solver.x.data(), at, 0.008f, hit) ? std::max(0.0f, hit.distance) : 0.008f;
  k.phase = KnotPhase::locked;
  k.offset = {};
  update_thread_collisions(model, solver, suture);
  events.push_back({0, EventKind::knot_locked, static_cast<uint8_t>(k.hand), static_cast<uint32_t>(which), thrown.tension, at});
}

}  // namespace

void tie_knots(const SolverModel& model, SolverState& solver, const SolverScratch& scratch, const SutureModel& suture,
               SutureState& state, float dt, std::vector<Event>& events) {
  for (size_t which = state.knot.size(); which-- > 0;) {
    Knot& k = state.knot[which];
    if (k.phase != KnotPhase::tightening) continue;
    const HandState& hand = state.hand[k.hand];
    if (hand.held != Held::thread || hand.slot != k.strand) {
      cancel(model, solver, suture, state, which, events);
      continue;
    }
    // "As the tool moves away from its original position, the knot object moves towards the suture point."
    // A strand that is drawn taut brings it along however short the way of the hand.
    const float whole = length(k.from);
    const float gone = tension_at(solver.thread, k.strand) > kTaut ? whole : distance(solver.body[k.hand].x, k.hand_from);
    const float left = std::max(whole - gone, length(k.offset) - kFastest * dt);
    k.offset = whole > 0 && left > 0 ? k.from * (std::min(left, length(k.offset)) / whole) : Vec3{};
    for (ThreadAnchor& a : solver.thread.anchor)
      if (a.knotted && (a.slot == k.loop[0] || a.slot == k.loop[1])) a.offset = k.offset;
    if (length(k.offset) < kArrived) lock(model, solver, suture, state, scratch, which, events);
  }
  for (uint8_t who = 0; who < 2; ++who)
    if (state.loop[who].wraps > 0 && state.hand[who].held == Held::thread) begin(model, solver, suture, state, who, events);
}

}  // namespace catgut
