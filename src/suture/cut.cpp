// suture/cut: scissors. Reads buttons and tools; marks the pair that was cut (Strand::cut), or takes the thread off its needle.
// To loops, knots, pulls and the solver a cut is an end of the thread. What a wrong cut opens stays open.
#include <algorithm>

#include "suture/suture.h"

namespace catgut {
namespace {

constexpr float kOtherStrand = 0.015f;  // [m] along the thread: nearer than this it is the same strand

// Thread [m] from node i to the nearest suture point or knot that way, and its slot; negative: there is none before the end.
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

}  // namespace

std::array<uint32_t, kMaxHands> pressed_buttons(SutureState& state, const HandInputs& hand) {
  std::array<uint32_t, kMaxHands> pressed{};
  for (size_t who = 0; who < kMaxHands; ++who) {
    const uint32_t now = hand[who].connected ? hand[who].buttons : 0;
    pressed[who] = now & ~state.buttons[who];
    state.buttons[who] = now;
  }
  return pressed;
}

void cut(const SolverModel& model, SolverState& solver, const SutureModel& suture, SutureState& state,
         const std::array<uint32_t, kMaxHands>& pressed, EventList& events) {
  Strand& t = solver.strand[0];
  for (uint8_t who = 0; who < state.instrument.size(); ++who) {
    const uint8_t by = hand_of(state, who);
    if (by == kNoHand || !(pressed[by] & kButtonCut) || !suture.instrument[who].can(kCutThread)) continue;
    const Vec3 at = solver.body[who].x;
    float best = suture.cut_reach, along = 0;
    size_t i = t.order.size();
    for (size_t k = 0; k + 1 < t.order.size(); ++k) {
      if (t.cut[k]) continue;
      const Vec3 a = xyz(solver.x[t.order[k]]), b = xyz(solver.x[t.order[k + 1]]);
      const float s = closest_on_segment(at, a, b), far = distance(a + (b - a) * s, at);
      if (far < best) best = far, along = s, i = k;
    }
    // A hand that holds the needle has the thread cut off it, wherever on the arc it holds.
    if (state.instrument[who].held == Held::needle && !t.cut.back()) i = t.order.size() - 2, along = 1;
    if (i == t.order.size()) continue;

    const Way free = to_stitch(t, i, -1), needle = to_stitch(t, i + 1, 1);
    const float to_free = free.length + along * t.rest[i], to_needle = needle.length + (1 - along) * t.rest[i];
    const bool stitch_free = free.length >= 0, stitch_needle = needle.length >= 0;
    const bool nearer_free = stitch_free && (!stitch_needle || to_free <= to_needle);
    const uint32_t slot = t.order[i];
    const float left = nearer_free ? to_free : stitch_needle ? to_needle : -1;
    const Vec3 where = lerp(xyz(solver.x[slot]), xyz(solver.x[t.order[i + 1]]), along);

    const auto swage =
        std::find_if(t.hold.begin(), t.hold.end(), [](const ThreadHold& h) { return h.kind == HoldKind::swage; });
    if (swage != t.hold.end() && i + 2 == t.order.size()) {
      t.hold.erase(swage);
    } else {
      cut_pair(t, i);
      // Turns that are cut through hold nothing.
      for (uint8_t tool = 0; tool < state.instrument.size(); ++tool) {
        if (!is_held_by(t, slot, tool, HoldKind::loop) || !is_held_by(t, t.order[i + 1], tool, HoldKind::loop)) continue;
        take_off_loop(model, solver, suture, state, tool);
        events.add({EventKind::loop_released, hand_of(state, tool), 0, 0, where});
      }
    }
    events.add({EventKind::thread_cut, by, slot, left, where});

    const auto fault = [&](uint32_t which, Fault f) { events.add({EventKind::technique_fault, by, which, 0, where, f}); };
    if (stitch_free && stitch_needle) {
      fault(slot, Fault::cut_in_stitch);
      continue;
    }
    const bool tied = std::any_of(state.knot.begin(), state.knot.end(), [](const Knot& k) { return k.slots > 0; });
    if (!tied) {
      fault(slot, Fault::cut_before_knot);
      continue;
    }
    // The end of a knot is cut: it will get no more throws.
    const uint32_t root = nearer_free ? free.slot : needle.slot;
    for (uint32_t k = 0; k < state.knot.size(); ++k) {
      Knot& knot = state.knot[k];
      const bool its_own = std::find(knot.slot.begin(), knot.slot.begin() + knot.slots, root) != knot.slot.begin() + knot.slots;
      if (left < 0 || !its_own || knot.told || knot.throws >= static_cast<uint32_t>(suture.least_throws)) continue;
      knot.told = 1;
      fault(k, Fault::too_few_throws);
    }
  }
}

void hold_other_strands(SolverState& solver, const SutureModel& suture, const SutureState& state, uint8_t who) {
  // Jaws with a loop round them draw one end through it; the loop's own strands lie near and are not meant.
  if (state.loop[who].wraps > 0) return;
  Strand& t = solver.strand[0];
  const RigidBody& tool = solver.body[who];
  // Thread from a particle of the order to the nearest one that these jaws hold, or more than kOtherStrand.
  const auto is_other = [&](size_t i) {
    for (const int way : {1, -1}) {
      float sum = 0;
      for (size_t k = i; sum < kOtherStrand;) {
        if (is_held_by(t, t.order[k], who)) return false;
        if (!continues(t, k, way)) break;
        sum += t.rest[pair_beside(k, way)];
        k = way > 0 ? k + 1 : k - 1;
      }
    }
    return true;
  };
  for (;;) {
    float best = suture.grasp_reach;
    size_t found = t.order.size();
    for (size_t i = 0; i < t.order.size(); ++i) {
      const uint32_t slot = t.order[i];
      const float d = distance(xyz(solver.x[slot]), tool.x);
      if (d >= best || is_locked(t, slot) || !is_other(i)) continue;
      best = d, found = i;
    }
    if (found == t.order.size()) return;
    const uint32_t slot = t.order[found];
    t.hold.push_back({slot, who, to_local(tool.pose(), xyz(solver.x[slot])), HoldKind::jaw});
  }
}

}  // namespace catgut
