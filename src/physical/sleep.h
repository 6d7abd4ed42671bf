// SPDX-License-Identifier: Apache-2.0
// physical/sleep: a thread that has been quiet is not stepped any more. It keeps its shape and tension, and its forces on the
// wall, on holds and on tools stay what they were. It wakes when the wall near it, a hold or a tool moves, when a hole is
// added, or when it is cut. Reads wall, holds and tools of a step; writes State::sleep. docs/physical.md, "Cost".
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "core/math.h"
#include "thread/thread.h"
#include "wall/points.h"

namespace catgut::physical {

struct Model;
struct State;
struct Hands;

struct SleepModel {
  bool on = true;
  uint32_t window = 250;  // steps
  float still = 1e-6f;    // [m] no node is farther from where it was at the beginning of the window
  float steady = 5e-3f;   // [N] no tension has changed by more, plus a hundredth of it
  float touched = 2e-6f;  // [m] motion of a hold, a tool or a loaded column that wakes the thread
  float nearby = 50e-6f;  // [m] the same for a column near the thread that it does not load
};

struct Sleep {
  bool asleep = false;
  uint32_t quiet = 0;          // steps since the window began
  std::vector<Vec3> from;      // [m] per node, at the beginning of the window
  std::vector<float> tension;  // [N] per segment, likewise
  // While asleep; empty otherwise.
  struct Load {
    uint32_t at = 0;  // 2 * column: its mid-surface point; + 1: its director
    Vec3 impulse;     // [N s] of every step
  };
  std::vector<Load> load;
  std::vector<Vec3> wall;       // [m] 2 per column, when the thread fell asleep
  std::vector<float> may_move;  // [m] per column: by which it may have moved since
  std::vector<Vec3> hold;       // per hold: its target [m], its force on the thread [N]
  std::vector<Vec3> tool;       // per capsule: its ends [m], forces on them [N]
};

// Room for everything, so that no step allocates.
void reserve(const State& state, Sleep& sleep);
void wake(Sleep& sleep);
// The wall has been cut: a thread that presses on nothing sleeps on.
void after_cut(const Model& model, State& state);
// Whether a sleeping thread sleeps on; with holds and tools of the step.
bool sleeps_on(const Model& model, const State& state, const Hands& hands, std::span<const thread::Hold> holds,
               std::span<const thread::ToolCapsule> tools);
// What a sleeping thread does in a step: forces of holds and tools, impulses on the wall.
void hold_still(const Sleep& sleep, wall::State& wall, wall::Scratch& scratch, std::span<thread::Hold> holds,
                std::span<thread::ToolCapsule> tools);
// After a step of the thread: whether it has been quiet for the whole window.
bool has_been_quiet(const Model& model, State& state, const Hands& hands);
// coupling: of this step, after its `end`.
void fall_asleep(const Model& model, State& state, const wall::Coupling& coupling, wall::Scratch& scratch,
                 std::span<const thread::Hold> holds, std::span<const thread::ToolCapsule> tools);

}  // namespace catgut::physical
