// SPDX-License-Identifier: Apache-2.0
// procedure: what an educator writes, as data: the stages of a procedure with goal, guard, tray, hints and errors, over named
// measures of events and Snapshot. Read from procedures/NAME.toml (procedure/procedure_file), carried out by procedure/manager.
// The educator's page is docs/procedures.md.
#pragma once
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "exchange/event.h"
#include "surgeon/plan.h"

namespace catgut {

// One measure (procedure/measures) within bounds, inclusive.
struct Condition {
  uint32_t measure = 0;
  double min = -std::numeric_limits<double>::infinity(), max = std::numeric_limits<double>::infinity();
};
using Conditions = std::vector<Condition>;  // all of them

struct StageHint {
  Conditions when;  // the first hint whose conditions hold is shown
  std::string text;
};

// A task of the scripted surgeon's plan, by kind and number among those of its kind, from 1.
struct DemoTask {
  TaskKind kind = TaskKind::rest;
  size_t number = 1;
};

struct ProcedureStage {
  std::string name;         // unique: "bite", or "bite 3" for the third pass of a repeated stage
  std::string base;         // as written in the file
  std::string title, text;  // instruction in one sentence
  std::vector<StageHint> hint;
  Conditions goal;         // the stage is done
  Conditions guard;        // has to hold once before the goal counts; empty: none
  std::string guard_text;  // what is missing
  Conditions skip;         // the stage is left without its goal; empty: never
  std::string skip_text;   // why
  bool skip_is_error = false;
  Conditions good;                // quality, measured when the goal is reached
  std::vector<std::string> tray;  // kinds of instruments that the stage needs
  std::vector<DemoTask> demo;     // empty: no demonstration
  size_t demo_from = 0;           // index of the stage at whose start the demonstration begins
  std::string start;              // saved state (a recording without ticks); empty: made by the scripted surgeon
};

// What counts as an error: an event, or conditions that become true. Nothing is corrected.
struct StageError {
  std::string name, text, why;
  EventKind on = EventKind::count_;                             // every such event, of
  Fault fault = Fault::none;                                    // this fault, if any, with
  double value_min = -std::numeric_limits<double>::infinity();  // a value of at least this
  bool off_tray = false;                                        // and an instrument that the stage's tray does not name
  Conditions when;                                              // or: every time that these become true
  std::vector<uint8_t> in;                                      // per stage: whether it counts there
};

struct Procedure {
  std::string name, title, text, scene, technique;
  std::vector<ProcedureStage> stage;
  std::vector<StageError> error;
  std::vector<std::string> instrument;  // kinds of the scene's instruments, by index
  std::string where;                    // file:line of its demonstrations, for messages about the scene
};

}  // namespace catgut
