// SPDX-License-Identifier: Apache-2.0
// app: `catgut study PLAN.toml`: many surgeons, seeds, scenes and settings; one table out.
#include <cstdio>
#include <filesystem>
#include <memory>

#include "commands/commands.h"
#include "core/check.h"
#include "core/file.h"
#include "runtime/study.h"

namespace catgut {
namespace {

struct StudyCommand {
  std::string plan, folder, out, report;
  size_t index = 0, of = 1;
  int jobs = 1;
  bool count = false;
};

int study(const StudyCommand& c) {
  const StudyPlan plan = read_study(c.plan);
  if (c.count) {
    std::printf("%zu\n", runs_of(plan).size());
    return 0;
  }
  if (c.index >= c.of)
    throw InputError("--index", "it must be below --of", "Slurm: --array=0-39, --index $SLURM_ARRAY_TASK_ID --of 40");
  check_suffix(c.out, ".csv", "--out");
  check_suffix(c.report, ".md", "--report");
  StudyOptions o;
  o.folder = c.folder.empty() ? std::filesystem::path(c.plan).stem().string() + ".runs" : c.folder;
  o.index = c.index, o.of = c.of, o.jobs = c.jobs;
  o.stop = &stop_on_interrupt();
  o.on_run = [](const StudyRun& run, size_t done, size_t all, const std::string& what) {
    if (what == "kept") return;
    std::fprintf(stderr, "%zu of %zu  %s, %s, %s, seed %llu: %s\n", done, all, run.scene.c_str(), run.setting.c_str(),
                 run.surgeon.c_str(), static_cast<unsigned long long>(run.seed), what.c_str());
  };
  const StudyOutcome outcome = make_runs(plan, o);
  for (const std::string& f : outcome.failed) std::fprintf(stderr, "catgut: %s\n", f.c_str());
  if (o.stop->load()) {
    std::fprintf(stderr, "catgut: interrupted; the same command resumes\n");
    return 130;
  }
  if (!c.out.empty()) write_output(c.out, study_table(plan, o.folder));
  if (!c.report.empty()) write_output(c.report, study_report(plan, o.folder));
  if (c.out != "-" && c.report != "-")
    std::printf("%zu runs made, %zu kept, %zu failed, %zu still missing\n", outcome.made, outcome.kept, outcome.failed.size(),
                outcome.missing);
  return outcome.failed.empty() ? 0 : 1;
}

}  // namespace

void add_study(CLI::App& app, int& exit_code) {
  auto c = std::make_shared<StudyCommand>();
  CLI::App* command = app.add_subcommand("study", "many surgeons, seeds, scenes and settings; one table out");
  command->add_option("plan", c->plan, "the study")->required()->type_name("FILE.toml");
  command->add_option("--runs", c->folder, "folder of the finished runs; the same folder resumes; default: NAME.runs")
      ->type_name("DIR");
  command->add_option("--out", c->out, "table of all finished runs; -: standard output")->type_name("FILE.csv|-");
  command->add_option("--report", c->report, "AUC and medians of all metrics; -: standard output")->type_name("FILE.md|-");
  command->add_option("--jobs", c->jobs, "runs at a time, one thread each")->check(CLI::Range(1, 1024))->capture_default_str();
  command->add_option("--index", c->index, "this process does every run whose number modulo --of is this")
      ->capture_default_str();
  command->add_option("--of", c->of, "number of processes")->check(CLI::Range(1, 1000000))->capture_default_str();
  command->add_flag("--count", c->count, "print the number of runs");
  command->callback([c, &exit_code] { exit_code = study(*c); });
}

}  // namespace catgut
