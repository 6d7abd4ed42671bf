// SPDX-License-Identifier: Apache-2.0
// app: `catgut play [SCENE]`, and `catgut` without arguments: the window.
#include <memory>

#include "commands/commands.h"
#include "core/check.h"
#include "core/file.h"
#include "device/drivers.h"
#include "procedure/procedure_file.h"
#include "procedure/scene_file.h"
#include "runtime/haptics.h"
#include "window/keeping.h"
#include "window/settings.h"
#include "window/window.h"

namespace catgut {
namespace {

// "1280x720"
void read_size(const std::string& text, PlayOptions& o) {
  int width = 0, height = 0;
  char rest = 0;
  if (std::sscanf(text.c_str(), "%dx%d%c", &width, &height, &rest) != 2 || width < 320 || height < 180 || width > 8192 ||
      height > 8192)
    throw InputError("--size " + text, "invalid window size", "write WIDTHxHEIGHT, 320x180 to 8192x8192");
  o.width = width, o.height = height;
}

// For both commands that open the window.
struct WindowCommand {
  PlayOptions play;
  std::string quality, size = "1280x720";
};

void add_window_options(CLI::App& command, WindowCommand& o) {
  command.add_option("--quality", o.quality, "graphics quality; default: the setting")
      ->check(CLI::IsMember({"low", "medium", "high"}))
      ->type_name("low|medium|high");
  command.add_option("--size", o.size, "window size [pixels]")->type_name("WxH")->capture_default_str();
  command.add_option("--seconds", o.play.seconds, "exit after S seconds; report latency")
      ->check(within(0.1, 1e6))
      ->type_name("S");
  command.add_option("--screenshot", o.play.screenshot, "save a PNG of the window, then exit")->type_name("FILE.png");
  command.add_option("--after", o.play.after, "frames before the screenshot")->check(CLI::Range(1, 1000000))->type_name("N");
  command.add_option("--screen", o.play.screen, "screen to show")
      ->check(CLI::IsMember({"start", "settings", "practice", "pause", "developer", "results", "survey", "view"}))
      ->type_name("NAME");
  command.add_option("--at", o.play.at, "session or recording time to show [s]")->check(within(0.0, 1e6))->type_name("S");
  command.add_option("--stall-ms", o.play.stall_ms, "for tests: stall rendering for this long every two seconds")
      ->check(CLI::Range(0, 10000))
      ->group("");
}

void read_window_options(WindowCommand& o) {
  read_size(o.size, o.play);
  o.play.quality_given = !o.quality.empty();
  o.play.quality = o.quality == "high" ? Quality::high : o.quality == "medium" ? Quality::medium : Quality::low;
}

}  // namespace

int play_without_arguments() {
  PlayOptions options;
  options.keep_sessions = options.sound = true;
  return play(options);
}

void add_play(CLI::App& app, int& exit_code) {
  auto o = std::make_shared<WindowCommand>();
  CLI::App* command = app.add_subcommand("play", "open the window");
  command->add_option("scene", o->play.scene, "scene to open; default: the start screen")->type_name("SCENE");
  command->add_option("--record", o->play.live.record, "write a recording; a restart or an undone bite starts another file")
      ->type_name("FILE.cgrec");
  command->add_option("--json", o->play.json, "results as JSON on leaving the scene; -: standard output")->type_name("FILE|-");
  command->add_option("--trainee", o->play.trainee, "pseudonym: the session is scored and stored; not a person's name")
      ->type_name("NAME");
  command->add_option("--store", o->play.store, "where sessions are stored: file, or postgresql://USER@HOST/DATABASE")
      ->type_name("FILE|URL");
  command
      ->add_option("--feedback", o->play.feedback,
                   "on the quality of the work: none before the results, after each stitch, or live cues too")
      ->check(CLI::IsMember({"silent", "stitch", "live"}))
      ->type_name("silent|stitch|live");
  command->add_option("--survey", o->play.survey, "questionnaire that is asked after the session")->type_name("NAME|FILE");
  command->add_option("--csv", o->play.csv, "the same as a table; -: standard output")->type_name("FILE|-");
  auto unrecorded = std::make_shared<bool>(false);
  command->add_flag("--no-record", *unrecorded,
                    "keep no recording; default: every session, in the data folder of the settings");
  command->add_flag("--kiosk", o->play.kiosk,
                    "whole screen, for a stand: cannot be left but by Ctrl+Shift+Q; start screen after three idle minutes");
  command->add_option("--idle", o->play.idle_s, "kiosk: time without input until the start screen is shown")
      ->type_name("SECONDS")
      ->check(CLI::Range(1.0, 86400.0))
      ->capture_default_str();
  command->add_flag("--left-handed", o->play.left_handed, "needle holder in the left hand");
  command->add_option("--surgeon", o->play.live.surgeon, "watch the scripted surgeon, or the hands of a recording")
      ->type_name("scripted|FILE");
  command->add_flag("--headset", o->play.headset, "draw for a headset (OpenXR) too; its controllers are the hands");
  command->add_option("--room", o->play.room, "headset: name of the room whose table height and registration apply")
      ->type_name("NAME")
      ->capture_default_str();
  command->add_flag("--register-arms", o->play.register_arms,
                    "headset: the cut button notes a point where a controller touches a stylus; three to five points");
  auto mode = std::make_shared<std::string>("practice");
  auto teach = std::make_shared<bool>(false);
  command->add_option("--procedure", o->play.procedure, "show the stages and errors of a procedure")->type_name("NAME");
  command->add_option("--stage", o->play.stage, "start with this stage, by name or number")->type_name("STAGE");
  command->add_option("--mode", *mode, "tutorial: time stands still at a new stage, with demonstrations; exam: no feedback")
      ->check(CLI::IsMember({"tutorial", "practice", "exam"}))
      ->type_name("tutorial|practice|exam");
  command->add_flag("--teach", *teach,
                    std::string("tutorial: first stitch, step by step (--procedure ") + kFirstLesson + " --mode tutorial)");
  // One by default: a tick is short, and waiting workers take processor time from rendering.
  command->add_option("--threads", o->play.live.threads, "solver threads")->check(CLI::Range(1, 64))->capture_default_str();
  std::string drivers;
  for (const ArmDriver& d : arm_drivers()) drivers += std::string(d.word) + "[:WHERE]|";
  command
      ->add_option("--haptics", o->play.live.haptics,
                   "haptic devices as hands, see catgut devices --help; other hands stay with the mouse; paper[:DRIVER]: the "
                   "paper's spring force")
      ->type_name(drivers + "paper[:DRIVER]|off");
  command
      ->add_option("--haptics-log", o->play.live.haptics_log,
                   "CSV log of every millisecond of the haptic devices; catgut bench haptics --log FILE plots it")
      ->type_name("FILE");
  command->add_option("--events", o->play.events, "event stream, one JSON object per line; -: standard output")
      ->type_name("FILE|-");
  add_window_options(*command, *o);
  command->callback([o, mode, teach, unrecorded, &exit_code] {
    read_window_options(*o);
    read_arm_choice(o->play.live.haptics);  // reports errors before a window opens
    if (*teach && o->play.procedure.empty()) o->play.procedure = kFirstLesson, *mode = "tutorial";
    o->play.tutorial = *mode == "tutorial";
    o->play.exam = *mode == "exam";
    if (o->play.procedure.empty() && (!o->play.stage.empty() || *mode != "practice"))
      throw InputError("play", "--stage and --mode need a procedure", "add --procedure NAME");
    if (!o->play.procedure.empty()) {  // reports errors before a window opens
      const Procedure procedure = read_procedure(o->play.procedure);
      if (!o->play.stage.empty()) find_stage(procedure, o->play.stage, "--stage");
      if (!o->play.scene.empty() && o->play.scene != procedure.scene)
        throw InputError("--procedure " + o->play.procedure,
                         "its scene is \"" + procedure.scene + "\", not \"" + o->play.scene + "\"", "leave the scene out");
      if (o->play.tutorial && !o->play.live.surgeon.empty())
        throw InputError("--mode tutorial", "a tutorial needs manual control", "leave --surgeon out");
      o->play.scene.clear();
    }
    if (!o->play.scene.empty()) read_scene(o->play.scene);  // reports errors before a window opens
    if (o->play.register_arms && (!o->play.headset || o->play.live.haptics.empty()))
      throw InputError("--register-arms", "a headset and haptic arms are needed", "add --headset and --haptics");
    check_keeping(o->play.trainee, o->play.survey);  // reports errors before a window opens
    o->play.live.say = [](const std::string& line) { std::fprintf(stderr, "catgut: %s\n", line.c_str()); };
    check_suffix(o->play.live.record, ".cgrec", "--record");
    check_suffix(o->play.json, ".json", "--json");
    check_suffix(o->play.csv, ".csv", "--csv");
    check_suffix(o->play.screenshot, ".png", "--screenshot");
    for (const std::string& path : {o->play.live.record, o->play.json, o->play.csv, o->play.events, o->play.screenshot})
      check_output(path);
    o->play.sound = o->play.screenshot.empty();
    o->play.keep_sessions = !*unrecorded && o->play.screenshot.empty();
    exit_code = play(o->play);
  });
}

void add_view(CLI::App& app, int& exit_code) {
  auto o = std::make_shared<WindowCommand>();
  CLI::App* command = app.add_subcommand("view", "open a recording in the window");
  command->add_option("file", o->play.view, "recording to open")->required()->type_name("FILE.cgrec");
  command->add_flag("--headset", o->play.headset, "draw for a headset (OpenXR) too: the wearer walks around the field");
  add_window_options(*command, *o);
  command->callback([o, &exit_code] {
    read_window_options(*o);
    const Recording recording = read_recording(o->play.view);  // as above
    check_replayable(recording, o->play.view);
    parse_scene(recording.header.scene, o->play.view);
    check_suffix(o->play.screenshot, ".png", "--screenshot");
    check_output(o->play.screenshot);
    exit_code = play(o->play);
  });
}

}  // namespace catgut
