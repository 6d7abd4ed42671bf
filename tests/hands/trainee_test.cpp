// SPDX-License-Identifier: Apache-2.0
// tests/hands: a trainee's way by mouse and keyboard events in the window: start screen, first lesson, score, the moment of a
// lost point, repeat, learning curve. Two minutes and more in real time, so for the nightly tests (CATGUT_LONG=1).
#if defined(CATGUT_TESTS_WINDOW) && defined(CATGUT_WITH_STORE)
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "at_the_window.h"

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
  const std::string store = (folder / "sessions.db").string(), events = (folder / "events").string();
  XMouse desk(x_->display, 900);
  if (!desk.ready()) GTEST_SKIP() << "no XTest here";
  desk.width = kWide, desk.height = kHigh;
  const auto screens = [&](const std::string& name) {
    std::ostringstream text;
    text << std::ifstream(events).rdbuf();
    const std::string all = text.str(), one = "{\"screen\":\"" + name + "\"}";
    size_t n = 0;
    for (size_t at = 0; (at = all.find(one, at)) != std::string::npos; ++at) ++n;
    return n;
  };
  const auto shows = [&](const std::string& name, size_t times, double seconds = 90) {
    const auto end = Clock::now() + std::chrono::duration<double>(seconds);
    while (screens(name) < times && Clock::now() < end) std::this_thread::sleep_for(std::chrono::milliseconds(50));
    return screens(name) >= times;
  };
  const auto sessions = [&] {  // as the program exports them
    const std::string file = (folder / "export.json").string();
    const std::string command = std::string(CATGUT_APP) + " store export T07 --json " + file + " --store " + store;
    EXPECT_EQ(std::system(command.c_str()), 0) << command;
    return nlohmann::json::parse(std::ifstream(file))["sessions"];
  };
  const auto begin = Clock::now();
  desk.prepare = [&](PlayOptions& options) {
    options.procedure.clear(), options.scene.clear(), options.tutorial = false;  // the start screen
    options.trainee = "T07", options.store = store, options.events = events;
    options.live.record = (folder / "session.cgrec").string();
  };
  desk.arrive = [&] {
    if (shows("start", 1)) desk.press("t");  // the tutorial
  };
  bool sewn = false, scored = false, why = false, back = false, again = false, bitten = false, scored_again = false;
  std::string stopped_at;
  desk.sit([&] {
    Person me(desk);
    sewn = sew_and_tie_once(desk, me, 2, true);
    stopped_at = me.doing();
    desk.press("F10");
    scored = shows("results", 1);
    if (!scored) return;
    // A lost point, below the score at the left.
    const int left = (kScreenWide - kWide) / 2, top = (kScreenHigh - kHigh) / 2;
    for (int y = kHigh / 5; y < 3 * kHigh / 4 && screens("view") == 0; y += 12) desk.click_at(left + 40, top + y);
    why = shows("view", 1, 5);
    if (why) {
      std::this_thread::sleep_for(std::chrono::seconds(2));
      desk.press("Escape");
      back = shows("results", 2, 30);
    }
    const size_t practiced = screens("practice");
    desk.press("Return");  // repeat
    again = shows("practice", practiced + 1);
    if (again) {
      Person second(desk);
      bitten = second.take_needle() && second.bite();
      stopped_at += ", then: " + second.doing();
      const size_t results = screens("results");
      desk.press("F10");
      scored_again = shows("results", results + 1);
    }
    desk.press("Escape");
    shows("start", 2, 20);
    desk.press("Escape");
  });
  const double minutes = std::chrono::duration<double>(Clock::now() - begin).count() / 60;
  EXPECT_TRUE(sewn && bitten) << stopped_at;
  EXPECT_TRUE(scored && scored_again) << "F10 shows the results";
  EXPECT_TRUE(why) << "a click on a lost point plays its moment";
  EXPECT_TRUE(back) << "Esc returns to the results";
  EXPECT_TRUE(again) << "Enter repeats";
  const nlohmann::json stored = sessions();
  ASSERT_EQ(stored.size(), 2u) << "the learning curve has two sessions";
  double practice_s = 0;
  std::vector<double> curve;
  for (const nlohmann::json& s : stored) {
    EXPECT_EQ(s["task"], "first_stitch");
    ASSERT_TRUE(s["score"].is_number() && s["score_max"].get<double>() > 0) << s["score"];
    curve.push_back(100 * s["score"].get<double>() / s["score_max"].get<double>());
    ASSERT_FALSE(s["lost"].empty());
    for (const nlohmann::json& l : s["lost"]) EXPECT_FALSE(l["reason"].get<std::string>().empty());
    EXPECT_TRUE(fs::exists(s["recording"].get<std::string>())) << "every moment can be played";
    practice_s += s["duration_s"].get<double>();
    std::printf("session of %.0f s: %.1f %%, %zu reasons, the first: %s\n", s["duration_s"].get<double>(), curve.back(),
                s["lost"].size(), s["lost"][0]["reason"].get<std::string>().c_str());
  }
  EXPECT_GT(curve[0], curve[1]) << "one bite is no stay suture";
  // The wall time depends on the machine; the practice itself does not.
  std::printf("%.1f min from the start screen to the second score, %.1f min of it practice\n", minutes, practice_s / 60);
  EXPECT_LT(practice_s, 60 * kMinutes);
  fs::remove_all(folder);
}

}  // namespace
}  // namespace catgut
#endif
