// SPDX-License-Identifier: Apache-2.0
// tests/hands: the first lesson again and again, by mouse and keyboard events in the window, in real time: how often it is
// completed at the first try, and where tries failed. Half an hour, so for the nightly tests (CATGUT_LONG=1);
// CATGUT_LESSON_RUNS is the number of runs in each size of the window, CATGUT_LESSON_PACE their speed,
// CATGUT_LESSON another lesson than the first.
#ifdef CATGUT_TESTS_WINDOW
#include <gtest/gtest.h>

#include <cstdlib>
#include <map>

#include "at_the_window.h"
#include "procedure/procedure_file.h"

namespace catgut {
namespace {

constexpr double kMostMinutes = 10;
constexpr double kFirstTries = 0.9;  // 18 of 20

TEST_F(StitchAtTheWindow, the_lesson_succeeds_at_the_first_try) {
  if (!std::getenv("CATGUT_LONG")) GTEST_SKIP() << "set CATGUT_LONG=1";
  const char* wanted = std::getenv("CATGUT_LESSON_RUNS");
  const char* pace = std::getenv("CATGUT_LESSON_PACE");
  const int runs = wanted ? std::atoi(wanted) : 10;
  const char* which = std::getenv("CATGUT_LESSON");
  const std::string name = which ? which : kFirstLesson;
  const Procedure lesson = read_procedure(name);
  int done = 0, all = 0;
  std::map<std::string, int> again;
  double slowest_min = 0;
  std::printf("%-10s %4s %-9s %8s  %-24s %s\n", "window", "run", "result", "time", "stopped at", "repeated, errors");
  for (const auto& [w, h] : {std::pair{1280, 720}, {640, 360}})
    for (int run = 0; run < runs; ++run) {
      XMouse desk(x_->display, static_cast<int>(60 * kMostMinutes), pace ? static_cast<float>(std::atof(pace)) : 1.0f,
                  lesson.scene.c_str());
      if (!desk.ready()) GTEST_SKIP() << "no XTest here";
      desk.width = w, desk.height = h, desk.lesson = name;
      Person me(desk);
      bool ok = false;
      const auto begin = Clock::now();
      desk.sit([&] { ok = me.carry_out(name); }, true);
      const double minutes = std::chrono::duration<double>(Clock::now() - begin).count() / 60;
      const ProcedureRun& seen = desk.lesson_run();
      ok = ok && finished(seen, lesson);
      slowest_min = std::max(slowest_min, minutes);
      ++all, done += ok;
      std::string notes;
      for (const std::string& r : me.repeated()) notes += (notes.empty() ? "" : ", ") + r, ++again[r];
      for (const ErrorNote& e : seen.error) notes += "; error: " + error_text(lesson, e);
      const std::string stage = seen.stage < lesson.stage.size() ? lesson.stage[seen.stage].name + ": " + me.doing() : "";
      std::printf("%4dx%-5d %4d %-9s %6.1f s  %-24s %s\n", w, h, run + 1, ok ? "done" : "FAILED", 60 * minutes, stage.c_str(),
                  notes.c_str());
      std::fflush(stdout);
    }
  std::printf("%d of %d at the first try; the slowest took %.1f min\n", done, all, slowest_min);
  for (const auto& [what, n] : again) std::printf("repeated %3d times: %s\n", n, what.c_str());
  EXPECT_GE(done, kFirstTries * all);
  EXPECT_LT(slowest_min, kMostMinutes);
}

}  // namespace
}  // namespace catgut
#endif
