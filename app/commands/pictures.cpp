// SPDX-License-Identifier: Apache-2.0
// app: `catgut bench pictures`; see pictures.h.
#include "commands/pictures.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <ctime>
#include <stdexcept>
#include <thread>
#include <vector>

#include "commands/commands.h"
#include "core/check.h"
#include "device/bite_guide.h"
#include "procedure/scene_file.h"
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

// The magnifier at the needle's tip, of the window's size, in the lower left corner.
Inset inset_at(const PictureModel& picture, const Snapshot& seen, const Camera& camera, int width, int height) {
  const Vec3 tip = on_needle(picture, seen.active().needle.pose, 1, seen.active_suture);
  const int side = inset_side(width, height);
  return {magnified(camera, tip, kInsetHalf), 0, height - side, side};
}

}  // namespace

int bench_pictures(const std::string& name) {
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
  const auto model = build_model(read_scene(name));
  Snapshot seen;
  publish(*model, *initial_state(*model), seen);
  const PictureModel picture = picture_model(*model);
  const Camera camera = camera_of(start_orbit(picture, seen.active().needle.pose.p));
  std::printf("%s, %u processors; median of up to %d pictures, complete to the last pixel\n%-10s %-9s %10s %9s %11s %14s\n",
              name.c_str(), std::thread::hardware_concurrency(), kPictures, "size", "quality", "resolution", "[ms]",
              "pictures/s", "processor [ms]");
  const std::atomic<bool>& stop = stop_on_interrupt();
  for (const Size& size : kSizes)
    for (const Row& row : kRows) {
      if (stop) return 130;
      std::vector<double> wall, cpu;
      try {
        const auto renderer = make_renderer(picture, size.width, size.height, row.level);
        renderer->set_resolution_scale(row.part);
        Overlay over;
        if (row.inset) over.inset = inset_at(picture, seen, camera, size.width, size.height);
        for (int i = 0; i < 2; ++i) renderer->draw(seen, camera, over);  // compiles the materials
        const auto begin = std::chrono::steady_clock::now();
        for (int i = 0; i < kPictures; ++i) {
          const auto start = std::chrono::steady_clock::now();
          const double used = cpu_ms();
          renderer->draw(seen, camera, over);
          const auto end = std::chrono::steady_clock::now();
          wall.push_back(std::chrono::duration<double, std::milli>(end - start).count());
          cpu.push_back(cpu_ms() - used);
          if (std::chrono::duration<double>(end - begin).count() > kLongEnough) break;
        }
      } catch (const std::runtime_error& error) {
        throw InputError("bench pictures", error.what(), "install a graphics driver");
      }
      const double ms = median(wall);
      std::printf("%4dx%-5d %-9s %8.0f %% %9.1f %11.1f %14.1f\n", size.width, size.height, row.quality,
                  static_cast<double>(100 * row.part), ms, 1000 / ms, median(cpu));
      std::fflush(stdout);
    }
  return 0;
}

}  // namespace catgut
