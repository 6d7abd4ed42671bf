// SPDX-License-Identifier: Apache-2.0
// runtime: studies: many surgeons, seeds, scenes and settings; one table out. Every finished run is a file of its own, so that
// a study is resumed where it stopped, and is divided over machines by a number (a Slurm array, a Dask map) without a
// scheduler.
#pragma once
#include <atomic>
#include <functional>
#include <string>
#include <vector>

namespace catgut {

struct StudySetting {
  std::string name;
  std::vector<std::string> set;  // as `--set`
  // 0..1: the abilities lie between those of the run's level and an expert's, and each setting has its own noise; -1: as drawn.
  double practice = -1;
};

struct StudyPlan {
  std::string title;
  std::vector<std::string> scene, surgeon;  // surgeon: as `catgut run --surgeon`
  std::vector<StudySetting> setting;        // at least one
  uint64_t first_seed = 1, last_seed = 1;
  std::string rubric;  // empty: that of the technique
  double seconds = 0;  // [s] simulated; 0: the scene's duration
  bool keep = false;   // keep the recordings
};

// Throws InputError: file:line, fault, remedy.
StudyPlan read_study(const std::string& path);
StudyPlan parse_study(const std::string& text, const std::string& filename);

struct StudyRun {
  size_t number = 0;  // from 0, in the order scene, setting, surgeon, seed
  std::string scene, surgeon, setting;
  uint64_t seed = 0;
};
std::vector<StudyRun> runs_of(const StudyPlan& plan);

struct StudyOptions {
  std::string folder;        // of the runs' files
  size_t index = 0, of = 1;  // this process does runs with number % of == index
  int jobs = 1;              // runs at a time, one thread each
  const std::atomic<bool>* stop = nullptr;
  std::function<void(const StudyRun&, size_t done, size_t all, const std::string& what)> on_run;
};

struct StudyOutcome {
  size_t made = 0, kept = 0, missing = 0;  // now; already there; still missing (also those of other processes)
  std::vector<std::string> failed;         // run and reason
};
// Makes the missing runs. A file of a run whose inputs have changed (scene, version, rubric) is made again.
StudyOutcome make_runs(const StudyPlan& plan, const StudyOptions& options);

// All finished runs as one CSV with a heading, in the order of their numbers.
std::string study_table(const StudyPlan& plan, const std::string& folder);

// Area under the ROC curve: the probability that a value of `a` is smaller than one of `b`, ties counting half. NaN values are
// left out; not a number where a side is empty.
double area_under_curve(const std::vector<double>& a, const std::vector<double>& b);

// For each scene: the AUC of the score and of every metric between the first and the last surgeon of the plan, and medians of
// all, as Markdown. 0.5 useless, 1 perfect; "against": it separates against the metric's stated direction, and is not counted.
std::string study_report(const StudyPlan& plan, const std::string& folder);

}  // namespace catgut
