// SPDX-License-Identifier: Apache-2.0
// runtime: `catgut devices --register`: which device is in which hand, and how each stands on the table. The user presses a
// button of the right device, then touches five marks of a card with each stylus. A rigid fit (Horn 1987) turns the device's
// axes into the card's and gives the residual. No force is rendered.
#pragma once
#include <array>
#include <atomic>
#include <functional>
#include <span>
#include <string>

#include "device/arm.h"

namespace catgut {

// Marks of the card [m]: its center, and 5 cm to the right, to the left, away from the user and toward the user.
struct RegistrationMark {
  const char* name;
  Vec3 at;
};
std::span<const RegistrationMark> registration_marks();

struct Registration {
  bool valid = false;        // the points determine a rotation
  Quat turn;                 // device axes to the card's
  Vec3 center;               // [m] device frame: the card's center
  float scale = 1;           // distances on the card per distance of the stylus: 1 for a calibrated device
  float rms = 0, worst = 0;  // [m] residual of the fit, which does not scale
};
// device: where the stylus was at each of the marks. Two spans of equal length, at least three points.
Registration fit_registration(std::span<const Vec3> device, std::span<const Vec3> card);
// A mark touched in the wrong order or a device out of calibration: beyond 3 mm or a scale off by more than 5 %.
bool is_plausible(const Registration& r);

struct RegistrationOptions {
  float patience = 60;   // [s] for each mark
  float steady = 0.1f;   // [s] that the stylus must hold still after the press,
  float still = 0.001f;  // [m] within this
};
struct RegistrationResult {
  std::array<bool, 2> done{};  // per device, as the driver lists them
  std::array<Registration, 2> fit;
  std::array<size_t, 2> hand{0, 1};  // 0 right, 1 left: in which hand the device is
};
// say: receives what to do next. Throws InputError if the devices do not start. Ends early on `stop`, or when no mark is
// touched for `patience`.
RegistrationResult register_arms(ArmPort port, const RegistrationOptions& options,
                                 const std::function<void(const std::string&)>& say, const std::atomic<bool>& stop);

}  // namespace catgut
