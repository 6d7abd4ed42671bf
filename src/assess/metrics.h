// SPDX-License-Identifier: Apache-2.0
// assess: the table of all metrics, and their values from Facts. The table is the manual: `catgut assess --metrics` and
// docs/assessment.md print it.
#pragma once
#include <span>
#include <string>
#include <string_view>

#include "assess/facts.h"
#include "assess/result.h"

namespace catgut::assess {

enum class Better { higher, lower, target };                     // target: a band of the rubric
enum class Summary { mean, spread, maximum, sum, count, only };  // of the samples; spread: standard deviation; only: one value
const char* better_name(Better better);
const char* summary_name(Summary summary);

struct MetricRow {
  const char* key;
  const char* name;
  const char* group;  // bite, needle, knot, line, cut, tissue, hands
  const char* unit;   // "" for counts and ratios
  Better better;
  Summary summary;
  const char* definition;  // of a sample
  const char* source;      // with DOI, or "Catgut" for our own definition
};
std::span<const MetricRow> metric_rows();
const MetricRow* find_metric(std::string_view key);  // null: none

// Everything but the head of the Result (names, version, hash), which the caller knows. seen: the last Snapshot.
Result measure(const Facts& facts, const PictureModel& picture, const Snapshot& seen);

// Of bites and knots only, which takes microseconds: for feedback after a stitch.
Result measure_stitches(const Facts& facts);

std::string metrics_markdown();  // the table of docs/assessment.md

}  // namespace catgut::assess
