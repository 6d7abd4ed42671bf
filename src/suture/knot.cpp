// SPDX-License-Identifier: Apache-2.0
// suture/knot: a loop becomes a throw, the throw moves to the tissue and locks there (paper 2.4). Reads loops, hands and
// the thread's order; writes knots, their anchors and, once a knot is locked, the slack under it.
//
// A tool with a loop round it grasps thread beyond the loop, usually the other end of the stitch. That end is thereby pulled
// through the loop. From then on the loop is a throw. It leaves the tool and hangs on the two ends of its own thread between
// tool and tissue. As the tool moves away, the throw approaches the tissue. Until it locks, releasing the thread undoes it.
#include <algorithm>
#include <cmath>

#include "suture/suture.h"

namespace catgut {
namespace {

constexpr float kTaut = 0.3f;      // [N] tension of a strand that pulls its throw down
constexpr float kFastest = 0.25f;  // [m/s] maximum speed of that

constexpr float kDrawSpeed = 0.25f;  // [m/s] thread pulled through a locked knot, and particles pulled into it
constexpr float kSnug = 0.00005f;    // [m] of slack that remains in a tight stitch
constexpr int kNone = kNoAnchor;

bool is_suture_point(const Suture& state, int anchor) {
  return std::any_of(state.point.begin(), state.point.end(),
                     [&](const SuturePoint& p) { return p.anchor == static_cast<uint32_t>(anchor); });
}

// The next anchor from node i along the thread: toward the needle (direction +1) or the free end. It stops at an end of the
// thread, cut or not. Loops of throws under way count as thread. `points`: suture points only, not the particles of knots.
int next_anchor(const Strand& t, const Suture& state, size_t i, int way, bool points) {
  while (continues(t, i, way)) {
    i = way > 0 ? i + 1 : i - 1;
    const int k = anchor_of(t, t.order[i]);
    if (k != kNone && (is_suture_point(state, k) || (!points && t.anchor[static_cast<size_t>(k)].knotted))) return k;
  }
  return kNone;
}

// Location on the thread: on the strand to the free end, on the strand to the needle, on a bight between two points of
// tissue, or on a piece without a knot.
enum class Side { free_end, needle, bight, loose };
struct Ends {
  Side strand = Side::loose;
  int inward = kNone;  // anchor of the stitch or the knot that it comes from
};
Ends ends_of(const Strand& t, const Suture& state, size_t first, size_t last) {
  const int down = next_anchor(t, state, first, -1, false), up = next_anchor(t, state, last, 1, false);
  if (down != kNone && up != kNone) return {Side::bight, down};
  if (down != kNone) return {Side::needle, down};
  if (up != kNone) return {Side::free_end, up};
  return {};
}

// The suture point nearest along the thread to a strand that leaves anchor k, that anchor included.
int nearest_point(const Strand& t, const Suture& state, int k, Side strand) {
  if (k == kNone || is_suture_point(state, k)) return k;
  return next_anchor(t, state, node_of(t, t.anchor[static_cast<size_t>(k)].slot), strand == Side::free_end ? 1 : -1, true);
}

bool pulls(const OneSuture& s, const Knot& knot) {
  const InstrumentState& hand = s.all.state.instrument[knot.hand];
  return hand.held == Held::thread && hand.suture == s.index && hand.slot == knot.strand;
}
// Whether the current throw is still on one thread: its loop, and the grasped strand, with the stitch.
bool is_whole(const OneSuture& s, const Knot& knot) {
  const Strand& t = s.strand;
  const size_t first = node_of(t, knot.end[0]), last = node_of(t, knot.end[1]), held = node_of(t, knot.strand);
  return first < last && is_whole(t, first, last) && ends_of(t, s.own, first, last).strand != Side::loose &&
         ends_of(t, s.own, held, held).strand != Side::loose;
}

void release_end(OneSuture& s, uint32_t slot) {
  const int k = anchor_of(s.strand, slot);
  if (k != kNone) erase_anchor(s.strand, s.own, static_cast<uint32_t>(k));
}

// "If the user decides they do not want to proceed ... they can release the free end of the thread. After letting go, the loop
// will be released, and the knot object will be destroyed." The event throw_undone reports it; only positions change.
void cancel(OneSuture& s, uint32_t which) {
  Knot& knot = s.own.knot[which];
  const Vec3 where = position_of(knot.target, s.x()) + normalized(knot.from) * knot.left;
  s.all.report_tool(s.index, EventKind::throw_undone, knot.hand, which, 0, where);
  for (uint32_t slot : knot.end) release_end(s, slot);
  if (knot.begun == 0) {
    s.own.knot.erase(s.own.knot.begin() + which);
  } else {
    knot.thrown[knot.throws - 1] = {};
    knot.throws = knot.begun;
    knot.phase = KnotPhase::locked;
  }
}

// The locked knot that a further throw belongs to: the one from which both strands come, or the wrapped one if it is thrown
// round a bight or round itself.
int knot_under(const Strand& t, const Suture& state, const Ends& loop, const Ends& taken, bool one_strand) {
  const auto holds = [&](const Knot& k, int anchor) {
    if (anchor == kNone) return false;
    const uint32_t slot = t.anchor[static_cast<size_t>(anchor)].slot;
    return std::find(k.slot.begin(), k.slot.begin() + k.slots, slot) != k.slot.begin() + k.slots;
  };
  for (size_t i = state.knot.size(); i-- > 0;) {
    const Knot& k = state.knot[i];
    if (k.phase == KnotPhase::locked && holds(k, loop.inward) && (one_strand || holds(k, taken.inward)))
      return static_cast<int>(i);
  }
  return kNone;
}

// Target of a first throw. "The knot object moves towards the suture point. ... If more than one suture point has been
// created, the knot object will move toward the midpoint of the last two created suture points." The paper's stitch is one such
// pair. A stitch here may have many points before it is tied (a purse-string). The knot joins its two ends: the suture
// point nearest to the grasped strand and the one nearest to the loop. For a stitch of two points both rules agree. A running
// suture tied to itself (the end of a Connell: the grasped strand is a bight, or the needle's own) has no other end.
// There the paper's rule applies unchanged.
EmbeddedPoint where_to(const OneSuture& s, const Ends& loop, const Ends& taken, bool one_strand) {
  const Strand& t = s.strand;
  const Suture& state = s.own;
  const Vec4* rest = s.all.model.shape.rest.data();
  const auto point = [&](int anchor) -> const EmbeddedPoint& { return t.anchor[static_cast<size_t>(anchor)].point; };
  const size_t points = state.point.size();
  if (one_strand) {
    const int last = static_cast<int>(state.point[points - 1].anchor);
    return points == 1 ? point(last) : midway(rest, point(static_cast<int>(state.point[points - 2].anchor)), point(last));
  }
  const int a = nearest_point(t, state, taken.inward, taken.strand), b = nearest_point(t, state, loop.inward, loop.strand);
  if (a == kNone || b == kNone) return point(a == kNone ? (b == kNone ? loop.inward : b) : a);
  return a == b ? point(a) : midway(rest, point(a), point(b));
}

// "Knots can be created when at least one valid loop and suture point are detected. If the tool that has the loop around it
// grabs the free end of the rope passed the loop, a 3D object that represents the knot is created. The loop's ends are attached
// to the object, and the whole loop detaches from the tool."
void begin(SutureContext& c, uint32_t who) {
  const ToolLoop loop = c.state.loop[who];
  const InstrumentState& hand = c.state.instrument[who];
  const RigidBody& tool = c.solver.body[who];
  const uint32_t strand = hand.slot;
  OneSuture s(c, loop.suture);
  Strand& t = s.strand;
  Suture& own = s.own;
  const bool own_thread = hand.suture == loop.suture;
  const size_t first = node_of(t, loop.first), last = node_of(t, loop.last), held = own_thread ? node_of(t, strand) : first;
  const Ends wrapped = ends_of(t, own, first, last), taken = own_thread ? ends_of(t, own, held, held) : Ends{};
  // Two strands are tied to each other if one leads to the free end and the other to the needle.
  const bool one_strand = wrapped.strand == taken.strand || wrapped.strand == Side::bight || taken.strand == Side::bight;
  const int under = knot_under(t, own, wrapped, taken, one_strand);
  const bool full = under != kNone && own.knot[static_cast<size_t>(under)].throws == KnotView::kMaxThrows;
  if (own.point.empty() || wrapped.strand == Side::loose || taken.strand == Side::loose || full) {
    if (!full)
      c.report_fault(s.index, Fault::knot_without_bite, hand_of(c.state, who), static_cast<uint32_t>(own.knot.size()), tool.x);
    release_loop(c, who);
    c.report_tool(s.index, EventKind::loop_released, who, 0, 0, tool.x);
    return;
  }
  if (!own.open.empty() && !own.open.back().reported) {
    c.report_fault(s.index, Fault::needle_in_tissue, hand_of(c.state, who), own.open.back().bite, tool.x);
    own.open.back().reported = 1;
  }

  uint32_t which = static_cast<uint32_t>(under);
  if (under == kNone) {
    which = static_cast<uint32_t>(own.knot.size());
    own.knot.emplace_back();
    own.knot[which].target = where_to(s, wrapped, taken, one_strand);
  }
  Knot& knot = own.knot[which];
  Vec3 place{};
  for (size_t i = first; i <= last; ++i) place += s.at(t.order[i]) / static_cast<float>(last - first + 1);
  const Vec3 target = position_of(knot.target, s.x());
  knot.phase = KnotPhase::tightening;
  knot.hand = who;
  knot.begun = knot.throws++;
  knot.from = place - target;
  knot.left = length(knot.from);
  knot.hand_from = tool.x;
  knot.strand = strand;
  knot.end = {loop.first, loop.last};
  KnotThrow& made = knot.thrown[knot.throws - 1];
  made = {};
  made.wraps = loop.wraps;
  made.chirality = loop.chirality;
  made.needle_end = wrapped.strand == Side::free_end ? 0 : 1;
  release_loop(c, who);
  for (uint32_t slot : knot.end) {
    ThreadAnchor a;
    a.slot = slot;
    a.point = knot.target;
    a.offset = s.at(slot) - target;
    a.friction = c.suture.pass_tension;
    a.capstan_friction = c.suture.capstan_friction;
    t.anchor.push_back(a);
  }
  c.report_tool(s.index, EventKind::throw_started, who, which, static_cast<float>(made.wraps), place);
}

// The particle of the grasped strand that the knot will hold: the one nearest to it between stitch and jaw. -1: there is
// none.
int64_t particle_for(const OneSuture& s, const Knot& knot) {
  const Strand& t = s.strand;
  const size_t held = node_of(t, knot.strand);
  const Ends taken = ends_of(t, s.own, held, held);
  if (taken.strand == Side::bight || taken.strand == Side::loose) return -1;
  const size_t from = node_of(t, t.anchor[static_cast<size_t>(taken.inward)].slot);
  const Vec3 target = position_of(knot.target, s.x());
  int64_t found = -1;
  float best = 1e30f;
  for (size_t i = std::min(from, held) + 1; i < std::max(from, held); ++i) {
    const uint32_t slot = t.order[i];
    if (is_locked(t, slot)) continue;
    const float d = distance(s.at(slot), target);
    if (d < best) best = d, found = slot;
  }
  return found;
}

// The first throw of a knot, at the tissue: from now on it holds a particle of each strand.
void hold_strands(OneSuture& s, Knot& knot, Vec3 where) {
  Strand& t = s.strand;
  const size_t first = node_of(t, knot.end[0]), last = node_of(t, knot.end[1]), held = node_of(t, knot.strand);
  const Ends wrapped = ends_of(t, s.own, first, last), taken = ends_of(t, s.own, held, held);
  const bool free_end_wrapped = wrapped.strand == Side::free_end;
  const bool two =
      (free_end_wrapped && taken.strand == Side::needle) || (wrapped.strand == Side::needle && taken.strand == Side::free_end);
  const int64_t other = two ? particle_for(s, knot) : -1;
  const uint32_t inner = knot.end[free_end_wrapped ? 1 : 0];
  release_end(s, knot.end[free_end_wrapped ? 0 : 1]);
  const int k = anchor_of(t, inner);
  if (k != kNone) {
    t.anchor[static_cast<size_t>(k)].offset = {};
    t.anchor[static_cast<size_t>(k)].knotted = true;
  }
  knot.slot[0] = inner;
  knot.slots = 1;
  if (other >= 0) {
    ThreadAnchor a;
    a.slot = static_cast<uint32_t>(other);
    a.point = knot.target;
    a.offset = s.at(a.slot) - where;
    a.knotted = true;
    t.anchor.push_back(a);
    knot.slot = free_end_wrapped ? std::array{inner, a.slot} : std::array{a.slot, inner};
    knot.slots = 2;
  }
  knot.slack_removed = 0;
}

// "When the knot object reaches the suture point or midpoint between the two previous suture points, it is locked in place, and
// the attached particles are released." From here on the knot holds the stitch: a particle of the wrapped strand, which is the
// loop's inner end, and one of the grasped strand.
void lock(OneSuture& s, uint32_t which) {
  Knot& knot = s.own.knot[which];
  KnotThrow& made = knot.thrown[knot.throws - 1];
  const Vec3 where = position_of(knot.target, s.x());
  made.tension = tension_at(s.strand, node_of(s.strand, knot.strand));
  if (knot.slots == 0) {
    hold_strands(s, knot, where);
    SurfaceHit hit;
    constexpr float kFar = 0.008f;
    const bool near = nearest_surface(s.all.model, s.all.scratch.candidates, s.x(), where, kFar, hit);
    made.gap = near ? std::max(0.0f, hit.distance) : kFar;
  } else {
    for (uint32_t slot : knot.end) release_end(s, slot);
    made.gap = knot.left;
  }
  knot.phase = KnotPhase::locked;
  s.all.report_tool(s.index, EventKind::throw_locked, knot.hand, which, made.tension, where);
}

// A newly locked knot pulls its two strands in. Slack between the stitch and the knot moves to the outer side, as if the
// hands pulled both ends, at a limited speed.
void draw_snug(OneSuture& s, Knot& knot) {
  Strand& t = s.strand;
  const float step = kDrawSpeed * s.all.model.h;
  bool busy = false;
  for (uint32_t i = 0; i < knot.slots; ++i) {
    const int k = anchor_of(t, knot.slot[i]);
    if (k == kNone) continue;
    ThreadAnchor& a = t.anchor[static_cast<size_t>(k)];
    const float off = length(a.offset);
    a.offset = off > step ? a.offset * (1 - step / off) : Vec3{};
    busy = busy || off > step;
    // Inward points to the stitch: for the needle's particle toward the free end, for the free end's toward the needle.
    const size_t node = node_of(t, a.slot);
    int way = knot.slots == 2 && i == 0 ? 1 : -1;
    if (knot.slots == 1 && next_anchor(t, s.own, node, -1, true) == kNone) way = 1;
    const int stitch = next_anchor(t, s.own, node, way, false);
    if (stitch == kNone) continue;
    const ThreadAnchor& inner = t.anchor[static_cast<size_t>(stitch)];
    const float slack =
        rest_between(t, node, node_of(t, inner.slot)) - distance(position_of(a, s.x()), position_of(inner, s.x()));
    if (std::abs(slack) <= kSnug) continue;
    if (draw_through(s, a.slot, slack > 0 ? -way : way, std::min(std::abs(slack), step)) > 0) busy = true;
  }
  if (!busy) knot.slack_removed = 1;
}

// "As the tool moves away from its original position, the knot object moves towards the suture point." It never reverses when
// the tool does. True: it has arrived.
bool bring_down(OneSuture& s, Knot& knot) {
  const float gone = distance(s.all.solver.body[knot.hand].x, knot.hand_from);
  float left = std::max(0.0f, length(knot.from) - gone);
  // A taut strand pulls the throw down even if the hand moves little.
  if (tension_at(s.strand, node_of(s.strand, knot.strand)) > kTaut)
    left = std::max(0.0f, std::min(left, knot.left - kFastest * s.all.model.h));
  if (left < knot.left) {
    const float part = left / knot.left;
    for (ThreadAnchor& a : s.strand.anchor)
      if (a.slot == knot.end[0] || a.slot == knot.end[1]) a.offset = a.offset * part;
    knot.left = left;
  }
  return knot.left <= 0;
}

}  // namespace

void undo_throws(OneSuture& s) {
  for (size_t i = s.own.knot.size(); i-- > 0;)
    if (s.own.knot[i].phase == KnotPhase::tightening) cancel(s, static_cast<uint32_t>(i));
}

void tie(SutureContext& c) {
  for (size_t k = 0; k < c.state.suture.size(); ++k) {
    OneSuture s(c, k);
    for (size_t i = s.own.knot.size(); i-- > 0;)
      if (s.own.knot[i].phase == KnotPhase::tightening && (!pulls(s, s.own.knot[i]) || !is_whole(s, s.own.knot[i])))
        cancel(s, static_cast<uint32_t>(i));
  }
  for (uint32_t who = 0; who < c.state.loop.size(); ++who)
    if (c.state.loop[who].wraps > 0 && c.state.instrument[who].held == Held::thread) begin(c, who);
}

void tighten(SutureContext& c) {
  for (size_t k = 0; k < c.state.suture.size(); ++k) {
    OneSuture s(c, k);
    for (uint32_t i = 0; i < s.own.knot.size(); ++i) {
      Knot& knot = s.own.knot[i];
      if (knot.phase == KnotPhase::locked) {
        if (!knot.slack_removed) draw_snug(s, knot);
      } else if (pulls(s, knot) && bring_down(s, knot)) {  // a throw that no hand pulls is undone at the next tick
        lock(s, i);
      }
    }
  }
}

}  // namespace catgut
