// SPDX-License-Identifier: Apache-2.0
// app: `catgut bridge`: serves the haptic devices of this machine to a simulator on another one (or in another process here).
#include <cstdio>
#include <memory>
#include <thread>

#include "commands/commands.h"
#include "core/check.h"
#include "device/drivers.h"
#include "runtime/arm_server.h"
#include "runtime/haptics.h"
#include "runtime/live.h"

namespace catgut {
namespace {

struct Options {
  std::string arms = "touch", listen = "127.0.0.1", key, new_key;
  double seconds = 0;
};

int bridge(const Options& o) {
  if (!o.new_key.empty()) {
    write_bridge_key(o.new_key);
    std::printf("%s: copy it to the simulator's machine, mode 600; there: CATGUT_BRIDGE_KEY=FILE, here: --key FILE\n",
                o.new_key.c_str());
    return 0;
  }
  const ArmChoice choice = read_arm_choice(o.arms);
  if (choice.as_paper || choice.driver.empty())
    throw InputError("--arms " + o.arms, "unknown device backend", "see catgut devices --help");
  check_listen(o.listen, o.key);
  std::vector<std::string> messages;
  ArmPort port = open_arms(choice, messages);
  for (const std::string& line : messages) std::printf("%s\n", line.c_str());
  if (!port.any()) throw InputError("bridge", "no haptic device to serve", "see above for what is missing");
  for (size_t k = 0; k < 2; ++k)
    if (port.arm[k].present) std::printf("%s device: %s\n", k == 0 ? "right" : "left", port.arm[k].name.c_str());
  ArmServerOptions options;
  options.listen = o.listen;
  options.key = o.key;
  const std::atomic<bool>& stop = stop_on_interrupt();
  ArmServer server(std::move(port), options);
  std::printf("listening on %s, port %u; there: catgut play SCENE --haptics bridge:HOST:%u; Ctrl-C ends\n", o.listen.c_str(),
              server.port(), server.port());
  std::fflush(stdout);
  for (const double until = wall_seconds() + o.seconds; !stop && (o.seconds <= 0 || wall_seconds() < until);) {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    for (const std::string& line : server.news()) std::printf("%s\n", line.c_str());
    std::fflush(stdout);
  }
  server.stop();
  return 0;
}

}  // namespace

void add_bridge(CLI::App& app, int& exit_code) {
  auto o = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand("bridge", "serve local haptic devices over the network");
  command->add_option("--arms", o->arms, "devices to serve, as for play --haptics")
      ->type_name("DRIVER[:WHERE]")
      ->capture_default_str();
  command
      ->add_option("--listen", o->listen, "address and port (0.0.0.0: any address); every address except 127.0.0.1 needs --key")
      ->type_name("HOST[:PORT]")
      ->capture_default_str();
  command->add_option("--key", o->key, "shared key file (mode 600)")->type_name("FILE");
  command->add_option("--new-key", o->new_key, "create a key file and exit")->type_name("FILE");
  command->add_option("--seconds", o->seconds, "exit after S seconds")->check(within(0.1, 1e9))->type_name("S");
  command->callback([o, &exit_code] { exit_code = bridge(*o); });
}

}  // namespace catgut
