// SPDX-License-Identifier: Apache-2.0
// bench/kernels: the solver's kernels one by one, on states from the middle of a small scene and of a large one.
// Compare the time per item (a cluster, a particle, a pair ...); a kernel that changes its input gets the same input
// every time.
//   bench_kernels --benchmark_filter=Shape --benchmark_repetitions=5
#include <benchmark/benchmark.h>
#include <time.h>

#include <functional>
#include <map>
#include <string>

#include "core/check.h"
#include "procedure/scene_file.h"
#include "runtime/session.h"
#include "sim/model.h"
#include "sim/simulation.h"
#include "sim/state.h"

namespace {
using namespace catgut;

// A scene in the middle of a suture: the state directly after entry of a needle's tip.
struct Sewn {
  std::shared_ptr<const Model> model;
  StatePtr state;
  Column<Vec4> predicted;  // predicted positions of the next substep
};

// bite: which one, counted from 1.
Sewn sew(const std::string& name, int bite) {
  const SceneSpec scene = read_scene(name);
  int entered = 0;
  bool done = false;
  std::vector<std::byte> bytes;
  SessionHooks hooks;
  hooks.on_tick = [&](const Snapshot& seen, const std::string&) {
    for (const Event& e : seen.event) entered += e.kind == EventKind::tip_entered;
    done = entered >= bite;
  };
  hooks.on_step = [&](const Model& model, const State& state, const TickInput&) {
    if (done) bytes = save_state(model, state);
  };
  hooks.on_cost = [&](const Snapshot&, const StageTimes&, double) { return !done; };
  run_session(scene, {}, hooks);
  if (!done) throw InputError(name, "the surgeon never came to bite " + std::to_string(bite), "choose an earlier one");
  Sewn s{build_model(scene), nullptr, {}};
  s.state = initial_state(*s.model);
  load_state(*s.model, *s.state, bytes);
  // One substep, so that candidates and other data of earlier stages exist.
  Jobs jobs(1);
  find_boxes(s.model->solver, s.state->solver, s.state->scratch, jobs, nullptr);
  find_candidates(s.model->solver, s.state->solver, s.state->scratch, 0.008f, nullptr);
  substep(s.model->solver, s.state->solver, s.state->scratch, jobs, nullptr);
  s.state->scratch.prev = s.predicted = s.state->solver.x;
  for (uint32_t i = 0; i < s.model->solver.count; ++i)
    if (s.model->solver.inv_mass[i] > 0) add(s.predicted[i], xyz(s.state->solver.v[i]) * s.model->solver.h);
  return s;
}

// 0: the purse-string in its sixth bite; 1: Lembert, in the bite of the third suture, with baked sutures behind it.
const char* const kName[] = {"purse_string", "lembert"};
Sewn& scene(int64_t which) {
  static std::map<int64_t, Sewn> all;
  const auto found = all.find(which);
  if (found != all.end()) return found->second;
  return all.emplace(which, sew(kName[which], which == 0 ? 6 : 5)).first->second;
}

// Processor time of this thread: other programs do not count. The call takes a third of a microsecond.
double thread_seconds() {
  timespec t;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

// Runs `work` after `again` has restored its input; only `work` is timed. items: per call.
void measure(benchmark::State& bench, size_t items, const char* scene_name, const std::function<void()>& again,
             const std::function<void()>& work) {
  if (items == 0) {
    bench.SkipWithError("there are none in this scene");
    return;
  }
  for (auto _ : bench) {
    again();
    const double start = thread_seconds();
    work();
    bench.SetIterationTime(thread_seconds() - start);
  }
  bench.SetLabel(std::string(scene_name) + ", " + std::to_string(items) + " items");
  bench.SetItemsProcessed(bench.iterations() * static_cast<int64_t>(items));
  bench.counters["per_item"] = benchmark::Counter(static_cast<double>(items),
                                                  benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

ContactView view_of(Sewn& s) {
  const SolverModel& m = s.model->solver;
  SolverState& state = s.state->solver;
  SolverScratch& k = s.state->scratch;
  return {state.x.data(), k.prev.data(), m.inv_mass.data(),     &m.body,        &state.body, &k.on_body, m.tissue,
          state.strand,   m.strand,      k.node_of_slot.data(), k.locked.data()};
}

void ShapeRows(benchmark::State& bench) {
  Sewn& s = scene(bench.range(0));
  const ShapeModel& m = s.model->solver.shape;
  measure(
      bench, m.groups, kName[bench.range(0)], [] {},
      [&] { make_shape_rows(m, s.state->solver.x.data(), s.state->scratch.shape, 0, m.groups); });
}
void ShapeClusters(benchmark::State& bench) {
  Sewn& s = scene(bench.range(0));
  const ShapeModel& m = s.model->solver.shape;
  make_shape_rows(m, s.state->solver.x.data(), s.state->scratch.shape, 0, m.groups);
  measure(
      bench, m.clusters, kName[bench.range(0)], [] {},
      [&] { solve_shape_clusters(m, s.state->solver.rotation, s.state->scratch.shape, 0, m.clusters); });
}
void ShapeParticles(benchmark::State& bench) {
  Sewn& s = scene(bench.range(0));
  const SolverModel& m = s.model->solver;
  measure(
      bench, m.tissue, kName[bench.range(0)], [&] { s.state->solver.x = s.predicted; },
      [&] {
        for (uint32_t first = 0; first < m.shape.groups; first += 32)  // like the substep, with blocks of the same length
          solve_shape_particles(m.shape, s.state->solver.x.data(), m.inv_mass.data(), m.shape_stiffness, m.shape_relaxation,
                                s.state->scratch.shape, first, std::min(first + 32, m.shape.groups), true);
      });
}
// Stages without a function of their own are timed by the substep itself, in wall time.
void StageOf(benchmark::State& bench, Stage stage) {
  Sewn& s = scene(bench.range(0));
  Jobs jobs(1);
  const SolverState before = s.state->solver;
  for (auto _ : bench) {
    s.state->solver = before;
    StageTimes times;
    substep(s.model->solver, s.state->solver, s.state->scratch, jobs, &times);
    bench.SetIterationTime(times.ms[static_cast<size_t>(stage)] / 1000);
  }
  s.state->solver = before;
  const double items = s.model->solver.count;
  bench.SetLabel(std::string(kName[bench.range(0)]) + ", " + std::to_string(s.model->solver.count) + " items");
  bench.SetItemsProcessed(bench.iterations() * static_cast<int64_t>(items));
  bench.counters["per_item"] =
      benchmark::Counter(items, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}
void PredictAndRows(benchmark::State& bench) { StageOf(bench, Stage::predict); }
void Velocity(benchmark::State& bench) { StageOf(bench, Stage::velocity); }

void ThreadSolve(benchmark::State& bench) {
  Sewn& s = scene(bench.range(0));
  const SolverModel& m = s.model->solver;
  SolverState& state = s.state->solver;
  SolverScratch& k = s.state->scratch;
  const Strand thread = state.strand[0];
  const std::vector<RigidBody> body = state.body;
  measure(
      bench, m.strand[0].count, kName[bench.range(0)],
      [&] {
        state.x = s.predicted, state.strand[0] = thread, state.body = body;
        std::fill(k.thread[0].lambda.begin(), k.thread[0].lambda.end(), 0.0f);
      },
      [&] {
        solve_thread(m.strand[0], state.strand[0], k.thread[0], state.x.data(), k.prev.data(), m.inv_mass.data(), m.body,
                     state.body, m.h);
      });
  state.strand[0] = thread, state.body = body;
}
void TissuePairsFound(benchmark::State& bench) {
  Sewn& s = scene(bench.range(0));
  const SolverModel& m = s.model->solver;
  Jobs jobs(1);
  measure(
      bench, m.tissue, kName[bench.range(0)], [] {},
      [&] {
        find_tissue_pairs(m.collision, s.state->solver.x.data(), s.state->solver.pair_origin,
                          s.state->scratch.candidates.tissue, jobs);
      });
}
// Whether they have to be searched again.
void TissueMovesLookedAt(benchmark::State& bench) {
  Sewn& s = scene(bench.range(0));
  const SolverModel& m = s.model->solver;
  measure(
      bench, m.tissue, kName[bench.range(0)], [] {},
      [&] { benchmark::DoNotOptimize(furthest_move(s.state->solver.x.data(), s.predicted.data(), m.tissue)); });
}
void TissuePairsSolved(benchmark::State& bench) {
  Sewn& s = scene(bench.range(0));
  const SolverModel& m = s.model->solver;
  Jobs jobs(1);
  PairSearch& search = s.state->scratch.candidates.tissue;
  find_tissue_pairs(m.collision, s.predicted.data(), s.state->solver.pair_origin, search, jobs);
  measure(
      bench, search.pair.size(), kName[bench.range(0)], [&] { s.state->solver.x = s.predicted; },
      [&] { solve_tissue_pairs(view_of(s), m.collision, search.pair, m.friction.tissue); });
}
void ToolAndThreadCandidates(benchmark::State& bench) {
  Sewn& s = scene(bench.range(0));
  Jobs jobs(1);
  measure(
      bench, s.model->solver.count, kName[bench.range(0)], [] {},
      [&] {
        find_boxes(s.model->solver, s.state->solver, s.state->scratch, jobs, nullptr);
        find_candidates(s.model->solver, s.state->solver, s.state->scratch, 0.008f, nullptr);
      });
}
void ToolsOnTissue(benchmark::State& bench) {
  Sewn& s = scene(bench.range(0));
  const SolverModel& m = s.model->solver;
  const std::vector<RigidBody> body = s.state->solver.body;
  Jobs jobs(1);
  find_boxes(m, s.state->solver, s.state->scratch, jobs, nullptr);
  find_candidates(m, s.state->solver, s.state->scratch, 0.008f, nullptr);
  measure(
      bench, s.state->scratch.candidates.tool.size(), kName[bench.range(0)],
      [&] { s.state->solver.x = s.predicted, s.state->solver.body = body; },
      [&] { solve_tools_on_tissue(view_of(s), m.collision, s.state->scratch.candidates.tool, m.friction.tool); });
  s.state->solver.body = body;
}
void Pins(benchmark::State& bench) {
  Sewn& s = scene(bench.range(0));
  const SolverModel& m = s.model->solver;
  SolverState& state = s.state->solver;
  SolverScratch& k = s.state->scratch;
  const std::vector<Tether> pin = state.pin;
  build_graph(state.pin, m.inv_mass.data(), m.tissue, k.web);
  measure(
      bench, pin.size() * static_cast<size_t>(m.pin_sweeps), kName[bench.range(0)],
      [&] { state.x = s.predicted, state.pin = pin; },
      [&] { solve_tethers(state.pin, k.web, state.x.data(), m.h, m.pin_sweeps, m.pin_tolerance, k.pin_span); });
  state.pin = pin;
}
void WholeSubstep(benchmark::State& bench) {
  Sewn& s = scene(bench.range(0));
  Jobs jobs(1);
  const SolverState before = s.state->solver;
  measure(
      bench, s.model->solver.count, kName[bench.range(0)], [&] { s.state->solver = before; },
      [&] { substep(s.model->solver, s.state->solver, s.state->scratch, jobs, nullptr); });
  s.state->solver = before;
}

// An empty stage of four blocks: the time to distribute it and to wait for it. On a busy machine workers wait long.
void ForkJoin(benchmark::State& bench) {
  Jobs jobs(static_cast<int>(bench.range(0)));
  for (auto _ : bench) jobs.each(4, 1, [](size_t first, size_t) { benchmark::DoNotOptimize(first); });
  bench.SetItemsProcessed(bench.iterations());
}

}  // namespace

#define CATGUT_KERNEL(f) BENCHMARK(f)->DenseRange(0, 1)->UseManualTime()->Unit(benchmark::kMicrosecond)
CATGUT_KERNEL(ShapeRows);
CATGUT_KERNEL(ShapeClusters);
CATGUT_KERNEL(ShapeParticles);
CATGUT_KERNEL(PredictAndRows);
CATGUT_KERNEL(Velocity);
CATGUT_KERNEL(ThreadSolve);
CATGUT_KERNEL(TissuePairsFound);
CATGUT_KERNEL(TissueMovesLookedAt);
CATGUT_KERNEL(TissuePairsSolved);
CATGUT_KERNEL(ToolAndThreadCandidates);
CATGUT_KERNEL(ToolsOnTissue);
BENCHMARK(Pins)->Arg(1)->UseManualTime()->Unit(benchmark::kMicrosecond);
CATGUT_KERNEL(WholeSubstep);
BENCHMARK(ForkJoin)->Arg(1)->Arg(2)->UseRealTime()->Unit(benchmark::kMicrosecond);
BENCHMARK_MAIN();
