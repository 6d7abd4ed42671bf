// SPDX-License-Identifier: Apache-2.0
// runtime/limits: see limits.h.
#include "runtime/limits.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "core/jobs.h"
#include "sim/simulation.h"
#include "technique/technique.h"

namespace catgut {
namespace {

constexpr double kRealTimeFps = 24;     // the paper's limit of real time
constexpr uint32_t kPaperLost = 26;     // sutures in two bodies at which the paper's simulation fell below real time
constexpr double kPaperOneBody = 76.2;  // [1/s] with 50 sutures in one body, rendering included
constexpr size_t kPasses = 5;           // of the first and the last suture, alternating

class SutureWatch {
 public:
  SutureWatch(LimitsResult& result, const SceneSpec& scene, const std::function<void(const SutureCost&)>& on_row)
      : result_(result), scene_(scene), on_row_(on_row) {}

  bool operator()(const Snapshot& seen, const StageTimes& times, double tick_ms) {
    if (seen.time_s <= scene_.settle) return true;
    solver_ms_.push_back(static_cast<float>(times.solver_ms()));
    tick_ms_.push_back(static_cast<float>(tick_ms));
    contacts_ = std::max(contacts_, times.contacts);
    const size_t completed = completed_in(seen);
    if (completed == 0) return true;
    SutureCost cost;
    cost.bites = static_cast<uint32_t>(
        std::count_if(seen.active().bite.begin(), seen.active().bite.end(), [](const BiteView& b) { return b.complete; }));
    cost.suture_points = static_cast<uint32_t>(seen.active().suture_point.size());
    cost.settled = static_cast<uint32_t>(seen.settled.size());
    cost.simulated_s = seen.time_s;
    cost.ticks = tick_ms_.size();
    cost.solver_ms = percentiles_of(std::move(solver_ms_));
    cost.tick_ms = percentiles_of(std::move(tick_ms_));
    cost.contacts = contacts_;
    cost.fps = cost.tick_ms.median > 0 ? 1000 / cost.tick_ms.median : 0;
    for (size_t k = completed; k > 0 && !result_.reached(); --k) {
      cost.suture = static_cast<uint32_t>(result_.row.size()) + 1;
      result_.row.push_back(cost);
      if (on_row_) on_row_(cost);
    }
    solver_ms_.clear(), tick_ms_.clear();
    contacts_ = 0;
    return !result_.reached();
  }

 private:
  // A single suture is complete with the last throw of its knot, a running one with every bite.
  size_t completed_in(const Snapshot& seen) {
    const TechniqueRow* technique = find_technique(scene_.technique.name);
    const bool single = technique && technique->interrupted;
    size_t completed = 0;
    for (const Event& e : seen.event) {
      if (e.kind == EventKind::suture_loaded) throws_ = 0;
      if (single && e.kind == EventKind::throw_locked) completed += ++throws_ == scene_.technique.throws;
      if (!single && e.kind == EventKind::bite_completed) ++completed;
    }
    return completed;
  }

  LimitsResult& result_;
  const SceneSpec& scene_;
  const std::function<void(const SutureCost&)>& on_row_;
  int throws_ = 0;  // of the current suture
  std::vector<float> solver_ms_, tick_ms_;
  uint32_t contacts_ = 0;
};

// One recorded suture: the state before it and the inputs of its ticks.
struct Stretch {
  std::vector<std::byte> start;
  std::vector<TickInput> input;
};

SutureGrowth rerun_alternating(const SceneSpec& scene, int threads, const Stretch& first, const Stretch& last,
                               const std::atomic<bool>* stop) {
  const std::shared_ptr<const Model> model = build_model(scene);
  const StatePtr a = initial_state(*model), b = initial_state(*model);
  Jobs jobs(threads);
  const auto solver_ms = [&](State& state, const TickInput& input) {
    StageTimes times;
    step(*model, state, input, jobs, &times);
    return static_cast<float>(times.solver_ms());
  };
  SutureGrowth growth;
  growth.ticks = std::min(first.input.size(), last.input.size());
  while (growth.ticks > 0 && growth.pass.size() < kPasses) {
    load_state(*model, *a, first.start);
    load_state(*model, *b, last.start);
    std::vector<float> first_ms, last_ms;
    for (size_t i = 0; i < growth.ticks; ++i) {
      if (stop && *stop) return growth;
      first_ms.push_back(solver_ms(*a, first.input[i]));
      last_ms.push_back(solver_ms(*b, last.input[i]));
    }
    const SutureGrowth::Pass pass{percentiles_of(std::move(first_ms)).median, percentiles_of(std::move(last_ms)).median};
    const auto larger = [](const SutureGrowth::Pass& p, const SutureGrowth::Pass& q) { return p.ratio() < q.ratio(); };
    growth.pass.insert(std::upper_bound(growth.pass.begin(), growth.pass.end(), pass, larger), pass);
  }
  return growth;
}

}  // namespace

LimitsResult measure_limits(SceneSpec scene, int sutures, int threads, const std::function<void(const SutureCost&)>& on_row,
                            const SessionHooks& hooks) {
  LimitsResult result;
  result.wanted = static_cast<uint32_t>(sutures);
  scene.surgeon.bites = sutures;
  SessionOptions options;
  options.threads = threads;
  SessionHooks own = hooks;
  SutureWatch watch(result, scene, on_row);
  Stretch first, last, now;
  own.on_cost = [&](const Snapshot& seen, const StageTimes& times, double tick_ms) {
    const size_t before = result.row.size();
    if (seen.time_s <= scene.settle) now = {};
    const bool go_on = watch(seen, times, tick_ms);
    if (result.row.size() > before) {
      last = std::exchange(now, {});
      if (before == 0) first = last;
    }
    return go_on;
  };
  own.on_step = [&](const Model& model, const State& state, const TickInput& input) {
    if (now.start.empty()) now.start = save_state(model, state);
    else now.input.push_back(input);
  };
  result.run = run_session(scene, options, own);
  if (result.row.size() > 1) result.growth = rerun_alternating(scene, threads, first, last, hooks.stop);
  return result;
}

std::string limits_csv_header() {
  return "suture,bites,suture_points,settled,simulated_s,ticks,solver_ms_median,solver_ms_p99,tick_ms_median,tick_ms_p99,"
         "contacts,fps\n";
}

std::string limits_csv_row(const SutureCost& r) {
  return fmt::format("{},{},{},{},{:.3f},{},{:.4f},{:.4f},{:.4f},{:.4f},{},{:.1f}\n", r.suture, r.bites, r.suture_points,
                     r.settled, r.simulated_s, r.ticks, r.solver_ms.median, r.solver_ms.p99, r.tick_ms.median, r.tick_ms.p99,
                     r.contacts, r.fps);
}

std::string limits_table(const LimitsResult& result, size_t bodies) {
  std::string text = fmt::format("{}: {} particles, {} thread{}; {} of {} sutures, {:.0f} s simulated", result.run.scene,
                                 result.run.particles, result.run.threads, result.run.threads == 1 ? "" : "s",
                                 result.row.size(), result.wanted, result.run.simulated_s);
  if (!result.reached()) text += fmt::format(" ({})", result.run.ended);
  text += "\n";
  if (result.row.empty()) return text;
  text += "suture  points  settled  contacts  solver ms: median    p99  tick ms: median    p99     FPS\n";
  for (size_t i = 0; i < result.row.size(); ++i) {
    const SutureCost& r = result.row[i];
    if (i > 0 && r.suture % 5 != 0 && i + 1 < result.row.size()) continue;
    text += fmt::format("{:6}  {:6}  {:7}  {:8}  {:17.2f}  {:5.2f}  {:15.2f}  {:5.2f}  {:6.0f}\n", r.suture, r.suture_points,
                        r.settled, r.contacts, r.solver_ms.median, r.solver_ms.p99, r.tick_ms.median, r.tick_ms.p99, r.fps);
  }
  if (const SutureGrowth& g = result.growth; !g.pass.empty())
    text += fmt::format(
        "sutures 1 and {} re-run interleaved, {} ticks each, {} times: solver {:.2f} and {:.2f} ms (median), x {:.2f} "
        "(x {:.2f} to {:.2f})\n",
        result.row.back().suture, g.ticks, g.pass.size(), g.middle().first_ms, g.middle().last_ms, g.middle().ratio(),
        g.pass.front().ratio(), g.pass.back().ratio());
  const auto slow =
      std::find_if(result.row.begin(), result.row.end(), [](const SutureCost& r) { return r.fps < kRealTimeFps; });
  const std::string ours = slow != result.row.end() ? fmt::format("ours from suture {}", slow->suture)
                                                    : fmt::format("ours not reached up to suture {}", result.row.size());
  text += bodies > 1
              ? fmt::format("paper, two bodies, drawing included: below {} FPS at suture {}, solver 20 ms there; {}\n",
                            kRealTimeFps, kPaperLost, ours)
              : fmt::format("paper, one body, drawing included: {} FPS at suture 50; here {:.0f} at suture {}, nothing drawn\n",
                            kPaperOneBody, result.row.back().fps, result.row.size());
  return text;
}

Image limits_plot(const LimitsResult& result, size_t bodies, double tick_rate) {
  Plot plot;
  plot.title = fmt::format("{}: solver time by suture count ({} particles, {} thread{})", result.run.scene,
                           result.run.particles, result.run.threads, result.run.threads == 1 ? "" : "s");
  plot.x_name = "suture";
  plot.y_name = "ms per tick";
  PlotCurve median{"median", {30, 90, 160, 255}, {}}, p99{"99th percentile", {120, 170, 210, 255}, {}};
  for (const SutureCost& r : result.row) {
    const double x = r.suture;
    median.point.push_back({x, r.solver_ms.median});
    p99.point.push_back({x, r.solver_ms.p99});
  }
  plot.curve = {p99, median};
  // The text of 3.5 gives two values of figure 21.
  if (bodies > 1) plot.curve.push_back({"paper, two bodies", {200, 120, 30, 255}, {{13, 10}, {kPaperLost, 20}}, false});
  plot.level = {{"24 FPS", 1000 / kRealTimeFps},
                {fmt::format("real time at {:g} ticks a second", tick_rate), 1000 / tick_rate}};
  return draw_plot(plot);
}

}  // namespace catgut
