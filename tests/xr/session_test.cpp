// SPDX-License-Identifier: Apache-2.0
// tests/xr: a session on the test runtime: its states, its two pictures, and what happens when the headset goes away.
#ifdef CATGUT_TESTS_HEADSET
#include <openxr/openxr.h>

#include <cmath>

#include "at_the_headset.h"
#include "sim/recording.h"

namespace catgut {
namespace {

using xr::HeadsetState;

// [pixels] from the left edge and from the top of the eye's picture.
std::array<float, 2> project(const Pose& eye, const Frustum& f, Vec3 p, const Image& image) {
  const Vec3 d = to_local(eye, p);
  const float tx = d.x / -d.z, ty = d.y / -d.z;
  return {static_cast<float>(image.width) * (tx - f.left) / (f.right - f.left),
          static_cast<float>(image.height) * (f.up - ty) / (f.up - f.down)};
}

float luma(const Image& image, int x, int y) {
  const uint8_t* p = &image.rgba[4 * (size_t(y) * size_t(image.width) + size_t(x))];
  return 0.3f * p[0] + 0.6f * p[1] + 0.1f * p[2];
}

// [pixels] from a patch of the left picture to where it is found in the right one, by the least squared difference.
int found_shift(const Image& left, const Image& right, int x, int y, int half, int reach) {
  double least = 1e30;
  int best = 0;
  for (int shift = -reach; shift <= reach; ++shift) {
    double sum = 0;
    int count = 0;
    for (int dy = -half; dy <= half; ++dy)
      for (int dx = -half; dx <= half; ++dx) {
        const int xl = x + dx, xr = x + dx + shift, yy = y + dy;
        if (std::min({xl, xr, yy}) < 0 || std::max(xl, xr) >= left.width || yy >= left.height) continue;
        const double d = static_cast<double>(luma(left, xl, yy) - luma(right, xr, yy));
        sum += d * d, ++count;
      }
    if (count > half * half && sum / count < least) least = sum / count, best = shift;
  }
  return best;
}

TEST_F(AtTheHeadset, a_session_reaches_focus_with_both_eyes_right_and_ends) {
  // The wearer looks down at the table.
  wearer_.head = {{0.1f, 1.55f, 0.2f}, axis_angle({1, 0, 0}, -0.7f)};
  PlayOptions options;
  options.scene = "stay";
  options.eye_pictures = true;
  std::array<Image, 2> picture;
  xr::WearerLook look;
  Vec3 focus;
  int focused = 0;
  const int code = sit(options, 90, [&](const WindowLook& now) {
    if (!now.headset || now.headset->state != HeadsetState::focused || !now.headset->picture) return true;
    look = *now.headset;
    picture = *now.headset->picture;
    focus = look.place.focus;
    return ++focused < 25;  // past the fade
  });
  EXPECT_EQ(code, 0);
  for (const int state : {XR_SESSION_STATE_IDLE, XR_SESSION_STATE_READY, XR_SESSION_STATE_SYNCHRONIZED,
                          XR_SESSION_STATE_VISIBLE, XR_SESSION_STATE_FOCUSED})
    EXPECT_TRUE(seen(layer_, state)) << state;
  ASSERT_GE(focused, 25);
  EXPECT_EQ(layer_->sessions, 1u);
  EXPECT_EQ(layer_->destroyed, 1u) << "the session was closed with the window";
  EXPECT_GE(layer_->projections, 25u);
  if (const char* folder = std::getenv("CATGUT_PICTURES"))
    for (size_t i = 0; i < 2; ++i) write_png(picture[i], std::string(folder) + (i ? "/eye_right.png" : "/eye_left.png"));

  // Room and driver have one frame: the head is where it was streamed.
  EXPECT_LT(distance(look.frame.head.p, wearer_.head.p), 0.01f);
  EXPECT_LT(length(rotation_vector(look.frame.head.q * conjugate(wearer_.head.q))), 0.02f);
  const Vec3 between = rotate(conjugate(look.frame.head.q), look.frame.eye[1].p - look.frame.eye[0].p);
  EXPECT_GT(between.x, 0.05f) << "the first view is the left eye";
  EXPECT_LT(between.x, 0.08f);

  // What the runtime received is what the picture was drawn for.
  for (size_t i = 0; i < 2; ++i) {
    const XrLayerState::Eye& e = layer_->eye[i];
    EXPECT_NEAR(std::tan(e.fov[0]), look.frame.frustum[i].left, 1e-4f);
    EXPECT_NEAR(std::tan(e.fov[3]), look.frame.frustum[i].down, 1e-4f);
    EXPECT_LT(distance({e.position[0], e.position[1], e.position[2]}, look.frame.eye[i].p), 0.01f);
    EXPECT_EQ(e.rect[2], picture[i].width);
    EXPECT_EQ(e.rect[3], picture[i].height);
  }

  // The field's center: the patch of the left picture lies in the right one where geometry puts it.
  std::array<std::array<float, 2>, 2> at;
  for (size_t i = 0; i < 2; ++i)
    at[i] = project(look.place.to_world(look.frame.eye[i]), look.frame.frustum[i], focus, picture[i]);
  const float expected = at[1][0] - at[0][0];
  const int found = found_shift(picture[0], picture[1], static_cast<int>(at[0][0]), static_cast<int>(at[0][1]), 20, 60);
  RecordProperty("expected_shift", std::to_string(expected));
  std::fprintf(stderr, "disparity of the field's center: %d pixels, by geometry %.1f; at distance infinity %.1f\n", found,
               static_cast<double>(expected),
               static_cast<double>(project({{}, look.frame.eye[0].q}, look.frame.frustum[1],
                                           rotate(look.frame.eye[0].q, {0, 0, -1000}), picture[1])[0] -
                                   project({{}, look.frame.eye[0].q}, look.frame.frustum[0],
                                           rotate(look.frame.eye[0].q, {0, 0, -1000}), picture[0])[0]));
  EXPECT_NEAR(static_cast<float>(found), expected, 2.0f);
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
