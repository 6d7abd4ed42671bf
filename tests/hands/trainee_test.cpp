// SPDX-License-Identifier: Apache-2.0
// tests/hands: a trainee's way by mouse and keyboard events in the window: start screen, first lesson, score, the moment of a
// lost point, repeat, learning curve. Two to four minutes in real time, so for the nightly tests (CATGUT_LONG=1). The trainee
// makes two bites and tries to tie. Whether the knot succeeds is printed, not required: window_test measures the whole stitch,
// and a trainee who fails gets a score and its reasons too.
#if defined(CATGUT_TESTS_WINDOW) && defined(CATGUT_WITH_STORE)
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "at_the_window.h"
#include "procedure/procedure_file.h"

namespace catgut {
namespace {
namespace fs = std::filesystem;

constexpr int kWide = 640, kHigh = 360, kScreenWide = 1280, kScreenHigh = 800;  // [pixels] of window and X server
constexpr double kMinutes = 5;

TEST_F(StitchAtTheWindow, a_trainee_starts_practices_sees_why_repeats_and_has_a_curve) {
  if (!std::getenv("CATGUT_LONG")) GTEST_SKIP() << "set CATGUT_LONG=1";
  const fs::path folder = fs::path(testing::TempDir()) / ("catgut_trainee_" + std::to_string(getpid()));
  fs::create_directories(folder);
  setenv("XDG_CONFIG_HOME", folder.c_str(), 1), setenv("XDG_DATA_HOME", folder.c_str(), 1);
  const std::string store = (folder / "sessions.db").string();
  const Procedure lesson = read_procedure(kFirstLesson);
  XMouse desk(x_->display, 900, 1, lesson.scene.c_str());
  if (!desk.ready()) GTEST_SKIP() << "no XTest here";
  desk.width = kWide, desk.height = kHigh;
  const auto sessions = [&] {  // as the program exports them
    const std::string file = (folder / "export.json").string();
    const std::string command = std::string(CATGUT_APP) + " store export T07 --json " + file + " --store " + store;
    EXPECT_EQ(std::system(command.c_str()), 0) << command;
    return nlohmann::json::parse(std::ifstream(file))["sessions"];
  };
  const auto begin = Clock::now();
  desk.prepare = [&](PlayOptions& options) {
    options.procedure.clear(), options.scene.clear(), options.tutorial = false;  // the start screen
    options.trainee = "T07", options.store = store;
    options.live.record = (folder / "session.cgrec").string();
  };
  desk.arrive = [&] {
    if (!desk.shows("start")) return false;
    desk.press("t");  // the first lesson
    return desk.shows("practice");
  };
  bool whole = false, bites = false, scored = false, why = false, back = false, again = false, bitten = false,
       scored_again = false;
  std::string stopped_at = "the start screen";
  desk.sit([&] {
    Person me(desk);
    whole = me.carry_out(kFirstLesson);
    bites = desk.count(EventKind::bite_completed) >= 2;
    stopped_at = me.doing();
    desk.press("F10");
    scored = desk.shows("results");
    if (!scored) return;
    desk.frames(2);
    const PanelRect reason = desk.moment();
    EXPECT_GT(reason.w, 0) << "the costliest lost point is in sight";
    const int left = (kScreenWide - kWide) / 2, top = (kScreenHigh - kHigh) / 2;
    why = reason.w > 0 &&
          desk.click_at(left + static_cast<int>(reason.x + reason.w / 2), top + static_cast<int>(reason.y + reason.h / 2)) &&
          desk.shows("view");
    if (why) {
      desk.frames(10);  // and the user watches
      desk.press("Escape");
      back = desk.shows("results");
    }
    desk.press("Return");  // repeat
    again = desk.shows("practice");
    if (!again) return;
    Person second(desk);
    bitten = second.take_needle() && second.bite();
    stopped_at += ", then: " + second.doing();
    desk.press("F10");
    scored_again = desk.shows("results");
  });
  const double minutes = std::chrono::duration<double>(Clock::now() - begin).count() / 60;
  EXPECT_TRUE(bites && bitten) << stopped_at;
  std::printf("the first stitch was %s\n", whole ? "tied and cut" : ("not completed: " + stopped_at).c_str());
  EXPECT_TRUE(scored && scored_again) << "F10 shows the results";
  EXPECT_TRUE(why) << "a click on a lost point plays its moment";
  EXPECT_TRUE(back) << "Esc returns to the results";
  EXPECT_TRUE(again) << "Enter repeats";
  const nlohmann::json stored = sessions();
  ASSERT_EQ(stored.size(), 2u) << "the learning curve has two sessions";
  double practice_s = 0;
  std::vector<double> curve;
  for (const nlohmann::json& s : stored) {
    EXPECT_EQ(s["task"], kFirstLesson);
    ASSERT_TRUE(s["score"].is_number() && s["score_max"].get<double>() > 0) << s["score"];
    curve.push_back(100 * s["score"].get<double>() / s["score_max"].get<double>());
    ASSERT_FALSE(s["lost"].empty());
    for (const nlohmann::json& l : s["lost"]) EXPECT_FALSE(l["reason"].get<std::string>().empty());
    EXPECT_TRUE(fs::exists(s["recording"].get<std::string>())) << "every moment can be played";
    practice_s += s["duration_s"].get<double>();
    std::printf("session of %.0f s: %.1f %%, %zu reasons, the first: %s\n", s["duration_s"].get<double>(), curve.back(),
                s["lost"].size(), s["lost"][0]["reason"].get<std::string>().c_str());
  }
  EXPECT_GT(curve[0], curve[1]) << "a stitch that is not tied scores less";
  // The wall time depends on the machine; the practice itself does not.
  std::printf("%.1f min from the start screen to the second score, %.1f min of it practice\n", minutes, practice_s / 60);
  EXPECT_LT(practice_s, 60 * kMinutes);
  fs::remove_all(folder);
}

}  // namespace
}  // namespace catgut
#endif
