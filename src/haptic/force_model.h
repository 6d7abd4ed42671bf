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
  ForcePatch before, now;
  bool any = false;
  float since = 0;       // [s] since `now` came
  float blend = 0;       // [s] over which `before` gives way to `now`; 0: at once
  Vec3 last;             // [m] where the hand was
  Vec3 bristle;          // [m] Dahl's state: how far the contact is dragged along, at most presliding
  float dropped = 1;     // of the force along the tip: what is left of it since the tip went through, 1: it has not
  float pierced_at = 0;  // [N] the force at which that was
  bool pierced = false;
};

struct ForceModelOptions {
  // Part of a physics period over which one patch gives way to the next. Interpolates the models' parameters: both are
  // evaluated where the hand is now, so no frame of delay is added to the feel of moving.
  float blend = 0.5f;
  float drop_time = 0.004f;  // [s] from the peak to what is left when the tip goes through: 3 to 5 ms (assumption)
};

// A newer patch. A jump in time, or a change of topology, is taken over at once.
void receive(ForceModel& model, const ForcePatch& patch, const ForceModelOptions& options = {});
// The force on the hand at x [m], moving with v [m/s], dt [s] after the last call.
Vec3 evaluate(ForceModel& model, Vec3 x, Vec3 v, float dt, const ForceModelOptions& options = {});

}  // namespace catgut
