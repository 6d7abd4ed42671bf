// SPDX-License-Identifier: Apache-2.0
// app: `catgut bench pictures`; see pictures.h.
#include "commands/pictures.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <ctime>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "commands/commands.h"
#include "core/check.h"
#include "device/bite_guide.h"
#include "procedure/scene_file.h"
#include "render/eyes.h"
#include "render/orbit.h"
#include "render/renderer.h"
#include "sim/simulation.h"

namespace catgut {
namespace {

constexpr int kPictures = 9;
constexpr double kLongEnough = 8;  // [s] per row: a machine without a graphics card draws `high` in seconds

double cpu_ms() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
}

double median(std::vector<double> v) {
  std::sort(v.begin(), v.end());
  return v[v.size() / 2];
}

struct Spent {
  std::vector<double> wall, cpu;  // [ms] of each picture
};

void print_row(int width, int height, const char* quality, float part, const Spent& spent) {
  const double ms = median(spent.wall);
  std::printf("%4dx%-5d %-9s %8.0f %% %9.1f %11.1f %14.1f\n", width, height, quality, static_cast<double>(100 * part), ms,
              1000 / ms, median(spent.cpu));
  std::fflush(stdout);
}

template <typename Draw>
Spent time_of(const Draw& draw) {
  for (int i = 0; i < 2; ++i) draw();  // compiles the materials
  Spent spent;
  const auto begin = std::chrono::steady_clock::now();
  for (int i = 0; i < kPictures; ++i) {
    const auto start = std::chrono::steady_clock::now();
    const double used = cpu_ms();
    draw();
    const auto end = std::chrono::steady_clock::now();
    spent.wall.push_back(std::chrono::duration<double, std::milli>(end - start).count());
    spent.cpu.push_back(cpu_ms() - used);
    if (std::chrono::duration<double>(end - begin).count() > kLongEnough) break;
  }
  return spent;
}

// Both eyes' images of a headset, without a runtime: what remains for it is to show them.
class Headset {
 public:
  Headset() : eyes_(make_eye_renderer(GlBinding::egl, "")) { eyes_->make_current(); }
  ~Headset() {
    if (width_ > 0) give_back();
  }

  // The card, as its driver names it.
  std::string card() const {
    constexpr unsigned kRenderer = 0x1F01;  // GL_RENDERER
    const auto* name = gl<const unsigned char*(unsigned)>("glGetString")(kRenderer);
    return name ? reinterpret_cast<const char*>(name) : "unknown";
  }

  void resize(int width, int height) {
    constexpr unsigned kTexture2D = 0x0DE1, kSrgb8Alpha8 = 0x8C43;  // GL_TEXTURE_2D, GL_SRGB8_ALPHA8
    if (width_ > 0) give_back();
    eyes_->make_current();
    gl<void(int, unsigned*)>("glGenTextures")(2, texture_);
    for (int i = 0; i < 2; ++i) {
      gl<void(unsigned, unsigned)>("glBindTexture")(kTexture2D, texture_[i]);
      gl<void(unsigned, int, unsigned, int, int)>("glTexStorage2D")(kTexture2D, 1, kSrgb8Alpha8, width, height);
      eyes_->set_images(i, {&texture_[i], 1}, width, height);
    }
    gl<void()>("glFinish")();
    width_ = width, height_ = height;
  }

  EyeRenderer& eyes() { return *eyes_; }

 private:
  template <typename Function>
  Function* gl(const char* name) const {
    return reinterpret_cast<Function*>(eyes_->handles().get_proc_address(name));
  }
  void give_back() {
    eyes_->drop_images();
    eyes_->make_current();
    gl<void(int, const unsigned*)>("glDeleteTextures")(2, texture_);
  }

  std::unique_ptr<EyeRenderer> eyes_;
  unsigned texture_[2] = {};
  int width_ = 0, height_ = 0;
};

// Pixels of one eye: Valve Index, Meta Quest 3.
constexpr std::array<std::array<int, 2>, 2> kEyes{{{1440, 1600}, {2064, 2208}}};
constexpr float kEyeDistance = 0.063f;  // [m] of an adult
constexpr Frustum kLeftEye{-1.2f, 0.8f, -1.0f, 0.8f}, kRightEye{-0.8f, 1.2f, -1.0f, 0.8f};

std::array<Camera, 2> eyes_at(const Camera& middle) {
  std::array<Camera, 2> eye{middle, middle};
  const Vec3 across = normalized(cross(middle.target - middle.eye, middle.up));
  for (size_t i = 0; i < 2; ++i) {
    const Vec3 by = (i == 0 ? -0.5f : 0.5f) * kEyeDistance * across;
    eye[i].eye = middle.eye + by, eye[i].target = middle.target + by;
    eye[i].frustum = i == 0 ? kLeftEye : kRightEye;
  }
  return eye;
}

// The magnifier at the needle's tip, of the window's size, in the lower left corner.
Inset inset_at(const PictureModel& picture, const Snapshot& seen, const Camera& camera, int width, int height) {
  const Vec3 tip = on_needle(picture, seen.active().needle.pose, 1, seen.active_suture);
  const int side = inset_side(width, height);
  return {magnified(camera, tip, kInsetHalf), 0, height - side, side};
}

int table(const std::string& name, const std::vector<std::string>& set) {
  struct Size {
    int width, height;
  };
  struct Row {
    const char* quality;
    Quality level;
    float part;  // of the resolution in each direction
    bool inset = false;
  };
  constexpr Size kSizes[] = {{640, 360}, {1280, 720}, {1920, 1080}};
  constexpr Row kRows[] = {{"low", Quality::low, 0.25f}, {"low+inset", Quality::low, 0.25f, true},
                           {"low", Quality::low, 0.5f},  {"low+inset", Quality::low, 0.5f, true},
                           {"low", Quality::low, 0.7f},  {"low+inset", Quality::low, 0.7f, true},
                           {"low", Quality::low, 1.0f},  {"medium", Quality::medium, 1.0f},
                           {"high", Quality::high, 1.0f}};
  SceneSpec scene = read_scene(name);
  for (const std::string& setting : set) set_value(scene, setting);
  const auto model = build_model(scene);
  Snapshot seen;
  publish(*model, *initial_state(*model), seen);
  const PictureModel picture = picture_model(*model);
  const Camera camera = camera_of(start_orbit(picture, seen.active().needle.pose.p));
  Headset headset;
  std::printf("%s\n%s, %u processors; median of up to %d pictures, complete to the last pixel\n%-10s %-9s %10s %9s %11s %14s\n",
              headset.card().c_str(), name.c_str(), std::thread::hardware_concurrency(), kPictures, "size", "quality",
              "resolution", "[ms]", "pictures/s", "processor [ms]");
  const std::atomic<bool>& stop = stop_on_interrupt();
  for (const Size& size : kSizes)
    for (const Row& row : kRows) {
      if (stop) return 130;
      const auto renderer = make_renderer(picture, size.width, size.height, row.level);
      renderer->set_resolution_scale(row.part);
      Overlay over;
      if (row.inset) over.inset = inset_at(picture, seen, camera, size.width, size.height);
      print_row(size.width, size.height, row.quality, row.part, time_of([&] { renderer->draw(seen, camera, over); }));
    }

  headset.eyes().stage(&picture, Quality::low);
  std::printf("both eyes of a headset, each of this size\n");
  for (const auto& [width, height] : kEyes)
    for (const auto& [quality, level] :
         {std::pair{"low", Quality::low}, {"medium", Quality::medium}, {"high", Quality::high}}) {
      if (stop) return 130;
      headset.eyes().stage(&picture, level);
      headset.resize(width, height);
      EyeRenderer::Frame frame;
      frame.snapshot = &seen, frame.camera = eyes_at(camera), frame.width = width, frame.height = height;
      print_row(width, height, quality, 1, time_of([&] { headset.eyes().draw(frame); }));
    }
  return 0;
}

}  // namespace

int bench_pictures(const std::string& scene, const std::vector<std::string>& set) {
  try {
    return table(scene, set);
  } catch (const InputError&) { throw; } catch (const std::runtime_error& error) {
    throw InputError("bench pictures", error.what(), "install a graphics driver");
  }
}

}  // namespace catgut
