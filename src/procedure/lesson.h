// SPDX-License-Identifier: Apache-2.0
// procedure: a lesson: what a user who has never sutured does first, step by step, and when each step is done. Data and pure
// functions: reads Snapshots and events; a caller that shows the lesson keeps the number of the step.
#pragma once
#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "exchange/snapshot.h"

namespace catgut {

// What can be seen of the work when a step is done.
enum class LessonGoal : uint8_t {
  needle_in_holder,  // and in nothing else
  bites,             // amount: complete
  tail,              // amount: [m] of thread left before the first bite, or less; the needle out of the tissue
  closed,            // the two edges have been drawn together
  wound,             // thread lies round a tool
  tail_through,      // the tail was taken through the loop: a throw has begun
  throws             // amount: locked
};

struct LessonStep {
  std::string name;               // one word or two, for files and tests
  std::string title, text, hint;  // what to do; in one sentence; how, on mouse and keyboard
  LessonGoal goal = LessonGoal::bites;
  float amount = 0;
  std::vector<size_t> shown_by;  // tasks of the surgeon's plan that demonstrate it
  size_t shown_from = 0;         // the step from whose beginning they do
};

struct Lesson {
  std::string scene, title;
  std::vector<LessonStep> step;
};

// From the needle on the drape to a first tied stitch, in the stay scene.
const Lesson& first_stitch();

// Whether a step is done, with what happened since the last picture: what lasts less than that is known by its event.
bool step_done(const LessonStep& step, const Snapshot& seen, std::span<const Event> happened);

// The step that a user is at who was at `now`: steps whose goals are met are behind them; so are all before one that is met
// and cannot be met by chance (a bite, a throw). lesson.step.size(): all done.
size_t next_step(const Lesson& lesson, size_t now, const Snapshot& seen, std::span<const Event> happened);

// After a bite was undone, or a beginning again: the first step that is not behind what is seen.
size_t step_from(const Lesson& lesson, const Snapshot& seen);

}  // namespace catgut
