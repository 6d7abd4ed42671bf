// SPDX-License-Identifier: Apache-2.0
// technique/common: shared queries of the view, and fault reports: an event once per suture and fault. Faults are not
// corrected.
#pragma once
#include <algorithm>
#include <span>
#include <vector>

#include "technique/view.h"

namespace catgut {

constexpr float kSeamClosed = 0.001f;  // [m] two points within this distance count as closed

// Throws that hold: the current one only once it is locked.
uint32_t locked_throws(const Knot& knot);
uint32_t locked_throws(std::span<const Knot> knot);

// One bit per wall that contains a suture point.
uint32_t walls_taken(std::span<const StitchPoint> point);
inline bool one_wall(uint32_t walls) { return (walls & (walls - 1)) == 0; }

// The particle of `group` nearest to p; group must not be empty.
uint32_t nearest_of(std::span<const uint32_t> group, const Vec4* x, Vec3 p);

// reported: a bit per fault, of the current suture.
void report_fault(Fault fault, uint32_t which, Vec3 where, uint32_t& reported, EventList& events);
// Marks faults that lower rooms have reported in this tick, so that a fault detected twice is reported once.
void merge_reported(std::span<const Event> events, uint32_t& reported);
// Of knots started in this tick: knot_without_bite and needle_in_tissue; join_two: one_wall_only too.
void judge_begun_knots(const TechniqueView& view, bool join_two, uint32_t& reported, EventList& events);
// Whether the cut of this tick went through the stitch itself.
bool cut_in_stitch(std::span<const Event> events);

// Reports the first closure of the row's two points, and sets reported.
void tell_closed(uint32_t row, const ClosurePlan::Pair& pair, const Vec4* x, uint32_t& reported, EventList& events);

// Toward `wanted`, at most `fastest` [1/s].
inline void advance(float& progress, float wanted, float fastest, float dt) {
  progress += std::clamp(wanted - progress, -fastest * dt, fastest * dt);
}

}  // namespace catgut
