// SPDX-License-Identifier: Apache-2.0
// app: `catgut devices`: lists connected haptic devices and their capabilities, backend by backend; with --test, a slow small
// push of each.
#include <algorithm>
#include <cstdio>
#include <memory>

#include "commands/commands.h"
#include "core/check.h"
#include "device/drivers.h"
#include "runtime/arm_test.h"
#include "runtime/haptics.h"
#include "runtime/registration.h"

namespace catgut {
namespace {

struct Options {
  std::string which;
  bool test = false, calibrate = false, register_arms = false;
  double scale = 1, turn = 0, countdown = 5;  // countdown [s]
};

int calibrate(ArmPort port, const Options& o) {
  const std::string file = arm_places_file();
  std::map<std::string, ArmPlace> places = read_arm_places(file);
  const std::array<ArmInfo, 2> arm = port.arm;
  std::array<bool, 2> known{};
  const auto say = [](const std::string& line) { std::printf("%s\n", line.c_str()), std::fflush(stdout); };
  const std::array<Vec3, 2> at = held_places(std::move(port), static_cast<float>(o.countdown), say, stop_on_interrupt(), known);
  for (size_t k = 0; k < 2; ++k) {
    if (!known[k]) continue;
    ArmPlace& place = places[arm_key(arm[k], k)];
    place.scale = static_cast<float>(o.scale), place.turn = static_cast<float>(o.turn), place.middle = at[k];
    place.residual = -1;  // this rotation replaces a registered one
    std::printf("%s device: center at %.0f, %.0f, %.0f mm, scale %g, rotation %g degrees\n", k == 0 ? "right" : "left",
                1e3 * double{at[k].x}, 1e3 * double{at[k].y}, 1e3 * double{at[k].z}, o.scale, o.turn);
  }
  if (!known[0] && !known[1]) return 1;
  write_arm_places(file, places);
  std::printf("%s\n", file.c_str());
  return 0;
}

int register_devices(ArmPort port, const Options& o) {
  const std::string file = arm_places_file();
  std::map<std::string, ArmPlace> places = read_arm_places(file);
  const std::array<ArmInfo, 2> arm = port.arm;
  const auto say = [](const std::string& line) { std::printf("%s\n", line.c_str()), std::fflush(stdout); };
  const RegistrationResult r = register_arms(std::move(port), {}, say, stop_on_interrupt());
  int code = 0;
  bool any = false;
  for (size_t k = 0; k < 2; ++k) {
    if (!arm[k].present) continue;
    const char* hand = r.hand[k] == 0 ? "right" : "left";
    const Registration& fit = r.fit[k];
    if (!r.done[k]) {
      std::printf("%s device: not registered\n", hand), code = 1;
      continue;
    }
    std::printf("%s device: residual %.1f mm RMS, %.1f mm at most; rotated by %.1f degrees; distances %.3f of the card's\n",
                hand, 1e3 * double{fit.rms}, 1e3 * double{fit.worst},
                double{length(rotation_vector(fit.turn))} * 180 / double{kPi}, 1 / double{fit.scale});
    if (!is_plausible(fit)) {
      std::printf("  not saved: more than 3 mm or 5 %%; touch the marks in the given order, or calibrate the device\n");
      code = 1;
      continue;
    }
    ArmPlace& place = places[arm_key(arm[k], k)];
    place.scale = static_cast<float>(o.scale), place.turn = 0, place.middle = fit.center;
    place.rotation = fit.turn, place.residual = fit.rms;
    if (arm[0].present && arm[1].present) place.hand = static_cast<int>(r.hand[k]);
    any = true;
  }
  if (any) write_arm_places(file, places), std::printf("%s\n", file.c_str());
  return code;
}

int test(ArmPort port, const Options& o) {
  ArmTestOptions options;
  options.countdown = static_cast<float>(o.countdown);
  const auto say = [](const std::string& line) { std::printf("%s\n", line.c_str()), std::fflush(stdout); };
  const ArmTestResult result = test_arms(std::move(port), options, say, stop_on_interrupt());
  for (const std::string& line : result.line) say(line);
  return result.ok ? 0 : 1;
}

void print(const ArmPort& port) {
  for (size_t k = 0; k < 2; ++k) {
    const ArmInfo& a = port.arm[k];
    if (!a.present) continue;
    std::printf("%s: %s device \"%s\", %s, serial %s, driver %s\n", port.kind, k == 0 ? "right" : "left", a.name.c_str(),
                a.model.c_str(), a.serial.c_str(), a.driver.c_str());
    ServoOptions servo;
    fit_to_arm(servo, a.limits);
    std::printf("  peak force %.2g N, continuous %.2g N; maximum %.0f N/m, %.1f N s/m; workspace %.0f x %.0f x %.0f mm\n",
                double{servo.limits.force}, double{servo.limits.continuous}, double{servo.limits.stiffness},
                double{servo.limits.damping}, 1e3 * double{a.most.x - a.least.x}, 1e3 * double{a.most.y - a.least.y},
                1e3 * double{a.most.z - a.least.z});
  }
}

// One backend after the other, so that no two of them hold the same device.
int devices(const Options& o) {
  int code = 0;
  bool any = false;
  const ArmChoice wanted = read_arm_choice(o.which);
  for (const ArmDriver& d : arm_drivers()) {
    if (!wanted.driver.empty() && wanted.driver != d.word) continue;
    std::vector<std::string> messages;
    ArmPort port = open_arms({d.word, wanted.where, false}, messages);
    for (const std::string& line : messages) std::printf("%s\n", line.c_str());
    print(port);
    if (!port.any()) continue;
    any = true;
    if (o.register_arms) code = std::max(code, register_devices(std::move(port), o));
    else if (o.calibrate) code = std::max(code, calibrate(std::move(port), o));
    else if (o.test) code = std::max(code, test(std::move(port), o));
    else std::printf("  catgut devices %s --test applies small forces; catgut play --haptics %s uses them\n", d.word, d.word);
  }
  if (any && !o.test && !o.calibrate && !o.register_arms)
    read_arm_places(arm_places_file());  // reports errors that would occur when a scene opens
  if (any) return code;
  if (o.test || o.calibrate || o.register_arms)
    throw InputError(o.test        ? "devices --test"
                     : o.calibrate ? "devices --calibrate"
                                   : "devices --register",
                     "no haptic device", "see above for what is missing");
  std::printf(
      "Mouse, keyboard and gamepad are hands in the window: catgut play\n"
      "The scripted surgeon needs none: catgut run purse_string --surgeon scripted --headless\n");
  return 0;
}

}  // namespace

void add_devices(CLI::App& app, int& exit_code) {
  auto o = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand("devices", "list haptic devices");
  std::string drivers = "this backend only:";
  for (const ArmDriver& d : arm_drivers())
    drivers += std::string("\n") + d.word + (*d.where ? std::string("[:") + d.where + "]" : "") + "  " + d.arms;
  command->add_option("driver", o->which, drivers)->type_name("DRIVER[:WHERE]");
  CLI::Option* test = command->add_flag("--test", o->test, "push each device slowly along each axis after a countdown");
  command->add_flag("--calibrate", o->calibrate, "map the workspaces into the field; saved per user and device")
      ->excludes(test);
  command
      ->add_flag(
          "--register", o->register_arms,
          "left and right, and rotation: touch five marks (center, 5 cm right, left, far, near) with each stylus; saved per "
          "user and device")
      ->excludes("--calibrate")
      ->excludes(test);
  command->add_option("--scale", o->scale, "calibrate, register: field meters per meter of the stylus")
      ->check(within(0.1, 3.0))
      ->capture_default_str();
  command->add_option("--turn", o->turn, "calibrate: rotation about the vertical [degrees]")
      ->check(within(-180.0, 180.0))
      ->capture_default_str();
  command->add_option("--countdown", o->countdown, "test, calibrate: time to take hold of the stylus [s]")
      ->check(within(0.0, 60.0))
      ->capture_default_str();
  command->callback([o, &exit_code] { exit_code = devices(*o); });
}

}  // namespace catgut
