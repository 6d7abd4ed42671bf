// SPDX-License-Identifier: Apache-2.0
// thread/topology: the knot type of a curve from its shape alone: for tests, scoring and a surgeon's eyes, never for
// the mechanics.
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

// A throw of `wraps` turns as a knot: the torus knot T(2, 2 wraps + 1), a trefoil for 1.
struct KnotFactor {
  uint8_t wraps = 0;
  int8_t hand = 0;  // +1 right-handed, -1 left-handed
  friend bool operator==(const KnotFactor&, const KnotFactor&) = default;
};
// What a closed curve is composed of, whatever its shape. Reidemeister moves I and II, Jones polynomial of the rest (Jones
// 1985, 10.1090/S0273-0979-1985-15304-2; Kauffman's bracket, 1987, 10.1016/0040-9383(87)90009-7), which is multiplicative under
// composition and differs between mirror images, divided by those of torus knots.
struct KnotType {
  bool known = false;               // composed of throws alone; false: another knot, or more crossings than it can handle
  std::vector<KnotFactor> factors;  // sorted: most wraps first, right before left; empty and known: no knot
  friend bool operator==(const KnotType&, const KnotType&) = default;
};
KnotType knot_type(std::span<const Vec3> closed);

// The knot in a thread with open ends: both are led away in one direction, `far` [m] and well beyond the thread, and joined
// there. What most of eight directions make of it; their share.
struct KnotVote {
  KnotType type;
  float share = 0;
};
KnotVote vote_knot(std::span<const Vec3> open, float far, bool quick = false);  // quick: three directions if they agree

// A thread whose ends are extended in the given directions and joined far below (-y).
std::vector<Vec3> close_curve(std::span<const Vec3> thread, Vec3 first_away, Vec3 last_away);

}  // namespace catgut::thread
