// SPDX-License-Identifier: Apache-2.0
// runtime: metrics of an interactive session so far, collected from the published snapshots tick by tick. Plain values,
// so that undoing a bite restores its metrics too.
#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "exchange/snapshot.h"

namespace catgut {

// Event counts of a run. Results of runs (runtime/metrics_collector) and of interactive sessions are both counted
// here.
struct Counts {
  std::array<uint32_t, static_cast<size_t>(EventKind::count_)> events{};  // of each kind
  std::array<uint32_t, static_cast<size_t>(Fault::count_)> faults{};
  uint32_t faults_in_all = 0;
  uint32_t bites = 0;            // completed
  uint32_t bites_withdrawn = 0;  // the needle was withdrawn
  uint32_t knots = 0;            // with at least one locked throw, baked ones included
  uint32_t throws = 0;
  uint32_t last_knot_throws = 0;  // of the most recent knot
  uint32_t cuts = 0;
  uint32_t sutures_baked = 0;
  // Drops: needle, thread or tissue slipped out of a jaw.
  uint32_t needle_slips = 0, thread_slips = 0, tissue_slips = 0;
  // Locked throws of every suture that is not baked; knots are numbered from 0 in each. A suture without a throw: no row.
  using ThrowsOfKnots = std::array<uint8_t, 32>;
  std::vector<ThrowsOfKnots> throws_of;
  uint32_t tied() const;  // sutures with a knot among them
};
void count(Counts& counts, const Event& event);

struct SessionMetrics : Counts {
  double time_s = 0;                          // [s] simulated, since the hands connected
  std::array<float, kMaxHands> path{};        // [m] of the tip of each hand's tool
  std::array<float, kMaxHands> peak_force{};  // [N] on each hand, in the physics
  // [N] written to the motors of the haptic device that moves the hand, since the scene opened; negative: no device.
  std::array<float, kMaxHands> peak_rendered{-1, -1, -1, -1};
  float peak_tension = 0;             // [N] of the threads, at a suture point
  uint32_t overloads = 0;             // pulls on a suture point above what bowel bears (assess::kTearForce)
  bool overloaded = false;            // one lasts
  float opening_start = 0;            // [m^2] when the hands connected; 0: nothing to close
  float opening = 0;                  // [m^2] current
  float closure = 0;                  // 0 open .. 1
  uint32_t undos = 0;                 // undone bites; not reset by an undo
  std::array<Vec3, kMaxHands> tip{};  // [m] previous tool positions, for the path
  bool begun = false;
};

// After every tick. dt: length of a tick [s].
void update(SessionMetrics& metrics, const Snapshot& seen, float dt);

}  // namespace catgut
