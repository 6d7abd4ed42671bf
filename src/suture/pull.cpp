// SPDX-License-Identifier: Apache-2.0
// suture/pull: thread through suture points (paper 2.3, figures 7 to 9). Reads tensions and rest lengths; edits the order list,
// never a slot. Thread slides at an anchor inside the solver (see solver/thread). When the pair on one side of an anchor is
// used up, its particle passes here. It moves to its new place in the order, at the midpoint of the pair it splits (figure 7c).
// Slack is resolved in the paper's order (figure 9) by tension. A slack span has none, so the anchor next to the pull slides
// first, and the one behind it only when the span between them is taut.
#include <algorithm>
#include <array>

#include "suture/suture.h"

namespace catgut {
namespace {

constexpr float kUsedUp = 0.1f;  // of the spacing: below this length of the pair beside an anchor, its particle passes

// Whether the particle beside the locked node i may pass it: it exists, it is free, and thread continues behind it.
bool can_give_free(const Strand& t, size_t i) {
  return i >= 2 && i + 1 < t.order.size() && !is_locked(t, t.order[i - 1]) && !t.cut[i - 1] && !t.cut[i - 2] && !t.cut[i];
}
bool can_give_needle(const Strand& t, size_t i) {
  return i >= 1 && i + 2 < t.order.size() && !is_locked(t, t.order[i + 1]) && !t.cut[i] && !t.cut[i + 1] && !t.cut[i - 1];
}

// Figure 7c: the particle beside the locked node i moves to the other side, at the midpoint of the pair it splits.
void pass(OneSuture& s, size_t i, bool toward_needle) {
  Strand& t = s.strand;
  SolverState& solver = s.all.solver;
  const uint32_t locked = t.order[i], slot = t.order[toward_needle ? i - 1 : i + 1],
                 beyond = t.order[toward_needle ? i + 1 : i - 1];
  if (toward_needle) move_particle(t, i - 1, i);
  else move_particle(t, i + 1, i - 1);
  set(solver.x[slot], lerp(xyz(solver.x[locked]), xyz(solver.x[beyond]), 0.5f));
  set(solver.v[slot], 0.5f * (xyz(solver.v[beyond]) + xyz(solver.v[locked])));
}

// "With a knot created, the suture pulling will perform the same slack check from the needle end but will stop checking when
// the knot is found." Between the two particles of a knot the stitch is closed. Pulls from outside do not reach it.
struct TiedNodes {
  static constexpr size_t kMost = 64;
  std::array<size_t, kMost> node;  // of locked knots' particles
  size_t count = 0;
};
TiedNodes tied_nodes(const Strand& t) {
  TiedNodes k;
  for (const ThreadAnchor& a : t.anchor)
    if (a.knotted && k.count < TiedNodes::kMost) k.node[k.count++] = node_of(t, a.slot);
  return k;
}
bool is_tied(const Strand& t, const TiedNodes& knots, size_t i) {
  size_t below = i, above = i;
  for (size_t k = 0; k < knots.count; ++k) {
    const size_t n = knots.node[k];
    if (n < i && (below == i || n > below)) below = n;
    if (n > i && (above == i || n < above)) above = n;
  }
  return below < i && above > i && is_whole(t, below, above);
}

}  // namespace

// Whether jaws pull the thread that passes at node i in that direction: they hold it there, without a suture point between.
static int drawing_instrument(const Strand& t, size_t i, int way) {
  for (size_t k = i; continues(t, k, way);) {
    k = way > 0 ? k + 1 : k - 1;
    const uint32_t slot = t.order[k];
    for (const ThreadHold& h : t.hold)
      if (h.slot == slot) return h.kind == HoldKind::jaw ? h.body : -1;
    if (is_anchored(t, slot)) return -1;
  }
  return -1;
}

// "Pulling" before the bite is complete. The needle pulls thread through holes; jaws on the thread are an error. One
// particle may pass at the moment of the grasp; at the second, thread of one spacing has been pulled.
static void judge_drawing(OneSuture& s, const ThreadAnchor& a, bool toward_needle) {
  if (s.own.open.empty()) return;
  OpenBite& open = s.own.open.back();
  const int tool = open.reported ? -1 : drawing_instrument(s.strand, node_of(s.strand, a.slot), toward_needle ? 1 : -1);
  if (tool < 0 || ++open.drawn < 2) return;
  open.reported = 1;
  s.all.report_fault(s.index, Fault::needle_in_tissue, hand_of(s.all.state, static_cast<size_t>(tool)), open.bite,
                     position_of(a, s.x()));
}

// A cut thread holds nothing together: return its whole length.
static float length_between(const Strand& t, size_t a, size_t b) {
  return is_whole(t, a, b) ? rest_between(t, a, b) : rest_length(t);
}

float length_between_ends(const Strand& t, const Suture& state) {
  if (state.point.size() < 2) return 0;
  size_t lo = t.order.size(), hi = 0;
  for (const SuturePoint& p : state.point) {
    const size_t i = node_of(t, t.anchor[p.anchor].slot);
    lo = std::min(lo, i);
    hi = std::max(hi, i);
  }
  return length_between(t, lo, hi);
}

void spans(const Strand& t, const Suture& state, const Vec4* x, std::vector<float>& span) {
  span.assign(state.point.size(), 0);
  for (size_t k = 0; k + 1 < state.point.size(); ++k) {
    const ThreadAnchor &here = t.anchor[state.point[k].anchor], &next = t.anchor[state.point[k + 1].anchor];
    const size_t a = node_of(t, here.slot), b = node_of(t, next.slot);
    span[k] = rest_between(t, a, b);
    for (const ThreadAnchor& knot : t.anchor) {
      const size_t node = knot.knotted ? node_of(t, knot.slot) : 0;
      if (node <= std::min(a, b) || node >= std::max(a, b)) continue;
      const float beyond = rest_between(t, node, b);  // from the knot on; thread before it cannot be pulled
      span[k] = std::min(span[k], std::max(0.0f, beyond - distance(position_of(knot, x), position_of(here, x))));
    }
  }
}

void erase_anchor(Strand& strand, Suture& state, uint32_t anchor) {
  strand.anchor.erase(strand.anchor.begin() + anchor);
  for (SuturePoint& p : state.point)
    if (p.anchor > anchor) --p.anchor;
}

// Two holes may be closer than two particles of the thread, and the previous hole has taken the last particle between. The
// next free particle then passes the suture points up to the needle early (figure 7c). False: there is none.
static bool bring_particle(OneSuture& s) {
  Strand& t = s.strand;
  SolverState& solver = s.all.solver;
  size_t from = t.order.size() - 2;
  const auto in_hole = [&](uint32_t slot) {
    const int k = anchor_of(t, slot);
    return k != kNoAnchor && !t.anchor[static_cast<size_t>(k)].knotted;
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

bool place_suture_point(OneSuture& s, uint32_t bite, bool exit) {
  Strand& t = s.strand;
  SolverState& solver = s.all.solver;
  if (t.order.size() < 3) return false;
  const size_t node = t.order.size() - 2;  // the last is the needle's
  // A needle without thread, or with a stump too short to follow it, leaves none in the hole.
  if (!is_swaged(t) || t.cut[node] || t.cut[node - 1]) return true;
  if (is_locked(t, t.order[node]) && !bring_particle(s)) return false;
  const uint32_t slot = t.order[node];
  const BiteEnd& end = exit ? s.own.bite[bite].exit : s.own.bite[bite].entry;
  ThreadAnchor a;
  a.slot = slot;
  a.point = end.point;
  a.friction = s.all.suture.pass_tension;
  a.capstan_friction = s.all.suture.capstan_friction;
  // The particle moves forward to the hole, with its rest length, so neither side is stretched or compressed.
  const Vec3 at = position_of(end.point, s.x());
  const float sum = t.rest[node - 1] + t.rest[node];
  const float to_needle = std::clamp(distance(at, s.at(t.order[node + 1])), 0.15f * s.thread.spacing, 0.9f * sum);
  t.rest[node] = to_needle;
  t.rest[node - 1] = sum - to_needle;
  set(solver.x[slot], at);
  solver.v[slot] = {};
  t.anchor.push_back(a);
  s.own.point.push_back({bite, exit, static_cast<uint32_t>(t.anchor.size() - 1)});
  s.report(EventKind::suture_point, static_cast<uint32_t>(s.own.point.size() - 1), static_cast<float>(bite), at);
  return true;
}

void remove_last_suture_point(OneSuture& s) {
  Suture& own = s.own;
  if (own.point.empty() || own.open.empty() || own.point.back().bite != own.open.front().bite)
    return;  // the needle was pulled through without thread
  const uint32_t anchor = own.point.back().anchor;
  own.point.pop_back();
  erase_anchor(s.strand, own, anchor);
}

// Two holes may be adjacent without a particle between them. When the short pair between them is used up, the nearer hole
// would block the thread under any force. So a little thread is moved through the further one (or several of them) as soon as
// the pull exceeds the friction of all.
static void feed(Strand& t, const ThreadAnchor& a, size_t i, float used_up, float step) {
  if (a.knotted) return;
  auto hole = [&](size_t node) {
    return std::find_if(t.anchor.begin(), t.anchor.end(),
                        [&](const ThreadAnchor& b) { return b.slot == t.order[node] && !b.knotted; });
  };
  for (const int way : {1, -1}) {
    float resist = a.threshold();
    const size_t nearest = way > 0 ? i - 1 : i;  // the pair on the side that supplies thread
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

// What may pass at one anchor. `point`: the suture point of the anchor, or -1 for the end of a loop that moves to the
// tissue.
static void pass_at(OneSuture& s, const TiedNodes& knots, ThreadAnchor& a, int64_t point) {
  Strand& t = s.strand;
  const float used_up = kUsedUp * s.thread.spacing;
  const size_t i = node_of(t, a.slot);
  if (i == 0 || i + 1 >= t.order.size()) return;
  const bool was_blocked = a.blocked_needle;
  feed(t, a, i, used_up, 0.25f * s.thread.spacing);
  const bool tied = is_tied(t, knots, i);
  const bool from_free = !tied && can_give_free(t, i), from_needle = !tied && can_give_needle(t, i);
  // A cut end has no length to give, whatever the rest length of the cut pair.
  a.blocked_needle = tied || t.cut[i - 1] || t.cut[i] || (!from_free && t.rest[i - 1] <= used_up);
  a.blocked_free = tied || t.cut[i - 1] || t.cut[i] || (!from_needle && t.rest[i] <= used_up);
  if (point >= 0 && a.blocked_needle && !was_blocked && !tied && (i == 1 || t.cut[i - 1] || t.cut[i - 2]))
    s.report(EventKind::thread_exhausted, static_cast<uint32_t>(point), 0, position_of(a.point, s.x()));

  // Toward the needle: the particle on the free side splits the pair on the needle side; vice versa for a pull on the
  // tail.
  const bool forward = from_free && t.rest[i - 1] <= used_up;
  const bool backward = !forward && from_needle && t.rest[i] <= used_up;
  if (!forward && !backward) return;
  pass(s, i, forward);
  if (point < 0) return;
  s.report(EventKind::particle_passed, static_cast<uint32_t>(point), forward ? 1.0f : -1.0f, position_of(a, s.x()));
  judge_drawing(s, a, forward);
}

void pull(SutureContext& c) {
  for (size_t k = 0; k < c.state.suture.size(); ++k) {
    OneSuture s(c, k);
    if (s.strand.anchor.empty()) continue;
    const TiedNodes knots = tied_nodes(s.strand);  // no particle passes a knot, so they stay valid while others pass
    for (size_t p = s.own.point.size(); p-- > 0;)
      pass_at(s, knots, s.strand.anchor[s.own.point[p].anchor], static_cast<int64_t>(p));
    for (const Knot& knot : s.own.knot)
      if (knot.phase == KnotPhase::tightening)
        for (ThreadAnchor& a : s.strand.anchor)
          if (a.slot == knot.end[0] || a.slot == knot.end[1]) pass_at(s, knots, a, -1);
  }
}

float draw_through(OneSuture& s, uint32_t slot, int direction, float length) {
  Strand& t = s.strand;
  const float used_up = kUsedUp * s.thread.spacing, least = 0.02f * s.thread.spacing;
  float gone = 0;
  for (;;) {
    const size_t i = node_of(t, slot);
    if (i == 0 || i + 1 >= t.order.size() || t.cut[i - 1] || t.cut[i]) return gone;
    const size_t from = pair_beside(i, -direction), to = pair_beside(i, direction);
    const float step = std::min(length - gone, t.rest[from] - least);
    if (step > 0) {
      t.rest[from] -= step;
      t.rest[to] += step;
      gone += step;
    }
    if (t.rest[from] > used_up || !(direction > 0 ? can_give_free(t, i) : can_give_needle(t, i))) return gone;
    pass(s, i, direction > 0);
  }
}

}  // namespace catgut
