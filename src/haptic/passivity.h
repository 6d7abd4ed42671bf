// SPDX-License-Identifier: Apache-2.0
// haptic: the last safety layer. Counts the energy given to the hand. If it exceeds what the rendering can have stored, the
// hand is damped as far as the device allows (time-domain passivity, Hannaford and Ryu 2002). It ensures safety, not quality:
// with a held force alone it leaves a limit cycle of a millimeter (`catgut bench haptics`). Pure; in the device's
// frame, where the work of the motors is exact: the force is held between two samples.
//
// Credit is bounded: energy from the hand counts only up to what the present spring can store. Energy dissipated a minute ago
// must not allow a force that pushes the hand.
//
// Force, torque and grip have one account: what a hand stores in a contact by pushing may come back by turning.
//
// Two hands are one system: energy that one gives to a thread or to tissue may return to the other. EnergyPool keeps the recent
// energy of each hand, without its friction, and the other hand's account may draw on it.
#pragma once
#include <array>
#include <atomic>

#include "core/math.h"
#include "exchange/arm.h"

namespace catgut {

struct PassivityOptions {
  double allowance =
      2e-4;  // [J] a spring that is sampled at 1 kHz releases 0.12 to 0.16 mJ without any fault (`catgut bench haptics`)
  float damping = 4;          // [N s/m] at most (CHAI3D's cap for a Touch)
  float slew = 500;           // [N/s] of the whole force
  float slew_time = 0.001f;   // [s] of a step that the slew may use, as in LimiterOptions
  float small_force = 0.02f;  // [N] below this,
  float quiet_time = 0.05f;   // [s] for this time, the account is closed
  // [s] after which a third of a surplus remains. A spring on an encoder releases stiffness * step^2 for each tremor over one
  // of its steps (some microwatts), which the device's own friction absorbs. Generating faults give milliwatts.
  float forget = 1;
  // [N/m] a force independent of the hand's motion counts as a spring of at least this stiffness. The credit is force^2 /
  // stiffness, twice the energy of a linear spring. A spring that hardens as a power of its depth stores at most that.
  float least_stiffness = 100;
  // Of devices with motors for rotation and grip; 0: none. Damping at most, and peaks.
  float turn_damping = 0, torque = 0;  // [N m s/rad], [N m]
  float grip_damping = 0, grip = 0;    // [N s/m], [N]
};

struct PassivityInput {
  Vec3 x, v;            // [m], [m/s] of the hand
  Vec3 force;           // [N] about to be written
  Vec3 rubbed;          // [N] its friction part
  float stiffness = 0;  // [N/m] along the force, as written
  float most = 3.3f;    // [N]
  float lent = 0;       // [J] available from the other hand
  float dt = 0.001f;    // [s]
  // Rotation and grip.
  Vec3 turned, spin;            // [rad] since the last call, [rad/s]
  Vec3 torque, rubbed_torque;   // [N m] about to be written; its friction part
  float gap = 0, gap_rate = 0;  // [m], [m/s] of the fingers
  float grip = 0;               // [N] about to be written
  float stored = 0;             // [J] that the springs of couple and grip can hold, besides the one of the force
};

struct Passivity {
  double energy = 0;  // [J] given to the hand, bounded; negative: credit
  double most = 0;    // [J] maximum so far
  double total = 0;   // [J] given to the hand since the start, unbounded
  Vec3 last;          // [m]
  float gap = 0;      // [m]
  ArmForce held;      // since then
  ArmForce rubbed;    // its friction
  float gave = 0;     // [J] in the last step, to tissue or thread: not to friction; negative: received
  float used = 0;     // [J] used from the other hand
  float quiet = 0;    // [s]
  bool any = false;
  bool braking = false;
};

// Returns the force to write, at most `most` [N] long and within the slew limit of the last.
ArmForce keep_passive(Passivity& p, const PassivityInput& in, const PassivityOptions& options = {});

// Recent energy of each hand [J]. Callable from any servo thread; no lock.
struct EnergyPool {
  std::array<std::atomic<float>, 2> of{};
};
constexpr float kPoolMost = 0.02f;  // [J] 2 N over a centimeter: the capacity of a stretched bowel
constexpr float kPoolTime = 0.2f;   // [s] after which a third remains: tissue and thread dissipate the rest
float lent_to(const EnergyPool& pool, size_t hand);
void settle(EnergyPool& pool, size_t hand, const Passivity& p, float dt);

}  // namespace catgut
