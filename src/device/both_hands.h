// SPDX-License-Identifier: Apache-2.0
// device: two-handed actions for users who can move one hand at a time. They wind the needle's strand round the other
// tool, and pull both ends apart. One gesture gives the amount; the paths of the hands follow from the Snapshot. Pure, like
// device/steer, which calls it. An instrument tie as described in docs/rooms/surgeon.md.
#pragma once
#include <array>
#include <cstdint>

#include "exchange/picture.h"
#include "exchange/snapshot.h"
#include "exchange/tying.h"

namespace catgut {

enum class BothDo : uint8_t { nothing, wind, draw, withdraw };

// State of a two-handed action, kept between calls.
struct BothHands {
  BothDo doing = BothDo::nothing;
  int stage = 0;         // of winding: see both_hands.cpp
  float wish = 0;        // [rad] remaining of the gesture
  Winding winding;       // way 0: not started
  float held_for = 0;    // [s] in this stage
  Vec3 lain;             // [m] last position of the tool that is wound round
  bool follows = false;  // the needle's hand follows the tool that carries the loop
  float not_driven = 1;  // [s] outside the tissue since a hand drove the needle
};

// hand: tool poses of the hands, moved here within the limits of dt. grip: of the hand that holds the needle, tool in the
// needle's frame. amount: [rad] of the gesture. Its sign selects the sense when winding starts. Returns what was done:
// nothing, if the hands do not hold what is needed. A needle that has entered the tissue while the thread is tied is withdrawn
// along its curve first; one that was driven there makes a bite, and stays.
BothDo both_hands(BothHands& b, float amount, std::array<Pose, 2>& hand, const Pose& grip, const PictureModel& picture,
                  const Snapshot& seen, float dt);

// While tool `who` carries a loop: the other hand, with the needle, follows above it, its strand slack.
void go_along(BothHands& b, size_t who, std::array<Pose, 2>& hand, const Pose& grip, const PictureModel& picture,
              const Snapshot& seen, float dt);

// Best position for hand `who` to grasp the tail of the thread: clear of the other strand, no tissue in the path of its shaft,
// near the knot, within the range of the loop on it. tried: [m] rejected positions. Returns false if no position is found.
bool tail_grip(const PictureModel& picture, const Snapshot& seen, size_t who, TailGrip& out, std::span<const Vec3> tried = {});

// Without force feedback a jerk would tear a stitch. A hand that holds an end of the thread is limited to slightly more than
// that end's length from the tissue. p: target of hand `who`.
Vec3 on_leash(const PictureModel& picture, const Snapshot& seen, size_t who, Vec3 p);

// A hand that pulls the thread through its first stitch slows while the free end becomes short: at few frames per second
// a user could not stop in time. from: [m] where the hand was, p: its target.
Vec3 spare_tail(const PictureModel& picture, const Snapshot& seen, size_t who, Vec3 from, Vec3 p, float dt);

// Toward `goal` by at most speed [m/s] and turn [rad/s]; true on arrival.
bool glide(Pose& pose, const Pose& goal, float speed, float turn, float dt);

}  // namespace catgut
