// SPDX-License-Identifier: Apache-2.0
// validation: knots laid by formula, then tightened, pulled, shaken, or left under load. For checks, tests,
// benchmarks and pictures of src/thread.
#pragma once
#include <span>
#include <vector>

#include "thread/thread.h"

namespace catgut::validation {

// A curve given by close points, as nodes of equal spacing from its first point on.
std::vector<Vec3> resample(const std::vector<Vec3>& fine, float spacing);

// One throw: two strands wound around each other, from the bite upward. 3 half turns: a single throw; 5: the surgeon's double
// throw. hand: +1 right-handed, -1 left-handed. Equal hands in turn make a granny, alternating ones a square knot.
struct Throw {
  int half_turns = 3;
  int hand = 1;
};
using Throws = std::vector<Throw>;
Throws single_throw();
Throws granny();
Throws square();
Throws surgeons();      // 2-1
Throws three_throws();  // 1-1-1, square
Throws surgeons_211();  // 2-1-1, square

// Two strands with a knot between them at the origin. Strand A: nodes 0 (tail) .. load_a; strand B: load_a + 1 = load_b .. last
// (tail). They are one thread whose bite is cut: the segment between the two load ends is broken.
// The load ends lie at -x and +x, `drop` [rad] below the horizontal; the tails leave along x above the knot.
struct LaidKnot {
  thread::State state;
  std::vector<thread::ToolCapsule> rod;  // that the bite goes round; empty: the bite is cut
  uint32_t load_a = 0, load_b = 0;
  uint32_t tail_a() const { return 0; }
  uint32_t tail_b() const { return static_cast<uint32_t>(state.nodes()) - 1; }
  Vec3 tail_direction_a, tail_direction_b;
};
LaidKnot lay_knot(std::span<const Throw> throws, float diameter, float segment, float load = 15e-3f, float tail = 12e-3f,
                  float drop = 0);
// The bite is whole and goes round a rod of 5 mm along y, below the knot; load_a = load_b is its middle.
LaidKnot lay_on_rod(std::span<const Throw> throws, float diameter, float segment, float tail = 12e-3f);

// Both strands as one closed curve: joined below the knot, the tails led far away.
std::vector<Vec3> closed_curve(const LaidKnot& knot);

// The settings of the holding tests: thread of 0.35 mm, EA 500 N, B 1e-8 N.m2, bends sharper than four diameters stay; segments
// of 1.4 diameters.
thread::Settings knot_settings(float friction);

struct Tightened {
  LaidKnot knot;
  thread::Stepper stepper;
  Tightened(LaidKnot k) : knot(std::move(k)), stepper(knot.state.nodes()) {}
};
// How the tails are pulled. Flat: to the sides on which they leave. Uncrossed: each to the other side, as if the hands had not
// crossed. Under tension: strand A is kept taut all the time, strand B is wound on it.
enum class Drawing { flat, uncrossed, under_tension };
// Pulls the tails with `tails` [N] while springs of 500 N/m (tissue) hold the load ends. Releases the tails within 50 ms,
// unless they are to be kept pulled.
void tighten(const thread::Settings& settings, Tightened& t, float tails, Drawing drawing = Drawing::flat, float seconds = 0.3f,
             bool let_go = true);

struct Holding {
  float peak = 0;     // [N] largest force on the load ends, smoothed over 5 ms
  float mean = 0;     // [N] over the last three quarters of the distance, or `limit`
  float slip = 0;     // [m] increase of the distance of the loads
  bool held = false;  // reached `limit`
};
// Pulls the load ends apart at `speed` [m/s] to `limit` [N] or `distance` [m], with `tails` [N] on each tail.
Holding pull_apart(const thread::Settings& settings, Tightened& t, float tails = 0, float speed = 0.02f, float limit = 8,
                   float distance = 8e-3f);
// Holds a constant load [N] for `seconds`; returns the creep speed [m/s] over the last `window` seconds.
double creep(const thread::Settings& settings, Tightened& t, float load, double seconds, double window);

struct Shaken {
  int passes = 0;     // pairs of segments that passed through each other
  float nearest = 1;  // smallest distance between touching strands, in diameters
};
// Shakes one load end by +-10 mm at up to `speed` [m/s], across and along the strands in turn, while the other is
// pulled.
Shaken shake(const thread::Settings& settings, Tightened& t, int cycles, float speed, float load);

}  // namespace catgut::validation
