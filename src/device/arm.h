// SPDX-License-Identifier: Apache-2.0
// device: a haptic arm, whatever its maker. A driver opens up to two arms and calls back once a millisecond for each of them,
// from its own thread (or from one thread for each arm): sample in, force out, both in the arm's own frame (exchange/arm).
// Drivers load the maker's library at run time; nothing of it is needed to build. What is missing (library, device, permission,
// version) becomes one line for the user, and the program continues without.
#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "exchange/arm.h"
#include "exchange/force_patch.h"

namespace catgut {

// Called from the driver's thread, about 1000 times a second for each arm: must not wait, allocate, log or throw. Returns the
// force [N] for the motors.
struct ArmCallback {
  Vec3 (*step)(void* user, size_t arm, const ArmSample& sample) = nullptr;
  void* user = nullptr;
};

struct ArmInfo {
  bool present = false;
  std::string name, model, serial, driver;
  ArmLimits limits;  // as the driver says; 0 where it does not say
  Vec3 least, most;  // [m] workspace, arm frame
};

// What happened to an arm since it was opened; any thread may ask.
struct ArmStatus {
  bool ready = false;   // samples come and forces go
  uint32_t error = 0;   // the driver's last error code, 0: none
  uint32_t errors = 0;  // how many there were
  uint64_t steps = 0;   // callbacks
  uint32_t faults = 0;  // LimiterFault bits (haptic/limiter) of an arm's end that evaluates patches itself, and
  float force = 0;      // [N] what it wrote last
};

// A driver's functions, and what they work on. Make one with open_touch or the like; destroying it takes the force off.
struct ArmPort {
  const char* kind = "";
  std::array<ArmInfo, 2> arm;  // 0 right, 1 left
  void* self = nullptr;
  bool (*start)(void* self, const ArmCallback& callback, std::string& why) = nullptr;
  void (*stop)(void* self) = nullptr;  // force down without a step, then no more callbacks
  ArmStatus (*status)(void* self, size_t arm) = nullptr;
  std::string (*error_text)(void* self, uint32_t error) = nullptr;
  void (*close)(void* self) = nullptr;  // stops too
  // Set where the arm's end evaluates patches (the bridge): it gets them in the arm's own frame, from the thread of the
  // physics, and what the callback returns is not used. Null: the callback's force goes to the motors.
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
