// SPDX-License-Identifier: Apache-2.0
// physical/sleep: a strand of the thread (between broken segments) that has been quiet is not stepped any more. It keeps its
// shape and tension, and its forces on the wall, on holds and on tools stay what they were. It wakes when the wall near it, a
// hold, a tool or an awake strand moves there, when a hole is added, or when thread is cut. A strand that only the wall holds
// is carried along (physical/carry), and wakes when the wall there is strained. While some strands sleep, the others are
// gathered into a thread of their own for the step. Reads wall, holds and tools of a step; writes State::sleep.
// docs/physical.md, "Cost".
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

constexpr float kToolMargin = 0.6e-3f;  // [m] a tool that moves wakes a thread that it may touch within this distance

struct SleepModel {
  bool on = true;
  uint32_t window = 250;  // steps
  // At rest: no node between the tails is farther from where it was at the beginning of the window [m]; no tension has changed
  // by more, plus a twentieth of it [N]. What creeps by less per window stands still from then on.
  float still = 2e-6f;
  float steady = 10e-3f;
  float touched = 2e-6f;  // [m] motion of a hold, a tool or a loaded column that wakes the strand
  float nearby = 50e-6f;  // [m] the same for a column near the strand that it does not load
  float strain = 20e-6f;  // [m] of a strand that is carried: a loaded column leaves the rigid motion by more
  // A tied loop with slack, as most finished stitches are: no tension is above that. Its thread swings to and fro in its holes
  // for ever while the wall is worked on, and changes nothing. Its knot must not change; the loop through its holes must not
  // become longer.
  float slack = 0.15f;           // [N]
  float slack_steady = 30e-3f;   // [N] no tension has changed by more
  float slack_swing = 0.15e-3f;  // [m] of thread between its holes, in a window
  float slack_strain = 0.1e-3f;  // [m] as `strain` and `nearby`
  float slack_knot = 10e-6f;     // [m] of the nodes of its knot against each other, in a window
  float longer = 20e-6f;         // [m] of its loop, since it fell asleep
};

struct Sleep {
  struct Strand {
    uint32_t first = 0, last = 0;  // nodes
    uint32_t quiet = 0;            // steps since its window began
    bool asleep = false;
    float loop = 0;  // [m] length of its loop, from hole to hole and back, when it fell asleep; 0: it had no slack, or no knot
  };
  std::vector<Strand> strand;  // all of the thread, in order
  uint32_t holes = 0;          // of the thread, when the strands were listed
  std::vector<Vec3> from;      // [m] per node, at the beginning of its strand's window; asleep: when it fell asleep
  std::vector<float> tension;  // [N] per segment, likewise
  // Of sleeping strands, each with the number of its strand.
  struct Load {
    uint32_t strand = 0, at = 0;  // 2 * column: its mid-surface point; + 1: its director
    Vec3 impulse;                 // [N s] of every step; awake: their sum over the last steps of its window
  };
  // Also of strands that are awake: the columns of their holes, at the beginning of the window.
  struct Watched {
    uint32_t strand = 0, column = 0;
    Vec3 mid, director;  // [m] when the strand fell asleep
    float may_move = 0;  // [m] by which it may have moved since; less than SleepModel::nearby: the strand loads it
  };
  struct Held {
    uint32_t strand = 0, node = 0;
    Vec3 to, force;  // [m], [N]
  };
  struct Touched {  // a tool's capsule nearby
    uint32_t strand = 0, tool = 0;
    Vec3 a, b, force_a, force_b;  // [m], [N]
  };
  std::vector<Load> load;
  std::vector<Watched> watched;
  std::vector<Held> held;
  std::vector<Touched> touched;

  bool any() const;              // a strand sleeps
  bool all() const;              // nothing is awake
  bool at(uint32_t node) const;  // whether the node's strand sleeps
};

// How the wall under a strand has moved since a moment that Sleep::watched remembers.
struct Carry {
  Vec3 from, to;  // [m] middle of the columns that the strand loads
  Quat turn;
  float strain = 0;  // [m] largest distance of such a column from where the rigid motion takes it
  bool moves() const { return !(to == from) || !(turn == Quat{}); }
  Vec3 place(Vec3 p) const { return to + rotate(turn, p - from); }
  Vec3 before(Vec3 p) const { return from + rotate(conjugate(turn), p - to); }
};

// Workspace: the awake strands as a thread of their own.
struct AwakeThread {
  thread::State part;
  std::vector<uint32_t> node;       // of the whole thread, per node of the part
  std::vector<uint32_t> part_node;  // and back; kNone: asleep
  std::vector<thread::Hold> hold;
  std::vector<uint32_t> hold_of;  // their places in the list
  std::vector<thread::Pull> pull;
  std::vector<uint32_t> point_of;  // per hole: its soft point; kNone: none
  std::vector<uint32_t> hole_of;   // per soft point
  std::vector<uint32_t> key;       // merged lists
  std::vector<float> budget;
  std::vector<thread::Crossing> crossing;
  std::vector<thread::Eyelet> eyelet;
  std::vector<thread::SoftContact> contact;
  std::vector<Vec3> impulse;              // [N s] per hole
  std::vector<uint32_t> load_at;          // per column and director: of Sleep::load; kNone: none
  std::vector<uint8_t> ready, disturbed;  // per strand: it may sleep; the wall has moved under it
  std::vector<Carry> carry;               // per strand that sleeps: what the wall has done since
  std::vector<float> room;                // [m] per column: how far its faces are from a strand that falls asleep
  struct Box {
    Vec3 low, high;  // [m]
  };
  struct Tool {
    Box box;
    float reach = 0;  // [m] of the thread's axis beyond which the tool cannot touch it
  };
  std::vector<Tool> tool;
  std::vector<Box> box;              // per strand, with its nodes' half segments
  std::vector<Sleep::Strand> boxed;  // per strand: whose box that is, if it sleeps and nothing carries it; else {1, 0}
  std::vector<double> far_due;  // per strand: SurfaceSearch::moved before which no column that is not watched can come near
  void reserve(const State& state);
};

// Whether the strand may be nearer than `reach` [m] to the line from a to b.
bool touches(const thread::State& thread, const Sleep::Strand& strand, Vec3 a, Vec3 b, float reach);

// Room for everything, so that no step allocates.
void reserve(const State& state, Sleep& sleep);
void wake(const Model& model, State& state);
// The wall has been cut: a strand that presses on nothing sleeps on.
void after_cut(const Model& model, State& state);
// At the beginning of a step: lists the strands again after a cut, and wakes those that no longer can sleep.
void wake_strands(const Model& model, State& state, const Hands& hands, std::span<const thread::Hold> holds,
                  std::span<const thread::ToolCapsule> tools, double wall_moved, AwakeThread& awake);
// What sleeping strands do in a step: impulses on the wall, before the others are stepped; forces of holds and tools, after it.
void press_asleep(const Sleep& sleep, const AwakeThread& awake, wall::State& wall, wall::Scratch& scratch);
void hold_asleep(const Sleep& sleep, std::span<thread::Hold> holds, std::span<thread::ToolCapsule> tools);
// Strands that are awake, out of the thread and back into it; and what acts on them, by the part's numbers.
void gather(const State& state, AwakeThread& awake);
void show_awake(std::span<const thread::Hold> holds, std::span<const thread::Pull> pulls,
                std::span<thread::SoftContact> contacts, AwakeThread& awake);
void scatter(State& state, AwakeThread& awake);
// After the step of the thread. Which strands have been quiet for their whole window, as have all those near them.
bool find_quiet(const Model& model, State& state, const Hands& hands, std::span<const thread::Hold> holds,
                std::span<const thread::ToolCapsule> tools, AwakeThread& awake);
// Adds to the impulses of strands that may sleep soon. coupling: of this step, after its `end`; contacts: with their points.
void note_loads(const Model& model, State& state, wall::Coupling& coupling, wall::Scratch& scratch, AwakeThread& awake,
                std::span<const thread::SoftContact> contacts);
// Those that have been quiet fall asleep.
void fall_asleep(const Model& model, State& state, AwakeThread& awake, std::span<const thread::Hold> holds,
                 std::span<const thread::ToolCapsule> tools);

}  // namespace catgut::physical
