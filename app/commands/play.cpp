// app: `catgut play [SCENE]`, and `catgut` without arguments: the window.
#include <memory>

#include "commands/commands.h"
#include "core/check.h"
#include "core/file.h"
#include "device/drivers.h"
#include "procedure/lesson.h"
#include "procedure/scene_file.h"
#include "runtime/haptics.h"
#include "window/window.h"

namespace catgut {
namespace {

// "1280x720"
void read_size(const std::string& text, PlayOptions& o) {
  int width = 0, height = 0;
  char rest = 0;
  if (std::sscanf(text.c_str(), "%dx%d%c", &width, &height, &rest) != 2 || width < 320 || height < 180 || width > 8192 ||
      height > 8192)
    throw InputError("--size " + text, "it is no size for a window", "write WIDTHxHEIGHT, 320x180 to 8192x8192");
  o.width = width, o.height = height;
}

// Of both commands that open the window.
struct WindowCommand {
  PlayOptions play;
  std::string quality, size = "1280x720";
};

void add_window_options(CLI::App& command, WindowCommand& o) {
  command.add_option("--quality", o.quality, "of the picture; else as set in the window")
      ->check(CLI::IsMember({"low", "medium", "high"}))
      ->type_name("low|medium|high");
  command.add_option("--size", o.size, "of the window [pixels]")->type_name("WxH")->capture_default_str();
  command.add_option("--seconds", o.play.seconds, "close after so much time, and tell the latencies")
      ->check(within(0.1, 1e6))
      ->type_name("S");
  command.add_option("--screenshot", o.play.screenshot, "a PNG of the window, then close")->type_name("FILE.png");
  command.add_option("--after", o.play.after, "pictures before the screenshot")->check(CLI::Range(1, 1000000))->type_name("N");
  command.add_option("--screen", o.play.screen, "the screen in the screenshot")
      ->check(CLI::IsMember({"start", "settings", "practise", "pause", "developer", "results", "view"}))
      ->type_name("NAME");
  command.add_option("--at", o.play.at, "the moment in the screenshot, of the work or the recording [s]")
      ->check(within(0.0, 1e6))
      ->type_name("S");
  command.add_option("--stall-ms", o.play.stall_ms, "for tests: the picture stands still so long every two seconds")
      ->check(CLI::Range(0, 10000))
      ->group("");
}

void read_window_options(WindowCommand& o) {
  read_size(o.size, o.play);
  o.play.quality_given = !o.quality.empty();
  o.play.quality = o.quality == "high" ? Quality::good : o.quality == "medium" ? Quality::medium : Quality::draft;
}

}  // namespace

int play_without_arguments() { return play({}); }

void add_play(CLI::App& app, int& exit_code) {
  auto o = std::make_shared<WindowCommand>();
  CLI::App* command = app.add_subcommand("play", "open the window");
  command->add_option("scene", o->play.scene, "opens straight into it; else the start screen")->type_name("SCENE");
  command->add_option("--record", o->play.live.record, "recording to write; a restart or a bite taken back begins another file")
      ->type_name("FILE.cgrec");
  command->add_option("--json", o->play.json, "what was sewn, when the scene is left; - for standard output")
      ->type_name("FILE|-");
  command->add_flag("--left-handed", o->play.left_handed, "the needle driver is the left hand's");
  command->add_option("--surgeon", o->play.live.surgeon, "watch: scripted, or a recording whose hands are played")
      ->type_name("scripted|FILE");
  command->add_flag("--teach", o->play.teach, "the lesson: a first stitch, step by step");
  // One by default: a tick is short, and workers that wait for the next one take time from the picture.
  command->add_option("--threads", o->play.live.threads, "workers of the solver")
      ->check(CLI::Range(1, 64))
      ->capture_default_str();
  std::string drivers;
  for (const ArmDriver& d : arm_drivers()) drivers += std::string(d.word) + "[:WHERE]|";
  command
      ->add_option(
          "--haptics", o->play.live.haptics,
          "haptic arms as hands (a hand without one stays the mouse's), see catgut devices --help; paper[:DRIVER]: with "
          "the paper's spring")
      ->type_name(drivers + "paper[:DRIVER]|off");
  command->add_option("--events", o->play.events, "what happens, as it happens, one JSON object a line; - for standard output")
      ->type_name("FILE|-");
  add_window_options(*command, *o);
  command->callback([o, &exit_code] {
    read_window_options(*o);
    read_arm_choice(o->play.live.haptics);  // its faults are told before a window opens
    if (o->play.teach && o->play.scene.empty()) o->play.scene = first_stitch().scene;
    if (o->play.teach && (o->play.scene != first_stitch().scene || !o->play.live.surgeon.empty()))
      throw InputError("--teach", "the lesson is given in the scene \"" + first_stitch().scene + "\", to you",
                       "write catgut play " + first_stitch().scene + " --teach");
    if (!o->play.scene.empty()) read_scene(o->play.scene);  // its faults are told before a window opens
    o->play.live.say = [](const std::string& line) { std::fprintf(stderr, "catgut: %s\n", line.c_str()); };
    check_suffix(o->play.live.record, ".cgrec", "--record");
    check_suffix(o->play.json, ".json", "--json");
    check_suffix(o->play.screenshot, ".png", "--screenshot");
    for (const std::string& path : {o->play.live.record, o->play.json, o->play.events, o->play.screenshot}) check_output(path);
    exit_code = play(o->play);
  });
}

void add_view(CLI::App& app, int& exit_code) {
  auto o = std::make_shared<WindowCommand>();
  CLI::App* command = app.add_subcommand("view", "look at a recording in the window");
  command->add_option("file", o->play.view, "the recording")->required()->type_name("FILE.cgrec");
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
