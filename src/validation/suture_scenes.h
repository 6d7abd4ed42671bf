// SPDX-License-Identifier: Apache-2.0
// validation: sutures laid through the wall by construction, and hands that draw, tie and let go. For checks, tests, benchmarks
// and pictures of src/physical.
#pragma once
#include <memory>
#include <span>
#include <vector>

#include "physical/physical.h"
#include "validation/knot_scenes.h"

namespace catgut::validation {

// A thread's course: free points and holes in order.
struct Stop {
  Vec3 at;            // [m]; of a hole its mouth
  int32_t hole = -1;  // index in physical::State::hole
};
// Nodes of equal spacing along the course, from its first point on; returns what thread::make_laced_state makes of them.
thread::State lay_course(std::span<const Stop> course, float spacing, float hole_friction);

// A world with one thread, and hands on its two ends.
struct Sewn {
  physical::Model model;
  physical::State state;
  std::unique_ptr<physical::Scratch> scratch;
  std::vector<thread::Hold> hold;  // the first two: the thread's ends
  std::vector<thread::Pull> pull;
  std::vector<physical::Hands::WallPull> wall_pull;
  std::unique_ptr<Jobs> jobs = std::make_unique<Jobs>(1);
  void start();  // after model and state are complete: scratch, and holds where the ends lie
  // Moves the held places evenly by what is missing to `to` in `seconds`.
  void move_holds(std::span<const Vec3> to, float seconds);
  void run(float seconds);
  float end_force(int end) const { return length(hold[static_cast<size_t>(end)].force); }
};

// Two tubes face to face, `gap` apart, held at their far ends. Tube A lies at z > 0.
wall::Wall two_tubes(float gap, int around = 24, int rings = 8, float step = 0.001f, float length = 0.025f);
// A hole where the wall comes nearest to p, on the side zeta.
physical::Hole hole_at(const wall::Wall& wall, Vec3 p, float zeta);

// A knot over a wound. `up` leads away from the tissue, `across` from where end 1 leaves the tissue to where end 0 does. A
// throw is laid by construction: the free tails, from where they leave what is tied so far, wind about each other by its half
// turns, then lead to both sides. Then the two ends are drawn apart, low, with `tension` each; forceps hold the throw below
// until the new one has come down. Nothing else is moved.
struct Tying {
  Vec3 center, up{1, 0, 0}, across{0, 0, 1};
  float tension = 2;   // [N] on each end while a throw is drawn
  float lift = 3e-3f;  // [m] by which a throw is laid above what is below it
  float side = 1;      // where end 0 is: +1 across, -1 the other side
  int throws = 0;      // so far
};
void tie_throw(Sewn& sewn, Tying& tying, Throw one);
void pull_apart(Sewn& sewn, const Tying& tying, float tension, float seconds);
void let_go(Sewn& sewn);  // both hands away, within 0.1 s

// An interrupted stitch between two tubes: outside, in, across, out. Its ends stand up from the two outer holes.
struct Stitch {
  float gap = 0.003f, bite = 0.004f;  // [m] between the tubes; from the edge to the hole
  float segment = 0.5e-3f, tail = 0.06f;
  float friction = 0.3f, hole_friction = 0.15f;
};
Sewn interrupted(const Stitch& stitch);
// Such stitches side by side round the tubes, with free tails of 12 mm: strands of one thread::State.
Sewn ring_of_stitches(const Stitch& stitch, int count);
// A running suture round the rim of one tube: `holes` passages through the wall (an even number), both ends outside.
Sewn purse_string(const Stitch& stitch, int passages);

// Both ends drawn away from the rim, the force growing to `tension` [N].
void draw_purse(Sewn& sewn, float tension, float seconds);

// Distances [m] between facing columns of two tubes' rims (mid-surface), round the ring.
std::vector<float> gaps(const Sewn& sewn);
// Area [m2] that the inner edge of a rim encloses, in the plane across its axis z.
double opening(const Sewn& sewn);
// Cuts the thread everywhere: nothing holds any more.
void remove_thread(Sewn& sewn);

}  // namespace catgut::validation
