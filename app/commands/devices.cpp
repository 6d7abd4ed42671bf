// app: `catgut devices`: which haptic arms are connected and what they can do; with --test, a slow small push of each.
#include <cstdio>
#include <memory>

#include "commands/commands.h"
#include "core/check.h"
#include "runtime/arm_test.h"
#include "runtime/haptics.h"

namespace catgut {
namespace {

int devices(bool test) {
  std::vector<std::string> told;
  ArmPort port = open_arms("touch", told);
  for (const std::string& line : told) std::printf("%s\n", line.c_str());
  for (size_t k = 0; k < 2; ++k) {
    const ArmInfo& a = port.arm[k];
    if (!a.present) continue;
    std::printf("%s arm: \"%s\", %s, serial %s, driver %s\n", k == 0 ? "right" : "left", a.name.c_str(), a.model.c_str(),
                a.serial.c_str(), a.driver.c_str());
    ServoOptions o;
    fit_to_arm(o, a.limits);
    std::printf("  force %.2g N, %.2g N for long; %.0f N/m, %.1f N s/m at most; workspace %.0f x %.0f x %.0f mm\n",
                double{o.limits.force}, double{o.limits.continuous}, double{o.limits.stiffness}, double{o.limits.damping},
                1e3 * double{a.most.x - a.least.x}, 1e3 * double{a.most.y - a.least.y}, 1e3 * double{a.most.z - a.least.z});
  }
  if (!port.any()) {
    if (test) throw InputError("devices --test", "there is no haptic arm to test", "see above for what is missing");
    std::printf(
        "Mouse, keyboard and gamepad are hands in the window: catgut play\n"
        "The scripted surgeon needs none: catgut run purse_string --surgeon scripted --headless\n");
    return 0;
  }
  if (!test) {
    std::printf("catgut devices --test pushes each gently; catgut play --haptics touch uses them\n");
    return 0;
  }
  const ArmTestResult result = test_arms(
      std::move(port), {},
      [](const std::string& line) {
        std::printf("%s\n", line.c_str());
        std::fflush(stdout);
      },
      stop_on_interrupt());
  for (const std::string& line : result.line) std::printf("%s\n", line.c_str());
  return result.ok ? 0 : 1;
}

}  // namespace

void add_devices(CLI::App& app, int& exit_code) {
  auto test = std::make_shared<bool>(false);
  CLI::App* command = app.add_subcommand("devices", "list haptic arms");
  command->add_flag("--test", *test, "push each arm slowly along each axis, after a countdown, and see what it does");
  command->callback([test, &exit_code] { exit_code = devices(*test); });
}

}  // namespace catgut
