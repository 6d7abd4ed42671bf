// SPDX-License-Identifier: Apache-2.0
// tests/xr: sessions on the test runtime: by X11, with tracked hands, without a headset, and when it goes away. The session by
// EGL is in sew_test.cpp.
#ifdef CATGUT_TESTS_HEADSET
#include <openxr/openxr.h>

#include "both_eyes.h"
#include "sim/recording.h"

namespace catgut {
namespace {

using xr::HeadsetState;

// XR_KHR_opengl_enable with GLX, on the X server of the window.
TEST_F(AtTheHeadset, a_session_by_x11_shows_both_eyes) {
  setenv("CATGUT_XR_BINDING", "xlib", 1);
  wearer_.head = {{0.1f, 1.55f, 0.2f}, axis_angle({1, 0, 0}, -0.7f)};
  PlayOptions options;
  options.scene = "stay";
  options.eye_pictures = true;
  std::array<Image, 2> picture;
  xr::WearerLook look;
  int shown = 0;
  double since = 0;
  testing::internal::CaptureStderr();
  EXPECT_EQ(sit(options, 60,
                [&](const WindowLook& now) {
                  if (!now.headset || now.headset->state != HeadsetState::focused || !now.headset->picture) return true;
                  if (shown++ == 0) since = wall_seconds();
                  look = *now.headset, picture = *now.headset->picture;
                  return wall_seconds() - since < 0.6 || shown < 4;  // past the dark start
                }),
            0);
  const std::string said = testing::internal::GetCapturedStderr();
  EXPECT_NE(said.find("(OpenGL by X11)"), std::string::npos) << said;
  ASSERT_GE(shown, 4);
  expect_both_eyes_right(*layer_, look, picture, wearer_.head, "x11");
}

// XR_EXT_hand_tracking: the runtime's driver bends simulated fingers. Without a controller the pinch holds the instrument.
TEST_F(AtTheHeadset, tracked_fingers_are_hands) {
  layer_->dark = true;
  for (RemoteHand& h : wearer_.hand) h.active = false, h.fingers = true;
  PlayOptions options;
  options.scene = "stay";
  int frames = 0;
  xr::HandState open, bent, moved;
  Vec3 tool, tool_moved;
  EXPECT_EQ(sit(options, 60,
                [&](const WindowLook& now) {
                  if (!now.headset || now.headset->state != HeadsetState::focused || now.status.settling) return true;
                  const xr::HandState& right = now.headset->frame.hand[1];
                  ++frames;
                  if (frames == 45) {
                    open = right, tool = now.seen.tool[0].hand.p;
                    wearer_.hand[1].pose.p += {0.05f, 0, 0};
                  } else if (frames == 70) {
                    moved = right, tool_moved = now.seen.tool[0].hand.p;
                    wearer_.hand[1].curl.fill(1);
                  } else if (frames == 90) {
                    bent = right;
                    return false;
                  }
                  return true;
                }),
            0);
  ASSERT_TRUE(open.tracked);
  EXPECT_TRUE(open.articulated);
  EXPECT_NEAR(distance(moved.grip.p, open.grip.p), 0.05f, 0.002f) << "the pinch follows the hand";
  EXPECT_NEAR(distance(tool_moved, tool), 0.05f, 0.005f) << "and the instrument follows the pinch";
  EXPECT_TRUE(bent.articulated);
  std::fprintf(stderr, "pinch: %.2f with straight fingers, %.2f with bent ones\n", static_cast<double>(open.trigger),
               static_cast<double>(bent.trigger));
  EXPECT_NE(open.trigger, bent.trigger);
}

// By the files that the loader reads.
TEST_F(AtTheHeadset, a_headset_is_offered_where_a_runtime_is_installed) {
  EXPECT_TRUE(xr::headset_offered());
  unsetenv("XR_RUNTIME_JSON");
  setenv("XDG_CONFIG_DIRS", (folder_ / "etc").c_str(), 1);
  EXPECT_FALSE(xr::headset_offered()) << "unless this machine has one in /etc/openxr";
  std::filesystem::create_directories(folder_ / "openxr/1");
  std::ofstream(folder_ / "openxr/1/active_runtime.json") << "{}";
  EXPECT_TRUE(xr::headset_offered());
}

// What the program wrote, and that the window ran on.
TEST_F(AtTheHeadset, without_a_runtime_or_a_headset_one_line_says_so_and_the_window_runs) {
  layer_->absent = true;
  for (const bool runtime : {true, false}) {
    if (!runtime) setenv("XR_RUNTIME_JSON", (folder_ / "none.json").c_str(), 1);
    PlayOptions options;
    options.scene = "stay";
    int frames = 0;
    testing::internal::CaptureStderr();
    const int code = sit(options, 20, [&](const WindowLook& now) {
      EXPECT_EQ(now.headset->state, HeadsetState::off);
      return ++frames < 5;
    });
    const std::string said = testing::internal::GetCapturedStderr();
    EXPECT_EQ(code, 0);
    EXPECT_GE(frames, 5);
    const std::string line =
        runtime ? "catgut: headset: the OpenXR runtime finds no headset; the session continues in the window"
                : "catgut: headset: no OpenXR runtime is active on this machine; the session continues in the window";
    EXPECT_NE(said.find(line), std::string::npos) << said;
    EXPECT_TRUE(runtime || said.find("Error [") == std::string::npos) << "the loader's own lines are silent:\n" << said;
  }
}

// An announced loss, calls that fail without one, and a runtime that quits.
TEST_F(AtTheHeadset, a_lost_headset_comes_back) {
  if (!std::getenv("CATGUT_LONG")) GTEST_SKIP() << "CATGUT_LONG=1 runs it; sew_test.cpp loses a session in every build";
  layer_->dark = true;
  PlayOptions options;
  options.scene = "stay";
  int lost = 0, frames_without = 0;
  double without_since = 0;
  uint64_t tick = 0;
  bool ran_on = true;
  const int code = sit(options, 120, [&](const WindowLook& now) {
    if (now.status.settling) return true;
    if (now.headset->state == HeadsetState::focused) {
      if (frames_without > 0) {
        ran_on = ran_on && now.seen.tick > tick + 30;
        frames_without = 0;
      }
      if (layer_->lose == 0 && layer_->sessions == static_cast<uint32_t>(lost) + 1) {
        if (lost == 3) return false;
        tick = now.seen.tick;
        layer_->lose = ++lost;
        without_since = now.seen.time_s;
      }
    } else if (lost > 0) {
      ++frames_without;
    }
    return now.seen.time_s - without_since < 60 || lost == 0;
  });
  EXPECT_EQ(code, 0);
  EXPECT_EQ(lost, 3);
  EXPECT_EQ(layer_->sessions, 4u);
  EXPECT_TRUE(ran_on) << "the simulation continued meanwhile";
}

}  // namespace
}  // namespace catgut
#endif
