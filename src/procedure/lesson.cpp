// procedure: see lesson.h.
#include "procedure/lesson.h"

#include <algorithm>

#include "exchange/strand.h"

namespace catgut {
namespace {

constexpr float kClosed = 0.98f;  // of a seam that counts as drawn together

uint32_t complete_bites(const Snapshot& seen) {
  return static_cast<uint32_t>(std::count_if(seen.bite.begin(), seen.bite.end(), [](const BiteView& b) { return b.complete; }));
}

bool happens(std::span<const Event> happened, EventKind kind) {
  return std::any_of(happened.begin(), happened.end(), [&](const Event& e) { return e.kind == kind; });
}

// Goals that stay met, and that nobody meets without having done what comes before.
bool lasts(LessonGoal goal) { return goal == LessonGoal::bites || goal == LessonGoal::closed || goal == LessonGoal::throws; }

}  // namespace

const Lesson& first_stitch() {
  static const Lesson kLesson{
      "stay",
      "A first stitch",
      {{"take",
        "Take the needle",
        "Bring the needle driver to the needle and close its jaw.",
        "Move the mouse until the tool jumps to the needle, then click.",
        LessonGoal::needle_in_driver,
        0,
        {0},
        0},
       {"first bite",
        "Bite through the left bowel end",
        "Point at the ring on the left bowel end, drive the needle round, and bring it out with the forceps.",
        "Right button and mouse to the right drives. Tab, point at the tip, click; Tab, click to let the driver go; Tab, drive "
        "on.",
        LessonGoal::bites,
        1,
        {1},
        1},
       {"hand back",
        "Hand the needle back",
        "The driver takes the needle from the forceps, which then lets go.",
        "Lift the forceps, Tab, point the driver at the needle, click; Tab, click to open the forceps.",
        LessonGoal::needle_in_driver,
        0,
        {2},
        2},
       {"second bite",
        "Bite through the right bowel end",
        "The same again at the ring on the other side.",
        "Drive with the right button, take the tip with the forceps, let the driver go, drive on.",
        LessonGoal::bites,
        2,
        {3},
        3},
       {"pull",
        "Pull the thread through",
        "Lift the needle with the forceps until both ends are about as long.",
        "Move the forceps up and away, slowly: a jerk tears.",
        LessonGoal::tail,
        0.1f,
        {4},
        4},
       {"draw together",
        "Draw the bowel ends together",
        "Take the tail with the driver and draw both ends apart.",
        "Tab to the driver, point at the tail, click. Hold W and move the mouse to the right.",
        LessonGoal::closed,
        0,
        {5},
        5},
       {"wind",
        "Wind the strand round the driver",
        "Lay the tail down and let it go; then the forceps winds its strand.",
        "Click to open the driver. Hold W and move the mouse to the right until the thread lies round the tool.",
        LessonGoal::wound,
        0,
        {6, 7},
        6},
       {"through the loop",
        "Take the tail through the loop",
        "With the thread round it, the driver takes the tail.",
        "Let W go, point the driver at the tail, click when it is there.",
        LessonGoal::tail_through,
        0,
        {6, 7},
        6},
       {"lock",
        "Draw the throw down",
        "Draw both ends apart, low and even, until the throw lies on the tissue.",
        "Hold W and move the mouse to the right.",
        LessonGoal::throws,
        1,
        {6, 7},
        6},
       {"second throw",
        "A second throw, the other way round",
        "Only two throws wound opposite ways make a knot that holds.",
        "Let the tail go. Hold W and move the mouse to the left; take the tail; hold W again and draw to the right.",
        LessonGoal::throws,
        2,
        {6, 8},
        9}}};
  return kLesson;
}

bool step_done(const LessonStep& step, const Snapshot& seen, std::span<const Event> happened) {
  switch (step.goal) {
    case LessonGoal::needle_in_driver:
      return seen.tool[0].held == Held::needle && seen.tool[1].held != Held::needle;
    case LessonGoal::bites:
      return static_cast<float>(complete_bites(seen)) >= step.amount && !seen.needle.in_tissue;
    case LessonGoal::tail:
      return complete_bites(seen) > 0 && !seen.needle.in_tissue && !seen.suture_point.empty() &&
             length_between(seen, 0, first_point_node(seen)) <= step.amount;
    case LessonGoal::closed:
      return std::any_of(seen.seam.begin(), seen.seam.end(), [](const SeamView& s) { return s.midpoint; }) &&
             std::all_of(seen.seam.begin(), seen.seam.end(),
                         [](const SeamView& s) { return !s.midpoint || s.progress >= kClosed; });
    case LessonGoal::wound:
      return seen.tool[0].loop_wraps > 0 || seen.tool[1].loop_wraps > 0 || happens(happened, EventKind::loop_formed);
    case LessonGoal::tail_through:
      return happens(happened, EventKind::knot_begun) ||
             (!seen.knot.empty() && seen.knot.back().phase == KnotPhase::tightening);
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
