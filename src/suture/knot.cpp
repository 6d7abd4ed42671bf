// suture/knot: a loop becomes a throw, the throw goes down to the tissue and locks there (paper 2.4). Reads loops, hands and
// the thread's order; writes knots, their anchors and, once a knot is locked, what was slack under it.
//
// A tool with a loop round it takes thread beyond the loop: the other end of the stitch, as a rule, which is thereby drawn
// through the loop. From then on the loop is a throw: it leaves the tool and hangs on the two ends of its own thread between
// tool and tissue. The further the tool goes away, the nearer it comes. Until it is there it can be taken back by letting go.
#include <algorithm>
#include <cmath>

#include "suture/suture.h"

namespace catgut {
namespace {

constexpr float kTaut = 0.3f;      // [N] of a strand that draws its throw down
constexpr float kFastest = 0.25f;  // [m/s] at which it does

constexpr float kDrawSpeed = 0.25f;  // [m/s] thread drawn through a locked knot, and particles drawn into it
constexpr float kSnug = 0.00005f;    // [m] of slack that a snug stitch keeps
constexpr int kNone = kNoAnchor;

bool is_suture_point(const SutureState& state, int anchor) {
  return std::any_of(state.point.begin(), state.point.end(),
                     [&](const SuturePoint& p) { return p.anchor == static_cast<uint32_t>(anchor); });
}

// The next anchor from node i along the thread: toward the needle (way +1) or the free end. An end of the thread, cut or not,
// is the end. Loops on their way are none: they are thread. `points`: suture points only, not the particles of knots.
int next_anchor(const Strand& t, const SutureState& state, size_t i, int way, bool points) {
  while (continues(t, i, way)) {
    i = way > 0 ? i + 1 : i - 1;
    const int k = anchor_of(t, t.order[i]);
    if (k != kNone && (is_suture_point(state, k) || (!points && t.anchor[static_cast<size_t>(k)].knotted))) return k;
  }
  return kNone;
}

// Where on its thread a place is: on the strand that leads to the free end, on the one that leads to the needle, on a bight
// between two points of tissue, or on a piece that is tied to nothing.
enum class Side { free_end, needle, bight, loose };
struct Ends {
  Side strand = Side::loose;
  int inward = kNone;  // anchor of the stitch or the knot that it comes out of
};
Ends ends_of(const Strand& t, const SutureState& state, size_t first, size_t last) {
  const int down = next_anchor(t, state, first, -1, false), up = next_anchor(t, state, last, 1, false);
  if (down != kNone && up != kNone) return {Side::bight, down};
  if (down != kNone) return {Side::needle, down};
  if (up != kNone) return {Side::free_end, up};
  return {};
}

// The suture point nearest along the thread to a strand that comes out of anchor k, that anchor included.
int nearest_point(const Strand& t, const SutureState& state, int k, Side strand) {
  if (k == kNone || is_suture_point(state, k)) return k;
  return next_anchor(t, state, node_of(t, t.anchor[static_cast<size_t>(k)].slot), strand == Side::free_end ? 1 : -1, true);
}

bool pulls(const SutureState& state, const Knot& knot) {
  const InstrumentState& hand = state.instrument[knot.hand];
  return hand.held == Held::thread && hand.slot == knot.strand;
}
// Whether the throw in hand still hangs on one thread: its loop, and the strand that was taken, with the stitch.
bool is_whole(const Strand& t, const SutureState& state, const Knot& knot) {
  const size_t first = node_of(t, knot.end[0]), last = node_of(t, knot.end[1]), held = node_of(t, knot.strand);
  return first < last && is_whole(t, first, last) && ends_of(t, state, first, last).strand != Side::loose &&
         ends_of(t, state, held, held).strand != Side::loose;
}

void release_end(SolverState& solver, SutureState& state, uint32_t slot) {
  const int k = anchor_of(solver.strand[0], slot);
  if (k != kNone) erase_anchor(solver, state, static_cast<uint32_t>(k));
}

// "If the user decides they do not want to proceed ... they can release the free end of the thread. After letting go, the loop
// will be released, and the knot object will be destroyed." Nothing but positions tells that there was a throw.
void cancel(const SolverModel&, SolverState& solver, const SutureModel&, SutureState& state, uint32_t which,
            EventList& events) {
  Knot& knot = state.knot[which];
  const Vec3 where = position_of(knot.target, solver.x.data()) + normalized(knot.from) * knot.left;
  events.add({EventKind::knot_cancelled, hand_of(state, knot.hand), which, 0, where});
  for (uint32_t slot : knot.end) release_end(solver, state, slot);
  if (knot.begun == 0) {
    state.knot.erase(state.knot.begin() + which);
  } else {
    knot.thrown[knot.throws - 1] = {};
    knot.throws = knot.begun;
    knot.phase = KnotPhase::locked;
  }
}

// The locked knot that a further throw belongs to: the one out of which both strands come, or out of which the wrapped one
// comes when it is thrown round a bight or round itself.
int knot_under(const Strand& t, const SutureState& state, const Ends& loop, const Ends& taken, bool one_strand) {
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

// Where a first throw goes. "The knot object moves towards the suture point. ... If more than one suture point has been
// created, the knot object will move toward the midpoint of the last two created suture points." The paper's stitch is one such
// pair; ours may have many points before it is tied (a purse-string), and what is tied together then is its two ends: the
// suture point nearest to the strand that was taken and the one nearest to the loop. For a stitch of two points both are the
// same. Where a running suture is tied to itself (the end of a Connell: the taken strand is a bight, or the needle's own) there
// is no other end, and the paper's rule holds as it stands.
TissuePoint where_to(const SolverModel& model, const Strand& t, const SutureState& state, const Ends& loop, const Ends& taken,
                     bool one_strand) {
  const auto point = [&](int anchor) -> const TissuePoint& { return t.anchor[static_cast<size_t>(anchor)].point; };
  const size_t points = state.point.size();
  if (one_strand) {
    const int last = static_cast<int>(state.point[points - 1].anchor);
    return points == 1 ? point(last)
                       : midway(model.shape.rest.data(), point(static_cast<int>(state.point[points - 2].anchor)), point(last));
  }
  const int a = nearest_point(t, state, taken.inward, taken.strand), b = nearest_point(t, state, loop.inward, loop.strand);
  if (a == kNone || b == kNone) return point(a == kNone ? (b == kNone ? loop.inward : b) : a);
  return a == b ? point(a) : midway(model.shape.rest.data(), point(a), point(b));
}

// "Knots can be created when at least one valid loop and suture point are detected. If the tool that has the loop around it
// grabs the free end of the rope passed the loop, a 3D object that represents the knot is created. The loop's ends are attached
// to the object, and the whole loop detaches from the tool."
void begin(const SolverModel& model, SolverState& solver, const SutureModel& suture, SutureState& state, uint8_t who,
           EventList& events) {
  Strand& t = solver.strand[0];
  const Vec4* x = solver.x.data();
  const ToolLoop loop = state.loop[who];
  const uint32_t strand = state.instrument[who].slot;
  const RigidBody& tool = solver.body[who];
  const size_t first = node_of(t, loop.first), last = node_of(t, loop.last), held = node_of(t, strand);
  const Ends wrapped = ends_of(t, state, first, last), taken = ends_of(t, state, held, held);
  // Two strands are tied to each other if one leads to the free end and the other to the needle.
  const bool one_strand = wrapped.strand == taken.strand || wrapped.strand == Side::bight || taken.strand == Side::bight;
  const int under = knot_under(t, state, wrapped, taken, one_strand);
  const auto fault = [&](uint32_t which, Fault f) {
    events.add({EventKind::technique_fault, hand_of(state, who), which, 0, tool.x, f});
  };
  const bool full = under != kNone && state.knot[static_cast<size_t>(under)].throws == KnotView::kMostThrows;
  if (state.point.empty() || wrapped.strand == Side::loose || taken.strand == Side::loose || full) {
    if (!full) fault(static_cast<uint32_t>(state.knot.size()), Fault::knot_without_bite);
    take_off_loop(model, solver, suture, state, who);
    events.add({EventKind::loop_released, hand_of(state, who), 0, 0, tool.x});
    return;
  }
  if (!state.open.empty() && !state.open.back().told) {
    fault(state.open.back().bite, Fault::needle_in_tissue);
    state.open.back().told = 1;
  }

  uint32_t which = static_cast<uint32_t>(under);
  if (under == kNone) {
    which = static_cast<uint32_t>(state.knot.size());
    state.knot.emplace_back();
    state.knot[which].target = where_to(model, t, state, wrapped, taken, one_strand);
  }
  Knot& knot = state.knot[which];
  Vec3 place{};
  for (size_t i = first; i <= last; ++i) place += xyz(x[t.order[i]]) / static_cast<float>(last - first + 1);
  const Vec3 target = position_of(knot.target, x);
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
  made.handed = loop.handed;
  made.needle_end = wrapped.strand == Side::free_end ? 0 : 1;
  take_off_loop(model, solver, suture, state, who);
  for (uint32_t slot : knot.end) {
    ThreadAnchor a;
    a.slot = slot;
    a.point = knot.target;
    a.offset = xyz(x[slot]) - target;
    a.friction = suture.pass_tension;
    a.capstan = suture.capstan;
    t.anchor.push_back(a);
  }
  events.add({EventKind::knot_begun, hand_of(state, who), which, static_cast<float>(made.wraps), place});
}

// The particle of the taken strand that the knot will hold: of those between the stitch and the jaw, the one nearest to it.
// -1: there is none.
int64_t particle_for(const SolverState& solver, const SutureState& state, const Knot& knot) {
  const Strand& t = solver.strand[0];
  const size_t held = node_of(t, knot.strand);
  const Ends taken = ends_of(t, state, held, held);
  if (taken.strand == Side::bight || taken.strand == Side::loose) return -1;
  const size_t from = node_of(t, t.anchor[static_cast<size_t>(taken.inward)].slot);
  const Vec3 target = position_of(knot.target, solver.x.data());
  int64_t found = -1;
  float best = 1e30f;
  for (size_t i = std::min(from, held) + 1; i < std::max(from, held); ++i) {
    const uint32_t slot = t.order[i];
    if (is_locked(t, slot)) continue;
    const float d = distance(xyz(solver.x[slot]), target);
    if (d < best) best = d, found = slot;
  }
  return found;
}

// "When the knot object reaches the suture point or midpoint between the two previous suture points, it is locked in place, and
// the attached particles are released." From here on the knot holds the stitch: a particle of the wrapped strand, which is the
// loop's inner end, and one of the taken strand.
void lock(const SolverModel& model, SolverState& solver, const SolverScratch& scratch, const SutureModel&, SutureState& state,
          uint32_t which, EventList& events) {
  Strand& t = solver.strand[0];
  Knot& knot = state.knot[which];
  KnotThrow& made = knot.thrown[knot.throws - 1];
  const Vec3 where = position_of(knot.target, solver.x.data());
  made.tension = tension_at(t, node_of(t, knot.strand));
  if (knot.slots == 0) {
    const size_t first = node_of(t, knot.end[0]), last = node_of(t, knot.end[1]), held = node_of(t, knot.strand);
    const Ends wrapped = ends_of(t, state, first, last), taken = ends_of(t, state, held, held);
    const bool free_end_wrapped = wrapped.strand == Side::free_end;
    const bool two = (free_end_wrapped && taken.strand == Side::needle) ||
                     (wrapped.strand == Side::needle && taken.strand == Side::free_end);
    const int64_t other = two ? particle_for(solver, state, knot) : -1;
    const uint32_t inner = knot.end[free_end_wrapped ? 1 : 0];
    release_end(solver, state, knot.end[free_end_wrapped ? 0 : 1]);
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
      a.offset = xyz(solver.x[a.slot]) - where;
      a.knotted = true;
      t.anchor.push_back(a);
      knot.slot = free_end_wrapped ? std::array{inner, a.slot} : std::array{a.slot, inner};
      knot.slots = 2;
    }
    knot.snug = 0;
    SurfaceHit hit;
    constexpr float kFar = 0.008f;
    made.gap =
        nearest_surface(model, scratch.candidates, solver.x.data(), where, kFar, hit) ? std::max(0.0f, hit.distance) : kFar;
  } else {
    for (uint32_t slot : knot.end) release_end(solver, state, slot);
    made.gap = knot.left;
  }
  knot.phase = KnotPhase::locked;
  events.add({EventKind::knot_locked, hand_of(state, knot.hand), which, made.tension, where});
}

// A knot that has just been locked draws its two strands in: what is slack between the stitch and it goes to the outer side, as
// if the hands drew on both ends, and no faster than they could.
void draw_snug(const SolverModel& model, SolverState& solver, const SutureModel&, const SutureState& state, Knot& knot) {
  Strand& t = solver.strand[0];
  const Vec4* x = solver.x.data();
  const float step = kDrawSpeed * model.h;
  bool busy = false;
  for (uint32_t i = 0; i < knot.slots; ++i) {
    const int k = anchor_of(t, knot.slot[i]);
    if (k == kNone) continue;
    ThreadAnchor& a = t.anchor[static_cast<size_t>(k)];
    const float off = length(a.offset);
    a.offset = off > step ? a.offset * (1 - step / off) : Vec3{};
    busy = busy || off > step;
    // Inward is where the stitch is: for the needle's particle toward the free end, for the free end's toward the needle.
    const size_t node = node_of(t, a.slot);
    int way = knot.slots == 2 && i == 0 ? 1 : -1;
    if (knot.slots == 1 && next_anchor(t, state, node, -1, true) == kNone) way = 1;
    const int stitch = next_anchor(t, state, node, way, false);
    if (stitch == kNone) continue;
    const ThreadAnchor& s = t.anchor[static_cast<size_t>(stitch)];
    const float slack = rest_between(t, node, node_of(t, s.slot)) - distance(position_of(a, x), position_of(s, x));
    if (std::abs(slack) <= kSnug) continue;
    if (draw_through(model, solver, a.slot, slack > 0 ? -way : way, std::min(std::abs(slack), step)) > 0) busy = true;
  }
  if (!busy) knot.snug = 1;
}

}  // namespace

void take_back_throws(const SolverModel& model, SolverState& solver, const SutureModel& suture, SutureState& state,
                      EventList& events) {
  for (size_t i = state.knot.size(); i-- > 0;)
    if (state.knot[i].phase == KnotPhase::tightening) cancel(model, solver, suture, state, static_cast<uint32_t>(i), events);
}

void tie(const SolverModel& model, SolverState& solver, const SutureModel& suture, SutureState& state, EventList& events) {
  for (size_t i = state.knot.size(); i-- > 0;)
    if (state.knot[i].phase == KnotPhase::tightening &&
        (!pulls(state, state.knot[i]) || !is_whole(solver.strand[0], state, state.knot[i])))
      cancel(model, solver, suture, state, static_cast<uint32_t>(i), events);
  for (uint8_t who = 0; who < state.instrument.size(); ++who)
    if (state.loop[who].wraps > 0 && state.instrument[who].held == Held::thread)
      begin(model, solver, suture, state, who, events);
}

void tighten(const SolverModel& model, SolverState& solver, const SolverScratch& scratch, const SutureModel& suture,
             SutureState& state, EventList& events) {
  for (uint32_t i = 0; i < state.knot.size(); ++i) {
    Knot& knot = state.knot[i];
    if (knot.phase == KnotPhase::locked) {
      if (!knot.snug) draw_snug(model, solver, suture, state, knot);
      continue;
    }
    if (!pulls(state, knot)) continue;  // taken back at the next tick
    // "As the tool moves away from its original position, the knot object moves towards the suture point." It never goes back
    // up again when the tool does.
    const float gone = distance(solver.body[knot.hand].x, knot.hand_from);
    float left = std::max(0.0f, length(knot.from) - gone);
    // A strand that is drawn taut brings the throw down however short the way of the hand.
    if (tension_at(solver.strand[0], node_of(solver.strand[0], knot.strand)) > kTaut)
      left = std::max(0.0f, std::min(left, knot.left - kFastest * model.h));
    if (left < knot.left) {
      const float part = left / knot.left;
      for (ThreadAnchor& a : solver.strand[0].anchor)
        if (a.slot == knot.end[0] || a.slot == knot.end[1]) a.offset = a.offset * part;
      knot.left = left;
    }
    if (knot.left <= 0) lock(model, solver, scratch, suture, state, i, events);
  }
}

}  // namespace catgut
