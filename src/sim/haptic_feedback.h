// SPDX-License-Identifier: Apache-2.0
// sim/haptic_feedback: haptic forces of each hand in a tick, from the solver's multipliers. Writes State::haptics, which does
// not affect motion.
#pragma once
#include <array>
#include <cstdint>

#include "core/sym3.h"
#include "exchange/force_patch.h"
#include "exchange/reflect.h"
#include "solver/substep.h"
#include "suture/suture.h"

namespace catgut {

struct Model;
struct State;

// Forces on one tool, summed over the last substeps of a tick [N]. Working memory of the tick.
struct ToolReaction {
  Vec3 pressing, rubbing;  // from tissue and the other tool, along the contact normals and tangential
  float pressed = 0;       // sum of normal forces, regardless of direction
  float by_tool = 0;       // part of it from the other tool
  Vec3 thread;             // thread that is wrapped round the tool, frozen on it or held in the jaws
  Vec3 held;               // tissue in the jaws
  Vec3 needle;             // the needle in the jaws, without friction along its shaft
  Vec3 drag;               // friction along the needle's shaft
  Vec3 all, torque;        // sum of all of them, with friction; their torque [N m] about the tool's grasp point
  Vec3 hand, wrist;        // force and torque of the weld between tool and hand: balance these in static equilibrium
  float substeps = 0;      // number of substeps in the sum
  Vec3 at;                 // [m] hand positions, summed too
};

// Contact stiffness of tissue, estimated online: least squares over recent ticks with exponential forgetting. A bending wall
// is about ten times softer than one loaded in its plane, so a constant would be wrong for one of them.
struct StiffnessEstimate {
  Vec3 point, force;  // [m], [N] of the previous tick
  uint32_t discontinuity_id = 0;
  bool loaded = false;  // the previous tick had a force
  float work = 0;       // [N m] sum of -dF . dx
  float travel = 0;     // [m^2] sum of dx . dx
};

struct HapticFeedback {
  std::array<StiffnessEstimate, kMaxHands> stiffness;
  // Counts discontinuities of a hand: grasp, release, puncture (ForcePatch::discontinuity_id).
  std::array<uint32_t, kMaxHands> discontinuity_id{};
  std::array<ForcePatch, kMaxHands> patch;   // force patch of each hand until the next tick
  std::array<ToolReaction, kMaxHands> tool;  // per hand: of the instrument that it holds
};

constexpr void reflect(auto& a, Like<StiffnessEstimate> auto& f) {
  a(f.point), a(f.force), a(f.discontinuity_id), a(f.loaded), a(f.work), a(f.travel);
}
constexpr void reflect(auto& a, Like<HapticFeedback> auto& f) {
  a(f.stiffness), a(f.discontinuity_id), a(f.patch), a.cache(f.tool);
}

// Once per tick, before its substeps.
void begin_haptics(State& state);
// After substep i of the tick, 1 to model.substeps.
void accumulate_haptics(const Model& model, State& state, int i);
// After the last stage of the tick: counts discontinuities, updates the stiffness estimate, finishes the patches.
void finish_haptics(const Model& model, State& state);

}  // namespace catgut
