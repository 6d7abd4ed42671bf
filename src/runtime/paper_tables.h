// SPDX-License-Identifier: Apache-2.0
// runtime: the paper's tables 1 to 4 with Catgut's figures beside its own. Time per tick at rest, while suturing, while tying
// knots, and after completion (sections 3.1 to 3.4). The scripted surgeon performs the technique a few times, each with
// another seed.
#pragma once
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "procedure/manager.h"
#include "runtime/session.h"

namespace catgut {

// The paper's phase of a tick. "Start" ends when the hands connect. Then "During suturing", and
// "During looping" from the first loop round a tool to the end of its knot (the next bite or needle, or the end of the work).
// "After completion" when the surgeon is done. With `numbered` (Lembert) every suture has its own: "Suture #2", "Loop #2".
class PaperPhase {
 public:
  explicit PaperPhase(bool numbered) : numbered_(numbered) {}
  // events: of the tick. settled: the hands are connected. done: the surgeon has finished.
  std::string operator()(std::span<const Event> events, bool settled, bool done);

 private:
  bool numbered_, looping_ = false;
  int suture_ = 1;
};

struct PhaseCost {
  std::string phase;
  // One per execution: medians over the ticks of the phase [ms]. frame: surgeon, tick and picture in sequence.
  std::vector<double> solver_ms, frame_ms;
};

struct PaperTable {
  std::string technique, preset;
  size_t particles = 0;
  int threads = 1, substeps = 0;
  double tick_rate = 0;  // [1/s]
  int executions = 0;    // that were run to their end
  int sewn = 0;          // of these, with all expected results
  bool pictures = false;
  bool interrupted = false;
  std::vector<PhaseCost> phase;  // in order of appearance
};

// procedure: its stages by name are the phases after "Start", instead of those of a technique; null: a technique.
// picture_ms: called at the start of an execution, returns a function that renders a snapshot and returns the time [ms], called
// every fourth tick. If empty, frames are not measured. Throws InputError (a scene without a script for its technique).
using PictureCost = std::function<double(const Snapshot&)>;
PaperTable measure_paper(SceneSpec scene, int executions, int threads,
                         const std::function<PictureCost(const PictureModel&)>& picture_ms, const SessionHooks& hooks = {},
                         const Procedure* procedure = nullptr);

// As Markdown: a row for each phase; mean and standard deviation over the executions, the paper's figure beside them.
std::string paper_markdown(const PaperTable& table);
std::string paper_csv_header();  // with a final newline
std::string paper_csv(const PaperTable& table);

}  // namespace catgut
