// SPDX-License-Identifier: Apache-2.0
// assess: map of the stitches and tension over time, for the review of a session. Collected
// from the published snapshots tick by tick, as runtime/session_metrics does. Reads PictureModel and Snapshot.
//
// Lengths are measured on the tissue at rest, because bites are fixed there. While the needle is in tissue, or an opening is
// closed, the same two points may be much nearer or further apart. Rows are only ever appended, in the order of
// time, so that undoing a bite removes the later ones.
#pragma once
#include <cstdint>
#include <vector>

#include "exchange/picture.h"
#include "exchange/snapshot.h"

namespace catgut {

// The sutured edge at rest: the row of tissue particles round the opening of one wall, closed.
struct StitchEdge {
  std::vector<Vec3> point;   // [m]
  std::vector<float> along;  // [m] from point[0], one more than points: the last is the edge's length
  float length() const { return along.empty() ? 0 : along.back(); }
};

struct StitchBite {
  uint64_t tick = 0;                      // of completion
  uint32_t bite = 0;                      // its number, as in events
  uint32_t suture = 0;                    // number of sutures loaded before
  uint32_t wall = 0;                      // of PictureModel::rim
  Vec3 entry, exit;                       // [m] at rest
  float entry_along = 0, exit_along = 0;  // [m] along the edge, to the nearest point of it
  float entry_edge = -1, exit_edge = -1;  // [m] distance from the edge there; -1: this wall has none
  float length = 0;                       // [m] from entry to exit
  float depth = 0;                        // [m] maximum depth of the tip below the surface (BiteView)
  float entry_angle = -1;                 // [rad] from the surface normal at entry; -1: not observed
  // [m] of edge between this bite and the nearest end of the previous one on the same wall. The unsutured stretch.
  // -1: it is the first there.
  float spacing = -1;
  bool entry_inside = false, exit_inside = false;  // on the mucosa
};

struct TensionSample {
  uint64_t tick = 0;  // end of the sample's interval
  float peak = 0;     // [N] maximum along the thread and over the interval
  float needle = 0;   // [N] at the needle, maximum over the interval
};

struct StitchMap {
  double tick_s = 1.0 / 60;      // [s] of a tick
  std::vector<StitchEdge> edge;  // of each wall; the second runs in parallel to the first, from the point opposite to its start
  std::vector<StitchBite> bite;
  std::vector<TensionSample> tension;  // ten per second
  std::vector<Event> event;            // all but those of single particles
  // Work in progress.
  uint32_t sutures = 0;
  std::vector<float> angle;  // of the started bites, by number
  TensionSample now;
  uint32_t in_now = 0;  // ticks
};

StitchMap start_map(const PictureModel& picture, double tick_s);
// After every tick with connected hands.
void note(StitchMap& map, const PictureModel& picture, const Snapshot& seen);
// Time goes back: removes what came after this tick.
void rewind(StitchMap& map, uint64_t tick);

// Rest position of a current point of the tissue: transformed back by the four nearest particles of its wall.
// turned (may be null): rotation of the tissue there.
Vec3 at_rest(const PictureModel& picture, const Snapshot& seen, uint32_t wall, Vec3 now, Quat* turned = nullptr);
// The nearest point of an edge: its coordinate along it, and the distance from it [m].
struct OnEdge {
  float along = 0, distance = -1;
};
OnEdge nearest_on(const StitchEdge& edge, Vec3 point);
// [m] of a closed edge between two stretches of it, each given by its two ends in the shorter direction; 0 if they overlap.
float between(float edge_length, float a0, float a1, float b0, float b1);

}  // namespace catgut
