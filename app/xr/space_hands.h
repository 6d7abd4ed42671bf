// SPDX-License-Identifier: Apache-2.0
// app/xr: controllers or tracked hands in space to the ToolInputs of both hands. Pure: no runtime, no clock.
//
// With a controller at rest in the hand, an instrument lies in it like a pen: the shaft along the grip's -z, tilted down, the
// jaws a hand's width ahead. A tracked hand holds it between thumb and index finger.
//
// The instrument lies exactly at the hand until the clutch or a motion scale below 1 displaces it (as in a surgical console). A
// hand that is not tracked leaves its instrument where it is; when it returns while the instrument holds something, the motion
// continues from there, so that nothing is torn or dropped.
#pragma once
#include <array>
#include <cstdint>

#include "exchange/snapshot.h"
#include "exchange/tool_input.h"
#include "xr/place.h"

namespace catgut::xr {

// One controller or tracked hand, as the runtime reports it for a predicted time. Poses in the room.
struct HandState {
  bool tracked = false;      // the pose is valid and measured
  bool articulated = false;  // fingers instead of a controller: `grip` is the pinch, -z ahead
  Pose grip;                 // OpenXR's grip pose: -z along the fist's tube, toward the thumb
  Pose aim;                  // pointing ray along -z
  float trigger = 0;         // 0 released .. 1 pulled; of a pinch: 1 closed
  float stick_x = 0, stick_y = 0;
  bool clutch = false, cut = false, new_suture = false, swap = false, menu = false;
};

// Joints of a tracked hand [m, room].
struct Fingers {
  Vec3 thumb_tip, index_tip, thumb_knuckle, index_knuckle;  // knuckle: the proximal joint
};
// The pinch as a grip: between thumb and index finger, -z from the knuckles ahead, x from thumb to index. Its closing is the
// trigger: 0 from 55 mm between the tips, 1 to 12 mm.
void pinch(const Fingers& fingers, HandState& hand);

// The 1-euro filter (Casiez, Roussel and Vogel 2012, https://doi.org/10.1145/2207676.2208639): a low pass whose cutoff rises
// with speed: it removes tremor of a still hand and does not delay a moving one.
struct Steady {
  float cutoff = 2.5f;                    // [Hz] of a still hand
  float per_speed = 60, per_turn = 1.5f;  // [Hz per m/s], [Hz per rad/s]
  Pose value;
  Vec3 speed, turn;  // [m/s], [rad/s] smoothed
  bool started = false;

  Pose filter(const Pose& measured, float dt);
};

struct SpaceHandOptions {
  bool left_handed = false;  // tool 0, the needle holder, is in the left hand
  bool steady = true;
  float motion_scale = 1;  // tool distance per hand distance, 0.2 .. 1
};

struct SpaceHand {
  Steady steady;
  bool attached = false;      // the tool follows the hand
  bool clutched = false;      // the clutch was used since the hand was tracked
  bool displaced = false;     // it follows from the two poses below, not from the grip itself
  Pose hand_from, tool_from;  // world
  bool jaw_waits = false;     // the jaw stays closed until the trigger has been pulled
  ToolInput sent;
};

struct SpaceHands {
  std::array<SpaceHand, 2> hand;  // per tool
  uint32_t sequence = 0;
};

// Tool pose that a grip in the world holds. loupe: the instrument's reach is magnified too.
Pose tool_in_grip(const Pose& grip_world, bool articulated, float loupe);
// Its inverse: the grip in the world that holds a tool there.
Pose grip_of_tool(const Pose& tool_world, bool articulated, float loupe);
size_t tool_of(size_t side, bool left_handed);  // side: 0 left, 1 right, the order of OpenXR's hands

// state: left, right. seen: the newest snapshot. active: the session has the input focus; otherwise the tools stay. dt: [s].
// out: per tool; connected = 0 for a hand that was never tracked.
std::array<ToolInput, 2> move(SpaceHands& hands, const std::array<HandState, 2>& state, const Place& place,
                              const SpaceHandOptions& options, const Snapshot& seen, bool active, float dt, uint64_t time_ns);

// After a restart, an undone bite or a lost session: the tools continue from their present poses.
void resume(SpaceHands& hands, const Snapshot& seen);

}  // namespace catgut::xr
