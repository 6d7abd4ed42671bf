// SPDX-License-Identifier: Apache-2.0
// assess: see tied.h.
#include "assess/tied.h"

#include <algorithm>

#include "assess/facts.h"
#include "thread/observe.h"

namespace catgut::assess {
namespace {

// The part of a thread's state that `observe` reads.
thread::State state_of(const Snapshot& seen, const SutureView& suture) {
  thread::State state;
  const size_t n = suture.thread_order.size();
  state.x.assign(n, 0), state.fine.assign(n, 0);
  state.rest.resize(n - 1), state.broken.assign(n - 1, 0);
  for (size_t i = 0; i < n; ++i) state.x.set(i, seen.particle[suture.thread_order[i]]);
  for (size_t i = 0; i + 1 < n; ++i) {
    state.rest[i] = distance(state.x.at(i), state.x.at(i + 1));
    state.broken[i] = i < suture.thread_cut.size() && suture.thread_cut[i] != 0;
  }
  return state;
}

// [m] of a loop that lies on the tissue: 0 without two suture points.
float tight_loop(const thread::State& state, const SutureView& suture) {
  if (suture.suture_point.size() < 2) return 0;
  const auto nearest = [&](Vec3 at) {
    size_t best = 0;
    for (size_t i = 1; i < state.nodes(); ++i)
      if (length2(state.x.at(i) - at) < length2(state.x.at(best) - at)) best = i;
    return best;
  };
  size_t first = state.nodes(), last = 0;
  for (const SuturePointView& p : suture.suture_point) {
    const size_t i = nearest(p.position);
    first = std::min(first, i), last = std::max(last, i);
  }
  float along = 0;
  for (size_t i = first; i < last; ++i) along += state.rest[i];
  return along + distance(state.x.at(first), state.x.at(last));
}

}  // namespace

std::vector<Knot> tied_knots(const PictureModel& picture, const Snapshot& seen) {
  std::vector<Knot> out;
  for (uint32_t k = 0; k < seen.suture.size() && k < picture.suture.size(); ++k) {
    const SutureView& suture = seen.suture[k];
    if (suture.thread_order.size() < 4) continue;
    const thread::State state = state_of(seen, suture);
    thread::Settings settings;
    settings.material.diameter = 2 * picture.suture[k].thread_radius;
    const thread::SeenKnot tied = thread::observe(settings, state, tight_loop(state, suture));
    if (tied.throws == 0) continue;
    Knot knot;
    knot.tick = seen.tick, knot.suture = k;
    for (const SuturePointView& p : suture.suture_point)
      knot.where += p.position / static_cast<float>(suture.suture_point.size());
    for (uint32_t t = 0; t < tied.throws; ++t) {
      const thread::SeenThrow& item = tied.item[t];
      Throw row;
      row.tick = seen.tick;
      row.wraps = (item.half_turns - 1) / 2, row.hand = item.hand, row.sliding = tied.sliding;
      row.gap = item.loop > 0 ? static_cast<double>(item.gap) * 1000 : kNotObserved;
      row.tension = row.seconds = kNotObserved;
      knot.thrown.push_back(row);
    }
    knot.kind = kind_of(knot.thrown);
    out.push_back(knot);
  }
  return out;
}

}  // namespace catgut::assess
