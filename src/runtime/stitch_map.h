// SPDX-License-Identifier: Apache-2.0
// runtime: where the stitches lie and how the thread was drawn: what a user who has sutured wants to look back at. Gathered
// from the published snapshots tick by tick, as runtime/session_metrics is. Reads PictureModel and Snapshot.
//
// Lengths are measured on the tissue at rest, because that is where a bite stays: while the needle is in it, or an opening is
// drawn together, the same two points may be much nearer or further apart. Everything is only ever added behind, in the order
// of time, so that undoing a bite is dropping what came later.
#pragma once
#include <cstdint>
#include <vector>

#include "exchange/picture.h"
#include "exchange/snapshot.h"

namespace catgut {

// The edge that is sutured, at rest: the row of tissue particles round the opening of one wall, closed.
struct StitchEdge {
  std::vector<Vec3> point;   // [m]
  std::vector<float> along;  // [m] from point[0], one more than points: the last is the edge's length
  float length() const { return along.empty() ? 0 : along.back(); }
};

struct StitchBite {
  uint64_t tick = 0;                      // when it was complete
  uint32_t bite = 0;                      // its number, as events tell it
  uint32_t suture = 0;                    // how many needles were taken before
  uint32_t wall = 0;                      // of PictureModel::rim
  Vec3 entry, exit;                       // [m] at rest
  float entry_along = 0, exit_along = 0;  // [m] along the edge, to the place nearest to it
  float entry_edge = -1, exit_edge = -1;  // [m] from there, the distance from the edge; -1: this wall has none
  float length = 0;                       // [m] from entry to exit
  float depth = 0;                        // [m] deepest the tip went below the surface (BiteView)
  float entry_angle = -1;                 // [rad] off upright when the tip went in; -1: not seen
  // [m] of edge between this bite and the nearest end of the one before it on the same wall: the stretch that nothing holds.
  // -1: it is the first there.
  float spacing = -1;
  bool entry_inside = false, exit_inside = false;  // on the mucosa
};

struct TensionSample {
  uint64_t tick = 0;  // the last of the samples' time
  float peak = 0;     // [N] maximum along the thread and over the interval
  float needle = 0;   // [N] at the needle, maximum over the interval
};

struct StitchMap {
  double tick_s = 1.0 / 60;      // [s] of a tick
  std::vector<StitchEdge> edge;  // of each wall; the second runs beside the first, from the place opposite to its start
  std::vector<StitchBite> bite;
  std::vector<TensionSample> tension;  // ten a second
  std::vector<Event> event;            // but for what happens particle by particle
  // What is being gathered.
  uint32_t sutures = 0;
  std::vector<float> angle;  // of the bites that were begun, by number
  TensionSample now;
  uint32_t in_now = 0;  // ticks
};

StitchMap start_map(const PictureModel& picture, double tick_s);
// After every tick in which hands were let in.
void note(StitchMap& map, const PictureModel& picture, const Snapshot& seen);
// Time goes back: what came after this tick has not happened.
void rewind(StitchMap& map, uint64_t tick);

// Where a point of the tissue as it is now was at rest: carried back by the four nearest particles of its wall.
Vec3 at_rest(const PictureModel& picture, const Snapshot& seen, uint32_t wall, Vec3 now);
// The nearest place of an edge: how far along it, and how far from it [m].
struct OnEdge {
  float along = 0, distance = -1;
};
OnEdge nearest_on(const StitchEdge& edge, Vec3 point);
// [m] of a closed edge between two stretches of it, each given by its two ends and taken the short way; 0 when they overlap.
float between(float edge_length, float a0, float a1, float b0, float b1);

}  // namespace catgut
