// SPDX-License-Identifier: Apache-2.0
// device: a haptic device of any maker. A backend opens up to two devices and calls back once per millisecond for each of them,
// from its own thread (or one thread per device): sample in, force out, both in the device's own frame (exchange/arm).
// Backends load the maker's library at run time; building needs nothing of it. A missing prerequisite (library, device,
// permission, version) is reported in one line, and the program continues without force feedback.
#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "exchange/arm.h"
#include "exchange/force_patch.h"

namespace catgut {

// Called from the backend's thread, about 1000 times per second for each device: must not wait, allocate, log or throw. Returns
// the command for the motors.
struct ArmCallback {
  ArmForce (*step)(void* user, size_t arm, const ArmSample& sample) = nullptr;
  void* user = nullptr;
};

// While a backend stops: the last command, smaller by `step` [N], and torque and grip in proportion to their peaks.
inline ArmForce fade(const ArmForce& last, const ArmLimits& limits, float step) {
  const auto shorter = [](Vec3 v, float by) {
    const float l = length(v);
    return l > by ? v * ((l - by) / l) : Vec3{};
  };
  const float part = step / std::max(1e-3f, limits.force);
  return {shorter(last.force, step), shorter(last.torque, part * limits.torque),
          shorter({last.grip, 0, 0}, part * limits.grip).x};
}
inline bool is_finite(const ArmForce& f) { return is_finite(f.force) && is_finite(f.torque) && std::isfinite(f.grip); }
inline bool is_zero(const ArmForce& f) { return length2(f.force) == 0 && length2(f.torque) == 0 && f.grip == 0; }

struct ArmInfo {
  bool present = false;
  std::string name, model, serial, driver;
  ArmLimits limits;  // reported by the device; 0: unknown
  Vec3 least, most;  // [m] workspace, device frame
};

// Status of a device since it was opened; readable from any thread.
struct ArmStatus {
  bool ready = false;   // samples arrive and forces are written
  uint32_t error = 0;   // the last error code of the maker's library, 0: none
  uint32_t errors = 0;  // number of errors
  uint64_t steps = 0;   // callbacks
  uint32_t faults = 0;  // LimiterFault bits (haptic/limiter) of a device server that evaluates patches itself, and
  float force = 0;      // [N] its last written force
};

// The functions of a backend and their context. Make one with open_touch or the like; the destructor switches the force off.
struct ArmPort {
  const char* kind = "";
  std::array<ArmInfo, 2> arm;  // 0 right, 1 left
  void* self = nullptr;
  bool (*start)(void* self, const ArmCallback& callback, std::string& why) = nullptr;
  void (*stop)(void* self) = nullptr;  // reduces the force without a step, then no more callbacks
  ArmStatus (*status)(void* self, size_t arm) = nullptr;
  std::string (*error_text)(void* self, uint32_t error) = nullptr;
  void (*close)(void* self) = nullptr;  // stops too
  // Set if a device server evaluates patches (the bridge): called from the physics thread with patches in the device's own
  // frame. The callback's return value is unused. Null: the callback's force goes to the motors.
  void (*send_patch)(void* self, size_t arm, const ForcePatch& patch) = nullptr;

  ArmPort() = default;
  ArmPort(ArmPort&& other) noexcept { *this = std::move(other); }
  ArmPort& operator=(ArmPort&& other) noexcept;
  ~ArmPort() { reset(); }
  void reset() {
    if (self) close(self);
    self = nullptr;
  }
  bool any() const { return self != nullptr && (arm[0].present || arm[1].present); }
};

}  // namespace catgut
