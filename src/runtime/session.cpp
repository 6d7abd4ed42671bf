// SPDX-License-Identifier: Apache-2.0
// runtime: the run loop. Per tick: the hands read the last snapshot, step, publish, measure, report. See session.h.
#include "runtime/session.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>
#include <thread>

#include "core/check.h"
#include "procedure/scene_file.h"
#include "runtime/hands.h"
#include "sim/simulation.h"
#include "sim/stitch_pull.h"

namespace catgut {
namespace {

using Clock = std::chrono::steady_clock;
constexpr double kAfterDone = 0.5;       // [s] simulated: the tissue settles
constexpr float kStitchPull = 2;         // [N] on either wall of a stitch; its bites bear 2.5 at least
constexpr uint64_t kValidityTicks = 16;  // interval of the validity check: early detection at no measurable cost

double ms_since(Clock::time_point start) { return std::chrono::duration<double, std::milli>(Clock::now() - start).count(); }

// The state of one run and the work around each of its ticks, for live and replayed hands.
class Run {
 public:
  Run(const SceneSpec& scene, int threads, const SessionHooks& hooks)
      : model_(build_model(scene)),
        picture_(picture_model(*model_)),
        state_(initial_state(*model_)),
        jobs_(threads),
        metrics_(scene_of(*model_), picture_),
        hooks_(hooks),
        dt_(1 / scene.solver.tick_rate) {
    publish(*model_, *state_, seen_);
    if (hooks_.on_start) hooks_.on_start(picture_);
    reported_at_ = Clock::now();
  }

  // hands: return the input of the tick. False when the run has to end: stopped, or state invalid.
  template <typename HandsOf>
  bool tick(HandsOf&& hands, const std::string& doing, double until_s) {
    const Clock::time_point start = Clock::now();
    input_ = hands(seen_);
    input_.tick = ticks_;
    StageTimes times;
    step(*model_, *state_, input_, jobs_, &times);
    {
      StageTimer timer(&times, Stage::publish);
      publish(*model_, *state_, seen_);
    }
    const double tick_ms = ms_since(start);
    metrics_.time(times, tick_ms);
    ++ticks_;
    metrics_.tick(seen_);
    if (ticks_ % kValidityTicks == 0 && !state_is_valid(*model_, *state_)) metrics_.invalidate();
    if (hooks_.on_tick) hooks_.on_tick(seen_, doing);
    if (hooks_.on_step) hooks_.on_step(*model_, *state_, input_);
    if (hooks_.on_cost && !hooks_.on_cost(seen_, times, tick_ms)) enough_ = true;
    if (hooks_.on_progress && ms_since(reported_at_) > 1000) {
      reported_at_ = Clock::now();
      hooks_.on_progress({simulated_s(), until_s, simulated_s() * 1000 / metrics_.spent_ms(), doing});
    }
    return !stopped() && !enough_ && metrics_.valid();
  }

  bool stopped() const { return hooks_.stop && hooks_.stop->load(std::memory_order_relaxed); }
  double simulated_s() const { return static_cast<double>(ticks_) * dt_; }

  void finish(RunResult& result) {
    if (!state_is_valid(*model_, *state_)) metrics_.invalidate();
    const SceneSpec& scene = scene_of(*model_);
    result.scene = scene.name;
    result.title = scene.title;
    result.preset = scene.solver.preset;
    result.threads = jobs_.threads();
    result.particles = particle_count(*model_);
    result.ticks = ticks_;
    result.simulated_s = simulated_s();
    result.state_hash = hash_state(*model_, *state_);
    if (hooks_.on_end) hooks_.on_end(*model_, *state_);
    if (!stopped() && metrics_.valid()) pull_stitches(scene, result);
    result.interrupted = stopped();
    if (enough_) result.ended = "stopped by callback";
    if (result.interrupted) result.ended = "interrupted";
    if (!metrics_.valid()) result.ended = "invalid state";
    result.value["contacts_dropped"] = dropped_contacts(*state_);
    metrics_.finish(seen_, result);
  }

  // Pulls each finished stitch apart. Seconds of work for a scene of many stitches, so only if the scene expects something of
  // it.
  void pull_stitches(const SceneSpec& scene, RunResult& result) {
    const auto asked = [](const Expectation& e) { return e.name == "stitch_slip" || e.name == "stitch_bears"; };
    if (scene.mechanics.kind != "physical" || std::none_of(scene.expect.begin(), scene.expect.end(), asked)) return;
    std::optional<double> slips, bears;
    const std::vector<StitchMeasures> stitches = measure_stitches(seen_);
    for (size_t i = 0; i < stitches.size(); ++i) {
      if (!stitches[i].finished) continue;
      if (stopped()) return;
      if (hooks_.on_progress)
        hooks_.on_progress({simulated_s(), simulated_s(), simulated_s() * 1000 / metrics_.spent_ms(),
                            "pull stitch " + std::to_string(i + 1) + " of " + std::to_string(stitches.size())});
      const StitchPull pull = pull_stitch(*model_, *state_, stitches[i].suture, kStitchPull, jobs_);
      slips = std::max(slips.value_or(-1e9), static_cast<double>(pull.slip));
      bears = std::min(bears.value_or(1e9), static_cast<double>(pull.tension));
    }
    if (slips) result.value["stitch_slip"] = *slips, result.value["stitch_bears"] = *bears;
  }

  std::shared_ptr<const Model> model_;
  PictureModel picture_;
  StatePtr state_;
  Jobs jobs_;
  MetricsCollector metrics_;
  const SessionHooks& hooks_;
  Snapshot seen_;
  TickInput input_;
  uint64_t ticks_ = 0;
  bool enough_ = false;
  const double dt_;

 private:
  Clock::time_point reported_at_;
};

TickInput nobody() {
  TickInput input;
  input.hand = no_hands();
  return input;
}

uint64_t ticks_in(double seconds, double dt) { return static_cast<uint64_t>(std::llround(seconds / dt)); }

}  // namespace

const char* catgut_version() { return CATGUT_VERSION; }

// More than four workers wait for each other longer than they save: the stages are tens of microseconds long.
int default_threads() { return std::clamp(static_cast<int>(std::thread::hardware_concurrency()), 1, 4); }

RunResult run_session(const SceneSpec& scene, const SessionOptions& options, const SessionHooks& hooks) {
  Run run(scene, options.threads, hooks);
  Hands hands = make_hands(options.surgeon, scene, run.picture_);
  std::unique_ptr<Recorder> recorder;
  if (!options.record.empty())
    recorder = std::make_unique<Recorder>(options.record, RecordingHeader{catgut_version(), kStateVersion, write_scene(scene)},
                                          save_state(*run.model_, *run.state_));

  const double until_s = options.seconds > 0 ? options.seconds : static_cast<double>(scene.duration);
  const uint64_t last = std::max<uint64_t>(1, ticks_in(until_s, run.dt_));
  const uint64_t settle = hands.settles ? std::min(last, ticks_in(scene.settle, run.dt_)) : 0;
  const uint64_t after_done = hands.settles ? ticks_in(kAfterDone, run.dt_) : 0;  // a recording includes that time
  const auto one_tick = [&](auto&& of, const std::string& doing) {
    const bool go_on = run.tick(of, doing, until_s);
    if (recorder) recorder->tick(run.input_, hash_state(*run.model_, *run.state_));
    return go_on;
  };

  RunResult result;
  result.surgeon = options.surgeon;
  result.ended = "time limit";
  bool go_on = true;
  while (go_on && run.ticks_ < settle) go_on = one_tick([](const Snapshot&) { return nobody(); }, "settling");
  run.metrics_.open();
  uint64_t done_for = 0;
  while (go_on && run.ticks_ < last) {
    if (hands.surgeon && hands.surgeon->done() && done_for++ >= after_done) break;
    const float dt = static_cast<float>(run.dt_);
    if (hands.surgeon)
      go_on = one_tick([&](const Snapshot& seen) { return hands.surgeon->operate(seen, dt); }, hands.surgeon->doing());
    else go_on = one_tick([](const Snapshot&) { return nobody(); }, "no hands");
  }
  if (hands.surgeon) result.value["surgeon_retries"] = hands.surgeon->retries();
  if (hands.surgeon && hands.surgeon->done()) {
    result.value["surgeon_done"] = hands.surgeon->gave_up() ? 0 : 1;
    result.ended = "surgeon: " + hands.surgeon->doing();
  }
  run.finish(result);
  if (recorder) recorder->finish(result.interrupted);
  return result;
}

void check_replayable(const Recording& recording, const std::string& name) {
  if (recording.header.state_version == kStateVersion) return;
  throw InputError(name,
                   "it was recorded by version " + recording.header.catgut_version + " with state layout " +
                       std::to_string(recording.header.state_version) + ", this version has " + std::to_string(kStateVersion),
                   "replay it with that version, or play its hands with `catgut run SCENE --surgeon " + name + "`");
}

ReplayResult replay_session(const Recording& recording, const std::string& name, bool check, int threads,
                            const SessionHooks& hooks) {
  check_replayable(recording, name);
  const SceneSpec scene = parse_scene(recording.header.scene, name);
  Run run(scene, threads, hooks);
  load_state(*run.model_, *run.state_, recording.start);
  publish(*run.model_, *run.state_, run.seen_);
  const uint64_t settle = ticks_in(scene.settle, run.dt_);
  const double until_s = static_cast<double>(recording.tick.size()) * run.dt_;

  ReplayResult result;
  result.run.surgeon = name;
  result.run.ended = "end of recording";
  for (const RecordedTick& t : recording.tick) {
    if (run.ticks_ == settle) run.metrics_.open();
    const bool go_on = run.tick([&](const Snapshot&) { return t.input; }, "replay", until_s);
    if (check && hash_state(*run.model_, *run.state_) != t.hash) {
      result.differs_at = run.ticks_;
      result.run.ended = "state differs from the recording";
      break;
    }
    if (!go_on) break;
  }
  run.finish(result.run);
  return result;
}

}  // namespace catgut
