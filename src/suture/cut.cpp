// SPDX-License-Identifier: Apache-2.0
// suture/cut: scissors. Reads commands and tools; marks the cut pair (Strand::cut), or removes the thread from its needle.
// To loops, knots, pulls and the solver a cut is an end of the thread. A stitch opened by a wrong cut stays open.
#include <algorithm>

#include "suture/suture.h"

namespace catgut {
namespace {

constexpr float kOtherStrand = 0.015f;  // [m] along the thread: below this distance it is the same strand

// Thread [m] from node i to the nearest suture point or knot in that direction, and its slot; negative: none before the end.
struct Way {
  float length = -1;
  uint32_t slot = 0;
};
Way to_stitch(const Strand& t, size_t i, int way) {
  for (float sum = 0;;) {
    if (is_anchored(t, t.order[i])) return {sum, t.order[i]};
    if (!continues(t, i, way)) return {};
    sum += t.rest[pair_beside(i, way)];
    i = way > 0 ? i + 1 : i - 1;
  }
}

// Where the scissors cut a suture's thread: which pair, and the fraction along it.
struct Place {
  size_t pair = 0;
  float along = 0;
  bool found = false;
};
Place where_cut(const SutureContext& c, uint32_t who, uint32_t suture) {
  const Strand& t = c.solver.strand[suture];
  // A hand that holds the needle has the thread cut at the needle, at any place on the arc.
  const InstrumentState& hand = c.state.instrument[who];
  if (hand.held == Held::needle && hand.suture == suture && !t.cut.back()) return {t.cut.size() - 1, 1, true};
  Place place;
  const Vec3 at = c.solver.body[who].x;
  float best = c.suture.cut_reach;
  for (size_t i = 0; i + 1 < t.order.size(); ++i) {
    if (t.cut[i]) continue;
    const Vec3 a = xyz(c.solver.x[t.order[i]]), b = xyz(c.solver.x[t.order[i + 1]]);
    const float s = closest_on_segment(at, a, b), far = distance(a + (b - a) * s, at);
    if (far < best) best = far, place = {i, s, true};
  }
  return place;
}

// The end of a knot was cut: it gets no more throws. root: slot of the knot's particle at which the end began.
void judge_cut_knot(OneSuture& s, uint8_t by, uint32_t root, Vec3 where) {
  for (uint32_t k = 0; k < s.own.knot.size(); ++k) {
    Knot& knot = s.own.knot[k];
    const bool its_own = std::find(knot.slot.begin(), knot.slot.begin() + knot.slots, root) != knot.slot.begin() + knot.slots;
    if (!its_own || knot.reported || knot.throws >= static_cast<uint32_t>(s.all.suture.min_throws)) continue;
    knot.reported = 1;
    s.all.report_fault(s.index, Fault::too_few_throws, by, k, where);
  }
}

void cut_at(OneSuture& s, uint8_t by, size_t i, float along) {
  SutureContext& c = s.all;
  Strand& t = s.strand;
  const Way free = to_stitch(t, i, -1), needle = to_stitch(t, i + 1, 1);
  const float to_free = free.length + along * t.rest[i], to_needle = needle.length + (1 - along) * t.rest[i];
  const bool stitch_free = free.length >= 0, stitch_needle = needle.length >= 0;
  const bool nearer_free = stitch_free && (!stitch_needle || to_free <= to_needle);
  const uint32_t slot = t.order[i];
  const float left = nearer_free ? to_free : stitch_needle ? to_needle : -1;
  const Vec3 where = lerp(s.at(slot), s.at(t.order[i + 1]), along);

  const auto swage = std::find_if(t.hold.begin(), t.hold.end(), [](const ThreadHold& h) { return h.kind == HoldKind::swage; });
  if (swage != t.hold.end() && i + 2 == t.order.size()) {
    t.hold.erase(swage);
  } else {
    cut_pair(t, i);
    // Turns that are cut hold nothing.
    for (uint32_t tool = 0; tool < c.state.loop.size(); ++tool) {
      const int body = static_cast<int>(tool);
      if (!is_held_by(t, slot, body, HoldKind::loop) || !is_held_by(t, t.order[i + 1], body, HoldKind::loop)) continue;
      release_loop(c, tool);
      c.report_tool(s.index, EventKind::loop_released, tool, 0, 0, where);
    }
  }
  c.report(s.index, EventKind::thread_cut, by, slot, left, where);
  const bool tied = std::any_of(s.own.knot.begin(), s.own.knot.end(), [](const Knot& k) { return k.slots > 0; });
  if (stitch_free && stitch_needle) c.report_fault(s.index, Fault::cut_in_stitch, by, slot, where);
  else if (!tied) c.report_fault(s.index, Fault::cut_before_knot, by, slot, where);
  else if (left >= 0) judge_cut_knot(s, by, nearer_free ? free.slot : needle.slot, where);
}

}  // namespace

void cut(SutureContext& c, const TickInput& input) {
  for (const Command& command : input.commands) {
    if (command.kind != CommandKind::cut) continue;
    const uint8_t by = command.hand;
    uint32_t who = 0;
    while (who < c.state.instrument.size() && hand_of(c.state, who) != by) ++who;
    const bool has = by < kMaxHands && input.hand[by].connected && who < c.state.instrument.size();
    if (!has || !c.suture.instrument[who].can(kCutThread) || command.argument >= c.state.suture.size()) {
      c.refuse(command);
      continue;
    }
    const Place place = where_cut(c, who, command.argument);
    if (!place.found) continue;
    OneSuture s(c, command.argument);
    cut_at(s, by, place.pair, place.along);
  }
}

namespace {

// Whether thread leads from a node to one that these jaws hold, within kOtherStrand.
bool is_same_strand(const Strand& t, size_t node, int body) {
  for (const int way : {1, -1}) {
    float sum = 0;
    for (size_t k = node; sum < kOtherStrand;) {
      if (is_held_by(t, t.order[k], body)) return true;
      if (!continues(t, k, way)) break;
      sum += t.rest[pair_beside(k, way)];
      k = way > 0 ? k + 1 : k - 1;
    }
  }
  return false;
}

}  // namespace

void hold_other_strands(SutureContext& c, uint32_t who) {
  // Jaws with a loop round them pull one end through it; the loop's own nearby strands are excluded.
  if (c.state.loop[who].wraps > 0) return;
  const RigidBody& tool = c.solver.body[who];
  const int body = static_cast<int>(who);
  for (;;) {
    float best = c.suture.grasp_reach;
    Strand* of = nullptr;
    uint32_t found = 0;
    for (Strand& t : c.solver.strand)
      for (size_t i = 0; i < t.order.size(); ++i) {
        const uint32_t slot = t.order[i];
        const float d = distance(xyz(c.solver.x[slot]), tool.x);
        if (d >= best || is_locked(t, slot) || is_same_strand(t, i, body)) continue;
        best = d, of = &t, found = slot;
      }
    if (!of) return;
    of->hold.push_back({found, body, to_local(tool.pose(), xyz(c.solver.x[found])), HoldKind::jaw});
  }
}

}  // namespace catgut
