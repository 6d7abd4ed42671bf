// SPDX-License-Identifier: Apache-2.0
// surgeon/hands: kinematics of a scripted hand: toward a goal at a bounded speed, with tremor added. Independent of the
// simulation.
#pragma once
#include "core/random.h"
#include "exchange/snapshot.h"
#include "exchange/tool_input.h"

namespace catgut {

struct ScriptedHand {
  Pose pose;      // commanded, without tremor
  Vec3 velocity;  // [m/s] of the last tick
  float jaw = 1;
  Vec3 tremor;  // [m]
  Pose grip;    // needle frame -> tool frame, measured at the grasp
};

// Moves toward `goal` at no more than speed [m/s] and a matching turn rate; true on arrival (0.3 mm, 0.02 rad).
bool move_toward(ScriptedHand& hand, const Pose& goal, float speed, float dt);
// Opens or closes the jaw at 5 full strokes per second; true on arrival.
bool move_jaw(ScriptedHand& hand, float goal, float dt);
// A hand's tremor: filtered noise of the given standard deviation [m], around 8 Hz.
void tremble(ScriptedHand& hand, float deviation, Random& random, float dt);
ToolInput as_input(ScriptedHand& hand, const Pose& before, float dt, uint32_t sequence);

}  // namespace catgut
