// SPDX-License-Identifier: Apache-2.0
// technique/common: see common.h.
#include "technique/common.h"

#include <limits>

namespace catgut {

uint32_t locked_throws(const Knot& knot) { return knot.phase == KnotPhase::locked ? knot.throws : knot.begun; }

uint32_t locked_throws(std::span<const Knot> knot) {
  uint32_t sum = 0;
  for (const Knot& k : knot) sum += locked_throws(k);
  return sum;
}

uint32_t walls_taken(std::span<const StitchPoint> point) {
  uint32_t walls = 0;
  for (const StitchPoint& p : point) walls |= 1u << std::min(p.wall, 31u);
  return walls;
}

uint32_t nearest_of(std::span<const uint32_t> group, const Vec4* x, Vec3 p) {
  uint32_t found = group.front();
  float best = std::numeric_limits<float>::max();
  for (uint32_t i : group) {
    const float d = length2(xyz(x[i]) - p);
    if (d < best) best = d, found = i;
  }
  return found;
}

void report_fault(Fault fault, uint32_t which, Vec3 where, uint32_t& reported, EventList& events) {
  const uint32_t bit = 1u << static_cast<uint32_t>(fault);
  if (reported & bit) return;
  reported |= bit;
  events.add({EventKind::technique_fault, 0, which, 0, where, fault});
}

void merge_reported(std::span<const Event> events, uint32_t& reported) {
  for (const Event& e : events)
    if (e.kind == EventKind::technique_fault) reported |= 1u << static_cast<uint32_t>(e.fault);
}

void judge_begun_knots(const TechniqueView& view, bool join_two, uint32_t& reported, EventList& events) {
  const size_t before = events.size();
  for (size_t i = 0; i < before; ++i) {
    const Event e = events[i];
    if (e.kind != EventKind::throw_started) continue;
    const uint32_t newest = view.bite.empty() ? 0 : static_cast<uint32_t>(view.bite.size() - 1);
    if (view.point.empty()) report_fault(Fault::knot_without_bite, e.which, e.where, reported, events);
    else if (view.needle_in_tissue) report_fault(Fault::needle_in_tissue, newest, e.where, reported, events);
    else if (join_two && one_wall(walls_taken(view.point)))
      report_fault(Fault::one_wall_only, view.point.back().bite, e.where, reported, events);
  }
}

bool cut_in_stitch(std::span<const Event> events) {
  return std::any_of(events.begin(), events.end(),
                     [](const Event& e) { return e.kind == EventKind::technique_fault && e.fault == Fault::cut_in_stitch; });
}

void tell_closed(uint32_t row, const ClosurePlan::Pair& pair, const Vec4* x, uint32_t& reported, EventList& events) {
  if (reported) return;
  const Vec3 a = position_of(pair.a, x), b = position_of(pair.b, x);
  const float gap = distance(a, b);
  if (gap >= kSeamClosed) return;
  reported = 1;
  events.add({EventKind::seam_closed, 0, row, gap, 0.5f * (a + b)});
}

}  // namespace catgut
