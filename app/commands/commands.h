// SPDX-License-Identifier: Apache-2.0
// app: the commands of the program, one file each. A command adds itself to the command line and, if selected, sets the
// exit code: 0 done, 1 the expectation or check failed, 2 bad input, 130 interrupted.
#pragma once
#include <CLI/CLI.hpp>
#include <atomic>
#include <string>
#include <vector>

#include "procedure/manager.h"
#include "render/frame_cost.h"
#include "runtime/pictures.h"
#include "runtime/session.h"

namespace catgut {

void add_play(CLI::App& app, int& exit_code);
void add_view(CLI::App& app, int& exit_code);
void add_run(CLI::App& app, int& exit_code);
void add_replay(CLI::App& app, int& exit_code);
void add_assess(CLI::App& app, int& exit_code);
void add_study(CLI::App& app, int& exit_code);
void add_bench(CLI::App& app, int& exit_code);
void add_validate(CLI::App& app, int& exit_code);
void add_devices(CLI::App& app, int& exit_code);
void add_bridge(CLI::App& app, int& exit_code);
void add_describe(CLI::App& app, int& exit_code);
void add_serve(CLI::App& app, int& exit_code);    // after add_records
void add_records(CLI::App& app, int& exit_code);  // store, report, survey; in a program built with CATGUT_STORE

// `catgut bench limits` (app/commands/limits.cpp). Code 1 when not all requested sutures could be made.
struct LimitsOptions {
  std::vector<std::string> scene, set;
  std::string out;  // folder
  int sutures = 50, threads = 1;
};
int bench_limits(const LimitsOptions& options);

// `catgut bench paper` (app/commands/paper.cpp). Code 1 when an execution lacks an expected result of its scene.
struct PaperOptions {
  std::vector<std::string> scene, set;
  std::string out;  // folder; empty: none
  int executions = 10, threads = 1;
};
int bench_paper(const PaperOptions& options);

// `catgut bench scale` (app/commands/scale.cpp): the first scene with 1, 4 and 16 times its particles, on one thread and on
// `threads`, each for `seconds` of simulated time.
struct ScaleOptions {
  std::string scene, json;
  std::vector<std::string> set;
  int repeat = 1, threads = 2;
  double seconds = 0;
};
int bench_scale(const ScaleOptions& options);
// Name of the processor and its number of cores, as text.
std::string this_machine();

// `catgut bench frame` (app/commands/frame.cpp).
struct FrameOptions {
  std::string scene, json;
  std::vector<std::string> set;
  double seconds = 0;  // [s] simulated
};
int bench_frame(const FrameOptions& options);
// Time of a headset's frame for snapshots `every_s` [s] simulated apart, without rasterization. Throws std::runtime_error
// in a build without pictures.
using StereoPictures = std::function<FrameCost::Times(const Snapshot&)>;
StereoPictures stereo_pictures(const PictureModel& model, float every_s);

// `catgut bench haptics` (app/commands/haptics.cpp). folder: empty: only the table.
int bench_haptics(const std::string& folder, const std::string& scene);
int plot_haptics_log(const std::string& file);  // to FILE.png

int play_without_arguments();  // the window's start screen

// Shared by several commands (app/commands/common.cpp).

// A number from least to most; unlike CLI::Range it refuses NaN.
CLI::Validator within(double least, double most);
// Refuses file names whose suffix does not match their format.
void check_picture_files(const PictureOptions& options);
// --video, --frames, --contact-sheet, --video-speed.
void add_picture_options(CLI::App& command, PictureOptions& options);
// A procedure that is observed during a run or a replay. It begins when the scene has settled. Throws InputError.
struct ProcedureWatch {
  explicit ProcedureWatch(const std::string& name);
  void start(const SceneSpec& scene, const PictureModel& picture);
  void tick(const Snapshot& seen);
  // FOLDER/NAME_STAGE.cgrec, a recording without ticks, when a stage has begun.
  void save_stage(const std::string& folder, const SceneSpec& scene, const Model& model, const State& state);
  std::string last_state_file(const std::string& folder) const { return state_file(folder, ""); }  // FOLDER/NAME.cgrec
  static void save_state_as(const std::string& path, const SceneSpec& scene, const std::vector<std::byte>& state);
  Procedure procedure;
  ProcedureRun run;

 private:
  std::string state_file(const std::string& folder, const std::string& stage) const;
  double tick_s_ = 1.0 / 60, settle_s_ = 0;  // [s]
  size_t saved_ = 0;                         // stages
};
void add_threads_option(CLI::App& command, int& threads);

// Set by the first Ctrl-C (the current tick is finished, files are closed); a second one ends the program at once.
const std::atomic<bool>& stop_on_interrupt();

// A line per second on a terminal, else one every five seconds, on standard error.
std::function<void(const Progress&)> progress_line();
void end_progress_line();

// Creates the folder of an output file and checks that the file can be written, before the work starts. "" and "-" pass.
void prepare_output(const std::string& path);
// The same, but never creates a folder. The path of an interactive session's recording may have a typing
// error, and a new folder would hide the file from the user.
void check_output(const std::string& path);
// path "-": standard output.
void write_output(const std::string& path, const std::string& text);

}  // namespace catgut
