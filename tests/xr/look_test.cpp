// SPDX-License-Identifier: Apache-2.0
// tests/xr: pictures for a person to look at, without a runtime. They assert little and are left out unless CATGUT_PICTURES
// names a folder: what a wearer sees of the results, and a walk around them, one picture per frame of a film.
#ifdef CATGUT_TESTS_HEADSET
#include <epoxy/gl.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <imgui.h>

#include <cstdlib>

#include "procedure/scene_file.h"
#include "render/eyes.h"
#include "runtime/live.h"
#include "runtime/session.h"
#include "window/panels.h"
#include "window/stitch_labels.h"
#include "window/widgets.h"
#include "xr/boards.h"
#include "xr/labels.h"

namespace catgut {
namespace {

constexpr Frustum kLeft{-1.1f, 0.9f, -1.0f, 0.9f}, kRight{-0.9f, 1.1f, -1.0f, 0.9f};

class Look : public testing::Test {
 protected:
  void SetUp() override {
    if (!std::getenv("CATGUT_PICTURES")) GTEST_SKIP() << "writes pictures; set CATGUT_PICTURES to a folder";
    if (!renderer_available()) GTEST_SKIP() << "no EGL driver here";
    folder_ = std::getenv("CATGUT_PICTURES");
    eyes_ = make_eye_renderer(GlBinding::egl, "");
  }
  void TearDown() override {
    if (!eyes_) return;
    images(0, 0);
    eyes_.reset();
  }
  void images(int wide, int tall) {
    eyes_->drop_images();
    eyes_->make_current();
    if (texture_[0]) glDeleteTextures(2, texture_);
    texture_[0] = 0;
    if (wide == 0) return;
    glGenTextures(2, texture_);
    for (int i = 0; i < 2; ++i) {
      glBindTexture(GL_TEXTURE_2D, texture_[i]);
      glTexStorage2D(GL_TEXTURE_2D, 1, GL_SRGB8_ALPHA8, wide, tall);
      eyes_->set_images(i, {&texture_[i], 1}, wide, tall);
    }
    glFinish();
    wide_ = wide, tall_ = tall;
  }
  // head: in the room.
  std::array<Image, 2> draw(EyeRenderer::Frame frame, const xr::Place& place, const Pose& head) {
    const Pose at = place.to_world(head);
    const Vec3 apart = rotate(at.q, {0.032f / place.loupe, 0, 0});
    frame.camera = {eye_camera({at.p - apart, at.q}, kLeft, distance(at.p, place.focus)),
                    eye_camera({at.p + apart, at.q}, kRight, distance(at.p, place.focus))};
    frame.width = wide_, frame.height = tall_;
    std::array<Image, 2> image;
    frame.copy = &image;
    EXPECT_TRUE(eyes_->draw(frame));
    return image;
  }
  std::string folder_;
  std::unique_ptr<EyeRenderer> eyes_;
  GLuint texture_[2] = {};
  int wide_ = 0, tall_ = 0;
};

// CATGUT_SCENE selects another scene than the purse string.
TEST_F(Look, around_the_results) {
  const char* given = std::getenv("CATGUT_SCENE");
  const SceneSpec scene = read_scene(given ? given : "purse_string");
  PictureModel picture;
  Snapshot seen;
  LiveResult result;
  SessionHooks hooks;
  hooks.on_start = [&](const PictureModel& model) {
    picture = model;
    result.map = start_map(model, 1.0 / scene.solver.tick_rate);
  };
  hooks.on_tick = [&](const Snapshot& now, const std::string&) { note(result.map, picture, seen = now); };
  run_session(scene, {}, hooks);
  ASSERT_FALSE(result.map.bite.empty());

  const RestTissue rest = rest_tissue(picture);
  xr::Place place;
  place.focus = picture.focus;
  Pose head{{0, 1.6f, 0}, {}};
  recenter(place, head);
  const auto looking = [&](Vec3 from, Vec3 to) {
    const Vec3 z = normalized(from - to), x = normalized(cross({0, 1, 0}, z));
    return Pose{from, from_axes(x, cross(z, x), z)};
  };
  eyes_->stage(&picture, Quality::medium);
  const xr::Place stand = place;
  BiteColor by = BiteColor::depth;
  ResultView view;
  view.scene = &scene, view.result = &result;
  bool styled = false;
  int quarter = 0;
  const auto shoot = [&](const Pose& at) {
    std::vector<xr::StitchMark> mark;
    EyeRenderer::Frame frame;
    frame.snapshot = &seen;
    frame.suture_points = true;
    frame.board = board_at(walked_stand(stand, quarter, at.p), place, false);
    frame.panels = [&] {
      if (!std::exchange(styled, true)) style_panels(1.4f);
      if (mark.empty()) mark = stitch_marks(result.map, rest, seen, by);
      result_panel(view, by);
    };
    // The first frame finds the colors; the labels are in the second.
    draw(frame, place, at);
    const std::vector<Label> label = place_labels(mark, place, place.to_world(at.p));
    frame.label = label;
    return draw(frame, place, at);
  };
  images(1100, 1200);
  const std::array<Image, 2> seat = shoot(looking(head.p, place.at + Vec3{0, 0.08f, 0}));
  for (size_t i = 0; i < 2; ++i) write_png(seat[i], folder_ + (i ? "/results_right.png" : "/results_left.png"));
  write_png(shoot(looking(head.p + Vec3{0, 0, 0.1f}, place.at + Vec3{0.2f, -0.25f, -1.4f}))[0], folder_ + "/results_room.png");

  images(400, 400);
  constexpr int kFrames = 72;
  for (int i = 0; i < kFrames; ++i) {
    const float t = static_cast<float>(i) / kFrames, turn = 2 * kPi * t, near = 1 - 0.35f * std::sin(kPi * t);
    place.loupe = t < 0.1f || t > 0.95f ? 1.0f : 2.0f;
    const Vec3 from = place.at + near * Vec3{0.42f * std::sin(turn), 0.38f, 0.42f * std::cos(turn)};
    write_png(shoot(looking(from, place.at + Vec3{0, 0.02f, 0}))[0], folder_ + fmt::format("/walk_{:03}.png", i));
  }
}

}  // namespace
}  // namespace catgut
#endif
