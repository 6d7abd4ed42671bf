// SPDX-License-Identifier: Apache-2.0
// suture/bake: a new suture (CommandKind::new_suture). Reads the thread and its knots; tied thread becomes a baked suture, the
// rest of the old suture is removed. Cost stays flat for any number of stitches in a procedure (paper 3.4). A baked suture is a
// curve that the tissue carries, and a few tethers between the points that its thread held together.
#include <algorithm>

#include "suture/suture.h"

namespace catgut {
namespace {

constexpr float kLongestTail = 0.03f;  // [m] of a strand left uncut: trimmed here, as an assistant would
constexpr uint32_t kCarriers = 6;      // particles that carry a tether's end
constexpr float kSamePlace = 0.003f;   // [m] less than the distance of stitches: a second tether there would oppose the first
constexpr float kCarries = 0.1f;       // [N] in a passage through a wall; below this the wall needs no tether

// Whether anchors a and b are the entry and the exit of one bite.
bool same_bite(const Suture& state, int a, int b) {
  const auto point_at = [&](int anchor) {
    return std::find_if(state.point.begin(), state.point.end(),
                        [&](const SuturePoint& p) { return static_cast<int>(p.anchor) == anchor; });
  };
  const auto in = point_at(a), out = point_at(b);
  return in != state.point.end() && out != state.point.end() && in->bite == out->bite;
}

// Whether one of the first `pins` tethers holds the points of `pin` together at least as closely. Either of the technique's
// closure, or of an adjacent stitch.
bool held_already(const SolverState& solver, size_t pins, const Tether& pin) {
  const Vec4* x = solver.x.data();
  const Vec3 a = position_of(pin.a, x), b = position_of(pin.b, x);
  return std::any_of(solver.pin.begin(), solver.pin.begin() + static_cast<long>(pins), [&](const Tether& other) {
    const Vec3 oa = position_of(other.a, x), ob = position_of(other.b, x);
    const float apart = std::min(std::max(distance(a, oa), distance(b, ob)), std::max(distance(a, ob), distance(b, oa)));
    return apart < kSamePlace && other.length <= pin.length;
  });
}

// A position bound to the nearest tissue particle, in the frame of that particle's cluster.
BakedNode bind(const SolverModel& model, const SolverState& solver, Vec3 at) {
  BakedNode n;
  float best = 1e30f;
  for (uint32_t i = 0; i < model.tissue; ++i) {
    const float d = length2(xyz(solver.x[i]) - at);
    if (d < best) best = d, n.particle = i;
  }
  const uint32_t c = model.shape.cluster_of[n.particle];
  const Quat q{solver.rotation.x[c], solver.rotation.y[c], solver.rotation.z[c], solver.rotation.w[c]};
  n.offset = rotate(conjugate(q), at - xyz(solver.x[n.particle]));
  return n;
}

// Thread between two anchors: a candidate for a tether.
struct Span {
  int a, b;
  float length = 0, tension = 0;  // [m], [N] maximum along it
  bool passage = false;           // from entry to exit of a wall
};

// The spans of the anchored part of a piece, from node `lowest` to node `highest`. A knot is not a point of tissue: it lies
// where its two strands pull it. If both ends of a stitch meet in one knot, they form one span through it. Of two spans
// between the same anchors, the shorter one carries the load.
std::vector<Span> spans_of(const Strand& t, size_t lowest, size_t highest, const Suture& state,
                           const std::vector<uint32_t>& knots) {
  std::vector<Span> spans;
  int before = -1;
  float length = 0, tension = 0;
  for (size_t i = lowest; i <= highest; ++i) {
    if (const int here = anchor_of(t, t.order[i]); here >= 0) {
      if (before >= 0) spans.push_back({before, here, length, tension, same_bite(state, before, here)});
      before = here;
      length = tension = 0;
    }
    if (i < highest) length += t.rest[i], tension = std::max(tension, t.tension[i]);
  }
  if (spans.size() < 3) return spans;
  const auto slot_of = [&](int anchor) { return t.anchor[static_cast<size_t>(anchor)].slot; };
  const std::array<uint32_t, 2> ends = {slot_of(spans.front().a), slot_of(spans.back().b)};
  const bool closed = std::any_of(knots.begin(), knots.end(), [&](uint32_t k) {
    const Knot& knot = state.knot[k];
    return knot.slots == 2 && std::is_permutation(ends.begin(), ends.end(), knot.slot.begin());
  });
  if (!closed) return spans;
  const Span& last = spans.back();
  Span round{spans.front().b, last.a, spans.front().length + last.length, std::max(spans.front().tension, last.tension)};
  if (spans.size() == 3) {
    round.length = std::min(round.length, spans[1].length);
    return {round};
  }
  spans.front() = round;
  spans.pop_back();
  return spans;
}

// The thread from node `first` to node `last`, tied by `knots`, as a baked suture and the tethers that replace it.
void settle_piece(OneSuture& one, size_t first, size_t last, const std::vector<uint32_t>& knots) {
  const SolverModel& model = one.all.model;
  SolverState& solver = one.all.solver;
  SutureState& state = one.all.state;
  const Strand& t = one.strand;
  BakedSuture stitch;
  size_t lowest = last, highest = first;
  for (size_t i = first; i <= last; ++i)
    if (anchor_of(t, t.order[i]) >= 0) lowest = std::min(lowest, i), highest = std::max(highest, i);
  const size_t pins = solver.pin.size();  // without the ones made here
  for (const Span& span : spans_of(t, lowest, highest, one.own, knots)) {
    // A passage through a wall holds only the wall together: without load, no tether is needed.
    if (span.passage && span.tension < kCarries) continue;
    Tether pin;
    const EmbeddedPoint &a = t.anchor[static_cast<size_t>(span.a)].point, &b = t.anchor[static_cast<size_t>(span.b)].point;
    // Forces of a tied stitch are small, and its tethers are solved in every substep from now on. In deformed tissue, fewer
    // particles give a slightly different position; this must not move anything.
    pin.a = carried_by(model.shape.rest.data(), a, kCarriers);
    pin.b = carried_by(model.shape.rest.data(), b, kCarriers);
    const Vec4* x = solver.x.data();
    const float other = distance(position_of(pin.a, x), position_of(pin.b, x)) - distance(position_of(a, x), position_of(b, x));
    pin.length = std::max(0.0f, span.length + other);
    pin.compliance = one.thread.stretch_compliance * span.length / one.thread.spacing;
    pin.owner = span.passage ? TetherOwner::passage : TetherOwner::stitch;
    if (!held_already(solver, pins, pin)) solver.pin.push_back(pin);
  }
  float tail = 0;
  while (lowest > first && tail + t.rest[lowest - 1] <= kLongestTail) tail += t.rest[--lowest];
  tail = 0;
  while (highest < last && tail + t.rest[highest] <= kLongestTail) tail += t.rest[highest++];
  for (size_t i = lowest; i <= highest; ++i)
    stitch.node.push_back(bind(model, solver, thread_position(t, i, solver.x.data(), solver.body)));
  Vec3 where{};
  for (uint32_t k : knots) {
    where = position_of(one.own.knot[k].target, solver.x.data());
    stitch.knot.push_back(bind(model, solver, where));
  }
  one.report(EventKind::suture_baked, static_cast<uint32_t>(state.settled.size()), 0, where);
  state.settled.push_back(std::move(stitch));
}

}  // namespace

void fresh_suture(const SolverModel& model, SolverState& solver, size_t suture, std::span<const Vec3> start,
                  const Pose& needle_start) {
  Strand& t = solver.strand[suture];
  const StrandModel& m = model.strand[suture];
  reset(m, t);
  for (uint32_t slot = m.first_slot; slot < m.first_slot + m.count; ++slot) {
    solver.x[slot] = point(start[slot]);
    solver.v[slot] = {};
  }
  const uint32_t body = model.needle_body(suture);
  RigidBody& needle = solver.body[body];
  needle = {};
  needle.x = needle.prev_x = needle_start.p;
  needle.q = needle.prev_q = needle_start.q;
  // The thread's last particle is the swage of the needle.
  t.hold.push_back({t.order.back(), static_cast<int>(body), model.needle_arc[suture].point(0), HoldKind::swage});
}

namespace {

// Tied thread is baked, piece by piece between the cuts; sutured thread without a knot is pulled out.
void settle_thread(OneSuture& s, uint8_t who) {
  SutureContext& c = s.all;
  const Strand& t = s.strand;
  std::vector<uint32_t> knots;
  for (size_t first = 0; first < t.order.size();) {
    size_t last = first;
    while (last + 1 < t.order.size() && !t.cut[last]) ++last;
    const auto on_piece = [&](uint32_t slot) {
      const size_t node = node_of(t, slot);
      return node >= first && node <= last;
    };
    knots.clear();
    for (uint32_t k = 0; k < s.own.knot.size(); ++k) {
      const Knot& knot = s.own.knot[k];
      if (knot.slots == 0 || !on_piece(knot.slot[0])) continue;
      knots.push_back(k);
      if (knot.throws < static_cast<uint32_t>(c.suture.min_throws) && !knot.reported)
        c.report_fault(s.index, Fault::too_few_throws, who, k, position_of(knot.target, s.x()));
    }
    if (!knots.empty()) {
      settle_piece(s, first, last, knots);
    } else {
      for (const SuturePoint& p : s.own.point) {
        const ThreadAnchor& a = t.anchor[p.anchor];
        if (!on_piece(a.slot)) continue;
        c.report_fault(s.index, Fault::cut_before_knot, who, a.slot, position_of(a.point, s.x()));
        break;
      }
    }
    first = last + 1;
  }
}

// Releases everything that holds the needle or thread of the suture.
void let_go_of(OneSuture& s) {
  SutureContext& c = s.all;
  const int needle = static_cast<int>(s.needle);
  for (uint32_t k = 0; k < c.state.instrument.size(); ++k) {
    InstrumentState& hand = c.state.instrument[k];
    const Vec3 at = c.solver.body[k].x;
    const bool mine = hand.suture == s.index;
    if (mine && hand.held == Held::needle) c.report_tool(s.index, EventKind::needle_released, k, 0, 0, at);
    if (mine && hand.held == Held::thread) {
      for (Strand& strand : c.solver.strand) release_holds(strand, static_cast<int>(k), HoldKind::jaw);
      c.report_tool(s.index, EventKind::thread_released, k, hand.slot, 0, at);
    }
    if (mine && hand.held != Held::tissue) hand.held = Held::nothing;
    ToolLoop& loop = c.state.loop[k];
    if (loop.suture != s.index) continue;
    if (loop.wraps > 0) c.report_tool(s.index, EventKind::loop_released, k, 0, 0, at);
    const float jaw = loop.jaw;
    loop = {};
    loop.jaw = jaw;
  }
  std::erase_if(c.solver.weld, [&](const Weld& w) { return w.a == needle; });
  std::erase_if(c.solver.attach, [&](const Attachment& a) { return a.body == needle; });
  std::erase_if(c.solver.channel, [&](const NeedleTrackConstraint& p) { return p.suture == s.index; });
  c.solver.body_collides[s.needle] = 1;
}

}  // namespace

namespace {

bool replace(SutureContext& c, const Command& command, std::span<const Vec3> start, std::span<const Pose> needle_start) {
  const uint8_t who = command.hand;
  OneSuture s(c, command.argument);
  if (!s.own.open.empty()) {
    c.report_fault(s.index, Fault::needle_in_tissue, who, s.own.open.back().bite, s.body().x);
    return false;
  }
  undo_throws(s);
  // Passages that drew their wall in until later stitches took over their load: a remaining tether costs time in every
  // substep.
  const float least = kCarries * c.model.h * c.model.h;
  std::erase_if(c.solver.pin, [&](const Tether& p) { return p.owner == TetherOwner::passage && -p.lambda < least; });
  settle_thread(s, who);
  let_go_of(s);
  s.own.attached = s.own.tip_inside = false;
  s.own.point.clear();
  s.own.knot.clear();
  fresh_suture(c.model, c.solver, s.index, start, needle_start[s.index]);
  c.report(s.index, EventKind::suture_loaded, who, s.own.suture_index++, 0, s.body().x);
  return true;
}

}  // namespace

bool new_suture(SutureContext& c, std::span<const Vec3> start, std::span<const Pose> needle_start, const TickInput& input) {
  bool any = false;
  for (const Command& command : input.commands) {
    if (command.kind != CommandKind::new_suture) continue;
    const bool ready = command.hand < kMaxHands && input.hand[command.hand].connected;
    if (ready && command.argument < c.state.suture.size()) any = replace(c, command, start, needle_start) || any;
    else c.refuse(command);
  }
  return any;
}

}  // namespace catgut
