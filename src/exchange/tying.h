// SPDX-License-Identifier: Apache-2.0
// exchange: the geometry of an instrument tie, from a Snapshot. Where to wind the strand, where to move the needle meanwhile,
// where to grasp the tail. For the scripted surgeon and for assisted hands. Background: docs/rooms/surgeon.md, "An instrument
// tie".
//
// One hand holds the needle, the other lays its tool across the strand. A throw:
//
//   Winding w;
//   w.way = 1;                                          // or -1: the opposite sense makes the next throw square
//   begin_winding(w, picture, seen);
//   const AcrossTool across(tying_axis(1));             // a tool that comes from the right
//   w.free = kTieTaut * (w.reach - distance(w.start, winding_axis(w, across)));
//   // every tick, the tool held with its tip kTieWindAt before winding_axis(), the needle's swage carried to `goal`:
//   float room;
//   const Vec3 goal = winding_swage(w, across, w.wound, room);
//   feel_winding(w, seen, across, distance(needle_swage(picture, seen), goal), room, dt);
//   w.wound += turn;                                    // and w.free -= kTieWound * turn
//   // when the loop is there: the tail, with the needle going along at strand_above()
//   TailGrip grip;
//   best_tail_grip(picture, seen, hand, 1, kTailByHand, {}, grip);
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>

#include "exchange/picture.h"
#include "exchange/snapshot.h"

namespace catgut {

constexpr float kTieWindAt = 0.024f;     // [m] behind the tool's tip, where thread is wound round it
constexpr float kTieBefore = -0.25f;     // [rad] where the strand stands before it is wound
constexpr float kTieWound = 0.0022f;     // [m] of thread per radian
constexpr float kTieLean = 0.3f;         // slope of the strand that leaves, along the tool
constexpr float kTieTaut = 0.975f;       // of the strand's length, between tool and needle: just below taut
constexpr float kTieTooTaut = 0.3f;      // [N]
constexpr float kTieLoose = 0.7f;        // of the strand between the turns and the needle, on the way to the tail
constexpr float kTieClear = 0.006f;      // [m] between jaws that grasp the tail and the other strand
constexpr float kTieLeastFree = 0.032f;  // [m] minimum free strand for winding

// The direction, from tip to handle, of a tool that is ready for a throw; side: +1 comes from the right, -1
// from the left.
Vec3 tying_axis(float side);
// A tool along z, its jaws opening upward.
Quat from_tool_axis(Vec3 z);

// Coordinates across a tool that lies along z: e1 away from the tissue, e2 to its side.
struct AcrossTool {
  Vec3 z, e1, e2;
  explicit AcrossTool(Vec3 along);
};

// [m] Position of the current stitch: its knot, else the mean of its points, else the center of the field.
Vec3 stitch_place(const PictureModel& picture, const Snapshot& seen);
Vec3 needle_swage(const PictureModel& picture, const Snapshot& seen);

// Estimate of the free strand between two hands: it decreases while the strand is taut and increases while it is slack.
float feel_strand(float strand, float tension, float dt);

// A strand that is wound round a tool lying across it.
struct Winding {
  Vec3 start;                               // [m] where the strand leaves the stitch
  float reach = 0, height = 0, ground = 0;  // [m] length of strand; height of the tool; height of tissue
  float way = 0;                            // +1, -1: sense of winding
  float wound = 0;                          // [rad] so far
  float lean = 0;                           // slope of the strand that leaves, along the tool
  float free = 0;                           // [m] of strand between tool and needle, estimated
};

// From the last suture point or the knot that is already on the strand; past_knot: always from the suture point. The caller
// sets `way` and `free`. least_free: [m] minimum free strand for winding.
void begin_winding(Winding& w, const PictureModel& picture, const Snapshot& seen, float least_free = kTieLeastFree,
                   bool past_knot = false);
// [m] Position of the tool.
Vec3 winding_axis(const Winding& w, const AcrossTool& across);
// [m] The needle's swage when the strand leaves the tool after `wound` [rad] about it. room: [m] of strand that fits below.
// If less than w.free, the strand is slack there and is tightened afterward.
Vec3 winding_swage(const Winding& w, const AcrossTool& across, float wound, float& room);
// Updates w.free while the strand is wound; behind: [m] distance of the needle from its target winding_swage.
void feel_winding(Winding& w, const Snapshot& seen, const AcrossTool& across, float behind, float room, float dt);
// [m] Position of the needle above the turns, at `turns`, on the way to the tail.
Vec3 strand_above(const Winding& w, const AcrossTool& across, Vec3 turns);

// A tail that has slipped down between the edges: no penalty down to `easy` [m] below the knot, then `worse` per
// meter.
struct TailDepth {
  float easy, worse;
};
// The script can descend slowly. A user at a mouse or a gamepad, at a low frame rate, does not
// finish a stitch with the script's values (tests/hands).
constexpr TailDepth kTailByScript{0.010f, 50}, kTailByHand{0.006f, 30};

// Best position for tool `who`, coming from `side`, to grasp the tail: clear of the other strand, no tissue in the path of
// its shaft, near the knot, not deep below it, within the range of a loop on the tool; `tried`: [m] positions that
// failed before. Returns false if no position is found.
struct TailGrip {
  uint32_t slot = 0;  // of the thread
  Pose pose;
  float tail = 0;  // [m] of thread beyond the knot
};
bool best_tail_grip(const PictureModel& picture, const Snapshot& seen, size_t who, float side, TailDepth depth,
                    std::span<const Vec3> tried, TailGrip& out);

}  // namespace catgut
