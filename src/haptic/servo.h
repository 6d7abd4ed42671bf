// SPDX-License-Identifier: Apache-2.0
// haptic: one millisecond of one hand. Reads an ArmSample and, when there is one, a newer ForcePatch; writes the force for the
// motors and the whole pose for the simulation. Nothing here waits, allocates, logs or reads a clock: it runs in the callback
// of the arm's driver. docs/rooms/haptic.md has the chain.
#pragma once
#include <cstdint>

#include "exchange/arm.h"
#include "exchange/force_patch.h"
#include "exchange/tool_input.h"
#include "haptic/force_model.h"
#include "haptic/limiter.h"
#include "haptic/passivity.h"

namespace catgut {

// Where an arm's workspace lies in the field: world = offset + scale * turn(arm). What `catgut devices --calibrate` finds.
struct Workspace {
  float scale = 1;
  Quat turn;    // of the arm's axes
  Vec3 offset;  // [m] world: where the arm's origin lies
  Quat stylus;  // of the tool in the stylus: identity, -z of both is the way they point
};
Pose to_world(const Workspace& w, const Pose& arm);
Pose to_arm(const Workspace& w, const Pose& world);

struct ServoOptions {
  ArmLimits limits;
  Workspace place;
  LimiterOptions limiter;
  PassivityOptions passivity;
  ForceModelOptions model;
  // Newtons at the motors per newton in the field; 0: the workspace's scale, which neither makes nor loses energy.
  float gain = 0;
  float velocity_filter = 50;  // [Hz] first-order, for damping (30 to 80 are usual)
  // [m] world. A patch is refused while the hand is farther from the patch's point than this plus what the hand can have moved
  // since: whatever the reason (another hand's patch, a jump in time, a demonstration), it belongs to another place.
  float reach = 0.004f;
  // Button 1 held: the tool stays and the arm goes elsewhere (clutch); pressed twice within `twice` [s]: cut. One press does
  // nothing that cannot be undone.
  bool clutch = true;
  float twice = 0.4f;
  bool ratchet = true;  // the button nearest to the tip closes the jaw and, pressed again, opens it; else it is held
  bool force = true;    // false: the arm moves the tool and feels nothing
};
// The same patch in the arm's own frame and newtons, for an arm's end that evaluates it elsewhere (no workspace, gain 1).
ForcePatch to_arm(const ServoOptions& options, const ForcePatch& world);
// Limits of the chain from those of the arm (device/profiles); what is 0 there stays as it is.
void fit_to_arm(ServoOptions& options, const ArmLimits& limits);

struct ServoHand {
  ForceModel model;
  Limiter limiter;
  Passivity passivity;
  Vec3 at, velocity;     // [m], [m/s] arm frame, filtered
  float fast = 0;        // [m/s] world: the largest speed of the last tenth of a second, fading
  uint64_t last_ns = 0;  // of the last step
  uint32_t epoch = 0;
  bool any = false;  // there was a sample
  bool has_patch = false;
  uint32_t buttons = 0;
  bool closed = false;
  Vec3 clutch, held_at;    // [m] world: how far the tool was moved by clutching; where it stands meanwhile
  uint64_t second_ns = 0;  // when button 1 went down last
  bool clutched = false, cuts = false;
  uint32_t sequence = 0;
  uint64_t steps = 0;
};

struct ServoOut {
  Vec3 force;            // [N] arm frame: what is written
  Vec3 wanted, allowed;  // [N] arm frame: of the patch; after the limiter, before the energy account
  ToolInput hand;        // world; connected 0 while the arm is lost
};

// fresh: null when the physics has published nothing since. now_ns: the clock that stamps ForcePatch::time_ns.
// pool: null, or what both hands share, of which this is hand k.
ServoOut servo_step(ServoHand& hand, const ServoOptions& options, const ArmSample& sample, const ForcePatch* fresh,
                    uint64_t now_ns, EnergyPool* pool = nullptr, size_t k = 0);

}  // namespace catgut
