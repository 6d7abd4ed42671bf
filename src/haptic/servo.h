// SPDX-License-Identifier: Apache-2.0
// haptic: one millisecond of one hand. Reads an ArmSample and, if available, a newer ForcePatch; writes the force for the
// motors and the complete pose for the simulation. It never waits, allocates, logs or reads a clock: it runs in the callback
// of the device's library. docs/rooms/haptic.md has the chain.
#pragma once
#include <cstdint>

#include "exchange/arm.h"
#include "exchange/force_patch.h"
#include "exchange/tool_input.h"
#include "haptic/force_model.h"
#include "haptic/limiter.h"
#include "haptic/passivity.h"

namespace catgut {

// Pose of a device's workspace in the field: world = offset + scale * turn(arm). Determined by `catgut devices --calibrate`.
struct Workspace {
  float scale = 1;
  Quat turn;    // of the arm's axes
  Vec3 offset;  // [m] world: position of the device's origin
  Quat stylus;  // of the tool in the stylus: identity, -z of both is the pointing direction
};
Pose to_world(const Workspace& w, const Pose& arm);
Pose to_arm(const Workspace& w, const Pose& world);

struct ServoOptions {
  ArmLimits limits;
  Workspace place;
  LimiterOptions limiter;
  PassivityOptions passivity;
  ForceModelOptions model;
  // Newtons at the motors per newton in the field; 0: the workspace's scale, which preserves energy.
  float gain = 0;
  float velocity_filter = 50;  // [Hz] first-order, for damping (30 to 80 are usual)
  // [m] world. A patch is refused while the hand is farther from the patch's point than this plus the possible motion since
  // then. It then belongs to another position, whatever the cause (another hand's patch, a jump in time, a demonstration).
  float reach = 0.004f;
  // Button 1 held: the tool stays while the stylus moves (clutch); pressed twice within `twice` [s]: cut. A single press does
  // nothing irreversible.
  bool clutch = true;
  float twice = 0.4f;
  bool ratchet = true;  // the button nearest to the tip toggles the jaw; false: the jaw is closed while it is pressed
  bool force = true;    // false: the device moves the tool without force
};
// The user's own gain of the force in a hand. It never raises a limit of the device: peak, stiffness and damping hold after it.
constexpr float kLeastStrength = 0.2f, kMostStrength = 2;
// The same patch in the device's own frame and newtons, for a device server that evaluates it (no workspace, gain 1).
ForcePatch to_arm(const ServoOptions& options, const ForcePatch& world, float strength = 1);
// Limits of the chain from those of the device (device/profiles); zero values stay unchanged.
void fit_to_arm(ServoOptions& options, const ArmLimits& limits);

struct ServoHand {
  ForceModel model;
  Limiter limiter;
  Passivity passivity;
  Vec3 at, velocity;                        // [m], [m/s] arm frame, filtered
  Quat turned;                              // arm frame
  Vec3 spin;                                // [rad/s] filtered
  float jaw = 1, jaw_rate = 0;              // of a gripper, [1/s] filtered
  float strength = 1, strength_wanted = 1;  // see kLeastStrength; the first follows the second without a step
  float fast = 0;                           // [m/s] world: maximum speed of the last tenth of a second, fading
  uint64_t last_ns = 0;                     // of the last step
  uint32_t epoch = 0;
  bool any = false;  // there was a sample
  bool has_patch = false;
  uint32_t buttons = 0;
  bool closed = false;
  Vec3 clutch, held_at;    // [m] world: displacement of the tool by clutching; its position meanwhile
  uint64_t second_ns = 0;  // time of the last press of button 1
  bool clutched = false, cuts = false;
  uint32_t sequence = 0;
  uint64_t steps = 0;
};

struct ServoOut : ArmForce {  // as written, device frame
  ArmForce wanted, allowed;   // device frame: of the patch; after the limiter, before the energy account
  ToolInput hand;             // world; connected 0 while the device is lost
};

// fresh: null if the physics has published nothing since. now_ns: the clock that stamps ForcePatch::time_ns.
// pool: null, or the energy pool of both hands, of which this is hand k.
ServoOut servo_step(ServoHand& hand, const ServoOptions& options, const ArmSample& sample, const ForcePatch* fresh,
                    uint64_t now_ns, EnergyPool* pool = nullptr, size_t k = 0);

}  // namespace catgut
