// SPDX-License-Identifier: Apache-2.0
// tests/render: images show the snapshot; image files can be written and read. Needs an EGL driver, else skips.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <stdexcept>

#include "render/renderer.h"
#include "render/video.h"
#include "scene.h"

namespace catgut {
namespace {

constexpr int kWidth = 320, kHeight = 180;

// One renderer and one picture for all tests: starting it takes longer than the pictures.
struct Stage {
  explicit Stage(const TestField& with) : field(with) {}
  TestField field;
  std::unique_ptr<Renderer> renderer = make_renderer(field.model, kWidth, kHeight, Quality::low);
  Camera camera = overview(field.model);
  Image picture = renderer->render(field.snapshot, camera);
};
Stage& stage() {
  static Stage the_stage{make_test_field()};
  return the_stage;
}

#define NEEDS_RENDERER() \
  if (!renderer_available()) GTEST_SKIP() << "no EGL driver here, or a build without pictures (CATGUT_RENDER=OFF)"

std::string temporary(const std::string& name) {
  const auto folder = std::filesystem::temp_directory_path() / ("catgut_render_" + std::to_string(::getpid()));
  std::filesystem::create_directories(folder);
  return (folder / name).string();
}

// Position of a scene point in the image.
std::array<int, 2> project(const Camera& camera, Vec3 point) {
  const Vec3 ahead = normalized(camera.target - camera.eye), right = normalized(cross(ahead, camera.up));
  const Vec3 up = cross(right, ahead), d = point - camera.eye;
  const float scale = 0.5f * kHeight / std::tan(0.5f * camera.fov_deg * kPi / 180) / dot(d, ahead);
  return {int(0.5f * kWidth + scale * dot(d, right)), int(0.5f * kHeight - scale * dot(d, up))};
}

int difference(const Image& a, const Image& b) {
  int changed = 0;
  for (size_t i = 0; i < a.rgba.size(); i += 4)
    changed += std::abs(a.rgba[i] - b.rgba[i]) + std::abs(a.rgba[i + 1] - b.rgba[i + 1]) > 24;
  return changed;
}

bool reddish(Color c) { return c[0] > c[1] + 8 && c[0] > c[2]; }
bool greenish(Color c) { return c[1] > c[0] + 8; }
bool bluish(Color c) { return c[2] > c[0] + 12 && c[2] > c[1] + 12; }

TEST(Pictures, TissueIsWhereTheMeshIsAndTheDrapeRoundIt) {
  NEEDS_RENDERER();
  const Stage& s = stage();
  ASSERT_EQ(s.picture.rgba.size(), size_t(kWidth * kHeight * 4));
  int red = 0, looked = 0;
  for (int i = 0; i < 40; ++i) {
    // The outside of the near wall: half a turn facing the camera, some way below the rim.
    const float side = std::atan2(s.camera.eye.x, s.camera.eye.z) + 0.9f * (float(i % 8) / 7 - 0.5f);
    const auto [x, y] = project(s.camera, {0.02f * std::sin(side), -0.006f - 0.003f * float(i / 8), 0.02f * std::cos(side)});
    if (x < 0 || y < 0 || x >= kWidth || y >= kHeight) continue;
    ++looked;
    red += reddish(pixel(s.picture, x, y));
  }
  ASSERT_GT(looked, 20);
  EXPECT_GT(red, looked * 6 / 10);  // tools and their shadows may hide some
  EXPECT_TRUE(greenish(pixel(s.picture, kWidth / 10, kHeight - 12)));
  EXPECT_TRUE(greenish(pixel(s.picture, kWidth / 2, 3)));
}

TEST(Pictures, TheThreadShowsInItsColor) {
  NEEDS_RENDERER();
  Stage& s = stage();
  int blue = 0;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) blue += bluish(pixel(s.picture, x, y));
  EXPECT_GT(blue, 30);
  Snapshot without = s.field.snapshot;
  without.active().thread_order.clear();
  const Image bare = s.renderer->render(without, s.camera);
  int left = 0;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) left += bluish(pixel(bare, x, y));
  EXPECT_LT(left, blue / 4);
}

// Physics holds the thread to within a fraction of a millimeter of the particles' surface, not of the drawn one.
TEST(Pictures, ThreadThatSankIntoTheWallIsDrawnOnIt) {
  NEEDS_RENDERER();
  Stage& s = stage();
  Snapshot sunk = s.field.snapshot;
  sunk.tool = {};
  for (InstrumentView& tool : sunk.instrument) tool.pose.p = {0, 5, 0};
  sunk.active().needle.pose.p = {0, 5, 0};
  sunk.active().suture_point.clear();
  const float toward = std::atan2(s.camera.eye.x, s.camera.eye.z);
  const auto count = [&](float radius) {
    for (size_t i = 0; i < sunk.active().thread_order.size(); ++i) {
      const float a = toward - 0.5f + float(i) / float(sunk.active().thread_order.size() - 1);
      sunk.particle[sunk.active().thread_order[i]] = {radius * std::sin(a), -0.012f, radius * std::cos(a)};
    }
    const Image picture = s.renderer->render(sunk, s.camera);
    int blue = 0;
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) blue += bluish(pixel(picture, x, y));
    return blue;
  };
  const int on_it = count(0.0203f);
  ASSERT_GT(on_it, 20);
  EXPECT_GT(count(0.0192f), 0.8f * float(on_it));  // 0.8 mm below the surface
}

// From the lumen over the rim and down the outer side: what lies there belongs to the outer side, and is not drawn on the inner
// one.
TEST(Pictures, ThreadThatGoesOverTheRimIsDrawnOnTheOuterSide) {
  NEEDS_RENDERER();
  constexpr float kThin = 0.002f;  // [m] the inner side is within the reach of the search
  Stage s{make_test_field(96, 40, kThin)};
  Snapshot over = s.field.snapshot;
  over.tool = {};
  for (InstrumentView& tool : over.instrument) tool.pose.p = {0, 5, 0};
  over.active().needle.pose.p = {0, 5, 0};
  over.active().suture_point.clear();
  const float toward = std::atan2(s.camera.eye.x, s.camera.eye.z), inner = 0.0197f - kThin;
  const auto at = [&](float radius, float y) { return Vec3{radius * std::sin(toward), y, radius * std::cos(toward)}; };
  // Blue pixels about the outer side, below the rim.
  const auto count = [&](Vec3 from) {
    const std::array<Vec3, 4> corner{from, at(0.5f * (0.0203f + inner), 0.0006f), at(0.0200f, 0.0002f), at(0.0199f, -0.010f)};
    const size_t n = over.active().thread_order.size();
    for (size_t i = 0; i < n; ++i) {
      const float t = 3 * float(i) / float(n - 1);
      const size_t k = std::min<size_t>(size_t(t), 2);
      over.particle[over.active().thread_order[i]] = lerp(corner[k], corner[k + 1], t - float(k));
    }
    const Image picture = s.renderer->render(over, s.camera);
    const auto [x0, top] = project(s.camera, at(0.0203f, -0.002f));
    const auto [x1, bottom] = project(s.camera, at(0.0203f, -0.010f));
    int blue = 0;
    for (int y = std::max(top, 0); y < std::min(bottom, kHeight); ++y)
      for (int x = x0 - 8; x < x0 + 8; ++x) blue += bluish(pixel(picture, x, y));
    return blue;
  };
  const int from_outside = count(at(0.0203f, 0.002f));
  ASSERT_GT(from_outside, 10);
  EXPECT_GT(count(at(inner, -0.006f)), 0.8f * float(from_outside));
}

// Physics has no cloth: a slack thread falls through the drape's plane.
TEST(Pictures, ThreadThatSankIntoTheDrapeIsDrawnOnIt) {
  NEEDS_RENDERER();
  Stage& s = stage();
  Snapshot sunk = s.field.snapshot;
  sunk.tool = {};
  for (InstrumentView& tool : sunk.instrument) tool.pose.p = {0, 5, 0};
  sunk.active().needle.pose.p = {0, 5, 0};
  sunk.active().suture_point.clear();
  // The drape as seen in the left of the picture, clear of the organ.
  const Vec3 ahead = normalized(s.camera.target - s.camera.eye), right = normalized(cross(ahead, s.camera.up));
  const float tall = std::tan(0.5f * s.camera.fov_deg * kPi / 180);
  const Vec3 ray = ahead - right * (0.65f * tall * kWidth / kHeight);
  const Vec3 middle = s.camera.eye + ray * ((s.field.model.drape - s.camera.eye.y) / ray.y);
  const auto count = [&](float height) {
    const auto& order = sunk.active().thread_order;
    for (size_t i = 0; i < order.size(); ++i) {
      const float t = float(i) / float(order.size() - 1) - 0.5f;
      sunk.particle[order[i]] = middle + right * (0.03f * t) + Vec3{0, height, 0};
    }
    const Image picture = s.renderer->render(sunk, s.camera);
    int blue = 0;
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) blue += bluish(pixel(picture, x, y));
    return blue;
  };
  const int on_it = count(0.001f);
  ASSERT_GT(on_it, 20);
  EXPECT_GT(count(-0.003f), 0.8f * float(on_it));  // 3 mm below the cloth
}

// While the needle is in the wall, nothing but the thread is drawn in its color, unless the guide of preset `paper` is wanted.
TEST(Pictures, NoSecondStrandRunsBesideTheNeedleInTheWall) {
  NEEDS_RENDERER();
  Stage& s = stage();
  Snapshot bite = s.field.snapshot;
  bite.tool = {};
  for (InstrumentView& tool : bite.instrument) tool.pose.p = {0, 5, 0};
  bite.active().thread_order.clear();  // no thread: what remains in its color is a second strand
  bite.active().needle.in_tissue = true;
  bite.active().needle.bite = 0;
  bite.active().bite.resize(1);
  const float toward = std::atan2(s.camera.eye.x, s.camera.eye.z);
  bite.active().bite[0].entry = {0.0204f * std::sin(toward), -0.010f, 0.0204f * std::cos(toward)};
  const auto count = [&](Renderer& renderer) {
    const Image picture = renderer.render(bite, s.camera);
    int blue = 0;
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) blue += bluish(pixel(picture, x, y));
    return blue;
  };
  PictureModel guided = s.field.model;
  guided.visual_guide = true;
  EXPECT_GT(count(*make_renderer(guided, kWidth, kHeight, Quality::low)), 10) << "the test's camera does not see the strand";
  EXPECT_LT(count(*s.renderer), 3);
}

TEST(Pictures, TheNeedleIsALineFromFarAway) {
  NEEDS_RENDERER();
  Stage& s = stage();
  // From 1 m at 180 lines a wire of 0.66 mm is a quarter of a pixel wide.
  Camera far = s.camera;
  far.eye = far.target + normalized(far.eye - far.target) * 0.5f;
  Snapshot without = s.field.snapshot;
  without.active().needle.pose.p = {0, 5, 0};
  const Image bare = s.renderer->render(without, far), picture = s.renderer->render(s.field.snapshot, far);
  // The needle's arc, 26 mm, covers as many pixels as it is long.
  const float pixels = kHeight * s.field.model.suture[0].needle_radius * s.field.model.suture[0].needle_arc /
                       (2 * 0.5f * std::tan(0.5f * far.fov_deg * kPi / 180));
  EXPECT_GT(difference(bare, picture), int(0.5f * pixels));
}

TEST(Pictures, TheInsetMagnifiesTheNeedleAndLeavesTheRestAlone) {
  NEEDS_RENDERER();
  Stage& s = stage();
  constexpr int side = 80;
  const SuturePicture& suture = s.field.model.suture[0];
  const Vec3 tip = transform(s.field.snapshot.active().needle.pose, {suture.needle_radius * std::cos(suture.needle_arc),
                                                                     suture.needle_radius * std::sin(suture.needle_arc), 0});
  Snapshot without = s.field.snapshot;
  without.active().needle.pose.p = {0, 5, 0};
  Overlay over;
  over.inset = Inset{magnified(s.camera, tip, kInsetHalf), kWidth - side - 4, 6, side};
  const auto inside = [&](size_t i) {
    const int x = static_cast<int>(i / 4) % kWidth, y = static_cast<int>(i / 4) / kWidth;
    return x >= over.inset->x && x < over.inset->x + side && y >= over.inset->y && y < over.inset->y + side;
  };
  const auto renderer = make_renderer(s.field.model, kWidth, kHeight, Quality::low);
  for (const float part : {0.5f, 1.0f, 0.5f}) {
    renderer->set_resolution_scale(part);
    const Image plain = renderer->render(s.field.snapshot, s.camera), with = renderer->render(s.field.snapshot, s.camera, over),
                bare = renderer->render(without, s.camera, over);
    size_t outside = 0, magnified_pixels = 0, coarse_pixels = 0;
    for (size_t i = 0; i < plain.rgba.size(); i += 4) {
      const auto off = [&](const Image& a, const Image& b) {
        return std::abs(a.rgba[i] - b.rgba[i]) + std::abs(a.rgba[i + 1] - b.rgba[i + 1]) > 24;
      };
      if (!inside(i)) outside += off(plain, with), coarse_pixels += off(with, bare);
      else magnified_pixels += off(with, bare);
    }
    // At whole resolution without an inset the materials convert the tones themselves, nearly the same.
    if (part < 1) { EXPECT_LT(outside, 20u) << "resolution " << part; }
    // Half its height of needle at least, as thick as the wire.
    const float thick = suture.needle_wire_radius / kInsetHalf * side;
    EXPECT_GT(static_cast<float>(magnified_pixels), 0.5f * side * thick) << "resolution " << part;
    EXPECT_GT(coarse_pixels, 0u);
  }
}

TEST(Pictures, MovingAParticleMovesThePicture) {
  NEEDS_RENDERER();
  Stage& s = stage();
  EXPECT_EQ(difference(s.picture, s.renderer->render(s.field.snapshot, s.camera)), 0);  // and everything else is equal
  Snapshot pushed = s.field.snapshot;
  for (uint32_t i = 0; i < 16; ++i) pushed.particle[i].y += 0.004f;
  EXPECT_GT(difference(s.picture, s.renderer->render(pushed, s.camera)), 200);
  Snapshot moved = s.field.snapshot;
  moved.instrument[0].jaw = 1;
  EXPECT_GT(difference(s.picture, s.renderer->render(moved, s.camera)), 40);
}

TEST(Pictures, MarkersAndCaptionsComeAndGo) {
  NEEDS_RENDERER();
  Stage& s = stage();
  EXPECT_GT(difference(s.picture, s.renderer->render(s.field.snapshot, s.camera, {"", true})), 5);
  EXPECT_GT(difference(s.picture, s.renderer->render(s.field.snapshot, s.camera, {"bite 3 of 12 - 14.2 s", false})), 100);
  EXPECT_EQ(difference(s.picture, s.renderer->render(s.field.snapshot, s.camera)), 0);
}

TEST(Pictures, WildSnapshotsDoNotBringItDown) {
  NEEDS_RENDERER();
  Stage& s = stage();
  Snapshot wild = s.field.snapshot;
  wild.particle[3] = {NAN, 1e30f, 0};
  wild.particle[wild.active().thread_order[5]] = {NAN, NAN, NAN};
  wild.active().thread_order.resize(1);
  wild.active().needle.pose.p = {NAN, 0, 0};
  EXPECT_NO_THROW(s.renderer->render(wild, s.camera));
  Snapshot long_thread = s.field.snapshot;
  const auto once = long_thread.active().thread_order;
  long_thread.active().thread_order.insert(long_thread.active().thread_order.end(), once.begin(), once.end());
  EXPECT_NO_THROW(s.renderer->render(long_thread, s.camera));
  EXPECT_EQ(difference(s.picture, s.renderer->render(s.field.snapshot, s.camera)), 0);
}

TEST(Pictures, SizesThatCannotBeAreRefused) {
  const TestField field = make_test_field(8, 2);
  EXPECT_THROW(make_renderer(field.model, 0, 100, Quality::low), std::runtime_error);
}

TEST(Pngs, RoundTrip) {
  Image image = make_image(40, 20, {10, 20, 30, 255});
  draw_text(image, 2, 2, "q\x01", {255, 255, 255, 255});
  const std::string path = temporary("round.png");
  write_png(image, path);
  const Image back = read_png(path);
  EXPECT_EQ(back.width, 40);
  EXPECT_EQ(back.rgba, image.rgba);
  EXPECT_THROW(read_png(temporary("missing.png")), std::runtime_error);
  EXPECT_THROW(write_png(image, "/nonexistent/folder/x.png"), std::runtime_error);
  EXPECT_THROW(write_png(Image{}, path), std::runtime_error);
}

TEST(Pngs, ContactSheetShowsEveryCellWithItsCaption) {
  std::vector<SheetCell> cells;
  for (int i = 0; i < 5; ++i)
    cells.push_back(
        {make_image(60, 30, {uint8_t(40 * i + 50), 0, 0, 255}), "bite " + std::to_string(i) + " with a long caption"});
  const std::string path = temporary("sheet.png");
  write_png(contact_sheet(cells, 3), path);
  const Image sheet = read_png(path);
  EXPECT_EQ(sheet.width, 6 + 3 * 66);
  EXPECT_EQ(sheet.height, 6 + 2 * 52);
  for (int i = 0; i < 5; ++i) EXPECT_EQ(pixel(sheet, 30 + i % 3 * 66, 20 + i / 3 * 52)[0], 40 * i + 50);
  int lit = 0;
  for (int x = 0; x < 66; ++x)
    for (int y = 37; y < 52; ++y) lit += pixel(sheet, x, y)[0] > 200;
  EXPECT_GT(lit, 30);
  EXPECT_GT(contact_sheet({}, 4).width, 0);
}

TEST(Videos, AFileComesOut) {
  if (!video_available()) GTEST_SKIP() << "the program ffmpeg is not installed";
  const std::string path = temporary("video.mp4");
  VideoWriter video(path, 64, 48, 30);
  for (int i = 0; i < 10; ++i) video.add(make_image(64, 48, {uint8_t(20 * i), 90, 60, 255}));
  EXPECT_THROW(video.add(make_image(32, 48, {})), std::runtime_error);
  video.finish();
  EXPECT_GT(std::filesystem::file_size(path), 500u);
  EXPECT_THROW(video.add(make_image(64, 48, {})), std::runtime_error);
}

TEST(Videos, ABrokenPipeIsAnErrorAndNotTheEnd) {
  if (!video_available()) GTEST_SKIP() << "the program ffmpeg is not installed";
  EXPECT_THROW(VideoWriter(temporary("odd.mp4"), 63, 48, 30), std::runtime_error);
  VideoWriter video("/nonexistent/folder/video.mp4", 640, 480, 30);
  const Image frame = make_image(640, 480, {1, 2, 3, 255});
  EXPECT_THROW(
      {
        for (int i = 0; i < 200; ++i) video.add(frame);
        video.finish();
      },
      std::runtime_error);
}

TEST(FollowCameras, NeverJump) {
  TestField field = make_test_field(8, 2);
  FollowCamera follow(field.model);
  Snapshot s = field.snapshot;
  const float dt = 1.0f / 30;
  Camera last = follow.update(s, dt);
  for (int i = 0; i < 600; ++i) {
    // The needle orbits, and jumps every two seconds.
    const float a = 0.01f * float(i) + 2.3f * float(i / 60);
    s.active().needle.pose.p = Vec3{0.02f * std::cos(a), 0.01f, 0.02f * std::sin(a)};
    if (i % 97 == 0) s.active().needle.pose.p = {NAN, 0, 0};
    const Camera now = follow.update(s, dt);
    ASSERT_TRUE(is_finite(now.eye));
    EXPECT_LT(distance(now.eye, last.eye), 0.004f) << "frame " << i;
    EXPECT_GT(now.eye.y, now.target.y);
    last = now;
  }
}

}  // namespace
}  // namespace catgut
