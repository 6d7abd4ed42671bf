// app: `catgut play [SCENE]`, and `catgut` without arguments: the window.
#include <memory>

#include "commands/commands.h"
#include "core/check.h"
#include "procedure/scene_file.h"
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

}  // namespace

int play_without_arguments() { return play({}); }

void add_play(CLI::App& app, int& exit_code) {
  struct Options {
    PlayOptions play;
    std::string quality = "low", size = "1280x720";
  };
  auto o = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand("play", "open the window");
  command->add_option("scene", o->play.scene, "opens straight into it; else the start screen")->type_name("SCENE");
  command->add_option("--record", o->play.live.record, "recording to write; a restart or a bite taken back begins another file")
      ->type_name("FILE.cgrec");
  command->add_option("--quality", o->quality, "of the picture")
      ->check(CLI::IsMember({"low", "medium", "high"}))
      ->type_name("low|medium|high")
      ->capture_default_str();
  command->add_option("--size", o->size, "of the window [pixels]")->type_name("WxH")->capture_default_str();
  command->add_flag("--left-handed", o->play.left_handed, "the needle driver is the left hand's");
  command->add_option("--surgeon", o->play.live.surgeon, "watch: scripted, or a recording whose hands are played")
      ->type_name("scripted|FILE");
  // One by default: a tick is short, and workers that wait for the next one take time from the picture.
  command->add_option("--threads", o->play.live.threads, "workers of the solver")
      ->check(CLI::Range(1, 64))
      ->capture_default_str();
  command
      ->add_option("--haptics", o->play.live.haptics,
                   "haptic arms as hands (a hand without one stays the mouse's); paper: with the paper's spring")
      ->check(CLI::IsMember({"touch", "paper", "off"}))
      ->type_name("touch|paper|off");
  command->add_option("--events", o->play.events, "what happens, as it happens, one JSON object a line; - for standard output")
      ->type_name("FILE|-");
  command->add_option("--seconds", o->play.seconds, "close after so much time")->check(CLI::Range(0.1, 1e6))->type_name("S");
  command->add_option("--screenshot", o->play.screenshot, "a PNG of the window, then close")->type_name("FILE.png");
  command->add_option("--after", o->play.after, "pictures before the screenshot")
      ->check(CLI::Range(1, 1000000))
      ->type_name("N");
  command->callback([o, &exit_code] {
    read_size(o->size, o->play);
    o->play.quality = o->quality == "high" ? Quality::good : o->quality == "medium" ? Quality::medium : Quality::draft;
    if (!o->play.scene.empty()) read_scene(o->play.scene);  // its faults are told before a window opens
    o->play.live.say = [](const std::string& line) { std::fprintf(stderr, "catgut: %s\n", line.c_str()); };
    for (const std::string& path : {o->play.live.record, o->play.events, o->play.screenshot}) prepare_output(path);
    exit_code = play(o->play);
  });
}

}  // namespace catgut
