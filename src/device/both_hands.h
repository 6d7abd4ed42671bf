// SPDX-License-Identifier: Apache-2.0
// device: what takes two hands at once, for people who can move only one of them: laying the needle's strand round the other
// tool, and drawing both ends apart. One motion says how far; where the hands go follows from what is seen and felt. Pure, like
// device/steer, which calls it. An instrument tie as docs/rooms/surgeon.md describes it.
#pragma once
#include <array>
#include <cstdint>

#include "exchange/picture.h"
#include "exchange/snapshot.h"
#include "exchange/tying.h"

namespace catgut {

enum class BothDo : uint8_t { nothing, wind, draw };

// What the two hands are about, kept from one call to the next.
struct BothHands {
  BothDo doing = BothDo::nothing;
  int stage = 0;         // of winding: see both_hands.cpp
  float wish = 0;        // [rad] still asked for
  Winding winding;       // way 0: nothing was wound yet
  float held_for = 0;    // [s] in this stage
  Vec3 lain;             // [m] where winding last left the tool that is wound round
  bool follows = false;  // the needle's hand goes along with the tool that carries the loop
};

// hand: tool poses as the hands have them, moved here by what dt allows. grip: of the hand that holds the needle, tool in the
// needle's frame. amount: [rad] of the gesture, more or less; the sign chooses the way when winding begins. Says what was done:
// nothing, when the hands do not hold what it takes.
BothDo both_hands(BothHands& b, float amount, std::array<Pose, 2>& hand, const Pose& grip, const PictureModel& picture,
                  const Snapshot& seen, float dt);

// While tool `who` carries a loop: the other hand, with the needle, goes along above it, its strand loose.
void go_along(BothHands& b, size_t who, std::array<Pose, 2>& hand, const Pose& grip, const PictureModel& picture,
              const Snapshot& seen, float dt);

// Where hand `who` best takes the tail of the thread: clear of the other strand, no tissue in the way of its shaft, near the
// knot, within what the loop on it leaves. False: there is no tail.
bool tail_grip(const PictureModel& picture, const Snapshot& seen, size_t who, TailGrip& out);

// A hand that feels nothing would tear a stitch with one jerk: what holds an end of the thread comes no more than a little
// farther from the tissue than that end is long. p: where hand `who` would be.
Vec3 on_leash(const PictureModel& picture, const Snapshot& seen, size_t who, Vec3 p);

// Toward `goal` by at most speed [m/s] and turn [rad/s]; true when it is there.
bool glide(Pose& pose, const Pose& goal, float speed, float turn, float dt);

}  // namespace catgut
