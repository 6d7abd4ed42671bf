// haptic: a net under everything else. Counts the energy that went into the hand and, when it is more than the rendering could
// have given rightly, brakes the hand as far as the arm may brake (time-domain passivity, Hannaford and Ryu
// 2002). It keeps things safe, not good: alone under a held force it leaves a limit cycle of a millimeter (`catgut bench
// haptics`). Pure; in the arm's frame, where what the motors do is exact: the force is held between two samples.
#pragma once
#include "core/math.h"

namespace catgut {

struct PassivityOptions {
  double allowance =
      2e-4;           // [J] a spring that is sampled at 1 kHz gives 0.12 to 0.16 mJ without any fault (`catgut bench haptics`)
  float damping = 4;  // [N s/m] at most (CHAI3D's cap for a Touch)
  float slew = 500;   // [N/s] of the whole force
  float slew_time = 0.001f;   // [s] of a step that the slew may use, as in LimiterOptions
  float small_force = 0.02f;  // [N] below this,
  float quiet_time = 0.05f;   // [s] for so long, the account is closed: old credit would delay the next brake
};

struct Passivity {
  double energy = 0;  // [J] into the hand since the account was opened; negative: the hand has given
  double most = 0;    // [J] the largest it ever was
  double total = 0;   // [J] into the hand since the beginning, whatever was forgotten in between
  Vec3 last;          // [m]
  Vec3 force;         // [N] held since then
  float quiet = 0;    // [s]
  bool any = false;
  bool braking = false;
};

// x [m], v [m/s] now; force [N] that is about to be written. Returns the force to write, at most `most` [N] long and no further
// than the slew limit from the last.
Vec3 keep_passive(Passivity& p, Vec3 x, Vec3 v, Vec3 force, float most, float dt, const PassivityOptions& options = {});

}  // namespace catgut
