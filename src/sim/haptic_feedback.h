// SPDX-License-Identifier: Apache-2.0
// sim/haptic_feedback: what each hand feels of a tick, from the solver's own multipliers. Writes State::haptics, which nothing
// that moves reads.
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
  Vec3 pressing, rubbing;  // tissue and the other tool on this one, along the contacts' normals and across
  float pressed = 0;       // all pressing, whatever its direction
  float by_tool = 0;       // of that, the other tool's
  Vec3 thread;             // thread that lies round the tool, is frozen there or is held in the jaws
  Vec3 held;               // tissue in the jaws
  Vec3 needle;             // the needle in the jaws, less what rubs along its shaft
  Vec3 drag;               // that
  Vec3 hand;               // the weld that couples tool and hand: what all of these balance when nothing speeds up
  float substeps = 0;      // how many there are in the sum
  Vec3 at;                 // [m] where the hand was, summed too
};

// How stiff the tissue is to a hand, learned from what it does: least squares over the last ticks, which forgets. A wall that
// bends answers ten times softer than one that is pulled in its plane, and no table knows which it is.
struct StiffnessEstimate {
  Vec3 point, force;  // [m], [N] of the tick before
  uint32_t discontinuity_id = 0;
  bool loaded = false;  // there was a force in the tick before
  float work = 0;       // [N m] sum of -dF . dx
  float travel = 0;     // [m^2] sum of dx . dx
};

struct HapticFeedback {
  std::array<StiffnessEstimate, kMaxHands> stiffness;
  // Counts what changes at once for a hand: taken, let go, pierced (ForcePatch::topology).
  std::array<uint32_t, kMaxHands> discontinuity_id{};
  std::array<ForcePatch, kMaxHands> patch;   // what each hand may feel until the next tick
  std::array<ToolReaction, kMaxHands> tool;  // per hand: of the instrument that it has
};

constexpr void reflect(auto& a, Like<StiffnessEstimate> auto& f) {
  a(f.point), a(f.force), a(f.discontinuity_id), a(f.loaded), a(f.work), a(f.travel);
}
constexpr void reflect(auto& a, Like<HapticFeedback> auto& f) {
  a(f.stiffness), a(f.discontinuity_id), a(f.patch), a.cache(f.tool);
}

// Once a tick, before its substeps.
void begin_haptics(State& state);
// After substep i of the tick's, 1 to model.substeps.
void accumulate_haptics(const Model& model, State& state, int i);
// After the tick's last stage: counts what changed at once, learns how stiff things are, finishes the patches.
void finish_haptics(const Model& model, State& state);

}  // namespace catgut
