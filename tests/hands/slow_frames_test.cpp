// SPDX-License-Identifier: Apache-2.0
// tests/hands: the first lesson at few and irregular frames per second, as on a busy machine without a graphics card. In lock
// step and reproducible by its number, so a failure of the window can be repeated here: the user sees every second frame, as in
// at_the_window.h. A minute for every ten runs, so for the nightly tests (CATGUT_LONG=1); CATGUT_LESSON_RUNS is
// the number of runs, CATGUT_LESSON_FIRST the number of the first, CATGUT_LESSON_TICKS (3: a fast machine) the usual length of
// a frame in ticks, CATGUT_LESSON another lesson than the first (first_stitch, simple_suture).
#include <gtest/gtest.h>

#include <cstdlib>
#include <map>
#include <random>

#include "lock_step.h"
#include "procedure/manager.h"
#include "procedure/procedure_file.h"
#include "render/orbit.h"

namespace catgut {
namespace {

constexpr double kFirstTries = 0.9;  // 18 of 20

class SlowFrames : public AtTheMouse {
 public:
  SlowFrames(unsigned number, const std::string& scene) : AtTheMouse(1, scene), random_(number) {
    const Camera camera = camera_of(start_orbit(picture_, look_.seen.active().needle.pose.p));
    look_.view = view_frame(camera.eye, camera.target, camera.up, camera.fov_deg, number % 2 ? 720 : 360);
    usual_ = std::uniform_int_distribution<int>(4, 24)(random_);  // 15 to 2.5 frames per second
    if (const char* ticks = std::getenv("CATGUT_LESSON_TICKS")) usual_ = std::atoi(ticks);
  }
  bool act(const Act& act) override {
    Act after;
    after.hand = act.hand;
    after.motion.together = act.motion.together;
    float passed = frame();
    LockStep::act(act);
    passed += frame();
    const bool goes_on = LockStep::act(after);
    look_.dt = std::clamp(passed, 0.02f, 0.25f);
    return goes_on;
  }
  int usual() const { return usual_; }

 private:
  // The length of the next one: usual, up to twice that, and sometimes a second.
  float frame() {
    const bool stalls = std::uniform_int_distribution<int>(0, 99)(random_) == 0;
    ticks_ = stalls ? 60 : std::uniform_int_distribution<int>(std::max(1, usual_ / 2), 2 * usual_)(random_);
    const float dt = kTick * static_cast<float>(ticks_);
    look_.dt = std::clamp(dt, 1e-3f, 0.25f);
    return dt;
  }
  std::mt19937 random_;
  int usual_ = 6;
};

TEST(SlowFrames, the_lesson_succeeds_at_the_first_try) {
  if (!std::getenv("CATGUT_LONG")) GTEST_SKIP() << "set CATGUT_LONG=1";
  const char* wanted = std::getenv("CATGUT_LESSON_RUNS");
  const char* from = std::getenv("CATGUT_LESSON_FIRST");
  const int runs = wanted ? std::atoi(wanted) : 20, first = from ? std::atoi(from) : 1;
  const char* which = std::getenv("CATGUT_LESSON");
  const std::string name = which ? which : kFirstLesson;
  const Procedure lesson = read_procedure(name);
  int done = 0;
  std::map<std::string, int> again;
  std::printf("%4s %5s %-7s %8s  %-40s %s\n", "run", "ticks", "result", "time", "stopped at", "repeated, errors");
  for (int number = first; number < first + runs; ++number) {
    SlowFrames desk(static_cast<unsigned>(number), lesson.scene);
    ProcedureRun run;
    begin_run(run, lesson, desk.look().seen, 1.0 / 60);
    desk.after_tick = [&](const Snapshot& seen) { update_run(run, lesson, seen); };
    Person me(desk);
    const bool ok = me.carry_out(name) && finished(run, lesson);
    done += ok;
    std::string notes;
    for (const std::string& r : me.repeated()) notes += (notes.empty() ? "" : ", ") + r, ++again[r];
    for (const ErrorNote& e : run.error) notes += "; error: " + error_text(lesson, e);
    const std::string stage = run.stage < lesson.stage.size() ? lesson.stage[run.stage].name + ": " + me.doing() : "";
    std::printf("%4d %5d %-7s %6.1f s  %-40s %s\n", number, desk.usual(), ok ? "done" : "FAILED", desk.look().seen.time_s,
                stage.c_str(), notes.c_str());
    std::fflush(stdout);
  }
  std::printf("%d of %d at the first try\n", done, runs);
  for (const auto& [what, n] : again) std::printf("repeated %3d times: %s\n", n, what.c_str());
  EXPECT_GE(done, kFirstTries * runs);
}

}  // namespace
}  // namespace catgut
