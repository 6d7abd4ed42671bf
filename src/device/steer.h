// SPDX-License-Identifier: Apache-2.0
// device: two hands for people without instruments: what turns small motions (of a mouse, of a stick) into whole ToolInputs.
// Pure functions over plain data: reads motions, the view and the last Snapshot; no clock, no window, no driver.
//
// A motion is meant as it is seen: right, up and into the picture. What a hand does with the needle is not: driving turns the
// held needle about its own circle, which is how a needle goes through tissue without tearing it.
//
// Where a flat screen and one hand at a time are not enough there is help, and it can be switched off (Steering::assist): an
// open jaw goes to where needle or tail are best held, a held needle to where the next bite begins, and what takes both hands
// at once is one gesture (device/both_hands).
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

// From where a user looks. Unit vectors at right angles; [m].
struct ViewFrame {
  Vec3 eye, right{1, 0, 0}, up{0, 1, 0}, ahead{0, 0, -1};
  float pixel = 0.001f;  // [m] that a pixel covers at 1 m from the eye
};
ViewFrame view_frame(Vec3 eye, Vec3 target, Vec3 up, float fov_deg, float height_px);  // fov: vertical

// What one hand is asked to do since the last call.
struct HandMotion {
  float right = 0, up = 0, ahead = 0;  // [m]
  float drive = 0;                     // [rad] about the held needle's circle, tip first; else about the tool's shaft
  float yaw = 0, pitch = 0, roll = 0;  // [rad] about the view's up, right and ahead, through the jaws
  bool together = false;               // both hands are meant, and
  float both = 0;                      // [rad] how far: see device/both_hands
};

enum class HelpAt : uint8_t { needle, tail, bite };  // what the help has found

struct SteeredHand {
  Pose pose;             // where the hand is, before any help
  bool closed = false;   // what the jaw is asked to be
  float opening = 1;     // of the jaw when it is not closed: a trigger half pulled
  uint32_t buttons = 0;  // kButtonCut, ...; a caller that reads keys sets them again before every steer()
  bool holds = false;    // the needle
  Pose grip;             // tool in the needle's frame, from the moment it was grasped
  bool snapped = false;  // the help has the tool, at
  HelpAt at = HelpAt::needle;
  Pose help;               // valid while snapped: where it holds it
  uint32_t tail_slot = 0;  // the tail's particle
  BiteGuide bite;          // the one that it is at: tissue that gives way does not move it
  bool hovered = false;    // the needle has come to the bite from outside the tissue, the jaws from above the tail
  float driven = 0;        // [rad] of the needle since then
  float waited = 0;        // [s] that the jaw was kept open until the tool was there
  ToolInput sent;          // last
};

struct Steering {
  std::array<SteeredHand, 2> hand;  // 0 needle driver, 1 forceps
  bool assist = true;               // help, all of it
  std::optional<BiteGuide> guide;   // where the next bite should go; a caller that knows sets it before every steer()
  BothHands both;
  uint32_t sequence = 0;
};

// Hands beside the field, the driver on the right, or on the left for left-handed people.
Steering start_steering(const PictureModel& picture, bool left_handed);

// After a restart, or a bite undone: the hands continue from where the tools are now.
void resume_steering(Steering& steering, const Snapshot& seen);

// Moves the hands and gives what a device would publish now. dt: [s] since the last call. time_ns: when the motion was made,
// on any clock; it is passed on.
std::array<ToolInput, 2> steer(Steering& steering, const std::array<HandMotion, 2>& motion, const ViewFrame& view,
                               const PictureModel& picture, const Snapshot& seen, float dt, uint64_t time_ns);

// Where hand `who` should grip the needle as it lies now: at right angles to it, two thirds of its length from the tip, or
// behind the tip when the other tool has that place or the needle is in tissue. shaft: unit, the way the hand's shaft runs.
Pose good_grip(const PictureModel& picture, const Snapshot& seen, size_t who, Vec3 shaft, Vec3 near);

}  // namespace catgut
