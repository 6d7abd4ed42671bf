// SPDX-License-Identifier: Apache-2.0
// haptic: a net under everything else. Counts the energy that went into the hand and, when it is more than the rendering can
// have held, brakes the hand as far as the arm may brake (time-domain passivity, Hannaford and Ryu 2002). It keeps things safe,
// not good: alone under a held force it leaves a limit cycle of a millimeter (`catgut bench haptics`). Pure; in the arm's
// frame, where what the motors do is exact: the force is held between two samples.
//
// Credit is bounded: whatever the hand has given before, no more of it counts than the spring that is felt now can hold. What a
// hand rubbed away a minute ago must not pay for a force that pushes it.
//
// Two hands are one system: what one of them gives to a thread or to tissue may rightly come out at the other. EnergyPool keeps
// what each hand gave lately, less its friction, and the other hand's account may draw on it.
#pragma once
#include <array>
#include <atomic>

#include "core/math.h"

namespace catgut {

struct PassivityOptions {
  double allowance =
      2e-4;           // [J] a spring that is sampled at 1 kHz gives 0.12 to 0.16 mJ without any fault (`catgut bench haptics`)
  float damping = 4;  // [N s/m] at most (CHAI3D's cap for a Touch)
  float slew = 500;   // [N/s] of the whole force
  float slew_time = 0.001f;   // [s] of a step that the slew may use, as in LimiterOptions
  float small_force = 0.02f;  // [N] below this,
  float quiet_time = 0.05f;   // [s] for so long, the account is closed
  // [s] after which a third of a surplus is forgotten: a spring on an encoder gives stiffness * step^2 at each tremor over one
  // of its steps (some microwatts), which the arm's own friction takes. What generates gives milliwatts.
  float forget = 1;
  // [N/m] a force that does not change with the hand counts as a spring at least this stiff. The credit is force^2 / stiffness,
  // twice what a linear spring holds: a spring that hardens as a power of its depth holds at most that much.
  float least_stiffness = 100;
};

struct PassivityInput {
  Vec3 x, v;            // [m], [m/s] of the hand
  Vec3 force;           // [N] that is about to be written
  Vec3 rubbed;          // [N] of it: friction
  float stiffness = 0;  // [N/m] along the force, as it is written
  float most = 3.3f;    // [N]
  float lent = 0;       // [J] that the other hand has given and this one may have
  float dt = 0.001f;    // [s]
};

struct Passivity {
  double energy = 0;  // [J] into the hand, as far as it counts; negative: credit
  double most = 0;    // [J] the largest it ever was
  double total = 0;   // [J] into the hand since the beginning, whatever was forgotten in between
  Vec3 last;          // [m]
  Vec3 force;         // [N] held since then
  Vec3 rubbed;        // [N]
  float gave = 0;     // [J] in the last step, to what is held or touched: not to friction; negative: took
  float used = 0;     // [J] of what was lent
  float quiet = 0;    // [s]
  bool any = false;
  bool braking = false;
};

// Returns the force to write, at most `most` [N] long and no further than the slew limit from the last.
Vec3 keep_passive(Passivity& p, const PassivityInput& in, const PassivityOptions& options = {});

// What each hand gave lately [J]. Any of the servos' threads; no lock.
struct EnergyPool {
  std::array<std::atomic<float>, 2> of{};
};
constexpr float kPoolMost = 0.02f;  // [J] 2 N over a centimeter: what a stretched bowel holds
constexpr float kPoolTime = 0.2f;   // [s] after which a third of it is left: tissue and thread lose the rest by themselves
float lent_to(const EnergyPool& pool, size_t hand);
void settle(EnergyPool& pool, size_t hand, const Passivity& p, float dt);

}  // namespace catgut
