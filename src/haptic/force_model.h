// SPDX-License-Identifier: Apache-2.0
// haptic: what a patch means at the place where the hand is now. Reads ForcePatch, writes a force [N] in the world frame.
// Pure: no clock, no lock, no allocation; the same calls give the same bits. Sources: docs/references.md.
#pragma once
#include "exchange/force_patch.h"

namespace catgut {

// Fit for use: everything finite, directions unit or zero, stiffness positive semidefinite and at most `stiffness` [N/m],
// damping at most `damping` [N s/m], the cap no more than `force` [N]. False when something had to be thrown away (then the
// patch renders nothing) or was not a stiffness at all.
bool make_safe(ForcePatch& patch, float force, float stiffness, float damping);

// The linear part alone, with its half-space, at x [m] with velocity v [m/s].
Vec3 linear_force(const ForcePatch& patch, Vec3 x, Vec3 v);

// One hand's memory between two evaluations.
struct ForceModel {
  ForcePatch now;
  bool any = false;
  Vec3 last, velocity;    // [m], [m/s] of the hand at the last evaluation
  Vec3 change;            // [N] what the last patch would still give more than the newest: it fades, so no patch makes a step
  float fade = 0;         // [s] time constant of that
  Vec3 bristle;           // [N] friction: a spring that is dragged along and slips at the limit
  float rub = 0;          // [N/m] that spring
  float sticks = 0;       // 1: it is being stretched, 0: it slips; smoothed
  Vec3 rubbed;            // [N] friction in the last force: it can only take energy
  float dropped = 1;      // of the wall's force at the tip: what is left of it since the tip went through, 1: it has not
  float pierced_at = 0;   // [N] the force at which that was
  float pierced_for = 0;  // [s]
  bool pierced = false;
};

struct ForceModelOptions {
  // Time constant over which one patch gives way to the next: this part of a physics period, at least `blend_least` [s], so
  // that patches blend over several servo steps at any rate. What the hand's own motion changes is felt at once.
  float blend = 0.3f, blend_least = 0.003f;
  float drop_time = 0.004f;  // [s] from the peak to what is left when the tip goes through: 3 to 5 ms
  // [s] within which the physics has to let the tip in as well; after that the wall comes back over `wall_back`.
  float unconfirmed = 0.04f, wall_back = 0.05f;
  // [s] damping of everything stiff, at least this times the stiffness: what keeps a spring still on an arm that moves some
  // milliseconds late (Gil et al. 2009: stiffness < damping / (half a period + delay)).
  float damping_time = 0.0025f;
  float damping = 4;      // [N s/m] at most
  float stiffness = 400;  // [N/m] of all springs together along any direction: what the arm can render
};

// A newer patch. A jump in time, or a change of topology, is taken over at once.
void receive(ForceModel& model, const ForcePatch& patch, const ForceModelOptions& options = {});
// The force on the hand at x [m], moving with v [m/s], dt [s] after the last call.
Vec3 evaluate(ForceModel& model, Vec3 x, Vec3 v, float dt, const ForceModelOptions& options = {});

}  // namespace catgut
