// SPDX-License-Identifier: Apache-2.0
// procedure: carries out a procedure: fed with the Snapshot of every tick, it finds the current stage, its errors and its
// quality. Pure and deterministic: the same Snapshots give the same ProcedureRun, in a tutorial, an exam, a run of the scripted
// surgeon or a replay. A ProcedureRun is plain data: copied to undo, saved and loaded (save_run).
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "exchange/snapshot.h"
#include "procedure/procedure.h"

namespace catgut {

enum class StageState : uint8_t {
  waiting,
  active,
  done,
  met,      // its goal held already when it began
  skipped,  // its skip conditions held before its goal
};

struct StageRecord {
  StageState state = StageState::waiting;
  bool ready = false;         // the guard has held
  bool assisted = false;      // it was demonstrated
  uint64_t from = 0, to = 0;  // [ticks] begin and end
  uint32_t errors = 0;
  std::vector<double> good;  // values of ProcedureStage::good at the end
};

struct ErrorNote {
  uint64_t tick = 0;
  uint32_t stage = 0;
  uint32_t error = 0;  // of Procedure::error; its size: the stage was skipped
};

struct ProcedureRun {
  bool begun = false;
  uint32_t stage = 0;  // the active one; number of stages: finished
  std::vector<StageRecord> record;
  std::vector<ErrorNote> error;
  double tick_s = 1.0 / 60;  // [s]
  // For the measures: events of this stage and of the run, extremes and paths in this stage.
  std::array<uint32_t, static_cast<size_t>(EventKind::count_)> events{};
  std::array<uint32_t, static_cast<size_t>(Fault::count_)> faults{};
  uint32_t bites = 0, throws = 0;                         // completed and locked, those present at the begin included
  float peak_force = 0;                                   // [N] on a hand
  float peak_tension = 0;                                 // [N] in the thread
  float path = 0;                                         // [m] of both tips
  float bite_length = 0, bite_depth = 0, bite_angle = 0;  // [m], [m], [rad] of the last one
  float opening_start = 0;                                // [m^2]
  std::array<Vec3, 2> tip{};                              // [m]
  std::vector<uint8_t> raised;                            // per error: its conditions hold
};

// Before the first tick: from the present Snapshot, with the hands not connected yet. stage: the first one.
void begin_run(ProcedureRun& run, const Procedure& procedure, const Snapshot& seen, double tick_s, size_t stage = 0);
// After every tick. True: the stage has changed.
bool update_run(ProcedureRun& run, const Procedure& procedure, const Snapshot& seen);

bool finished(const ProcedureRun& run, const Procedure& procedure);
bool goal_reached(const ProcedureRun& run, const Procedure& procedure, const Snapshot& seen);  // of the active stage
// Hint of the active stage for the present state; empty: none.
std::string hint_of(const ProcedureRun& run, const Procedure& procedure, const Snapshot& seen);
// The guard of the active stage, as text, while it does not hold; empty: it does.
std::string guard_of(const ProcedureRun& run, const Procedure& procedure);
std::string error_text(const Procedure& procedure, const ErrorNote& note);

// Results, stage by stage: what was done well, what to repeat and why.
struct Feedback {
  uint32_t stage = 0;
  bool well = false;  // done, without errors and within its quality bounds
  std::string text;
};
std::vector<Feedback> feedback(const ProcedureRun& run, const Procedure& procedure);
// Lines for a terminal: each stage with state, time and errors, and what is missing.
std::string run_table(const ProcedureRun& run, const Procedure& procedure);
// Every goal reached, none skipped, no error.
bool faultless(const ProcedureRun& run, const Procedure& procedure);

std::vector<std::byte> save_run(const ProcedureRun& run);
// Throws InputError where the bytes do not belong to this procedure.
ProcedureRun load_run(const std::vector<std::byte>& bytes, const Procedure& procedure);

}  // namespace catgut
