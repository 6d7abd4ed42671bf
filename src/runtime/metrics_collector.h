// SPDX-License-Identifier: Apache-2.0
// runtime: the results of a run, collected from the published snapshots tick by tick. Reads Snapshot and StageTimes; writes
// RunResult. It has no access to the state, so the results are measured from outside.
#pragma once
#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "core/profile.h"
#include "exchange/picture.h"
#include "exchange/snapshot.h"
#include "runtime/session_metrics.h"
#include "runtime/stitch_measures.h"
#include "sim/scene.h"

namespace catgut {

constexpr size_t kStages = static_cast<size_t>(Stage::count_);

struct Percentiles {
  double median = 0, p99 = 0, p999 = 0, max = 0;
};
Percentiles percentiles_of(std::vector<float> values);  // all zero for none

struct ExpectationResult {
  Expectation want;
  double got = 0;
  bool ok = false;
};

struct RunResult {
  std::string scene, title, preset, surgeon;
  int threads = 1;
  size_t particles = 0;
  uint64_t ticks = 0;
  double simulated_s = 0;
  double real_time_factor = 0;                   // simulated time over the time spent in step, publish and the surgeon's plan
  Percentiles solver_ms, tick_ms;                // per tick
  std::array<Percentiles, kStages> stage_ms;     // per tick
  StageTimes longest;                            // of the longest tick
  uint64_t longest_tick = 0, overrun_ticks = 0;  // its number; ticks longer than the time that they simulate
  uint32_t contacts = 0;                         // maximum in a substep
  std::map<std::string, uint64_t> events;        // by kind, only those that occurred
  std::map<std::string, uint64_t> faults;        // technique_fault events by name, only those that occurred
  std::map<std::string, double> value;           // every name of result_names
  std::vector<StitchMeasures> stitch;            // physical mechanics: at the end
  std::vector<ExpectationResult> expect;
  uint64_t state_hash = 0;
  bool interrupted = false;
  std::string ended;  // why, as text

  bool expectations_hold() const;
};

class MetricsCollector {
 public:
  MetricsCollector(const SceneSpec& scene, const PictureModel& picture);

  void open();                      // the hands connect now: the next snapshot's opening is the initial opening
  void tick(const Snapshot& seen);  // after every tick
  void time(const StageTimes& times, double tick_ms);
  void invalidate() { valid_ = false; }
  bool valid() const { return valid_; }
  double spent_ms() const { return spent_ms_; }

  // Fills values, events, percentiles and expectations; the caller sets the rest of `result` before.
  void finish(const Snapshot& last, RunResult& result) const;

 private:
  float thread_length_error(const Snapshot& seen) const;
  uint32_t count_order_errors(const Snapshot& seen);
  double wound_gap(const Snapshot& seen) const;
  double edge_inversion(const Snapshot& seen) const;
  void measure_depth(const Snapshot& last, std::map<std::string, double>& value) const;
  void measure_seam(const Snapshot& last, std::map<std::string, double>& value) const;

  const SceneSpec& scene_;
  const std::vector<SuturePicture> suture_;
  const std::vector<std::vector<uint32_t>> rim_;
  std::vector<uint8_t> seen_slot_;
  bool opening_wanted_ = true, valid_ = true;
  bool held_ = false;                                // by an instrument, in the last tick
  double let_go_s_ = 0, let_go_gap_ = 0;             // when the last instrument let go
  double most_inversion_ = 0;                        // [m]
  float thread_force_ = 0;                           // [N]
  float least_opening_ = 1e9f, let_go_opening_ = 0;  // [m2] at any time; when the last instrument let go
  float opening_at_start_ = 0, length_error_ = 0, length_error_passing_ = 0;
  uint32_t order_errors_ = 0, contacts_ = 0;
  Counts counts_;                       // a Snapshot does not list baked knots
  std::vector<double> tail_asymmetry_;  // per suture, when its first knot was begun; -1: none yet
  std::vector<float> solver_ms_, tick_ms_;
  std::array<std::vector<float>, kStages> stage_ms_;
  double spent_ms_ = 0, longest_ms_ = 0;
  StageTimes longest_;
  uint64_t longest_tick_ = 0, overrun_ticks_ = 0;
};

}  // namespace catgut
