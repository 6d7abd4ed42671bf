// SPDX-License-Identifier: Apache-2.0
// haptic: the chain between the computed force and the motors, in this order: finite, age of
// the model, soft map, clamp, slew, heat, ramp-in. The energy controller (haptic/passivity) follows it. Reads a wanted
// force, writes an allowed one; both in the device's frame [N]. Torque and grip pass the same chain: a fault of one is a fault
// of all. Pure: the caller passes the time.
#pragma once
#include <array>
#include <cstdint>

#include "core/math.h"
#include "exchange/arm.h"

namespace catgut {

struct LimiterOptions {
  float force = 3.3f;        // [N] length of the vector, not per axis (Touch: 3.3)
  float continuous = 0.88f;  // [N] leaky RMS (Touch's data sheet, from memory: the driver's own number replaces it)
  float knee = 1.5f;         // [N] up to here 1:1; above it
  float above = 0.5f;        // this slope: a bowel that tears at 4.6 N stays stronger than a knot that ties at 3.8
  float slew = 500;          // [N/s] 0.5 N/ms: a puncture's drop of 1 to 1.8 N in 3 to 5 ms passes
  float slew_recovery = 20;  // [N/s] 0.02 N/ms while force returns
  // [s] limit of the time step used by the slew: after a gap the motors get the step of one millisecond, not of the gap.
  float slew_time = 0.001f;
  float late = 0.005f;        // [s] a longer gap between two steps is a fault, and force returns slowly
  float decay = 0.02f;        // [s] time constant once the model has expired
  float off_after = 0.06f;    // [s] after expiry: off, and engage again; with an expiry of 30 ms, within 100 ms
  float heat_time = 10;       // [s] of the leaky mean (an assumption; no motor model was found)
  float margin = 0.95f;       // of the continuous force: a mean over minutes includes the peak that the leaky mean allows
  float warm = 0.8f;          // of ArmSample::warmth, above which the force decreases to zero at 1
  float engage_force = 0.2f;  // [N] engage only after the wanted force has been below this (CHAI3D cGenericTool)
  int engage_steps = 3;       // for more than this many steps
  float ramp = 2;             // [s] from zero to full force
  float top_speed = 1.0f;     // [m/s] of the hand; above: force off (the device's own limit is 1.2 m/s)
  float free_force = 0.05f;   // [N] a fast hand with less force than this stays engaged
  // Peaks of torque and grip; 0: no such motors. Their other limits are those of the force, in proportion to the peaks.
  float torque = 0;  // [N m]
  float grip = 0;    // [N]
};

enum LimiterFault : uint32_t {
  kNotFinite = 1u << 0,  // a force, position or velocity was not finite
  kTooMuch = 1u << 1,    // the wanted force was more than ten times the device's limit
  kBadModel = 1u << 2,   // the patch was invalid (see make_safe)
  kTimeBack = 1u << 3,   // the time step was zero, negative or too large
  kTooFast = 1u << 4,    // the hand was faster than top_speed
  kExpired = 1u << 5,    // without a patch for so long that the force was switched off
  kGenerated = 1u << 6,  // the energy controller acted
  kTooWarm = 1u << 7,    // motors or the mean force
  kLate = 1u << 8,       // the servo was called later than LimiterOptions::late
  kElsewhere = 1u << 9,  // the patch was computed for a position far from the hand
};

enum class Engaged : uint8_t { no, waiting, rising, yes };

// Of force, torque or grip; torque and grip in units of peak / LimiterOptions::force, so that one chain serves all.
struct LimiterMotors {
  Vec3 soft;       // [N] after slew, before heat and ramp
  Vec3 trusted;    // [N] the last wanted force while the model was young
  float heat = 0;  // [N^2] leaky mean square of the output
  Vec3 out;        // [N] the last force
};

struct Limiter {
  Engaged engaged = Engaged::waiting;
  int quiet = 0;                       // steps in which the wanted force was small
  float ramp = 0;                      // 0..1
  bool recovering = false;             // slew_recovery holds until force has caught up
  std::array<LimiterMotors, 3> motor;  // force, torque, grip (along x)
  uint32_t faults = 0;                 // LimiterFault bits so far; a caller that may log does so once for each
};

struct LimiterInput {
  ArmForce wanted;
  float age = 0;         // [s] of the patch; negative: there is none
  float expiry = 0.03f;  // [s] maximum valid age
  float cap = 3.3f;      // [N] of the patch; 0 for torque and grip, too
  float speed = 0;       // [m/s] of the hand
  float warmth = 0;      // ArmSample::warmth
  bool ready = true;     // the arm takes force
};

// dt [s]: since the last call; values outside 0 to 20 ms count as 1 ms and as a fault.
ArmForce limit(Limiter& limiter, const LimiterInput& in, float dt, const LimiterOptions& options = {});
// The force is switched off (through the slew) and has to engage again.
void disengage(Limiter& limiter);
// dt, or 1 ms if it is implausible (kTimeBack); a gap longer than `late` is a fault (kLate) and starts a recovery.
float safe_dt(Limiter& limiter, float dt, const LimiterOptions& options = {});

}  // namespace catgut
