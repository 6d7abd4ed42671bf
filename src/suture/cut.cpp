// suture/cut: scissors (paper 2.5.3: "Once the knot is tied, the thread is disconnected from the needle"). Reads buttons and
// where the tools are; marks a pair of the thread as cut, or takes the needle off. A cut at the wrong place is carried out like
// any other, and told.
#include <algorithm>

#include "suture/suture.h"

namespace catgut {
namespace {

constexpr float kReach = 0.004f;  // [m] how near the thread must be to the jaws

// [m] of thread from pair `pair` to the nearest anchored particle on either side, up to a cut; the whole way when there is
// none.
float to_nearest_anchor(const Thread& t, size_t pair, const std::vector<uint8_t>& anchored) {
  float best = 0;
  bool found = false;
  for (const int way : {-1, 1}) {
    float sum = 0.5f * t.rest[pair];
    size_t node = way < 0 ? pair : pair + 1;
    for (;; node = static_cast<size_t>(static_cast<std::ptrdiff_t>(node) + way)) {
      if (anchored[node]) {
        if (!found || sum < best) best = sum;
        found = true;
        break;
      }
      if ((way < 0 && node == 0) || (way > 0 && node + 1 == t.order.size())) break;
      const size_t next = way < 0 ? node - 1 : node;
      if (t.cut[next]) break;
      sum += t.rest[next];
    }
  }
  return best;
}

void cut_at(const SolverModel& model, SolverState& solver, const SutureModel& suture, SutureState& state, uint8_t who,
            std::vector<Event>& events) {
  Thread& t = solver.thread;
  const Vec3 at = solver.body[who].x;
  float best = kReach;
  size_t found = t.rest.size();
  for (size_t i = 0; i < t.rest.size(); ++i) {
    if (t.cut[i]) continue;
    const Vec3 a = xyz(solver.x[t.order[i]]), b = xyz(solver.x[t.order[i + 1]]);
    const float l2 = length2(b - a), part = l2 > 0 ? std::clamp(dot(at - a, b - a) / l2, 0.0f, 1.0f) : 0;
    if (const float d = distance(at, lerp(a, b, part)); d < best) best = d, found = i;
  }
  const bool swaged = std::any_of(t.hold.begin(), t.hold.end(), [](const ThreadHold& h) { return h.kind == HoldKind::swage; });
  // A hand that holds the needle has the thread cut off it.
  if (state.hand[who].held == Held::needle && swaged) found = t.rest.size() - 1;
  if (found == t.rest.size()) return;
  std::vector<uint8_t> anchored(t.order.size());
  size_t first = t.order.size(), last = 0;
  for (const ThreadAnchor& a : t.anchor) {
    const size_t node = static_cast<size_t>(std::find(t.order.begin(), t.order.end(), a.slot) - t.order.begin());
    anchored[node] = 1;
    first = std::min(first, node);
    last = std::max(last, node);
  }
  const uint32_t slot = t.order[found];
  if (found + 1 == t.rest.size() && swaged) {
    // At the swage: the whole thread stays, the needle comes off.
    std::erase_if(t.hold, [](const ThreadHold& h) { return h.kind == HoldKind::swage; });
  } else {
    t.cut[found] = 1;
    t.tension[found] = 0;
  }
  update_thread_collisions(model, solver, suture);
  events.push_back({0, EventKind::thread_cut, who, slot, to_nearest_anchor(t, found, anchored), at});
  const auto fault = [&](Fault what) {
    events.push_back({0, EventKind::technique_fault, who, slot, static_cast<float>(what), at});
  };
  const bool tied =
      std::any_of(state.knot.begin(), state.knot.end(), [](const Knot& k) { return k.phase == KnotPhase::locked; });
  if (first < last && found >= first && found < last) fault(Fault::cut_in_stitch);
  else if (!t.anchor.empty() && !tied) fault(Fault::cut_before_knot);
}

}  // namespace

void cut(const SolverModel& model, SolverState& solver, const SutureModel& suture, SutureState& state,
         const std::array<uint32_t, 2>& pressed, std::vector<Event>& events) {
  for (uint8_t who = 0; who < 2; ++who)
    if (pressed[who] & kButtonCut) cut_at(model, solver, suture, state, who, events);
}

}  // namespace catgut
