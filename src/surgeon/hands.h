// SPDX-License-Identifier: Apache-2.0
// surgeon/hands: how a scripted hand moves. Plain kinematics: toward a goal at a bounded speed, with a tremor on top. Knows
// nothing of the simulation.
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
  Pose grip;    // needle frame -> tool frame, measured when the needle was grasped
};

// Moves toward `goal` at no more than speed [m/s] and a turn rate to match; true when it is there (0.3 mm, 0.02 rad).
bool move_toward(ScriptedHand& hand, const Pose& goal, float speed, float dt);
// Opens or closes the jaw at 5 full strokes a second; true when it is there.
bool move_jaw(ScriptedHand& hand, float goal, float dt);
// A hand's tremor: filtered noise of the given standard deviation [m], around 8 Hz.
void tremble(ScriptedHand& hand, float deviation, Random& random, float dt);
ToolInput as_input(ScriptedHand& hand, const Pose& before, float dt, uint32_t sequence);

}  // namespace catgut
