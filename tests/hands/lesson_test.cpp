// SPDX-License-Identifier: Apache-2.0
// tests/hands: the lesson: every step is recognized when completed, not before; and the scripted surgeon can demonstrate each
// from the learner's present state, with the needle in the learner's grasp.
#include <gtest/gtest.h>

#include "lock_step.h"
#include "procedure/lesson.h"
#include "runtime/hands.h"
#include "sim/simulation.h"
#include "surgeon/plan.h"

namespace catgut {
namespace {

TEST(LessonData, every_step_says_what_to_do_and_who_shows_it) {
  const Lesson& lesson = first_stitch();
  const SceneSpec scene = read_scene(lesson.scene);
  const Plan plan = make_plan(scene.technique.name, picture_model(*build_model(scene)), skill_of(scene));
  ASSERT_GE(lesson.step.size(), 8u);
  for (size_t k = 0; k < lesson.step.size(); ++k) {
    const LessonStep& s = lesson.step[k];
    EXPECT_FALSE(s.name.empty() || s.title.empty() || s.text.empty() || s.hint.empty());
    EXPECT_LE(s.text.size(), 110u) << s.name << ": one sentence";
    EXPECT_LE(s.shown_from, k);
    ASSERT_FALSE(s.shown_by.empty());
    for (const size_t t : s.shown_by) ASSERT_LT(t, plan.task.size());
    const TaskKind kind = plan.task[s.shown_by.back()].kind;
    const TaskKind wanted = s.goal == LessonGoal::bites    ? TaskKind::bite
                            : s.goal == LessonGoal::tail   ? TaskKind::pull_tail
                            : s.goal == LessonGoal::closed ? TaskKind::draw
                            : s.goal >= LessonGoal::wound  ? TaskKind::throw_
                                                           : kind;
    EXPECT_EQ(kind, wanted) << s.name;
  }
}

TEST(LessonData, what_was_done_at_once_is_behind) {
  const Lesson& lesson = first_stitch();
  Snapshot seen;
  seen.active().thread_order = {0, 1};
  seen.particle = {{}, {0.2f, 0, 0}};
  EXPECT_EQ(next_step(lesson, 0, seen, {}), 0u);
  seen.active().bite.resize(2);
  seen.active().bite[0].complete = true;
  EXPECT_EQ(next_step(lesson, 1, seen, {}), 2u);
  seen.active().bite[1].complete = true;  // through both walls in one sweep
  EXPECT_EQ(next_step(lesson, 1, seen, {}), 4u);
  EXPECT_EQ(step_from(lesson, seen), 4u);
  const Event begun[] = {{EventKind::throw_started, 0, 0, 1, {}}};
  EXPECT_EQ(next_step(lesson, 7, seen, {}), 7u);
  EXPECT_EQ(next_step(lesson, 7, seen, begun), 8u) << "shorter than a picture";
}

// A user completes the lesson with the mouse. Before every step the surgeon demonstrates it from the present state; then the
// demonstration is undone, as in the window.
TEST(Lessons, each_step_is_shown_undone_and_done_by_mouse) {
  AtTheMouse desk(1);
  const Lesson& lesson = first_stitch();
  size_t step = 0, shown = 0;
  std::vector<std::vector<std::byte>> begun(lesson.step.size());
  desk.after_tick = [&](const Snapshot& seen) {
    const size_t was = step;
    step = next_step(lesson, step, seen, seen.event);
    for (size_t k = was + 1; k <= step && k < lesson.step.size(); ++k) begun[k] = desk.save();
  };
  begun[0] = desk.save();
  Person me(desk);
  const auto show = [&] {
    const size_t wanted = step;
    const LessonStep& s = lesson.step[wanted];
    const auto after_tick = std::exchange(desk.after_tick, nullptr);
    const std::vector<std::byte> before = desk.save();
    if (s.shown_from != wanted) desk.load(begun[s.shown_from]);
    EXPECT_TRUE(desk.show(s.shown_by, [&](const Snapshot& seen) { return step_done(s, seen, seen.event); })) << s.name;
    ++shown;
    desk.load(before);
    desk.after_tick = after_tick;
  };
  show();
  ASSERT_EQ(step, 0u);
  ASSERT_TRUE(me.take_needle());
  ASSERT_EQ(step, 1u);
  show();
  ASSERT_TRUE(me.bite());
  ASSERT_EQ(step, 2u);
  show();
  ASSERT_TRUE(me.hand_back());
  ASSERT_EQ(step, 3u);
  show();
  ASSERT_TRUE(me.bite());
  ASSERT_EQ(step, 4u);
  show();
  ASSERT_TRUE(me.pull_tail(0.09f));
  ASSERT_EQ(step, 5u);
  show();
  ASSERT_TRUE(me.draw_together());
  ASSERT_EQ(step, 6u);
  show();
  ASSERT_TRUE(me.wind(1));
  ASSERT_EQ(step, 7u);
  show();
  ASSERT_TRUE(me.take_tail());
  ASSERT_EQ(step, 8u);
  show();
  ASSERT_TRUE(me.set_throw());
  ASSERT_EQ(step, 9u);
  show();
  ASSERT_TRUE(me.tie(-1)) << me.doing();
  EXPECT_EQ(step, lesson.step.size());
  EXPECT_EQ(shown, lesson.step.size());
}

}  // namespace
}  // namespace catgut
