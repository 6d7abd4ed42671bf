// SPDX-License-Identifier: Apache-2.0
// runtime: see stitch_measures.h.
#include "runtime/stitch_measures.h"

#include <algorithm>

#include "exchange/strand.h"
#include "surgeon/throws.h"

namespace catgut {

std::vector<StitchMeasures> measure_stitches(const Snapshot& seen) {
  std::vector<StitchMeasures> out;
  for (uint32_t k = 0; k < seen.suture.size(); ++k) {
    const SutureView& suture = seen.suture[k];
    if (suture.suture_point.size() < 2) continue;
    StitchMeasures m;
    m.suture = k, m.points = static_cast<uint32_t>(suture.suture_point.size());
    m.finished = is_cut_off(suture);
    m.first_to_last = static_cast<double>(distance(suture.suture_point.front().position, suture.suture_point.back().position));
    // Its piece of thread: from the cut before its first hole to the one after its last.
    const auto at = [&](const SuturePointView& p) {
      return static_cast<size_t>(std::find(suture.thread_order.begin(), suture.thread_order.end(), p.anchored) -
                                 suture.thread_order.begin());
    };
    const size_t one = at(suture.suture_point.front()), other = at(suture.suture_point.back());
    const size_t first = std::min(one, other), last = std::max(one, other);
    size_t from = first, to = last;
    const auto whole = [&](size_t pair) { return pair >= suture.thread_cut.size() || !suture.thread_cut[pair]; };
    while (from > 0 && whole(from - 1)) --from;
    while (to + 1 < suture.thread_order.size() && whole(to)) ++to;
    std::vector<Vec3> thread;
    for (size_t i = from; i <= to && i < suture.thread_order.size(); ++i)
      thread.push_back(seen.particle[suture.thread_order[i]]);
    const SeenThrows throws = see_throws(thread);
    m.right = throws.right, m.left = throws.left, m.alternating = throws.alternating();
    for (size_t i = first; i < last && i < suture.thread_tension.size(); ++i)
      m.tension = std::max(m.tension, static_cast<double>(suture.thread_tension[i]));
    out.push_back(m);
  }
  return out;
}

int throws_held(const std::vector<StitchMeasures>& stitches) {
  int fewest = 0;
  bool any = false;
  for (const StitchMeasures& m : stitches)
    if (m.finished) fewest = any ? std::min(fewest, m.throws()) : m.throws(), any = true;
  return fewest;
}

int stitches_finished(const std::vector<StitchMeasures>& stitches) {
  return static_cast<int>(std::count_if(stitches.begin(), stitches.end(), [](const StitchMeasures& m) { return m.finished; }));
}

}  // namespace catgut
