// SPDX-License-Identifier: Apache-2.0
// runtime/paper_tables: see paper_tables.h.
#include "runtime/paper_tables.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "technique/technique.h"

namespace catgut {
namespace {

constexpr uint64_t kPictureEvery = 4;  // [ticks] between measured pictures: they take longer than a tick

struct PaperFigure {
  const TechniqueRow* technique;
  const char* phase;
  double fps, render_ms, solver_ms;
};
// Tables 1 to 4, measured there with a headset and two arms on an i7-13700KF and an RTX 4070 Ti.
const PaperFigure kPaper[] = {
    {&kPurseString, "Start", 82.1, 12.1, 5.42},
    {&kPurseString, "During suturing", 81.38, 12.21, 5.61},
    {&kPurseString, "After completion", 82.2, 12.1, 5.08},
    {&kConnell, "Start", 72.3, 13.8, 6.70},
    {&kConnell, "During suturing", 70.1, 14.2, 6.78},
    {&kConnell, "During looping", 65.7, 15.7, 7.99},
    {&kConnell, "After completion", 70.2, 14.3, 7.35},
    {&kStay, "Start", 76.5, 12.9, 5.9},
    {&kStay, "During suturing", 72.1, 13.8, 6.33},
    {&kStay, "During looping", 72.6, 13.82, 6.78},
    {&kStay, "After completion", 73.1, 13.6, 6.41},
    {&kLembert, "Start", 52.2, 19.0, 11.47},
    {&kLembert, "Suture #1", 51.3, 19.2, 11.80},
    {&kLembert, "Loop #1", 52.0, 19.3, 11.85},
    {&kLembert, "Suture #2", 52.5, 19.2, 11.60},
    {&kLembert, "Loop #2", 53.1, 18.8, 11.68},
    {&kLembert, "Suture #3", 50.8, 19.54, 11.69},
    {&kLembert, "Loop #3", 53.2, 18.6, 11.65},
    {&kLembert, "Suture #4", 50.65, 19.73, 11.95},
    {&kLembert, "Loop #4", 52.8, 18.95, 11.93},
    {&kLembert, "Suture #5", 50.62, 19.48, 11.84},
    {&kLembert, "Loop #5", 52.81, 18.62, 11.74},
    {&kLembert, "After completion", 53.2, 18.8, 11.45},
};

// Times of one execution's ticks of a phase.
struct Ticks {
  std::string phase;
  std::vector<float> solver_ms, tick_ms, picture_ms;
};

struct MeanAndDeviation {
  double mean = 0, deviation = 0;
};
MeanAndDeviation over(std::span<const double> value) {
  MeanAndDeviation r;
  if (value.empty()) return r;
  const double n = static_cast<double>(value.size());
  for (const double v : value) r.mean += v / n;
  for (const double v : value) r.deviation += (v - r.mean) * (v - r.mean) / n;
  r.deviation = std::sqrt(r.deviation);
  return r;
}

std::vector<double> rates(std::span<const double> ms) {
  std::vector<double> r;
  for (const double m : ms) r.push_back(m > 0 ? 1000 / m : 0);
  return r;
}

const PaperFigure* paper_figure(const std::string& technique, const std::string& phase) {
  const TechniqueRow* row = find_technique(technique);
  for (const PaperFigure& f : kPaper)
    if (row == f.technique && phase == f.phase) return &f;
  return nullptr;
}

template <typename T>
T& of_phase(std::vector<T>& list, const std::string& phase) {
  const auto it = std::find_if(list.begin(), list.end(), [&](const T& t) { return t.phase == phase; });
  if (it != list.end()) return *it;
  list.emplace_back();
  list.back().phase = phase;
  return list.back();
}

}  // namespace

std::string PaperPhase::operator()(std::span<const Event> events, bool settled, bool done) {
  if (!settled) return "Start";
  for (const Event& e : events) {
    if (e.kind == EventKind::loop_formed || e.kind == EventKind::throw_started) looping_ = true;
    if (e.kind == EventKind::tip_entered || e.kind == EventKind::suture_loaded) looping_ = false;
    if (e.kind == EventKind::suture_loaded) ++suture_;
  }
  if (done) return "After completion";
  if (numbered_) return fmt::format("{} #{}", looping_ ? "Loop" : "Suture", suture_);
  return looping_ ? "During looping" : "During suturing";
}

PaperTable measure_paper(SceneSpec scene, int executions, int threads,
                         const std::function<PictureCost(const PictureModel&)>& picture_ms, const SessionHooks& hooks,
                         const Procedure* procedure) {
  PaperTable table;
  table.technique = procedure ? procedure->scene : scene.technique.name;
  table.preset = scene.solver.preset;
  table.substeps = scene.solver.substeps;
  table.tick_rate = static_cast<double>(scene.solver.tick_rate);
  table.pictures = static_cast<bool>(picture_ms);
  const uint64_t first_seed = scene.seed;
  for (int i = 0; i < executions; ++i) {
    scene.seed = first_seed + static_cast<uint64_t>(i);
    PaperPhase phase_of(paper_figure(table.technique, "Suture #1") != nullptr);
    ProcedureRun stages;
    std::vector<Ticks> ticks;
    PictureCost picture;
    bool done = false;
    uint64_t n = 0;
    SessionHooks own = hooks;
    if (picture_ms) own.on_start = [&](const PictureModel& model) { picture = picture_ms(model); };
    own.on_tick = [&](const Snapshot&, const std::string& doing) { done = doing == "done"; };
    const auto phase_now = [&](const Snapshot& seen) -> std::string {
      const bool settled = seen.time_s > static_cast<double>(scene.settle);
      if (!procedure) return phase_of(seen.event, settled, done);
      if (!stages.begun) begin_run(stages, *procedure, seen, 1 / table.tick_rate);
      else update_run(stages, *procedure, seen);
      if (!settled) return "Start";
      return done || finished(stages, *procedure) ? "After completion" : procedure->stage[stages.stage].name;
    };
    own.on_cost = [&](const Snapshot& seen, const StageTimes& times, double tick_ms) {
      Ticks& t = of_phase(ticks, phase_now(seen));
      t.solver_ms.push_back(static_cast<float>(times.solver_ms()));
      t.tick_ms.push_back(static_cast<float>(tick_ms));
      if (picture && n++ % kPictureEvery == 0) t.picture_ms.push_back(static_cast<float>(picture(seen)));
      return true;
    };
    SessionOptions options;
    options.threads = threads;
    const RunResult run = run_session(scene, options, own);
    table.particles = run.particles;
    table.threads = run.threads;
    if (run.interrupted) {
      table.interrupted = true;
      break;
    }
    ++table.executions;
    table.sewn += run.expectations_hold();
    for (Ticks& t : ticks) {
      PhaseCost& cost = of_phase(table.phase, t.phase);
      cost.solver_ms.push_back(percentiles_of(std::move(t.solver_ms)).median);
      cost.frame_ms.push_back(percentiles_of(std::move(t.tick_ms)).median + percentiles_of(std::move(t.picture_ms)).median);
    }
  }
  return table;
}

std::string paper_markdown(const PaperTable& table) {
  std::string text = fmt::format(
      "{}: {} particles, preset {}, {} substeps {:g} times a second, {} thread{}; {} of {} executions completed\n\n",
      table.technique, table.particles, table.preset, table.substeps, table.tick_rate, table.threads,
      table.threads == 1 ? "" : "s", table.sewn, table.executions);
  text += "| phase            |          FPS | paper |     frame ms | paper |    solver ms | paper | solver: paper / ours |\n";
  text += "|------------------|-------------:|------:|-------------:|------:|-------------:|------:|---------------------:|\n";
  for (const PhaseCost& p : table.phase) {
    const MeanAndDeviation fps = over(rates(p.frame_ms)), frame = over(p.frame_ms), solver = over(p.solver_ms);
    const PaperFigure* f = paper_figure(table.technique, p.phase);
    const auto theirs = [&](double v) { return f ? fmt::format("{:.1f}", v) : std::string(); };
    text +=
        fmt::format("| {:<16} | {:6.0f} ± {:3.0f} | {:>5} | {:5.2f} ± {:4.2f} | {:>5} | {:5.2f} ± {:4.2f} | {:>5} | {:>20} |\n",
                    p.phase, fps.mean, fps.deviation, theirs(f ? f->fps : 0), frame.mean, frame.deviation,
                    theirs(f ? f->render_ms : 0), solver.mean, solver.deviation, theirs(f ? f->solver_ms : 0),
                    f && solver.mean > 0 ? fmt::format("{:.1f}", f->solver_ms / solver.mean) : "");
  }
  return text + "\n";
}

std::string paper_csv_header() {
  return "technique,preset,threads,phase,executions,fps,fps_deviation,frame_ms,frame_ms_deviation,solver_ms,"
         "solver_ms_deviation,paper_fps,paper_render_ms,paper_solver_ms\n";
}

std::string paper_csv(const PaperTable& table) {
  std::string text;
  for (const PhaseCost& p : table.phase) {
    const MeanAndDeviation fps = over(rates(p.frame_ms)), frame = over(p.frame_ms), solver = over(p.solver_ms);
    text += fmt::format("{},{},{},{},{},{:.1f},{:.1f},{:.3f},{:.3f},{:.3f},{:.3f}", table.technique, table.preset,
                        table.threads, p.phase, p.solver_ms.size(), fps.mean, fps.deviation, frame.mean, frame.deviation,
                        solver.mean, solver.deviation);
    if (const PaperFigure* f = paper_figure(table.technique, p.phase))
      text += fmt::format(",{:.2f},{:.2f},{:.2f}\n", f->fps, f->render_ms, f->solver_ms);
    else text += ",,,\n";
  }
  return text;
}

}  // namespace catgut
