// SPDX-License-Identifier: Apache-2.0
// procedure: the measures that goals, guards, hints and errors of a procedure refer to by name. Each is a number read from the
// Snapshot or counted by the manager from events. docs/procedures.md lists them all; tests/procedure compares.
#pragma once
#include <string>
#include <vector>

#include "exchange/snapshot.h"
#include "procedure/procedure.h"

namespace catgut {

struct ProcedureRun;

struct Measure {
  std::string name, unit, meaning;
  double (*value)(const Snapshot& seen, const ProcedureRun& run) = nullptr;  // null: number of
  EventKind event = EventKind::count_;                                       // these events in the stage, of
  Fault fault = Fault::none;                                                 // this fault
};
const std::vector<Measure>& measures();
std::string measures_text();  // `catgut describe procedure`
double measured(uint32_t measure, const Snapshot& seen, const ProcedureRun& run);

bool hold(const Conditions& conditions, const Snapshot& seen, const ProcedureRun& run);
// "tail_mm 62 (at most 100)"
std::string condition_text(const Condition& condition, double value);

}  // namespace catgut
