// SPDX-License-Identifier: Apache-2.0
// procedure: see lesson.h.
#include "procedure/lesson.h"

#include <algorithm>

#include "exchange/strand.h"

namespace catgut {
namespace {

constexpr float kClosed = 0.98f;  // progress of a seam that counts as approximated

uint32_t complete_bites(const Snapshot& seen) {
  return static_cast<uint32_t>(
      std::count_if(seen.active().bite.begin(), seen.active().bite.end(), [](const BiteView& b) { return b.complete; }));
}

bool happens(std::span<const Event> happened, EventKind kind) {
  return std::any_of(happened.begin(), happened.end(), [&](const Event& e) { return e.kind == kind; });
}

// Goals that stay met, and that cannot be met without the steps before.
bool lasts(LessonGoal goal) { return goal == LessonGoal::bites || goal == LessonGoal::closed || goal == LessonGoal::throws; }

}  // namespace

const Lesson& first_stitch() {
  static const Lesson kLesson{
      "stay",
      "A first stitch",
      {{"take",
        "Grasp the needle",
        "Move the needle holder to the needle and close the jaws.",
        "Move the mouse until the needle holder snaps to the needle, then click.",
        LessonGoal::needle_in_holder,
        0,
        {0},
        0},
       {"first bite",
        "Bite the left bowel end",
        "Drive the needle through the ring on the left bowel end. Pull it out with the forceps.",
        "Right button, mouse to the right: drive. Tab, point at the tip, click. Tab, click to release. Tab, pull through.",
        LessonGoal::bites,
        1,
        {1},
        1},
       {"hand back",
        "Return the needle",
        "Grasp the needle with the needle holder, then release the forceps.",
        "Lift the forceps. Tab, point at the needle, click. Tab, click to open the forceps.",
        LessonGoal::needle_in_holder,
        0,
        {2},
        2},
       {"second bite",
        "Bite the right bowel end",
        "Repeat the bite at the ring on the right bowel end.",
        "Right button: drive. Grasp the tip with the forceps, release the needle holder, pull through.",
        LessonGoal::bites,
        2,
        {3},
        3},
       {"pull",
        "Pull the thread",
        "Lift the needle with the forceps until both ends are equally long.",
        "Move the forceps up and away slowly.",
        LessonGoal::tail,
        0.1f,
        {4},
        4},
       {"approximate",
        "Approximate the bowel ends",
        "Grasp the tail with the needle holder and pull both ends apart.",
        "Tab to the needle holder, point at the tail, click. Hold W and move the mouse to the right.",
        LessonGoal::closed,
        0,
        {5},
        5},
       {"wrap",
        "Wrap the needle holder",
        "Release the tail. Wrap the suture around the needle holder with the forceps.",
        "Click to open the needle holder. Hold W and move the mouse to the right until a wrap forms.",
        LessonGoal::wound,
        0,
        {6, 7},
        6},
       {"through the loop",
        "Grasp the tail",
        "Grasp the tail with the wrapped needle holder.",
        "Release W, point at the tail, click.",
        LessonGoal::tail_through,
        0,
        {6, 7},
        6},
       {"lock",
        "Lay down the throw",
        "Pull both ends apart, low and evenly, until the throw lies on the tissue.",
        "Hold W and move the mouse to the right.",
        LessonGoal::throws,
        1,
        {6, 7},
        6},
       {"second throw",
        "Add the opposite throw",
        "Wrap in the opposite direction: two opposite throws make a square knot.",
        "Release the tail. Hold W, move left; grasp the tail; hold W, move right.",
        LessonGoal::throws,
        2,
        {6, 8},
        9}}};
  return kLesson;
}

bool step_done(const LessonStep& step, const Snapshot& seen, std::span<const Event> happened) {
  switch (step.goal) {
    case LessonGoal::needle_in_holder:
      return seen.tool[0].held == Held::needle && seen.tool[1].held != Held::needle;
    case LessonGoal::bites:
      return static_cast<float>(complete_bites(seen)) >= step.amount && !seen.active().needle.in_tissue;
    case LessonGoal::tail:
      return complete_bites(seen) > 0 && !seen.active().needle.in_tissue && !seen.active().suture_point.empty() &&
             length_between(seen, 0, first_point_node(seen)) <= step.amount;
    case LessonGoal::closed:
      return std::any_of(seen.active().seam.begin(), seen.active().seam.end(), [](const SeamView& s) { return s.midpoint; }) &&
             std::all_of(seen.active().seam.begin(), seen.active().seam.end(),
                         [](const SeamView& s) { return !s.midpoint || s.progress >= kClosed; });
    case LessonGoal::wound:
      return seen.tool[0].loop_wraps > 0 || seen.tool[1].loop_wraps > 0 || happens(happened, EventKind::loop_formed);
    case LessonGoal::tail_through:
      return happens(happened, EventKind::throw_started) ||
             (!seen.active().knot.empty() && seen.active().knot.back().phase == KnotPhase::tightening);
    case LessonGoal::throws:
      return static_cast<float>(locked_throws(seen)) >= step.amount;
  }
  return false;
}

size_t next_step(const Lesson& lesson, size_t now, const Snapshot& seen, std::span<const Event> happened) {
  for (size_t k = lesson.step.size(); k-- > now;)
    if (lasts(lesson.step[k].goal) && step_done(lesson.step[k], seen, happened)) {
      now = k + 1;
      break;
    }
  if (now < lesson.step.size() && step_done(lesson.step[now], seen, happened)) ++now;
  return now;
}

size_t step_from(const Lesson& lesson, const Snapshot& seen) { return next_step(lesson, 0, seen, {}); }

}  // namespace catgut
