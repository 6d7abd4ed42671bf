// SPDX-License-Identifier: Apache-2.0
// haptic: the multi-rate comparison of docs/rooms/haptic.md, with the production servo code. One dimension: a hand presses
// a wall of tissue, holds, and releases, on a device, while a slow simulation computes the tissue. The method of rendering in
// between decides whether the hand feels tissue or vibration. `catgut bench haptics` prints it, tests/haptic checks its
// claims.
#pragma once
#include <string>
#include <vector>

#include "haptic/servo.h"

namespace catgut {

enum class Rendering : uint8_t {
  reference,       // tissue and coupling computed at 1 kHz, no delay
  held_force,      // the force of the last frame, held (the paper's method)
  held_and_net,    // the same with the energy controller
  coupling,        // a spring at 1 kHz to the tool's position in the last frame
  coupling_blend,  // to its position interpolated between the last two frames
  local_model,     // ForcePatch
};
const char* rendering_name(Rendering r);

struct StudyCase {
  Rendering rendering{};
  float tissue = 1100, coupling = 400;  // [N/m]
  float rate = 60;                      // [1/s] of the physics
  float hardening = 0;                  // [N/m^2] a2 of f = a1 z + a2 z^2; 0: linear tissue
  float mass = 0.1f, viscous = 0.5f;    // [kg], [N s/m] device and finger
  float grip = 150, grip_damping = 2;   // [N/m], [N s/m] hand
};
struct StudyRow {
  float force_error = 0;   // [N] RMS against the reference with the same motion
  float hold_swing = 0;    // [m] peak to peak while the hand tries to hold still
  float largest_step = 0;  // [N] maximum change within one millisecond
  float energy = 0;        // [J] maximum energy given to the hand
};
StudyRow run_study(const StudyCase& c);

// The cases, each with the figures of an earlier one-dimensional prototype for comparison. hold_swing [m], energy [J].
struct StudyPublished {
  StudyCase c;
  StudyRow prototype;
};
std::vector<StudyPublished> published_study();

}  // namespace catgut
