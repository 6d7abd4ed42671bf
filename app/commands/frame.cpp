// SPDX-License-Identifier: Apache-2.0
// app: `catgut bench frame`: processor time of a headset's frame, without a rasterizer, while a scene runs.
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <memory>
#include <stdexcept>

#include "commands/commands.h"
#include "core/check.h"
#include "core/file.h"
#include "procedure/scene_file.h"
#include "technique/technique.h"

namespace catgut {
namespace {

constexpr double kFrameEvery = 1.0 / 30;            // [s] simulated: a sufficient sample of a run's frames
constexpr int kEyeWidth = 1440, kEyeHeight = 1584;  // [pixels] a usual headset's

double at_part(std::vector<double>& values, double part) {
  std::sort(values.begin(), values.end());
  return values.empty() ? 0
                        : values[std::min(values.size() - 1, static_cast<size_t>(part * static_cast<double>(values.size())))];
}

}  // namespace

StereoPictures stereo_pictures(const PictureModel& model, float every_s) {
  const std::shared_ptr<FrameCost> picture = make_frame_cost(model, kEyeWidth, kEyeHeight, Quality::medium, 2);
  const auto follow = std::make_shared<FollowCamera>(model);
  return [picture, follow, every_s](const Snapshot& seen) {
    const Camera middle = follow->update(seen, every_s);
    Camera eyes[2] = {middle, middle};
    const Vec3 apart = normalized(cross(middle.target - middle.eye, middle.up)) * 0.032f;
    eyes[0].eye -= apart, eyes[1].eye += apart;
    return picture->frame(seen, eyes);
  };
}

int bench_frame(const FrameOptions& o) {
  SceneSpec scene = read_scene(o.scene);
  for (const std::string& setting : o.set) set_value(scene, setting);
  check_suffix(o.json, ".json", "--json");
  prepare_output(o.json);
  StereoPictures picture;
  std::vector<double> caller, all;
  double next_s = 0;
  SessionHooks hooks;
  hooks.stop = &stop_on_interrupt();
  hooks.on_progress = progress_line();
  hooks.on_start = [&](const PictureModel& model) { picture = stereo_pictures(model, static_cast<float>(kFrameEvery)); };
  hooks.on_tick = [&](const Snapshot& seen, const std::string&) {
    if (seen.time_s < next_s) return;
    next_s = seen.time_s + kFrameEvery;
    const FrameCost::Times t = picture(seen);
    caller.push_back(t.caller_ms), all.push_back(t.all_ms);
  };
  SessionOptions session;
  session.seconds = o.seconds;
  session.surgeon = scene.technique.name == kNoTechnique ? "none" : "scripted";
  RunResult run;
  try {
    run = run_session(scene, session, hooks);
  } catch (const InputError&) { throw; } catch (const std::runtime_error& error) {
    throw InputError("bench frame", error.what(), "build with -DCATGUT_RENDER=ON");
  }
  end_progress_line();
  if (caller.size() > 30) {  // the first second compiles materials and fills caches
    caller.erase(caller.begin(), caller.begin() + 30);
    all.erase(all.begin(), all.begin() + 30);
  }
  const double median = at_part(caller, 0.5), p99 = at_part(caller, 0.99), all_median = at_part(all, 0.5),
               all_p99 = at_part(all, 0.99);
  if (!o.json.empty())
    write_output(
        o.json,
        fmt::format("{{\"scene\": \"{}\", \"eyes\": 2, \"frames\": {}, \"frame_ms\": {{\"median\": {:.3f}, \"p99\": {:.3f}}}, "
                    "\"all_threads_ms\": {{\"median\": {:.3f}, \"p99\": {:.3f}}}}}\n",
                    scene.name, caller.size(), median, p99, all_median, all_p99));
  if (o.json != "-")
    std::printf(
        "%s: %zu stereo frames, not rasterized; CPU time per frame [ms]\n"
        "                     median    p99\n"
        "render thread      %8.2f %6.2f\n"
        "all threads        %8.2f %6.2f\n",
        scene.name.c_str(), caller.size(), median, p99, all_median, all_p99);
  return run.interrupted ? 130 : 0;
}

}  // namespace catgut
