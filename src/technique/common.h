// SPDX-License-Identifier: Apache-2.0
// technique/common: what several techniques ask of the view, and how they say what was wrong: once per suture and fault, as an
// event, repairing nothing.
#pragma once
#include <algorithm>
#include <span>
#include <vector>

#include "technique/view.h"

namespace catgut {

constexpr float kSeamClosed = 0.001f;  // [m] two places this near count as together

// Throws that hold: those of the throw in hand only once it is locked.
uint32_t locked_throws(const Knot& knot);
uint32_t locked_throws(std::span<const Knot> knot);

// One bit per wall that the suture's points lie in.
uint32_t walls_taken(std::span<const StitchPoint> point);
inline bool one_wall(uint32_t walls) { return (walls & (walls - 1)) == 0; }

// The particle of `group` nearest to p; group must not be empty.
uint32_t nearest_of(std::span<const uint32_t> group, const Vec4* x, Vec3 p);

// reported: a bit per fault, of the suture in hand.
void report_fault(Fault fault, uint32_t which, Vec3 where, uint32_t& reported, EventList& events);
// Marks as reported what the rooms below have reported in this tick: a mistake that both see is one fault.
void merge_reported(std::span<const Event> events, uint32_t& reported);
// Of knots begun in this tick: knot_without_bite and needle_in_tissue; join_two: one_wall_only too.
void judge_begun_knots(const TechniqueView& view, bool join_two, uint32_t& reported, EventList& events);
// Whether the cut of this tick went through the stitch itself.
bool cut_in_stitch(std::span<const Event> events);

// The row's two points are together for the first time: says so. reported is set then.
void tell_closed(uint32_t row, const ClosurePlan::Pair& pair, const Vec4* x, uint32_t& reported, EventList& events);

// Toward `wanted`, no faster than `fastest` [1/s].
inline void advance(float& progress, float wanted, float fastest, float dt) {
  progress += std::clamp(wanted - progress, -fastest * dt, fastest * dt);
}

}  // namespace catgut
