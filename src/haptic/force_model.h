// SPDX-License-Identifier: Apache-2.0
// haptic: evaluates a patch at the current position of the hand. Reads ForcePatch, writes a force [N] in the world frame.
// Pure: no clock, no lock, no allocation; the same calls give the same bits. Sources: docs/references.md.
#pragma once
#include "exchange/arm.h"
#include "exchange/force_patch.h"

namespace catgut {

// Makes a patch safe for a device. Everything finite, directions unit or zero, stiffness positive semidefinite and within the
// limits, the cap no more than the peak; no torque and no grip where the device has none. False if something was discarded
// (then the patch renders nothing) or the stiffness was not valid.
bool make_safe(ForcePatch& patch, const ArmLimits& limits);

// The linear part alone, with its half-space, at x [m] with velocity v [m/s].
Vec3 linear_force(const ForcePatch& patch, Vec3 x, Vec3 v);

// Memory of one hand between two evaluations.
struct ForceModel {
  ForcePatch now;
  bool any = false;
  Vec3 last, velocity;    // [m], [m/s] of the hand at the last evaluation
  Vec3 change;            // [N] remaining difference of the last patch to the newest: it fades, so that no patch causes a step
  float fade = 0;         // [s] time constant of that
  Vec3 bristle;           // [N] friction: a spring that is dragged along and slips at the limit
  float rub = 0;          // [N/m] stiffness of that spring
  float sticks = 0;       // 1: it is being stretched, 0: it slips; smoothed
  Vec3 rubbed;            // [N] friction in the last force: dissipative
  float dropped = 1;      // fraction of the wall's force at the tip that remains since the puncture, 1: no puncture
  float pierced_at = 0;   // [N] force at that puncture
  float pierced_for = 0;  // [s]
  bool pierced = false;
  // Of six degrees of freedom.
  Vec3 hand;         // [m] of the hand, while `last` is where the force acts
  Quat q;            // its orientation
  Vec3 turn_change;  // [N m] as `change`, of the torque
  Vec3 couple;       // [N m] in the last torque
};

struct ForceModelOptions {
  // Time constant of blending from one patch to the next: this fraction of a physics period, at least `blend_least` [s].
  // Patches then blend over several servo steps at any rate. Changes due to the hand's own motion are rendered at once.
  float blend = 0.3f, blend_least = 0.003f;
  float drop_time = 0.004f;  // [s] from the peak to the remaining force at puncture: 3 to 5 ms
  // [s] within which the physics must confirm the puncture; after that the wall returns over `wall_back`.
  float unconfirmed = 0.04f, wall_back = 0.05f;
  // [s] damping of every stiffness, at least this times the stiffness. Stabilizes a spring on a device with some milliseconds
  // of delay (Gil et al. 2009: stiffness < damping / (half a period + delay)).
  float damping_time = 0.0025f;
  float damping = 4;       // [N s/m] at most
  float stiffness = 400;   // [N/m] of all springs together along any direction: limit of the device
  float turn_damping = 0;  // [N m s/rad] of a couple, at most
};

// A newer patch. After a jump in time, or a new discontinuity_id, it replaces the old one at once.
void receive(ForceModel& model, const ForcePatch& patch, const ForceModelOptions& options = {});
// The force on the hand at x [m], moving with v [m/s], dt [s] after the last call.
Vec3 evaluate(ForceModel& model, Vec3 x, Vec3 v, float dt, const ForceModelOptions& options = {});

struct FeltMotion {
  Vec3 x, v;           // [m], [m/s]
  Quat q;              // orientation
  Vec3 spin;           // [rad/s]
  float jaw = 1;       // 0 closed .. 1 open
  float jaw_rate = 0;  // [1/s]
};
// [m] from the hand to where the force acts, at the last evaluation.
Vec3 lever_of(const ForceModel& model);
// Force, torque and grip on a hand, dt [s] after the last call. The force is the one above at the place where it acts; without
// lever, couple and grip, the same to the bit.
ArmForce evaluate(ForceModel& model, const FeltMotion& hand, float dt, const ForceModelOptions& options = {});

}  // namespace catgut
