// SPDX-License-Identifier: Apache-2.0
// device: two hands without haptic devices: converts small motions (of a mouse, of a stick) into complete ToolInputs.
// Pure functions over plain data: reads motions, the view and the last Snapshot; no clock, no window, no backend.
//
// Motions are in the view frame: right, up and along the view axis. Driving is not: it turns the held needle about its own
// circle, which passes through tissue without tearing it.
//
// Assists compensate for the flat screen and for one hand at a time (Steering::assist switches them off). An open jaw snaps to
// the best grasp of needle or tail, a held needle to the start of the next bite; clamp, pen, swab and scissors to the tissue
// under the pointer (device/wall_spot). A two-handed action is one gesture (device/both_hands).
#pragma once
#include <array>
#include <cstdint>
#include <optional>

#include "device/bite_guide.h"
#include "device/both_hands.h"
#include "exchange/picture.h"
#include "exchange/snapshot.h"
#include "exchange/tool_input.h"

namespace catgut {

// View of the user. Orthogonal unit vectors; [m].
struct ViewFrame {
  Vec3 eye, right{1, 0, 0}, up{0, 1, 0}, ahead{0, 0, -1};
  float pixel = 0.001f;  // [m] that a pixel covers at 1 m from the eye
};
ViewFrame view_frame(Vec3 eye, Vec3 target, Vec3 up, float fov_deg, float height_px);  // fov: vertical

// Requested motion of one hand since the last call.
struct HandMotion {
  float right = 0, up = 0, ahead = 0;  // [m]
  float drive = 0;                     // [rad] about the held needle's circle, tip first; else about the tool's shaft
  float yaw = 0, pitch = 0, roll = 0;  // [rad] about the view's up, right and ahead, through the jaws
  bool together = false;               // both hands are meant, and
  float both = 0;                      // [rad] amount: see device/both_hands
};

// Target of the assist. rim: jaws or blades astride the wall; face: a tip on it.
enum class HelpAt : uint8_t { needle, tail, bite, rim, face };

struct SteeredHand {
  Pose pose;             // pose of the hand, before any assist
  bool closed = false;   // requested state of the jaw
  float opening = 1;     // of the jaw when it is not closed: a partly pulled trigger
  uint32_t buttons = 0;  // kButtonCut, ...; a caller that reads keys sets them before every steer()
  bool holds = false;    // the needle
  Pose grip;             // tool in the needle's frame, from the moment it was grasped
  bool snapped = false;  // the assist moves the tool, at
  HelpAt at = HelpAt::needle;
  Pose help;                     // valid while snapped: its pose
  uint32_t tail_slot = 0;        // the tail's particle
  std::array<Vec3, 3> missed{};  // [m] positions on the tail where tissue stopped the jaws, and
  uint32_t misses = 0;           // their number
  float blocked = 0;             // [s] that tissue has stopped them now
  BiteGuide bite;                // the one that it is at: not affected by tissue deformation
  bool hovered = false;          // the needle has approached the bite from outside the tissue, jaws from above the tail or rim
  float driven = 0;              // [rad] of the needle since then
  float waited = 0;              // [s] that the jaw was kept open until the tool arrived
  float lift = 0;                // [m] of a tip off the face that it is at, by the wheel
  ToolInput sent;                // last
};

struct Steering {
  std::array<SteeredHand, 2> hand;  // 0 needle holder, 1 forceps
  bool assist = true;               // all assists
  std::optional<BiteGuide> guide;   // planned position of the next bite; the caller sets it before every steer()
  BothHands both;
  uint32_t sequence = 0;
};

// Hands beside the field, the needle holder on the right, or on the left for left-handed users.
Steering start_steering(const PictureModel& picture, bool left_handed);

// After a restart, or an undone bite: the hands continue from the present poses of the tools.
void resume_steering(Steering& steering, const Snapshot& seen);

// Moves the hands and returns the ToolInput that a device would publish. dt: [s] since the last call. time_ns: time of the
// motion, on any clock; it is passed on.
std::array<ToolInput, 2> steer(Steering& steering, const std::array<HandMotion, 2>& motion, const ViewFrame& view,
                               const PictureModel& picture, const Snapshot& seen, float dt, uint64_t time_ns);

// Best grasp of the needle for hand `who`: perpendicular to it, a third from the swage, or
// behind the tip if the other tool is there or the needle is in tissue. shaft: unit, direction of the hand's shaft.
Pose good_grip(const PictureModel& picture, const Snapshot& seen, size_t who, Vec3 shaft, Vec3 near,
               int suture = -1);  // -1: the active one

}  // namespace catgut
