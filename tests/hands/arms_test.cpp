// SPDX-License-Identifier: Apache-2.0
// tests/hands: haptic devices in the window itself, with simulated devices: the user's settings reach them, and F9, as an event
// of the X server, switches their force off and on. Waits for observed states only.
#ifdef CATGUT_TESTS_WINDOW
#include <gtest/gtest.h>
#include <signal.h>

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <mutex>
#include <thread>

#include "../device/fake_hd/load.h"
#include "render/renderer.h"
#include "window/window.h"
#include "x_events.h"
#include "x_server.h"

namespace catgut {
namespace {

TEST(ArmsAtTheWindow, S10_F9_switches_the_force_off_and_on) {
  if (!renderer_available()) GTEST_SKIP() << "no EGL driver here";
  if (!on_path("Xvfb")) GTEST_SKIP() << "Xvfb is missing (Debian: apt install xvfb)";
  const XServer server;
  if (server.display.empty()) GTEST_SKIP() << "Xvfb does not start here";
  setenv("DISPLAY", server.display.c_str(), 1);
  setenv("SDL_VIDEODRIVER", "x11", 1);
  signal(SIGPIPE, SIG_IGN);
  const std::filesystem::path home = std::filesystem::temp_directory_path() / ("catgut_arms_" + std::to_string(getpid()));
  std::filesystem::create_directories(home / "catgut");
  std::ofstream(home / "catgut" / "settings.toml") << "force_right = 0.5\nforce_left = 1.5\n";
  const char* config = std::getenv("XDG_CONFIG_HOME");
  const std::string before = config ? config : "";
  setenv("XDG_CONFIG_HOME", home.c_str(), 1);

  FakeHd fake(false);
  XEvents x(server.display);
  std::mutex mutex;
  LiveStatus newest;
  bool any = false;
  std::atomic<bool> gone{false}, closed{false};
  PlayOptions options;
  options.scene = "stay";
  options.live.haptics = "touch";
  options.live.say = [](const std::string&) {};
  options.width = 320, options.height = 200;
  options.seconds = 180;
  options.watch = [&](const WindowLook& now) {
    const std::lock_guard lock(mutex);
    newest = now.status;
    any = true;
    return !gone;
  };
  bool ready = false, felt = false, off = false, silent = false, again = false;
  std::array<float, 2> strength{};
  std::thread person([&] {
    const auto wait = [&](const std::function<bool(const LiveStatus&)>& done) {
      for (int i = 0; i < 6000 && !closed; ++i) {
        {
          const std::lock_guard lock(mutex);
          if (any && done(newest)) return true;
        }
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
      }
      return false;
    };
    const auto both = [](const LiveStatus& s) { return s.arm_view[0].felt && s.arm_view[1].felt; };
    const auto f9 = [&] { x.key("F9", true), x.key("F9", false); };
    ready = x.ready();
    felt = ready && wait(both);
    {
      const std::lock_guard lock(mutex);
      strength = {newest.arm_view[0].strength, newest.arm_view[1].strength};
    }
    if (felt) {
      f9();
      off = wait([](const LiveStatus& s) {
        return s.arms_off && std::string(s.arm_view[0].off).find("F9") != std::string::npos &&
               std::string(s.arm_view[1].off).find("F9") != std::string::npos;
      });
      silent = wait([](const LiveStatus& s) { return s.arm_view[0].force == 0 && s.arm_view[1].force == 0; }) &&
               length(fake.force(0)) == 0 && length(fake.force(1)) == 0;
      f9();
      again = wait([&](const LiveStatus& s) { return !s.arms_off && both(s) && !*s.arm_view[0].off; });
    }
    gone = true;
  });
  const int code = play(options);
  closed = true;
  person.join();
  if (config) setenv("XDG_CONFIG_HOME", before.c_str(), 1);
  else unsetenv("XDG_CONFIG_HOME");
  std::filesystem::remove_all(home);
  if (!ready) GTEST_SKIP() << "no XTest here";
  EXPECT_EQ(code, 0);
  EXPECT_TRUE(felt) << "the devices engage";
  EXPECT_EQ(strength[0], 0.5f) << "of the settings";
  EXPECT_EQ(strength[1], 1.5f);
  EXPECT_TRUE(off) << "F9";
  EXPECT_TRUE(silent);
  EXPECT_TRUE(again) << "F9 again";
}

}  // namespace
}  // namespace catgut
#endif
