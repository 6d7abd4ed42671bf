// SPDX-License-Identifier: Apache-2.0
// surgeon/plan: a technique as a list of tasks for two hands, with the positions of its bites. The engine (surgeon/scripted)
// carries out the tasks in order; each checks the actual state before the next begins.
#pragma once
#include <span>
#include <string>
#include <vector>

#include "exchange/picture.h"
#include "exchange/snapshot.h"
#include "surgeon/surgeon.h"

namespace catgut {

// Where the needle's circle cuts the tissue, at rest. The needle turns about `up`: its tip enters along `along`, which is
// cross(out, up), and is deepest at `at - out * depth`.
struct BitePlace {
  Vec3 at, out, up;       // [m], unit, unit; at: on the surface, or midway between two layers
  float length = 0;       // [m] chord from entry to exit
  float depth = 0;        // [m]
  uint32_t wall = 0;      // whose tissue carries it
  bool level = false;     // hands keep the circle nearly square to `up` where the tissue is inclined
  float deep = 0.5f;      // of the wall, at which a needle that is scooped is lifted
  float deepest = 0;      // of the wall: a deeper bite, or one that ends on the inner face, is made again; 0: may go through
  int walls = 1;          // passages through a wall that the sweep makes
  bool backhand = false;  // both hands come from the other sides of the needle's plane
  uint32_t suture = 0;    // that makes it
};

// The current frame of a bite in the world: position, outward direction, direction of the needle, axis of its rotation.
struct BiteFrame {
  Vec3 at, out, along, up;
};
BiteFrame bite_frame(const PictureModel& picture, const Snapshot& seen, const BitePlace& place);

enum class TaskKind {
  pick_up,        // the needle holder takes the needle of suture `which` from the drape
  hold_edge,      // the forceps grasps the rim at place[which], against the needle
  bite,           // one sweep of the needle at place[which]; the forceps pulls it out
  draw_out,       // the forceps draws the thread out of a bite that has missed a wall
  pull_tail,      // the forceps pulls thread through until the tail has the planned length
  pull_slack,     // until the span before the last bite has no slack
  pull_together,  // until the last midpoint is closed
  hand_back,      // the needle holder takes the needle from the forceps
  regrip,         // the forceps grasps the needle near its back end, to tie
  draw,           // the needle holder takes the tail; both hands pull until the technique's closure is complete
  throw_,         // one throw of a knot: `which` wraps on the needle holder, `way` +1 or -1; then the tail is pulled through
  lock_strand,    // the same with the needle's own strand: the end of a running suture
  cut_long,       // scissors cut the needle's strand a short distance from the knot
  cut_tail,       // and the tail
  cut_needle,     // at the needle
  take_both,      // the needle holder takes both strands of the knot between its jaws
  discard,        // the forceps lays a needle that was cut off beside the field
  fresh,          // a new suture
  gather,         // the needle holder takes the tail; both hands pull with Plan::pull and hold both ends
  approximate,    // the assistant brings the clamped bowel ends together, so that a knot is tied without tension
  remove,         // a stitch that cannot be tied is taken out: cut, its needle laid aside, its thread drawn out
  leave,          // the forceps lays the needle down; no hand holds anything, and the tissue settles
  rest            // hands off; the tissue settles
};

struct Task {
  TaskKind kind = TaskKind::rest;
  int which = 0;  // see TaskKind
  int way = 1;
  bool release = false;  // of a throw_: the clamps go back while both strands are held taut
  int assistant =
      0;  // of a throw_, while both strands are held taut: +1 the assistant's forceps takes it; -1 leaves the one below
};

struct Plan {
  std::vector<BitePlace> place;
  std::vector<Task> task;
  // Tool orientation at the work: the side of the needle's plane (+1: its `up`) from which each tool comes, and the height of
  // the hands.
  float driver_side = 1, forceps_side = 1;
  float lift = 0;  // [m] along `up`, on approach to a bite
  // Where the needle holder grips the needle, as a fraction of its arc from the swage; how far beyond the bite a sweep turns
  // the needle before the forceps takes the tip [rad].
  float driver_at = 0.35f, beyond = 0.72f;
  // The forceps comes for the tip from its side, leaning by `tip_lean` toward the outside of the tissue when the tip is
  float tip_open = 1;  // of the forceps' jaws on their way to the tip
  // `tip_psi` past the deepest point [rad].
  float tip_lean = 0.8f, tip_psi = 2.6f;
  float scoop = 0;        // [m] by which the needle is lifted once it is deep enough in the wall, at most
  float flatten = 0;      // [rad] by which it is turned about its tip when that has entered
  float approximate = 0;  // [m] travel of each clamp
  float stay = 0;         // [m] of it by which the clamp stays advanced: the ends are mobile
  float jerk = 0;         // [s] of more than the maximum load after which thread is not pulled further: a jerk is shorter
  bool rise = false;      // the needle is lifted over the edges on its way to where it is laid down
  bool flat = false;      // a pad: the tail lies on it
  bool lumen = false;     // the tail hangs into the lumen beside the stitch
  float aside = 0;        // [rad] physical throws: turn of the line on which they are drawn, clear of the stitch opposite
  float knot_turn = 0;    // [rad] about y: where a physical knot is tied, 0 toward the viewer, positive to the right
  float pull = 0;  // [N] of each strand when a throw is pulled tight, with physical mechanics; 0: throws of guided mechanics
};

// A plan is a row of one table. Throws std::invalid_argument for a name that is not in it, or a picture that does not fit.
Plan make_plan(const std::string& name, const PictureModel& picture, const SurgeonSkill& skill);
std::span<const char* const> plan_names();
std::span<const char* const> task_names();  // of TaskKind, in order; in procedure files

}  // namespace catgut
