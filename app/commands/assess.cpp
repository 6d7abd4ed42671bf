// SPDX-License-Identifier: Apache-2.0
// app: `catgut assess RECORDING`: measures a recorded session and scores it by a rubric.
#include <cstdio>
#include <memory>

#include "commands/commands.h"
#include "core/check.h"
#include "core/file.h"
#include "procedure/scene_file.h"
#include "runtime/assessment.h"

namespace catgut {
namespace {

struct AssessOptions {
  std::string file, rubric, json, csv;
  int threads = 1, repeat = 1;
  bool metrics = false;
};

int assess_command(const AssessOptions& o) {
  if (o.metrics) {
    std::fputs(assess::metrics_markdown().c_str(), stdout);
    return 0;
  }
  if (o.file.empty()) {
    if (o.rubric.empty()) throw InputError("assess", "no recording was given", "give a .cgrec file, or --metrics");
    const assess::Rubric rubric = assess::read_rubric(o.rubric);  // checks it
    std::printf("%s, version %s: %zu items, no fault found\n", rubric.title.c_str(), rubric.version.c_str(),
                rubric.item.size());
    return 0;
  }
  check_suffix(o.json, ".json", "--json");
  check_suffix(o.csv, ".csv", "--csv");
  const Recording recording = read_recording(o.file);
  check_replayable(recording, o.file);
  const auto rubrics = rubrics_for(o.rubric, parse_scene(recording.header.scene, o.file));
  for (const std::string& path : {o.json, o.csv}) prepare_output(path);
  SessionHooks hooks;
  hooks.stop = &stop_on_interrupt();
  hooks.on_progress = progress_line();
  const assess::Result result = assess_recording(recording, o.file, o.threads, rubrics, hooks);
  end_progress_line();
  if (stop_on_interrupt()) return 130;
  const std::string json = assess::result_json(result);
  if (!o.json.empty()) write_output(o.json, json);
  if (!o.csv.empty()) write_output(o.csv, assess::result_csv(result));
  if (o.json != "-" && o.csv != "-") {
    for (const assess::Score& score : result.score) std::fputs(assess::score_text(score).c_str(), stdout);
    if (result.score.empty()) std::printf("no rubric for this technique: give --rubric NAME, or --csv - for the metrics\n");
  }
  for (int k = 1; k < o.repeat; ++k) {
    const bool same = assess::result_json(assess_recording(recording, o.file, o.threads, rubrics, hooks)) == json;
    end_progress_line();
    if (stop_on_interrupt()) return 130;
    if (!same) {
      std::fprintf(stderr, "catgut: %s: assessment %d differs from the first\n", o.file.c_str(), k + 1);
      return 1;
    }
  }
  if (o.repeat > 1 && o.json != "-" && o.csv != "-")
    std::printf("test-retest: %d assessments, identical to the bit\n", o.repeat);
  if (recording.truncated)
    throw InputError(o.file, "truncated recording: " + recording.fault, "the ticks it holds were assessed");
  return 0;
}

}  // namespace

void add_assess(CLI::App& app, int& exit_code) {
  auto o = std::make_shared<AssessOptions>();
  CLI::App* command = app.add_subcommand("assess", "measure and score a recorded session");
  command->add_option("file", o->file, "recording to assess; without one, --rubric is only checked")->type_name("FILE.cgrec");
  command->add_option("--rubric", o->rubric, "name from rubrics/ or path of a .toml file; default: that of the technique")
      ->type_name("NAME|FILE");
  command->add_option("--json", o->json, "metrics, score and reasons as JSON; -: standard output")->type_name("FILE|-");
  command->add_option("--csv", o->csv, "metrics as CSV; -: standard output")->type_name("FILE|-");
  command->add_option("--repeat", o->repeat, "assess this often and compare the results to the bit")
      ->check(CLI::Range(1, 1000));
  command->add_flag("--metrics", o->metrics, "print the table of all metrics");
  add_threads_option(*command, o->threads);
  command->callback([o, &exit_code] { exit_code = assess_command(*o); });
}

}  // namespace catgut
