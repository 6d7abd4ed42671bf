// SPDX-License-Identifier: Apache-2.0
// exchange: see strand.h.
#include "exchange/strand.h"

#include <algorithm>

namespace catgut {

size_t node_of(const Snapshot& seen, uint32_t slot) {
  const auto at = std::find(seen.active().thread_order.begin(), seen.active().thread_order.end(), slot);
  return at == seen.active().thread_order.end() ? 0 : static_cast<size_t>(at - seen.active().thread_order.begin());
}

Vec3 node_at(const Snapshot& seen, size_t node) { return seen.particle[seen.active().thread_order[node]]; }

float length_between(const Snapshot& seen, size_t a, size_t b) {
  float sum = 0;
  for (size_t i = std::min(a, b); i < std::max(a, b) && i + 1 < seen.active().thread_order.size(); ++i)
    sum += distance(node_at(seen, i), node_at(seen, i + 1));
  return sum;
}

size_t node_along(const Snapshot& seen, size_t from, float far, int way) {
  const size_t last = seen.active().thread_order.size() - 1;
  size_t at = from;
  for (float gone = 0; gone < far;) {
    if ((way > 0 && at == last) || (way < 0 && at == 0)) break;
    const size_t next = way > 0 ? at + 1 : at - 1, pair = std::min(at, next);
    if (pair < seen.active().thread_cut.size() && seen.active().thread_cut[pair]) break;
    gone += distance(node_at(seen, at), node_at(seen, next));
    at = next;
  }
  return at;
}

uint32_t locked_throws(const Snapshot& seen) {
  uint32_t sum = 0;
  for (const KnotView& k : seen.active().knot) sum += k.throws - (k.phase != KnotPhase::locked && k.throws > 0);
  return sum;
}

size_t suture_point_count(const Snapshot& seen) {
  size_t sum = 0;
  for (const SutureView& s : seen.suture) sum += s.suture_point.size();
  return sum;
}
const SuturePointView& suture_point_at(const Snapshot& seen, size_t i) {
  size_t k = 0;
  for (; i >= seen.suture[k].suture_point.size(); ++k) i -= seen.suture[k].suture_point.size();
  return seen.suture[k].suture_point[i];
}

float needle_tension(const Snapshot& seen) {
  return seen.active().thread_tension.empty() ? 0 : seen.active().thread_tension.back();
}

float largest_tension(const Snapshot& seen, size_t skip) {
  float most = 0;
  for (const SutureView& s : seen.suture)
    for (size_t i = &s == &seen.active() ? skip : 0; i < s.thread_tension.size(); ++i)
      most = std::max(most, s.thread_tension[i]);
  return most;
}

size_t first_point_node(const Snapshot& seen) {
  size_t node = seen.active().thread_order.size();
  for (const SuturePointView& p : seen.active().suture_point) node = std::min(node, node_of(seen, p.anchored));
  return seen.active().suture_point.empty() ? 0 : node;
}

size_t last_point_node(const Snapshot& seen) {
  size_t node = 0;
  for (const SuturePointView& p : seen.active().suture_point) node = std::max(node, node_of(seen, p.anchored));
  return node;
}

Vec3 knot_center(const Snapshot& seen, Vec3 stitch) {
  constexpr float kTouching = 0.8e-3f;   // [m] between the nodes of two strands in contact
  constexpr float kNearStitch = 12e-3f;  // [m]
  const size_t last = seen.active().thread_order.size() - 1, first = first_point_node(seen);
  Vec3 sum;
  float count = 0;
  for (size_t i = 0; i < first; ++i)
    for (size_t k = last_point_node(seen) + 1; k <= last; ++k) {
      const Vec3 a = node_at(seen, i), b = node_at(seen, k);
      if (distance(a, b) > kTouching || distance(a, stitch) > kNearStitch) continue;
      sum += 0.5f * (a + b), count += 1;
    }
  return count > 0 ? sum / count : stitch;
}

bool is_cut_off(const SutureView& suture) {
  if (suture.suture_point.empty()) return false;
  const auto hole = std::find(suture.thread_order.begin(), suture.thread_order.end(), suture.suture_point.back().anchored);
  const auto& cut = suture.thread_cut;
  const auto from = std::min(hole - suture.thread_order.begin(), static_cast<std::ptrdiff_t>(cut.size()));
  return std::find(cut.begin() + from, cut.end(), 1) != cut.end();
}

}  // namespace catgut
