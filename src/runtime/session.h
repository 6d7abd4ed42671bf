// SPDX-License-Identifier: Apache-2.0
// runtime: runs a scene from its first tick to its last, in lock step: as fast as possible, on the caller's thread. Measured
// times go into reports, never into the physics, so a run's bits depend only on its inputs.
#pragma once
#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "core/jobs.h"
#include "exchange/picture.h"
#include "exchange/snapshot.h"
#include "runtime/metrics_collector.h"
#include "sim/recording.h"
#include "sim/scene.h"
#include "surgeon/surgeon.h"

namespace catgut {

struct Model;
struct State;

const char* catgut_version();

struct Progress {
  double simulated_s = 0, until_s = 0;  // until_s: maximum
  double real_time_factor = 0;
  std::string doing;
};

// Callbacks of a run. Each may be empty.
struct SessionHooks {
  std::function<void(const PictureModel&)> on_start;
  std::function<void(const Snapshot&, const std::string& doing)> on_tick;
  // The result of the tick; before on_cost.
  std::function<void(const Model&, const State&, const TickInput&)> on_step;
  std::function<void(const Model&, const State&)> on_end;  // the last state; also of a run that was stopped
  // Time of the tick, per stage and total [ms]; false: ends the run.
  std::function<bool(const Snapshot&, const StageTimes&, double tick_ms)> on_cost;
  std::function<void(const Progress&)> on_progress;  // about once per second of wall time
  const std::atomic<bool>* stop = nullptr;           // set: the run ends after the current tick
};

struct SessionOptions {
  std::string surgeon = "scripted";  // "scripted", "none", or the path of a recording whose inputs are played
  double seconds = 0;                // [s] simulated, settling included; 0: the scene's duration
  int threads = 1;                   // workers of the solver, 1..64
  std::string record;                // path of the recording to write; empty: none
};

// Settles the scene without hands, then lets the surgeon work until half a second after it is done, or until the time limit.
// Throws InputError (scene, surgeon, recording).
RunResult run_session(const SceneSpec& scene, const SessionOptions& options, const SessionHooks& hooks = {});

// Throws InputError when the recording comes from a program with another layout of the state.
void check_replayable(const Recording& recording, const std::string& name);

struct ReplayResult {
  RunResult run;
  std::optional<uint64_t>
      differs_at;  // number of the first tick, from 1, after which the hash of the state is not the recorded one
};
// Plays a recording. check: compare the hash after every tick and stop at the first difference. Throws InputError when the
// recording comes from a program with another layout of the state.
ReplayResult replay_session(const Recording& recording, const std::string& name, bool check, int threads,
                            const SessionHooks& hooks = {});

// Number of workers that is fastest on this machine.
int default_threads();

}  // namespace catgut
