// SPDX-License-Identifier: Apache-2.0
// app: `catgut bench scale`: scaling with particle count (1, 4, 16 times) and thread count. The paper's
// substeps and sweeps unless --set says otherwise; every feature is on, and the scripted surgeon starts to work.
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "commands/commands.h"
#include "core/file.h"
#include "procedure/scene_file.h"
#include "runtime/report.h"
#include "technique/technique.h"

namespace catgut {
namespace {

struct Measured {
  int times = 1, threads = 1;
  RunResult run;
};

RunResult run_once(const SceneSpec& scene, int threads, double seconds, const SessionHooks& hooks) {
  SessionOptions session;
  session.threads = threads;
  session.seconds = seconds;
  session.surgeon = scene.technique.name == kNoTechnique ? "none" : "scripted";
  return run_session(scene, session, hooks);
}

std::string json_text(const std::string& scene, const std::vector<Measured>& all) {
  nlohmann::ordered_json j;
  j["scene"] = scene;
  j["machine"] = this_machine();
  for (const Measured& m : all) {
    nlohmann::ordered_json row = {{"times", m.times}};
    row.update(nlohmann::ordered_json::parse(run_json(m.run)));
    j["runs"].push_back(std::move(row));
  }
  return j.dump(2) + "\n";
}

// The three most expensive stages.
std::string most_expensive(const RunResult& run) {
  std::vector<size_t> stage(kStages);
  for (size_t s = 0; s < kStages; ++s) stage[s] = s;
  std::sort(stage.begin(), stage.end(), [&](size_t a, size_t b) { return run.stage_ms[a].median > run.stage_ms[b].median; });
  std::string out;
  for (size_t k = 0; k < 3; ++k)
    out +=
        fmt::format("{}{} {:.2f}", k == 0 ? "" : ", ", stage_name(static_cast<Stage>(stage[k])), run.stage_ms[stage[k]].median);
  return out;
}

}  // namespace

int bench_scale(const ScaleOptions& o) {
  SceneSpec scene = read_scene(o.scene);
  set_value(scene, "solver.preset=paper");
  for (const std::string& setting : o.set) set_value(scene, setting);
  check_suffix(o.json, ".json", "--json");
  prepare_output(o.json);
  SessionHooks hooks;
  hooks.stop = &stop_on_interrupt();
  hooks.on_progress = progress_line();
  std::vector<int> threads{1};
  if (o.threads > 1) threads.push_back(o.threads);
  std::vector<Measured> all;
  for (const int times : {1, 4, 16}) {
    SceneSpec larger = scene;
    for (BodySpec& body : larger.body) body.particles *= times;
    std::vector<Measured> row;
    for (const int t : threads) row.push_back({times, t, {}});
    for (int i = 0; i < o.repeat && !hooks.stop->load(); ++i)
      for (Measured& m : row) {  // alternating, so that interference affects both
        RunResult run = run_once(larger, m.threads, o.seconds, hooks);
        if (!run.interrupted && (m.run.ticks == 0 || run.solver_ms.median < m.run.solver_ms.median)) m.run = std::move(run);
      }
    if (hooks.stop->load()) break;
    if (row.size() > 1 && row[0].run.state_hash != row[1].run.state_hash) {
      end_progress_line();
      std::fprintf(
          stderr,
          "catgut: bench scale: one and %d threads gave different states; this is a defect in Catgut, please report it\n",
          o.threads);
      return 1;
    }
    all.insert(all.end(), row.begin(), row.end());
  }
  end_progress_line();
  if (!o.json.empty()) write_output(o.json, json_text(scene.name, all));
  if (o.json != "-") {
    std::printf("%s, preset %s, %g s simulated, best of %d; %s\n\n", scene.name.c_str(), scene.solver.preset.c_str(), o.seconds,
                o.repeat, this_machine().c_str());
    std::printf(
        "| particles | threads | solver ms: median | 99 %% | maximum | us per particle | speedup | most expensive stages [ms] "
        "|\n"
        "|---|---|---|---|---|---|---|---|\n");
    double one = 0;
    for (const Measured& m : all) {
      const Percentiles& s = m.run.solver_ms;
      if (m.threads == 1) one = s.median;
      std::printf("| %zu | %d | %.3f | %.3f | %.3f | %.3f | %.2f | %s |\n", m.run.particles, m.threads, s.median, s.p99, s.max,
                  1000 * s.median / static_cast<double>(m.run.particles), one / s.median, most_expensive(m.run).c_str());
    }
  }
  return hooks.stop->load() ? 130 : 0;
}

}  // namespace catgut
