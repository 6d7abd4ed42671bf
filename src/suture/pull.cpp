// suture/pull: thread through suture points (paper 2.3, figures 7 to 9). Reads tensions and rest lengths; edits the order list,
// never a slot. Thread slides at an anchor inside the solver (see solver/thread); here, when the pair on one side of an anchor
// is used up, its particle passes: it takes its new place in the order and stands at the midpoint of the pair it splits (figure
// 7c). Slack is resolved in the paper's order (figure 9) because tension is: a span with slack has none, so the anchor next to
// the pull slides first, and the one behind it only when the span between them is taut.
#include <algorithm>
#include <array>

#include "core/check.h"
#include "suture/suture.h"

namespace catgut {
namespace {

constexpr float kUsedUp = 0.1f;  // of the spacing: the pair beside an anchor is so short that its particle's turn has come

bool is_locked(const Thread& t, uint32_t slot) {
  return std::any_of(t.anchor.begin(), t.anchor.end(), [&](const ThreadAnchor& a) { return a.slot == slot; }) ||
         std::any_of(t.hold.begin(), t.hold.end(), [&](const ThreadHold& h) { return h.slot == slot; });
}

size_t node_of(const Thread& t, uint32_t slot) {
  return static_cast<size_t>(std::find(t.order.begin(), t.order.end(), slot) - t.order.begin());
}

// Whether the particle beside the locked node i may pass it: there is one, it is free, and thread goes on behind it.
bool can_give_free(const Thread& t, size_t i) {
  return i >= 2 && i + 1 < t.order.size() && !is_locked(t, t.order[i - 1]) && !t.cut[i - 1] && !t.cut[i - 2] && !t.cut[i];
}
bool can_give_needle(const Thread& t, size_t i) {
  return i >= 1 && i + 2 < t.order.size() && !is_locked(t, t.order[i + 1]) && !t.cut[i] && !t.cut[i + 1] && !t.cut[i - 1];
}

// Figure 7c: the particle beside the locked node i takes its place on the other side, at the midpoint of the pair it splits.
void pass(SolverState& solver, size_t i, bool toward_needle) {
  Thread& t = solver.thread;
  const uint32_t locked = t.order[i], slot = t.order[toward_needle ? i - 1 : i + 1],
                 beyond = t.order[toward_needle ? i + 1 : i - 1];
  if (toward_needle) move_particle(t, i - 1, i);
  else move_particle(t, i + 1, i - 1);
  set(solver.x[slot], lerp(xyz(solver.x[locked]), xyz(solver.x[beyond]), 0.5f));
  set(solver.v[slot], 0.5f * (xyz(solver.v[beyond]) + xyz(solver.v[locked])));
}

// "With a knot created, the suture pulling will perform the same slack check from the needle end but will stop checking when
// the knot is found." Between the two particles of a knot the stitch is closed: no pull from outside gets there.
struct TiedNodes {
  static constexpr size_t kMost = 64;
  std::array<size_t, kMost> node;  // of locked knots' particles
  size_t count = 0;
};
TiedNodes tied_nodes(const Thread& t) {
  TiedNodes k;
  for (const ThreadAnchor& a : t.anchor)
    if (a.knotted && k.count < TiedNodes::kMost) k.node[k.count++] = node_of(t, a.slot);
  return k;
}
bool is_tied(const Thread& t, const TiedNodes& knots, size_t i) {
  size_t below = i, above = i;
  for (size_t k = 0; k < knots.count; ++k) {
    const size_t n = knots.node[k];
    if (n < i && (below == i || n > below)) below = n;
    if (n > i && (above == i || n < above)) above = n;
  }
  return below < i && above > i &&
         std::none_of(t.cut.begin() + static_cast<long>(below), t.cut.begin() + static_cast<long>(above),
                      [](uint8_t cut) { return cut != 0; });
}

}  // namespace

void move_particle(Thread& t, size_t from, size_t after) {
  // Figure 8: the two pairs at the old place become one, the pair at the new place becomes two.
  if (from == after + 1) return;
  CATGUT_CHECK(!t.cut[from - 1] && !t.cut[from] && !t.cut[after]);
  const uint32_t slot = t.order[from];
  const float joined = t.rest[from - 1] + t.rest[from];
  const float half = 0.5f * t.rest[after];
  if (from < after) {
    // rest: [.. from-1, from, from+1 .. after ..] -> [.. joined, from+1 .. after-1, half, half ..]
    t.rest[from - 1] = joined;
    std::move(t.rest.begin() + static_cast<long>(from) + 1, t.rest.begin() + static_cast<long>(after),
              t.rest.begin() + static_cast<long>(from));
    t.rest[after - 1] = t.rest[after] = half;
    std::move(t.cut.begin() + static_cast<long>(from) + 1, t.cut.begin() + static_cast<long>(after),
              t.cut.begin() + static_cast<long>(from));
    t.cut[after - 1] = 0;
    std::move(t.order.begin() + static_cast<long>(from) + 1, t.order.begin() + static_cast<long>(after) + 1,
              t.order.begin() + static_cast<long>(from));
    t.order[after] = slot;
  } else {
    // rest: [.. after, after+1 .. from-2, from-1, from ..] -> [.. half, half, after+1 .. from-2, joined ..]
    t.rest[from] = joined;
    std::move_backward(t.rest.begin() + static_cast<long>(after) + 1, t.rest.begin() + static_cast<long>(from) - 1,
                       t.rest.begin() + static_cast<long>(from));
    t.rest[after] = t.rest[after + 1] = half;
    std::move_backward(t.cut.begin() + static_cast<long>(after) + 1, t.cut.begin() + static_cast<long>(from) - 1,
                       t.cut.begin() + static_cast<long>(from));
    t.cut[after + 1] = 0;
    std::move_backward(t.order.begin() + static_cast<long>(after) + 1, t.order.begin() + static_cast<long>(from),
                       t.order.begin() + static_cast<long>(from) + 1);
    t.order[after + 1] = slot;
  }
}

void update_thread_collisions(const SolverModel& model, SolverState& solver, const SutureModel& suture) {
  std::fill(solver.thread_collides.begin(), solver.thread_collides.end(), uint8_t{1});
  const int nodes = static_cast<int>(solver.thread.order.size());
  auto off = [&](uint32_t slot) {
    const int at = static_cast<int>(node_of(solver.thread, slot));
    for (int i = std::max(0, at - suture.collision_off); i <= std::min(nodes - 1, at + suture.collision_off); ++i)
      solver.thread_collides[solver.thread.order[static_cast<size_t>(i)] - model.thread.first_slot] = 0;
  };
  for (const ThreadAnchor& a : solver.thread.anchor) off(a.slot);
  // A loop round a tool goes on colliding: the turns that follow lie on the same tool.
  for (const ThreadHold& h : solver.thread.hold)
    if (h.kind != HoldKind::loop) off(h.slot);
  // The loop of a throw on its way to the tissue has left the tool that it lay round, and must not catch on it: off from one of
  // its ends to the other.
  const std::vector<ThreadAnchor>& anchor = solver.thread.anchor;
  const auto travels = [](const ThreadAnchor& a) { return !a.knotted && length2(a.offset) > 0; };
  for (size_t k = 0; k + 1 < anchor.size(); ++k) {
    if (!travels(anchor[k]) || !travels(anchor[k + 1])) continue;
    for (size_t i = node_of(solver.thread, anchor[k].slot); i <= node_of(solver.thread, anchor[k + 1].slot); ++i)
      solver.thread_collides[solver.thread.order[i] - model.thread.first_slot] = 0;
    ++k;
  }
}

// Whether jaws draw thread that passes at node i that way: they hold it there, with no other suture point in between.
static int drawing_hand(const Thread& t, size_t i, int way) {
  for (size_t k = i; way > 0 ? k + 1 < t.order.size() && !t.cut[k] : k > 0 && !t.cut[k - 1];) {
    k = way > 0 ? k + 1 : k - 1;
    const uint32_t slot = t.order[k];
    for (const ThreadHold& h : t.hold)
      if (h.slot == slot) return h.kind == HoldKind::jaw ? h.body : -1;
    if (std::any_of(t.anchor.begin(), t.anchor.end(), [&](const ThreadAnchor& a) { return a.slot == slot; })) return -1;
  }
  return -1;
}

// "Pulling" before the bite is done. The needle draws thread through holes too, and should; jaws on the thread should not. One
// particle may have been about to pass when they took hold; with the second, thread as long as the way between two has come.
static void judge_drawing(const SolverState& solver, SutureState& state, const ThreadAnchor& a, bool toward_needle,
                          std::vector<Event>& events) {
  if (state.open.empty()) return;
  OpenBite& open = state.open.back();
  const int hand = open.told ? -1 : drawing_hand(solver.thread, node_of(solver.thread, a.slot), toward_needle ? 1 : -1);
  if (hand < 0 || ++open.drawn < 2) return;
  open.told = 1;
  events.push_back({0, EventKind::technique_fault, static_cast<uint8_t>(hand), open.bite,
                    static_cast<float>(Fault::needle_in_tissue), position_of(a, solver.x.data())});
}

// A cut thread holds nothing together: as long as all of it, whatever is drawn.
static float length_between(const Thread& t, size_t a, size_t b) {
  float sum = 0, all = 0;
  bool whole = true;
  for (size_t i = std::min(a, b); i < std::max(a, b); ++i) sum += t.rest[i], whole = whole && !t.cut[i];
  if (whole) return sum;
  for (float rest : t.rest) all += rest;
  return all;
}

float length_between_ends(const SolverState& solver, const SutureState& state) {
  const Thread& t = solver.thread;
  if (state.point.size() < 2) return 0;
  size_t lo = t.order.size(), hi = 0;
  for (const SuturePoint& p : state.point) {
    const size_t i = node_of(t, t.anchor[p.anchor].slot);
    lo = std::min(lo, i);
    hi = std::max(hi, i);
  }
  return length_between(t, lo, hi);
}

void spans(const SolverState& solver, const SutureState& state, std::vector<float>& span) {
  const Thread& t = solver.thread;
  const Vec4* x = solver.x.data();
  span.assign(state.point.size(), 0);
  for (size_t k = 0; k + 1 < state.point.size(); ++k) {
    const ThreadAnchor &here = t.anchor[state.point[k].anchor], &next = t.anchor[state.point[k + 1].anchor];
    const size_t a = node_of(t, here.slot), b = node_of(t, next.slot);
    for (size_t i = std::min(a, b); i < std::max(a, b); ++i) span[k] += t.rest[i];
    for (const ThreadAnchor& knot : t.anchor) {
      const size_t node = knot.knotted ? node_of(t, knot.slot) : 0;
      if (node <= std::min(a, b) || node >= std::max(a, b)) continue;
      float beyond = 0;  // from the knot on; what lies before it cannot be drawn
      for (size_t i = std::min(node, b); i < std::max(node, b); ++i) beyond += t.rest[i];
      span[k] = std::min(span[k], std::max(0.0f, beyond - distance(position_of(knot, x), position_of(here, x))));
    }
  }
}

void erase_anchor(SolverState& solver, SutureState& state, uint32_t anchor) {
  solver.thread.anchor.erase(solver.thread.anchor.begin() + anchor);
  for (SuturePoint& p : state.point)
    if (p.anchor > anchor) --p.anchor;
}

// Two holes may lie closer together than two particles of the thread, and the one before has just taken the last of them: the
// next free particle behind passes the suture points up to the needle before its turn (figure 7c). False: there is none.
bool bring_particle(Thread& t, SolverState& solver) {
  size_t from = t.order.size() - 2;
  const auto in_hole = [&](uint32_t slot) {
    return std::any_of(t.anchor.begin(), t.anchor.end(), [&](const ThreadAnchor& a) { return a.slot == slot && !a.knotted; });
  };
  while (from > 0 && in_hole(t.order[from]) && !t.cut[from]) --from;
  if (from == 0 || is_locked(t, t.order[from]) || t.cut[from] || t.cut[from - 1]) return false;
  for (; from + 2 < t.order.size(); ++from) {
    const uint32_t slot = t.order[from];
    move_particle(t, from, from + 1);
    const size_t at = from + 1;
    set(solver.x[slot], lerp(xyz(solver.x[t.order[at - 1]]), xyz(solver.x[t.order[at + 1]]), 0.5f));
    solver.v[slot] = {};
  }
  return true;
}

bool place_suture_point(const SolverModel& model, SolverState& solver, const SutureModel& suture, SutureState& state,
                        uint32_t bite, bool exit, std::vector<Event>& events) {
  Thread& t = solver.thread;
  if (t.order.size() < 3) return false;
  const size_t node = t.order.size() - 2;  // the last is the needle's
  // A needle off which the thread was cut, or with a stump too short to follow it, leaves none in the hole.
  const bool swaged = std::any_of(t.hold.begin(), t.hold.end(), [](const ThreadHold& h) { return h.kind == HoldKind::swage; });
  if (!swaged || t.cut[node] || t.cut[node - 1]) return true;
  if (is_locked(t, t.order[node]) && !bring_particle(t, solver)) return false;
  const uint32_t slot = t.order[node];
  const BiteEnd& end = exit ? state.bite[bite].exit : state.bite[bite].entry;
  ThreadAnchor a;
  a.slot = slot;
  a.point = end.point;
  a.friction = suture.pass_tension;
  a.capstan = suture.capstan;
  // The particle steps forward to the hole. Rest length goes with it, so neither side is stretched or squeezed by that.
  const Vec3 at = position_of(end.point, solver.x.data());
  const float sum = t.rest[node - 1] + t.rest[node];
  const float to_needle = std::clamp(distance(at, xyz(solver.x[t.order[node + 1]])), 0.15f * model.thread.spacing, 0.9f * sum);
  t.rest[node] = to_needle;
  t.rest[node - 1] = sum - to_needle;
  set(solver.x[slot], at);
  solver.v[slot] = {};
  t.anchor.push_back(a);
  state.point.push_back({bite, exit, static_cast<uint32_t>(t.anchor.size() - 1)});
  update_thread_collisions(model, solver, suture);
  events.push_back(
      {0, EventKind::suture_point, 0, static_cast<uint32_t>(state.point.size() - 1), static_cast<float>(bite), at});
  return true;
}

void remove_last_suture_point(const SolverModel& model, SolverState& solver, const SutureModel& suture, SutureState& state) {
  if (state.point.empty() || state.open.empty() || state.point.back().bite != state.open.front().bite)
    return;  // the needle was drawn through without thread
  const uint32_t anchor = state.point.back().anchor;
  state.point.pop_back();
  erase_anchor(solver, state, anchor);
  update_thread_collisions(model, solver, suture);
}

// Two holes may follow each other with no particle between them. When the short pair between them is used up, the nearer hole
// would hold the thread fast however hard it is pulled; so a little thread is drawn through the further one (or several of
// them) as soon as the pull is more than the friction of all.
static void feed(Thread& t, const ThreadAnchor& a, size_t i, float used_up, float step) {
  if (a.knotted) return;
  auto hole = [&](size_t node) {
    return std::find_if(t.anchor.begin(), t.anchor.end(),
                        [&](const ThreadAnchor& b) { return b.slot == t.order[node] && !b.knotted; });
  };
  for (const int way : {1, -1}) {
    float resist = a.threshold();
    const size_t nearest = way > 0 ? i - 1 : i;  // the pair on the side from which thread comes
    size_t pair = nearest;
    while (t.rest[pair] <= 2 * used_up) {
      const size_t node = way > 0 ? pair : pair + 1;  // its far end
      if (node == 0 || node + 1 == t.order.size()) break;
      const auto next = hole(node);
      const size_t beyond = way > 0 ? pair - 1 : pair + 1;
      if (next == t.anchor.end() || t.cut[beyond]) break;
      resist += next->threshold();
      pair = beyond;
    }
    const float force = way > 0 ? a.tension_needle : a.tension_free;
    if (pair == nearest || t.rest[nearest] > used_up || t.rest[pair] <= 2 * used_up || force <= resist) continue;
    const float drawn = std::min(step, t.rest[pair] - used_up);
    t.rest[pair] -= drawn;
    t.rest[nearest] += drawn;
  }
}

void pull(const SolverModel& model, SolverState& solver, const SutureModel& suture, SutureState& state,
          std::vector<Event>& events) {
  Thread& t = solver.thread;
  const float used_up = kUsedUp * model.thread.spacing;
  bool changed = false;
  const TiedNodes knots = tied_nodes(t);  // no particle passes a knot, so they stay true while others pass
  // `point`: the suture point that the anchor is, or -1 for the end of a loop on its way to the tissue.
  const auto pass_at = [&](ThreadAnchor& a, int64_t point) {
    const size_t i = node_of(t, a.slot);
    if (i == 0 || i + 1 >= t.order.size()) return;
    const bool was_blocked = a.blocked_needle;
    feed(t, a, i, used_up, 0.25f * model.thread.spacing);
    const bool tied = is_tied(t, knots, i);
    const bool from_free = !tied && can_give_free(t, i), from_needle = !tied && can_give_needle(t, i);
    // A cut end has no length to give, however much of the cut pair is written in the list.
    a.blocked_needle = tied || t.cut[i - 1] || t.cut[i] || (!from_free && t.rest[i - 1] <= used_up);
    a.blocked_free = tied || t.cut[i - 1] || t.cut[i] || (!from_needle && t.rest[i] <= used_up);
    if (point >= 0 && a.blocked_needle && !was_blocked && !tied && (i == 1 || t.cut[i - 1] || t.cut[i - 2]))
      events.push_back(
          {0, EventKind::thread_ran_out, 0, static_cast<uint32_t>(point), 0, position_of(a.point, solver.x.data())});

    // Toward the needle: the particle on the free side splits the pair on the needle side; the other way round for a pull on
    // the tail.
    const bool forward = from_free && t.rest[i - 1] <= used_up;
    const bool backward = !forward && from_needle && t.rest[i] <= used_up;
    if (!forward && !backward) return;
    pass(solver, i, forward);
    changed = true;
    if (point < 0) return;
    events.push_back({0, EventKind::particle_passed, 0, static_cast<uint32_t>(point), forward ? 1.0f : -1.0f,
                      position_of(a, solver.x.data())});
    judge_drawing(solver, state, a, forward, events);
  };
  for (size_t k = state.point.size(); k-- > 0;) pass_at(t.anchor[state.point[k].anchor], static_cast<int64_t>(k));
  for (const Knot& knot : state.knot)
    if (knot.phase == KnotPhase::tightening)
      for (ThreadAnchor& a : t.anchor)
        if (a.slot == knot.end[0] || a.slot == knot.end[1]) pass_at(a, -1);
  if (changed) update_thread_collisions(model, solver, suture);
}

float draw_through(const SolverModel& model, SolverState& solver, uint32_t slot, int way, float length) {
  Thread& t = solver.thread;
  const float used_up = kUsedUp * model.thread.spacing, least = 0.02f * model.thread.spacing;
  float gone = 0;
  for (;;) {
    const size_t i = node_of(t, slot);
    if (i == 0 || i + 1 >= t.order.size() || t.cut[i - 1] || t.cut[i]) return gone;
    const size_t from = way > 0 ? i - 1 : i, to = way > 0 ? i : i - 1;
    const float step = std::min(length - gone, t.rest[from] - least);
    if (step > 0) {
      t.rest[from] -= step;
      t.rest[to] += step;
      gone += step;
    }
    if (t.rest[from] > used_up || !(way > 0 ? can_give_free(t, i) : can_give_needle(t, i))) return gone;
    pass(solver, i, way > 0);
  }
}

}  // namespace catgut
