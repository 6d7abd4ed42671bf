// SPDX-License-Identifier: Apache-2.0
// app: shared by the commands; see commands.h.
#include <fmt/format.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <thread>

#include "commands/commands.h"
#include "core/check.h"
#include "core/file.h"
#include "procedure/procedure_file.h"
#include "procedure/scene_file.h"
#include "render/camera.h"
#include "sim/recording.h"
#include "sim/simulation.h"

namespace catgut {
namespace {

std::atomic<bool> stop_wanted{false};
static_assert(std::atomic<bool>::is_always_lock_free, "set in a signal handler");

void on_interrupt(int) { stop_wanted = true; }

bool line_open = false;  // the terminal shows a progress line

}  // namespace

CLI::Validator within(double least, double most) {
  return CLI::Validator(
      [least, most](std::string& text) {
        double value = 0;
        if (CLI::detail::lexical_cast(text, value) && value >= least && value <= most) return std::string();
        return fmt::format("{} must be a number in [{}, {}]", text, least, most);
      },
      fmt::format("{} to {}", least, most));
}

void add_picture_options(CLI::App& command, PictureOptions& options) {
  command.add_option("--video", options.video, "time-lapse video")->type_name("FILE.mp4");
  command.add_option("--video-speed", options.speed, "simulated seconds per second of video")
      ->check(within(0.01, 1000.0))
      ->capture_default_str();
  command.add_option("--frames", options.frames, "folder for the video's frames as PNG")->type_name("DIR");
  command.add_option("--contact-sheet", options.contact_sheet, "up to twelve frames on one PNG")->type_name("FILE.png");
  command
      .add_option_function<std::vector<std::string>>(
          "--still",
          [&options](const std::vector<std::string>& all) {
            for (const std::string& one : all) {
              const size_t colon = one.find(':');
              char* end = nullptr;
              const double at_s = std::strtod(one.c_str(), &end);
              if (colon == std::string::npos || end != one.c_str() + colon || !(at_s >= 0) || colon + 1 == one.size())
                throw CLI::ValidationError("--still", one + ": expected SECONDS:FILE.png");
              options.still.emplace_back(at_s, one.substr(colon + 1));
            }
          },
          "one frame in best quality: simulated seconds and a PNG file; repeatable")
      ->type_name("S:FILE.png")
      ->take_all()
      ->allow_extra_args(false);
  command
      .add_option_function<std::string>(
          "--size",
          [&options](const std::string& text) {
            int width = 0, height = 0, used = 0;
            if (std::sscanf(text.c_str(), "%dx%d%n", &width, &height, &used) != 2 || size_t(used) != text.size() ||
                width < 16 || height < 16 || width > 8192 || height > 8192)
              throw CLI::ValidationError("--size", text + ": expected WIDTHxHEIGHT of 16 to 8192 pixels");
            // Even sizes: the film's format requires them.
            options.width = options.still_width = width & ~1, options.height = options.still_height = height & ~1;
          },
          "size of all pictures; default: stills 1920x1080, the others 640x360")
      ->type_name("WxH");
  command
      .add_option("--camera", options.camera,
                  "follow, close (the decisive thing, unobstructed), overview, front, left, right, top, or eye and target "
                  "X,Y,Z,X,Y,Z [m]; default: films follow, stills and the film's end are close")
      ->type_name("NAME")
      ->check(CLI::Validator(
          [](std::string& name) {
            const bool known = name == "follow" || name == "close" || fixed_camera(name, PictureModel{});
            return known ? std::string() : name + ": expected follow, close, overview, front, left, right, top or six numbers";
          },
          ""));
}

void check_picture_files(const PictureOptions& options) {
  check_suffix(options.video, ".mp4", "--video");
  check_suffix(options.contact_sheet, ".png", "--contact-sheet");
  for (const auto& [at_s, path] : options.still) check_suffix(path, ".png", "--still");
}

ProcedureWatch::ProcedureWatch(const std::string& name) : procedure(read_procedure(name)) {}

void ProcedureWatch::start(const SceneSpec& scene, const PictureModel& picture) {
  tick_s_ = 1 / static_cast<double>(scene.solver.tick_rate);
  settle_s_ = static_cast<double>(scene.settle);
  for (size_t k = 0; k < procedure.stage.size(); ++k) demo_tasks(procedure, k, scene, picture);  // reports errors early
}

void ProcedureWatch::tick(const Snapshot& seen) {
  if (run.begun) update_run(run, procedure, seen);
  else if (seen.time_s > settle_s_ - 0.5 * tick_s_) begin_run(run, procedure, seen, tick_s_);
}

void ProcedureWatch::save_stage(const std::string& folder, const SceneSpec& scene, const Model& model, const State& state) {
  if (!run.begun || run.stage < saved_ || finished(run, procedure)) return;
  saved_ = run.stage + 1;
  save_state_as(state_file(folder, "_" + procedure.stage[run.stage].name), scene, save_state(model, state));
}

std::string ProcedureWatch::state_file(const std::string& folder, const std::string& stage) const {
  std::string name = procedure.name + stage + ".cgrec";
  std::replace(name.begin(), name.end(), ' ', '_');
  return (std::filesystem::path(folder) / name).string();
}

void ProcedureWatch::save_state_as(const std::string& path, const SceneSpec& scene, const std::vector<std::byte>& state) {
  prepare_output(path);
  Recorder(path, RecordingHeader{catgut_version(), kStateVersion, write_scene(scene)}, state).finish(false);
}

void add_threads_option(CLI::App& command, int& threads) {
  threads = default_threads();
  command.add_option("--threads", threads, "solver threads; the result does not depend on their number")
      ->check(CLI::Range(1, 64))
      ->capture_default_str();
}

const std::atomic<bool>& stop_on_interrupt() {
  struct sigaction action = {};
  action.sa_handler = on_interrupt;
  action.sa_flags = static_cast<int>(SA_RESETHAND);
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  return stop_wanted;
}

std::function<void(const Progress&)> progress_line() {
  const bool terminal = isatty(STDERR_FILENO);
  return [terminal, calls = 0](const Progress& p) mutable {
    if (!terminal && ++calls % 5 != 0) return;
    std::fprintf(stderr, "%s%7.1f of %.0f s  real-time factor %5.1f  %s%s", terminal ? "\r\033[K" : "", p.simulated_s,
                 p.until_s, p.real_time_factor, p.doing.c_str(), terminal ? "" : "\n");
    std::fflush(stderr);
    line_open = terminal;
  };
}

void end_progress_line() {
  if (line_open) std::fputs("\r\033[K", stderr);
  line_open = false;
}

void prepare_output(const std::string& path) {
  if (path.empty() || path == "-") return;
  std::error_code error;
  const std::filesystem::path folder = std::filesystem::path(path).parent_path();
  if (!folder.empty()) std::filesystem::create_directories(folder, error);
  const bool was_there = std::filesystem::exists(path, error);
  if (std::filesystem::is_directory(path, error) || !std::ofstream(path, std::ios::app))
    throw InputError(path, "cannot be written", "choose another path");
  if (!was_there) std::filesystem::remove(path, error);  // a run that fails early leaves no empty file
}

void check_output(const std::string& path) {
  if (path.empty() || path == "-") return;
  std::error_code error;
  const std::filesystem::path folder = std::filesystem::path(path).parent_path();
  if (!folder.empty() && !std::filesystem::is_directory(folder, error))
    throw InputError(path, "no folder " + folder.string(), "create it, or choose another path");
  prepare_output(path);
}

void write_output(const std::string& path, const std::string& text) {
  if (path == "-") {
    std::fputs(text.c_str(), stdout);
    if (std::fflush(stdout) != 0) throw InputError("standard output", "cannot be written", "is the disk full?");
    return;
  }
  write_file(path, text);
}

std::string this_machine() {
  std::ifstream info("/proc/cpuinfo");
  std::string name = "unknown processor";
  for (std::string line; std::getline(info, line);)
    if (line.rfind("model name", 0) == 0) {
      name = line.substr(line.find(':') + 2);
      break;
    }
  return fmt::format("{}, {} hardware threads", name, std::thread::hardware_concurrency());
}

}  // namespace catgut
