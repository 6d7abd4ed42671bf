// runtime: a run's result as JSON (the contract of `catgut run --json`) and as lines to read.
#pragma once
#include <string>

#include "runtime/live.h"
#include "runtime/session.h"

namespace catgut {

std::string run_json(const RunResult& result);  // an object, indented, with a final newline
std::string replay_json(const ReplayResult& result, const Recording& recording);
// What somebody has sewn: counts, every stitch in millimetres, the thread's tension over time, events. Null: not known.
std::string practice_json(const SceneSpec& scene, const LiveResult& result);
std::string run_summary(const RunResult& result);  // a few lines for a terminal
std::string stage_table(const RunResult& result);  // median and 99th percentile of every stage [ms per tick]

}  // namespace catgut
