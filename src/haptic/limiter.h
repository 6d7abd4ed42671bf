// SPDX-License-Identifier: Apache-2.0
// haptic: everything between the force that was worked out and the motors, in this order: finite, age of
// the model, soft map, clamp, slew, heat, ramp-in; the energy controller (haptic/passivity) comes after it. Reads a wanted
// force, writes an allowed one; both in the arm's frame [N]. Pure: time is handed in.
#pragma once
#include <cstdint>

#include "core/math.h"
#include "exchange/arm.h"

namespace catgut {

struct LimiterOptions {
  float force = 3.3f;        // [N] length of the vector, not per axis (Touch: 3.3)
  float continuous = 0.88f;  // [N] leaky RMS (Touch's data sheet, from memory: the driver's own number replaces it)
  float knee = 1.5f;         // [N] up to here 1:1; beyond it
  float above = 0.5f;        // that much per newton: a bowel that tears at 4.6 N stays stronger than a knot that ties at 3.8
  float slew = 500;          // [N/s] 0.5 N/ms: a puncture's drop of 1 to 1.8 N in 3 to 5 ms passes
  float slew_recovery = 20;  // [N/s] 0.02 N/ms while force comes back
  // [s] the slew acts on at most this much of a step: after a gap the motors get the step of one millisecond, not of the gap.
  float slew_time = 0.001f;
  float late = 0.005f;        // [s] a longer gap between two steps is a fault, and force recovers slowly
  float decay = 0.02f;        // [s] time constant once the model has expired
  float off_after = 0.06f;    // [s] after expiry: off, and engage again; with an expiry of 30 ms, within 100 ms
  float heat_time = 10;       // [s] of the leaky mean (an assumption; no motor model was found)
  float margin = 0.95f;       // of the continuous force: a mean over minutes contains what the leaky one let through at first
  float warm = 0.8f;          // of ArmSample::warmth from which force backs off to nothing at 1
  float engage_force = 0.2f;  // [N] engage only when the wanted force has been below this (CHAI3D cGenericTool)
  int engage_steps = 3;       // for more than so many steps
  float ramp = 2;             // [s] from nothing to all of it
  float top_speed = 1.0f;     // [m/s] of the hand; faster: force off (driver's own limit 1.2 m/s)
  float free_force = 0.05f;   // [N] a fast hand that felt less than this keeps its engagement
};

enum LimiterFault : uint32_t {
  kNotFinite = 1u << 0,  // a force, position or velocity was no number
  kTooMuch = 1u << 1,    // more than ten times what the arm can give was wanted
  kBadModel = 1u << 2,   // the patch was not one (see make_safe)
  kTimeBack = 1u << 3,   // time stood still, ran backwards or leapt
  kTooFast = 1u << 4,    // the hand was faster than top_speed
  kExpired = 1u << 5,    // no patch for so long that force was taken off
  kGenerated = 1u << 6,  // the energy controller had to brake
  kTooWarm = 1u << 7,    // motors or the mean force
  kLate = 1u << 8,       // the servo was called later than LimiterOptions::late
  kElsewhere = 1u << 9,  // the patch was computed for another place than where the hand is
};

enum class Engaged : uint8_t { no, waiting, rising, yes };

struct Limiter {
  Engaged engaged = Engaged::waiting;
  int quiet = 0;            // steps in which the wanted force was small
  float ramp = 0;           // 0..1
  Vec3 soft;                // [N] after slew, before heat and ramp
  Vec3 trusted;             // [N] the last wanted force while the model was young
  bool recovering = false;  // slew_recovery holds until force has caught up
  float heat = 0;           // [N^2] leaky mean of what went out
  Vec3 out;                 // [N] the last force
  uint32_t faults = 0;      // LimiterFault bits seen so far; a caller that may log does so once for each
};

struct LimiterInput {
  Vec3 wanted;           // [N]
  float age = 0;         // [s] of the patch; negative: there is none
  float expiry = 0.03f;  // [s] of age from which it is not believed
  float cap = 3.3f;      // [N] of the patch
  float speed = 0;       // [m/s] of the hand
  float warmth = 0;      // ArmSample::warmth
  bool ready = true;     // the arm takes force
};

// dt [s]: since the last call; whatever is not between 0 and 20 ms counts as 1 ms and as a fault.
Vec3 limit(Limiter& limiter, const LimiterInput& in, float dt, const LimiterOptions& options = {});
// The force goes off (through the slew) and has to engage again.
void disengage(Limiter& limiter);
// dt, or 1 ms where it cannot be right (kTimeBack); a gap longer than `late` is a fault (kLate) and starts a recovery.
float safe_dt(Limiter& limiter, float dt, const LimiterOptions& options = {});

}  // namespace catgut
