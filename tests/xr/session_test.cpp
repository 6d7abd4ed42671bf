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

// XR_KHR_opengl_enable with GLX, on the X server of the window. Afterwards the wearer pauses, points the controller at the
// board and pulls the trigger: the session resumes.
TEST_F(AtTheHeadset, a_session_by_x11_shows_both_eyes_and_a_ray_presses_a_button) {
  constexpr float kResume[] = {640, 212};  // [pixels] of the board: the pause panel's first button
  setenv("CATGUT_XR_BINDING", "xlib", 1);
  wearer_.head = {{0.1f, 1.55f, 0.2f}, axis_angle({1, 0, 0}, -0.7f)};
  const Pose head = wearer_.head;
  PlayOptions options;
  options.scene = "stay";
  options.eye_pictures = true;
  std::array<Image, 2> picture, paused;
  xr::WearerLook look;
  int shown = 0, pressed = 0, without_work = 0, pointing = 0;
  bool resumed = false, late_shown = false, points_at_work = false;
  std::optional<std::array<float, 2>> pointer;
  xr::HandState buttons;
  float reach = 0;
  options.watch_eyes = [&](const xr::WearerLook& now) {
    if (++without_work < 4 || pressed == 0 || !now.frame.hand[1].tracked) return;
    if (now.picture) paused = *now.picture;
    const xr::HandState& hand = now.frame.hand[1];
    const Vec3 on{now.board.width * (kResume[0] / EyeRenderer::kBoardWidth - 0.5f),
                  height_of(now.board) * (0.5f - kResume[1] / EyeRenderer::kBoardHeight), 0};
    const Vec3 z = normalized(hand.aim.p - now.place.to_room(transform(now.board.pose, on)));
    const Vec3 x = normalized(cross({0, 1, 0}, z));
    wearer_.hand[1].pose.q = normalized(from_axes(x, cross(z, x), z) * conjugate(conjugate(hand.grip.q) * hand.aim.q));
    RemoteHand& left = wearer_.hand[0];
    left.a = left.b = left.stick = pointing < 4;
    left.squeeze = left.stick_y = pointing < 4 ? 1 : 0;
    if (++pointing == 4) buttons = now.frame.hand[0], reach = now.place.reach;
    if (pointing == 8) pointer = now.pointer;
    wearer_.hand[1].trigger = pointing > 7 && pointing < 10 ? 1 : 0;
    remote_->set(wearer_);
  };
  testing::internal::CaptureStderr();
  EXPECT_EQ(sit(options, 30,
                [&](const WindowLook& now) {
                  if (pointing > 7) resumed = true;
                  without_work = 0;
                  if (!now.headset || now.headset->state != HeadsetState::focused || !now.headset->picture) return true;
                  points_at_work = points_at_work || (pressed == 0 && now.headset->pointer);
                  for (const PlacedPanel& p : now.board)
                    for (const PanelLine& l : p.line) late_shown = late_shown || l.text.find(" late") != std::string::npos;
                  if (now.headset->brightness < 1 || ++shown < 4) {  // past the dark start
                    look = *now.headset, picture = *now.headset->picture;
                    return true;
                  }
                  for (RemoteHand& h : wearer_.hand) h.trackpad_force = pressed < 3 ? 1 : 0;
                  ++pressed;
                  return !resumed;
                }),
            0);
  const std::string said = testing::internal::GetCapturedStderr();
  EXPECT_NE(said.find("(OpenGL by X11)"), std::string::npos) << said;
  ASSERT_GE(shown, 4);
  expect_both_eyes_right(*layer_, look, picture, head, "x11");
  if (const char* folder = std::getenv("CATGUT_PICTURES"))
    for (size_t i = 0; i < 2; ++i) write_png(paused[i], std::string(folder) + (i ? "/pause_right.png" : "/pause_left.png"));
  EXPECT_TRUE(late_shown) << "late pictures are on a panel";
  EXPECT_FALSE(points_at_work) << "while instruments are in use the trigger is the jaw";
  ASSERT_TRUE(pointer.has_value()) << "the ray meets the board";
  EXPECT_NEAR((*pointer)[0], kResume[0], 12);
  EXPECT_NEAR((*pointer)[1], kResume[1], 12);
  EXPECT_TRUE(buttons.cut && buttons.new_suture && buttons.swap && buttons.clutch) << "the left controller's buttons";
  EXPECT_GT(buttons.stick_y, 0.9f);
  EXPECT_GT(reach, xr::kAhead) << "its stick moves the table away";
  EXPECT_TRUE(resumed) << "the trigger pressed the button";
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
