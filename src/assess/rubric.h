// SPDX-License-Identifier: Apache-2.0
// assess: rubrics, the marking schemes of educators, as TOML files. A rubric gives points for bands of metrics and says why
// each point was lost. docs/assessment.md is the manual.
#pragma once
#include <string>
#include <vector>

#include "assess/result.h"

namespace catgut::assess {

struct Band {
  double low = -1e300, high = 1e300;
  bool holds(double v) const { return v >= low && v <= high; }
};

struct RubricItem {
  std::string key, title, metric;
  std::string stage;  // of the operation, for sums by stage; empty: none
  double weight = 1;  // points
  Band full, half;    // all, or half of the points; beyond: none. half contains full
  bool has_critical = false;
  Band critical;           // outside it the session fails; also where a required item was not observed
  bool each = true;        // every sample is judged, and has its share of the points; else the summary
  double pass = 0.5;       // part of the points that the item needs, where every item must pass
  bool required = true;    // without an observation the points are lost; else the item does not count
  bool validated = false;  // a study with people supports the band
  std::string source;
  std::string why;  // for the learner: what is wrong with a value outside the band
};

// The whole task, in completed work. A session that did a part of it earns that part of every item's points. 0: not counted.
struct WholeTask {
  double bites = 0, throws = 0;  // completed and locked
  double cuts = 0;               // of a tied suture's thread
  double closure = 0;            // of the opening, 0..1
  double cut = 0;                // [mm] of the rim
};

struct Rubric {
  std::string name, title, technique, version;
  uint64_t hash = 0;  // of the file
  double pass = 70;   // [%] of the points
  bool every_item = false;
  bool needs_stitch = true;  // a session without a completed bite and without a throw has no points
  WholeTask whole;
  std::vector<RubricItem> item;
};

// name_or_path: "stay" (from the rubrics folder) or the path of a .toml file. Throws InputError: file:line, fault, remedy.
Rubric read_rubric(const std::string& name_or_path);
Rubric parse_rubric(const std::string& text, const std::string& filename);
std::string rubrics_folder();             // empty: not found
std::vector<std::string> rubric_names();  // sorted
// The rubric of a technique; empty: there is none.
std::string rubric_for(const std::string& technique);

// Part of the task that was done, 0..1, with the reason of a part: "1 of 2 bites, 0 of 2 throws". 1: none is stated.
double completed(const WholeTask& whole, const Result& result, std::string* reason = nullptr);

Score mark(const Rubric& rubric, const Result& result);

// Lines for a terminal: the score, every item, and the lost points with their moments.
std::string score_text(const Score& score);

}  // namespace catgut::assess
