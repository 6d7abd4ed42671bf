// SPDX-License-Identifier: Apache-2.0
// runtime: a run's result as JSON (the contract of `catgut run --json`) and as lines to read.
#pragma once
#include <string>

#include "procedure/manager.h"
#include "runtime/live.h"
#include "runtime/session.h"

namespace catgut {

std::string run_json(const RunResult& result);  // an object, indented, with a final newline
std::string replay_json(const ReplayResult& result, const Recording& recording);
// Results of a session: counts, every bite [mm], thread tension over time, events. Null: unknown.
std::string session_json(const SceneSpec& scene, const LiveResult& result);
// The same object with "procedure": stages, errors and feedback.
std::string with_procedure(const std::string& json, const Procedure& procedure, const ProcedureRun& run);
// Lines for a terminal. judged: a violated expectation is FAILED, else it only differs.
std::string run_summary(const RunResult& result, bool judged = true);
std::string stage_table(const RunResult& result);  // median and 99th percentile of every stage [ms per tick]

}  // namespace catgut
