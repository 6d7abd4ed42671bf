// SPDX-License-Identifier: Apache-2.0
// tests/hands: the lessons: every stage is recognized when completed by mouse, one after the other; and the scripted
// surgeon demonstrates each from the learner's state.
#include <gtest/gtest.h>

#include <cstdlib>

#include "lock_step.h"
#include "procedure/manager.h"
#include "procedure/procedure_file.h"

namespace catgut {
namespace {

TEST(LessonData, every_stage_says_what_to_do_and_who_shows_it) {
  for (const char* name : kLessons) {
    const Procedure lesson = read_procedure(name);
    ASSERT_GE(lesson.stage.size(), 12u);
    for (const ProcedureStage& s : lesson.stage) {
      EXPECT_FALSE(s.hint.empty() || s.demo.empty()) << s.name;
      EXPECT_LE(s.text.size(), 110u) << s.name << ": one sentence";
      ASSERT_TRUE(s.hint.empty() || s.hint.back().when.empty()) << s.name << ": a hint for every state";
    }
  }
}

struct Moment {
  std::vector<std::byte> state;
  ProcedureRun run;
};

// A user at the mouse does every stage; then the scripted surgeon shows each from where it began.
class Lessons : public testing::Test {
 protected:
  Lessons(const std::string& name, const std::string& scene) : desk(1, scene), lesson(read_procedure(name)), me(desk) {
    begin_run(run, lesson, desk.look().seen, 1.0 / 60);
    begun.resize(lesson.stage.size());
    begun[0] = {desk.save(), run};
    desk.after_tick = [this](const Snapshot& seen) {
      if (update_run(run, lesson, seen) && run.stage < lesson.stage.size()) begun[run.stage] = {desk.save(), run};
    };
  }
  std::string at() const { return run.stage < lesson.stage.size() ? lesson.stage[run.stage].name : "done"; }
  void expect_done_and_shown() {
    EXPECT_TRUE(finished(run, lesson)) << run_table(run, lesson);
    EXPECT_TRUE(run.error.empty()) << run_table(run, lesson);
    for (size_t k = 0; k < lesson.stage.size(); ++k) {
      EXPECT_NE(run.record[k].state, StageState::waiting) << lesson.stage[k].name;
      EXPECT_NE(run.record[k].state, StageState::skipped) << lesson.stage[k].name;
    }
    desk.after_tick = nullptr;
    for (size_t k = 0; k < lesson.stage.size(); ++k) {
      const Moment& from = begun[lesson.stage[k].demo_from];
      if (from.state.empty()) continue;  // a stage that was already reached has no begin of its own
      desk.load(from.state);
      ProcedureRun shown = from.run;
      EXPECT_TRUE(desk.show(demo_tasks(lesson, k, desk.scene(), desk.picture()),
                            [&](const Snapshot& seen) { return update_run(shown, lesson, seen), shown.stage > k; }))
          << lesson.stage[k].name << ", from " << lesson.stage[lesson.stage[k].demo_from].name;
    }
  }
  AtTheMouse desk;
  const Procedure lesson;
  ProcedureRun run;
  std::vector<Moment> begun;
  Person me;
};

struct SkinLesson : Lessons {
  SkinLesson() : Lessons("simple_suture", "skin") {}
};
struct BowelLesson : Lessons {
  BowelLesson() : Lessons("first_stitch", "stay") {}
};

TEST_F(SkinLesson, each_stage_is_done_by_mouse_and_shown) {
  ASSERT_TRUE(me.take_needle());
  ASSERT_EQ(at(), "sweep");
  ASSERT_TRUE(me.bite()) << me.doing();
  ASSERT_EQ(at(), "pull");
  ASSERT_TRUE(me.pull_tail(0.045f) && me.draw_together()) << me.doing();
  ASSERT_EQ(at(), "first wrap");
  ASSERT_TRUE(me.tie(1)) << me.doing() << " at " << at();
  ASSERT_EQ(at(), "second wrap") << "the tail was laid down";
  ASSERT_TRUE(me.tie(-1)) << me.doing() << " at " << at();
  ASSERT_EQ(at(), "cut needle end");
  ASSERT_TRUE(me.cut_needle());
  ASSERT_EQ(at(), "cut tail");
  ASSERT_TRUE(me.cut_tail());
  expect_done_and_shown();
}

// Eight seconds, so for the nightly tests.
TEST_F(BowelLesson, each_stage_is_done_by_mouse_and_shown) {
  if (!std::getenv("CATGUT_LONG")) GTEST_SKIP() << "set CATGUT_LONG=1";
  ASSERT_TRUE(me.take_needle());
  ASSERT_EQ(at(), "first bite");
  ASSERT_TRUE(me.bite());
  ASSERT_EQ(at(), "hand back");
  ASSERT_TRUE(me.hand_back());
  ASSERT_EQ(at(), "second bite");
  ASSERT_TRUE(me.bite());
  ASSERT_EQ(at(), "pull");
  ASSERT_TRUE(me.pull_tail(0.075f));
  ASSERT_EQ(at(), "approximate");
  ASSERT_TRUE(me.draw_together());
  ASSERT_EQ(at(), "first wrap");
  ASSERT_TRUE(me.wind(1));
  ASSERT_EQ(at(), "first tail");
  ASSERT_TRUE(me.take_tail());
  ASSERT_EQ(at(), "first throw");
  ASSERT_TRUE(me.set_throw());
  ASSERT_EQ(at(), "second wrap") << "the tail was laid down";
  ASSERT_TRUE(me.tie(-1)) << me.doing();
  ASSERT_EQ(at(), "cut");
  ASSERT_TRUE(me.cut_needle());
  expect_done_and_shown();
}

// A pad over nothing let the tail slide into the open slit and hang 3 cm below it, where no jaws reach.
TEST(LessonData, thread_in_the_slit_stays_within_reach_of_the_jaws) {
  const auto model = build_model(read_scene("skin"));
  const PictureModel picture = picture_model(*model);
  float top = -1;
  for (const Vec3& p : picture.particle_rest) top = std::max(top, p.y);
  EXPECT_LT(top - picture.drape, 0.006f);
  EXPECT_GT(top - picture.drape, 0.004f) << "the skin lies above the drape, not in it";
}

}  // namespace
}  // namespace catgut
