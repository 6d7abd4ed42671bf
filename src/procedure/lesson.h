// SPDX-License-Identifier: Apache-2.0
// procedure: a lesson: a beginner's tasks step by step, and when each step is done. Data and pure
// functions: reads Snapshots and events; the caller that shows the lesson keeps the number of the step.
#pragma once
#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "exchange/snapshot.h"

namespace catgut {

// Observable goal of a step.
enum class LessonGoal : uint8_t {
  needle_in_holder,  // and not in tissue
  bites,             // amount: complete
  tail,              // amount: [m] of thread left before the first bite, or less; the needle out of the tissue
  closed,            // the two edges are approximated
  wound,             // thread is wrapped round a tool
  tail_through,      // the tail was pulled through the loop: a throw has started
  throws             // amount: locked
};

struct LessonStep {
  std::string name;               // one word or two, for files and tests
  std::string title, text, hint;  // instruction in one sentence; how to do it with mouse and keyboard
  LessonGoal goal = LessonGoal::bites;
  float amount = 0;
  std::vector<size_t> shown_by;  // tasks of the surgeon's plan that demonstrate it
  size_t shown_from = 0;         // the step at whose start they begin
};

struct Lesson {
  std::string scene, title;
  std::vector<LessonStep> step;
};

// From the needle on the drape to the first tied stitch, in the stay scene.
const Lesson& first_stitch();

// Whether a step is done, given the events since the last picture: shorter actions are detected by their events.
bool step_done(const LessonStep& step, const Snapshot& seen, std::span<const Event> happened);

// The current step of a user who was at `now`. Steps whose goals are met are done. So are all before one that is met
// and cannot be met by chance (a bite, a throw). lesson.step.size(): all done.
size_t next_step(const Lesson& lesson, size_t now, const Snapshot& seen, std::span<const Event> happened);

// After an undone bite, or a restart: the first step that is not done in the current state.
size_t step_from(const Lesson& lesson, const Snapshot& seen);

}  // namespace catgut
