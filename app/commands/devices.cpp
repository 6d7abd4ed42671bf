// app: `catgut devices`: what is connected.
#include <cstdio>
#include <memory>

#include "commands/commands.h"
#include "core/check.h"

namespace catgut {

void add_devices(CLI::App& app, int& exit_code) {
  auto test = std::make_shared<bool>(false);
  CLI::App* command = app.add_subcommand("devices", "list connected hands");
  command->add_flag("--test", *test, "a safe force test of every device");
  command->callback([test, &exit_code] {
    if (*test)
      throw InputError("devices --test", "this version supports no haptic device",
                       "use the scripted surgeon: catgut run SCENE");
    write_output("-",
                 "No haptic devices are supported in this version yet. Mouse, keyboard and gamepad are hands in the window: "
                 "catgut play\n"
                 "The scripted surgeon needs none: catgut run purse_string --surgeon scripted --headless\n");
    exit_code = 0;
  });
}

}  // namespace catgut
