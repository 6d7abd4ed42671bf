// SPDX-License-Identifier: Apache-2.0
// tests/xr: the two pictures against geometry, without a runtime: a white board of known size and place, projected by hand
// through each eye's four half angles.
#ifdef CATGUT_TESTS_HEADSET
#include <epoxy/gl.h>
#include <gtest/gtest.h>
#include <imgui.h>

#include <optional>

#include "../hands/x_server.h"
#include "procedure/procedure_file.h"
#include "procedure/scene_file.h"
#include "render/eyes.h"
#include "sim/simulation.h"
#include "window/panels.h"
#include "window/widgets.h"
#include "xr/boards.h"

namespace catgut {
namespace {

constexpr int kWide = 240, kTall = 200;

struct Center {
  double x = 0, y = 0, area = 0;  // [pixels]
};

Center white(const Image& image) {
  Center c;
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      const uint8_t* p = &image.rgba[4 * (size_t(y) * size_t(image.width) + size_t(x))];
      if (p[0] < 200 || p[1] < 200 || p[2] < 200) continue;
      c.x += x + 0.5, c.y += y + 0.5, c.area += 1;
    }
  if (c.area > 0) c.x /= c.area, c.y /= c.area;
  return c;
}

// The center of a square's picture and its area, from the pinhole equations: a sum over a fine grid of its points.
Center expected(const Pose& eye, const Frustum& f, const Board& board) {
  Center c;
  constexpr int kGrid = 200;
  const float tall = board.width * EyeRenderer::kBoardHeight / EyeRenderer::kBoardWidth;
  double weight = 0;
  for (int i = 0; i < kGrid; ++i)
    for (int j = 0; j < kGrid; ++j) {
      const Vec3 on{board.width * ((static_cast<float>(i) + 0.5f) / kGrid - 0.5f),
                    tall * ((static_cast<float>(j) + 0.5f) / kGrid - 0.5f), 0};
      const Vec3 p = to_local(eye, transform(board.pose, on));
      const double tx = static_cast<double>(p.x / -p.z), ty = static_cast<double>(p.y / -p.z);
      const double w = 1 / std::pow(static_cast<double>(-p.z), 3);  // area of a patch in the picture falls so, for one plane
      c.x += w * kWide * (tx - static_cast<double>(f.left)) / static_cast<double>(f.right - f.left);
      c.y += w * kTall * (static_cast<double>(f.up) - ty) / static_cast<double>(f.up - f.down);
      weight += w;
    }
  c.x /= weight, c.y /= weight;
  return c;
}

class Eyes : public testing::TestWithParam<GlBinding> {
 protected:
  void SetUp() override {
    if (!renderer_available()) GTEST_SKIP() << "no EGL driver here";
    if (GetParam() == GlBinding::xlib && !std::getenv("CATGUT_LONG"))
      GTEST_SKIP() << "CATGUT_LONG=1 runs it; session_test.cpp draws both eyes by X11 in every build";
    if (GetParam() == GlBinding::xlib) {
      if (!on_path("Xvfb")) GTEST_SKIP() << "Xvfb is missing (Debian: apt install xvfb)";
      x_ = std::make_unique<XServer>();
      if (x_->display.empty()) GTEST_SKIP() << "Xvfb does not start here";
      setenv("DISPLAY", x_->display.c_str(), 1);
    }
    eyes_ = make_eye_renderer(GetParam(), "");
    eyes_->make_current();
    for (int i = 0; i < 2; ++i) {
      glGenTextures(1, &texture_[i]);
      glBindTexture(GL_TEXTURE_2D, texture_[i]);
      glTexStorage2D(GL_TEXTURE_2D, 1, GL_SRGB8_ALPHA8, kWide, kTall);
      eyes_->set_images(i, {&texture_[i], 1}, kWide, kTall);
    }
    glFinish();
  }
  void TearDown() override {
    if (!eyes_) return;
    eyes_->drop_images();
    eyes_->make_current();
    glDeleteTextures(2, texture_);
    eyes_.reset();
  }
  void board_is_where_geometry_puts_it();
  void panels_are_upright();
  void caption_shows_its_part();
  void part_of_the_image_is_drawn();
  void labels_show_their_own_lines();

  std::unique_ptr<XServer> x_;
  std::unique_ptr<EyeRenderer> eyes_;
  GLuint texture_[2] = {};
};

// Field of view of a headset: more outward than toward the nose, more down than up.
constexpr Frustum kLeft{-1.2f, 0.8f, -1.0f, 0.8f}, kRight{-0.8f, 1.2f, -1.0f, 0.8f};

void Eyes::board_is_where_geometry_puts_it() {
  const auto model = build_model(read_scene("stay"));
  const auto state = initial_state(*model);
  Snapshot seen;
  publish(*model, *state, seen);
  const PictureModel picture = picture_model(*model);
  for (const bool field : {false, true}) {
    if (field) eyes_->stage(&picture, Quality::low);
    const Pose head{picture.focus + Vec3{0.03f, 0.38f, 0.42f},
                    normalized(axis_angle({0, 1, 0}, 0.1f) * axis_angle({1, 0, 0}, -0.6f) * axis_angle({0, 0, 1}, 0.05f))};
    std::array<Pose, 2> eye{head, head};
    eye[0].p += rotate(head.q, {-0.032f, 0, 0});
    eye[1].p += rotate(head.q, {0.032f, 0, 0});
    EyeRenderer::Frame frame;
    frame.snapshot = field ? &seen : nullptr;
    frame.camera = {eye_camera(eye[0], kLeft, 0.55f), eye_camera(eye[1], kRight, 0.55f)};
    frame.width = kWide, frame.height = kTall;
    Board board;
    board.pose = {head.p + rotate(head.q, {0.04f, 0.06f, -0.35f}), normalized(head.q * axis_angle({0, 1, 0}, 0.2f))};
    board.width = 0.12f;
    frame.board = board;
    frame.panels = [] { ImGui::GetBackgroundDrawList()->AddRectFilled({0, 0}, {1280, 720}, 0xffffffffu); };
    std::array<Image, 2> image;
    frame.copy = &image;
    for (int i = 0; i < 3; ++i) ASSERT_TRUE(eyes_->draw(frame));
    if (const char* folder = std::getenv("CATGUT_PICTURES"))
      for (int i = 0; i < 2; ++i)
        write_png(image[size_t(i)],
                  std::string(folder) + (field ? "/board_field_" : "/board_") + (i ? "right.png" : "left.png"));
    // Around a recenter: darker, then black everywhere, in both eyes, with and without a field.
    std::array<Image, 2> dark;
    EyeRenderer::Frame faded = frame;
    faded.brightness = 0.5f, faded.copy = &dark;
    ASSERT_TRUE(eyes_->draw(faded));
    if (field) {
      EXPECT_GT(pixel(image[0], 20, kTall - 20)[1], 80) << "the drape";
      EXPECT_GT(pixel(dark[0], 20, kTall - 20)[1], 15) << "a fade, not a cut";
      EXPECT_LT(pixel(dark[0], 20, kTall - 20)[1], 0.8 * pixel(image[0], 20, kTall - 20)[1]);
    }
    faded.brightness = 0;
    ASSERT_TRUE(eyes_->draw(faded));
    int brightest = 0;
    for (const Image& one : dark)
      for (size_t i = 0; i < one.rgba.size(); ++i)
        if (i % 4 < 3) brightest = std::max<int>(brightest, one.rgba[i]);
    EXPECT_LE(brightest, 2) << "the board too";
    const Center left = white(image[0]), right = white(image[1]);
    const Center want_left = expected(eye[0], kLeft, board), want_right = expected(eye[1], kRight, board);
    ASSERT_GT(left.area, 500);
    EXPECT_NEAR(left.x, want_left.x, 0.6);
    EXPECT_NEAR(left.y, want_left.y, 0.6);
    EXPECT_NEAR(right.x, want_right.x, 0.6);
    EXPECT_NEAR(right.y, want_right.y, 0.6);
    // The direction to a near object turns from right to left between the left and the right eye.
    const auto slope = [&](double x, const Frustum& f) { return f.left + (f.right - f.left) * static_cast<float>(x) / kWide; };
    EXPECT_GT(slope(left.x, kLeft) - slope(right.x, kRight), 0.05) << "left and right are not swapped";
  }
}

// The board's upper left corner is the panels' upper left corner, and its text is not mirrored.
void Eyes::panels_are_upright() {
  EyeRenderer::Frame frame;
  const Frustum f{-1, 1, -0.8f, 0.8f};
  frame.camera = {eye_camera({}, f, 0.5f), eye_camera({}, f, 0.5f)};
  frame.width = kWide, frame.height = kTall;
  frame.board = Board{{{0, 0, -0.5f}, {}}, 0.4f, {}, {}};
  frame.panels = [] {
    ImGui::GetBackgroundDrawList()->AddRectFilled({0, 0}, {1280, 720}, 0xff000000u);
    ImGui::GetBackgroundDrawList()->AddRectFilled({0, 0}, {320, 180}, 0xffffffffu);
  };
  std::array<Image, 2> image;
  frame.copy = &image;
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(eyes_->draw(frame));
  const Center c = white(image[0]);
  ASSERT_GT(c.area, 50);
  EXPECT_NEAR(c.x, kWide * (0.5 - 0.2 * 0.75), 1.5) << "0.15 m left of the middle at 0.5 m";
  EXPECT_NEAR(c.y, kTall * (0.5 - (0.1125 * 0.75 / 0.5) / 1.6), 1.5);
}

// A part of the image: dynamic resolution draws from the lower left corner.
void Eyes::part_of_the_image_is_drawn() {
  EyeRenderer::Frame frame;
  const Frustum f{-1, 1, -1, 1};
  frame.camera = {eye_camera({}, f, 0.5f), eye_camera({}, f, 0.5f)};
  frame.width = kWide / 2, frame.height = kTall / 2;
  frame.board = Board{{{0, 0, -0.5f}, {}}, 4, {}, {}};
  frame.panels = [] { ImGui::GetBackgroundDrawList()->AddRectFilled({0, 0}, {1280, 720}, 0xffffffffu); };
  std::array<Image, 2> image;
  frame.copy = &image;
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(eyes_->draw(frame));
  EXPECT_GT(white(image[0]).area, 0.98 * kWide / 2 * kTall / 2);
  EXPECT_GT(white(image[1]).area, 0.98 * kWide / 2 * kTall / 2);
}

// A second board shows a part of the panels, undistorted.
void Eyes::caption_shows_its_part() {
  EyeRenderer::Frame frame;
  const Frustum f{-1, 1, -0.8f, 0.8f};
  frame.camera = {eye_camera({}, f, 0.5f), eye_camera({}, f, 0.5f)};
  frame.width = kWide, frame.height = kTall;
  frame.caption = Board{{{0.1f, -0.1f, -0.5f}, {}}, 0.2f, {}, {}, {0.25f, 0.5f, 0.75f, 0.75f}};
  EXPECT_NEAR(height_of(*frame.caption), 0.2f * 0.25f * 720 / (0.5f * 1280), 1e-5f);
  frame.panels = [] {
    ImGui::GetBackgroundDrawList()->AddRectFilled({0, 0}, {1280, 720}, 0xff000000u);
    ImGui::GetBackgroundDrawList()->AddRectFilled({320, 360}, {960, 540}, 0xffffffffu);
  };
  std::array<Image, 2> image;
  frame.copy = &image;
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(eyes_->draw(frame));
  const Center c = white(image[0]);
  const double tall = static_cast<double>(height_of(*frame.caption));
  EXPECT_NEAR(c.x, kWide * (0.5 + 0.1 / 0.5 / 2), 1.5);
  EXPECT_NEAR(c.y, kTall * (0.5 + 0.1 / 0.5 / 1.6), 1.5);
  EXPECT_NEAR(c.area, kWide * (0.2 / 0.5 / 2) * kTall * (tall / 0.5 / 1.6), 0.12 * c.area) << "all of it is white";
}

// Two labels of one width: each shows its own part of the sheet, and a rod leads to each of its points.
void Eyes::labels_show_their_own_lines() {
  EyeRenderer::Frame frame;
  const Frustum f{-1, 1, -0.8f, 0.8f};
  frame.camera = {eye_camera({}, f, 0.5f), eye_camera({}, f, 0.5f)};
  frame.width = kWide, frame.height = kTall;
  std::array<Label, 2> label;
  for (size_t k = 0; k < 2; ++k) {
    label[k].pose = {{k == 0 ? -0.25f : 0.25f, 0.1f, -0.5f}, {}};
    label[k].width = 0.45f;
    label[k].point = {Vec3{label[k].pose.p.x - 0.1f, -0.2f, -0.5f}, Vec3{label[k].pose.p.x + 0.1f, -0.2f, -0.5f}};
    label[k].text = {k == 0 ? "1: edge 5.0 | 4.8 mm" : "", "depth 1.5"};
    label[k].color = k == 0 ? 0xff0000ffu : 0xff00ff00u;  // red, green
  }
  frame.label = label;
  frame.panels = [] { ImGui::GetBackgroundDrawList()->AddRectFilled({0, 0}, {1280, 720}, 0xffffffffu); };
  std::array<Image, 2> image;
  frame.copy = &image;
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(eyes_->draw(frame));
  EXPECT_LT(white(image[0]).area, 1000) << "letters, and no part of the panels: the labels have 4500 pixels";
  struct Count {
    int red = 0, green = 0, yellow = 0, cyan = 0, pale = 0;
  };
  std::array<Count, 2> half;  // of the picture: left, right
  for (int y = 0; y < kTall; ++y)
    for (int x = 0; x < kWide; ++x) {
      const uint8_t* p = &image[0].rgba[4 * (size_t(y) * kWide + size_t(x))];
      Count& c = half[x < kWide / 2 ? 0 : 1];
      c.red += p[0] > p[1] + 50 && p[0] > p[2] + 50, c.green += p[1] > p[0] + 50 && p[1] > p[2] + 50;
      if (y < kTall / 2) c.pale += p[0] > 110 && p[1] > 110 && p[2] > 100;
      if (y > kTall * 6 / 10)
        c.yellow += p[0] > 150 && p[1] > 130 && p[2] < 110, c.cyan += p[0] < 110 && p[1] > 130 && p[2] > 130;
    }
  EXPECT_GT(half[0].red, 3);
  EXPECT_EQ(half[0].green, 0);
  EXPECT_GT(half[1].green, 3);
  EXPECT_EQ(half[1].red, 0);
  EXPECT_GT(half[0].pale, half[1].pale * 5 / 4) << "the first has one line more";
  for (const Count& c : half) {
    EXPECT_GT(c.yellow, 5);
    EXPECT_GT(c.cyan, 5);
  }
}

// One test for each binding: an engine and its shaders take longer to start than all pictures.
TEST_P(Eyes, show_boards_where_geometry_puts_them) {
  panels_are_upright();
  caption_shows_its_part();
  part_of_the_image_is_drawn();
  labels_show_their_own_lines();
  board_is_where_geometry_puts_it();
}

// For a look: both eyes at the size of a headset's images, with the board and the caption of a lesson's stage.
TEST_P(Eyes, look_at_a_lesson) {
  const char* folder = std::getenv("CATGUT_PICTURES");
  if (!folder) GTEST_SKIP() << "writes pictures; set CATGUT_PICTURES to a folder";
  constexpr int kBigWide = 1100, kBigTall = 1200;
  eyes_->drop_images();
  eyes_->make_current();
  glDeleteTextures(2, texture_);
  for (int i = 0; i < 2; ++i) {
    glGenTextures(1, &texture_[i]);
    glBindTexture(GL_TEXTURE_2D, texture_[i]);
    glTexStorage2D(GL_TEXTURE_2D, 1, GL_SRGB8_ALPHA8, kBigWide, kBigTall);
    eyes_->set_images(i, {&texture_[i], 1}, kBigWide, kBigTall);
  }
  glFinish();
  const Procedure lesson = read_procedure("first_stitch");
  const auto model = build_model(scene_of(lesson));
  const auto state = initial_state(*model);
  Snapshot seen;
  publish(*model, *state, seen);
  const PictureModel picture = picture_model(*model);
  eyes_->stage(&picture, Quality::medium);
  xr::Place place;
  place.focus = picture.focus;
  const Pose head{{0, 1.6f, 0}, normalized(axis_angle({0, 1, 0}, -0.25f) * axis_angle({1, 0, 0}, -0.55f))};
  recenter(place, {head.p, {}});
  EyeRenderer::Frame frame;
  frame.snapshot = &seen;
  const Pose eyes = place.to_world(head);
  frame.camera = {eye_camera({eyes.p + rotate(eyes.q, {-0.032f, 0, 0}), eyes.q}, kLeft, 0.55f),
                  eye_camera({eyes.p + rotate(eyes.q, {0.032f, 0, 0}), eyes.q}, kRight, 0.55f)};
  frame.width = kBigWide, frame.height = kBigTall;
  frame.board = board_at(place, place, true);
  const ProcedureStage& stage = lesson.stage[2];
  const Panel step{"procedure", {{Tone::accent, stage.title}, {Tone::normal, stage.text}}, 2, 0.2f, 0.5f, 1, 64, 0.8f};
  const Panel now{"state", {{Tone::normal, lesson.title}, {Tone::quiet, "0:12.5   real-time factor 1.00"}}, 2, -1, 0, 0, 0,
                  0.6f};
  std::vector<PlacedPanel> placed;
  frame.panels = [&] {
    if (placed.empty()) style_panels(1.4f);
    placed = place_panels(std::vector<Panel>{step, now}, EyeRenderer::kBoardWidth, EyeRenderer::kBoardHeight, panel_text_size(),
                          {}, placed);
    draw_panels(placed);
  };
  std::array<Image, 2> image;
  frame.copy = &image;
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(eyes_->draw(frame));
    for (const PlacedPanel& p : placed)
      if (p.name == "procedure")
        frame.caption = caption_at(place, place, {p.rect.x, p.rect.y, p.rect.x + p.rect.w, p.rect.y + p.rect.h});
  }
  EXPECT_TRUE(frame.caption.has_value());
  for (size_t i = 0; i < 2; ++i) write_png(image[i], std::string(folder) + (i ? "/lesson_right.png" : "/lesson_left.png"));
}

INSTANTIATE_TEST_SUITE_P(Bindings, Eyes, testing::Values(GlBinding::egl, GlBinding::xlib),
                         [](const auto& one) { return std::string(one.param == GlBinding::egl ? "egl" : "xlib"); });

}  // namespace
}  // namespace catgut
#endif
