// SPDX-License-Identifier: Apache-2.0
// thread/topology: the knot type of a curve from its shape alone: for tests and scoring, never for the mechanics.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "core/math.h"

namespace catgut::thread {

// One crossing of the curve's projection: over at parameter `over`, under at `under` (segment + fraction); +1 right-handed.
struct Projected {
  double over = 0, under = 0;
  int sign = 0;
};
// Crossings of the closed curve as seen along `view`.
std::vector<Projected> project(std::span<const Vec3> closed, Vec3 view);

// Knot determinant, |Alexander polynomial at -1|: 1 no knot, 3 overhand, 9 square and granny, 15 surgeon's 2-1, 27 three throws
// (Burde, Zieschang and Heusener, Knots, 2014, 10.1515/9783110270785). Exact below 1e9.
uint64_t knot_determinant(std::span<const Vec3> closed);
// Sum of the signs over a few views: +3 right-handed, -3 left-handed for an overhand knot drawn tight; near 0 for a square
// knot.
double mean_writhe(std::span<const Vec3> closed);
// A thread whose ends are extended in the given directions and joined far below (-y).
std::vector<Vec3> close_curve(std::span<const Vec3> thread, Vec3 first_away, Vec3 last_away);

}  // namespace catgut::thread
