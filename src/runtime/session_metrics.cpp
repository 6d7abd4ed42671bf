// SPDX-License-Identifier: Apache-2.0
// runtime: see session_metrics.h.
#include "runtime/session_metrics.h"

#include <algorithm>

#include "assess/facts.h"

namespace catgut {

namespace {

void forget_throws(Counts& c, size_t suture) {
  if (suture < c.throws_of.size()) c.throws_of[suture].fill(0);
}

}  // namespace

uint32_t Counts::tied() const {
  return static_cast<uint32_t>(
      std::count_if(throws_of.begin(), throws_of.end(), [](const ThrowsOfKnots& t) { return t != ThrowsOfKnots{}; }));
}

void count(Counts& c, const Event& e) {
  if (e.kind < EventKind::count_) ++c.events[static_cast<size_t>(e.kind)];
  switch (e.kind) {
    case EventKind::bite_completed:
      ++c.bites;
      break;
    case EventKind::bite_withdrawn:
      ++c.bites_withdrawn;
      break;
    case EventKind::throw_locked: {  // one more throw
      if (e.suture >= c.throws_of.size()) c.throws_of.resize(e.suture + 1u);
      Counts::ThrowsOfKnots& suture = c.throws_of[e.suture];
      uint8_t& throws = suture[std::min<size_t>(e.which, suture.size() - 1)];
      c.knots += throws == 0;
      throws = static_cast<uint8_t>(std::min(throws + 1, 255));
      c.last_knot_throws = throws;
      ++c.throws;
      break;
    }
    case EventKind::suture_loaded:
      forget_throws(c, e.suture);
      break;
    case EventKind::suture_baked:
      ++c.sutures_baked;
      forget_throws(c, e.suture);
      break;
    case EventKind::thread_cut:
      ++c.cuts;
      break;
    case EventKind::needle_released:
      c.needle_slips += e.value > 0;
      break;
    case EventKind::thread_released:
      c.thread_slips += e.value > 0;
      break;
    case EventKind::tissue_released:
      c.tissue_slips += e.value > 0;
      break;
    case EventKind::technique_fault:
      if (e.fault < Fault::count_) ++c.faults[static_cast<size_t>(e.fault)], ++c.faults_in_all;
      break;
    default:
      break;
  }
}

void update(SessionMetrics& p, const Snapshot& seen, float dt) {
  if (!p.begun) p.opening_start = seen.opening_area;
  for (size_t k = 0; k < kMaxHands; ++k) {
    const float way = distance(seen.tool[k].pose.p, p.tip[k]);
    if (p.begun && way < 0.05f) p.path[k] += way;  // a hand that connects has not moved there
    p.tip[k] = seen.tool[k].pose.p;
    p.peak_force[k] = std::max(p.peak_force[k], length(seen.tool[k].force));
  }
  float pull = 0;
  for (const SutureView& s : seen.suture)
    for (const SuturePointView& point : s.suture_point) pull = std::max({pull, point.tension_needle, point.tension_free});
  p.peak_tension = std::max(p.peak_tension, pull);
  p.overloads += pull > assess::kTearForce && !p.overloaded;
  if (pull > assess::kTearForce) p.overloaded = true;
  else if (pull < 0.8f * assess::kTearForce) p.overloaded = false;  // as assess/facts counts
  p.begun = true;
  p.time_s += static_cast<double>(dt);
  p.opening = seen.opening_area;
  p.closure = seen.closure;
  for (const Event& e : seen.event) count(p, e);
}

}  // namespace catgut
