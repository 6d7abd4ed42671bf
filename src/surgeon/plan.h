// SPDX-License-Identifier: Apache-2.0
// surgeon/plan: what a technique asks of two hands, as a list of tasks with the places of its bites. The engine
// (surgeon/scripted) carries the tasks out one after the other; each looks at what really happened before the next begins.
#pragma once
#include <string>
#include <vector>

#include "exchange/picture.h"
#include "exchange/snapshot.h"
#include "surgeon/surgeon.h"

namespace catgut {

// Where the needle's circle cuts the tissue, at rest. The needle turns about `up`: its tip comes in along `along`, which is
// cross(out, up), and is deepest at `at - out * depth`.
struct BitePlace {
  Vec3 at, out, up;    // [m], unit, unit; at: on the surface, or in the middle between two layers
  float length = 0;    // [m] chord from where the tip goes in to where it comes out
  float depth = 0;     // [m]
  uint32_t wall = 0;   // whose tissue carries the place
  bool level = false;  // hands keep the circle nearly square to `up` where the tissue leans
  int walls = 1;       // passages through a wall that the sweep makes
};

// Where a bite is made, in the world as it is now: a place, outward, the path of the needle, the axis about which it turns.
struct BiteFrame {
  Vec3 at, out, along, up;
};
BiteFrame bite_frame(const PictureModel& picture, const Snapshot& seen, const BitePlace& place);

enum class TaskKind {
  pick_up,        // the driver takes the needle from the drape
  bite,           // one sweep of the needle at place[which]; the forceps brings it out
  pull_tail,      // the forceps pulls thread through until the tail is as long as wanted
  pull_slack,     // until the way before the last bite has no slack
  pull_together,  // until the last midpoint has come together
  hand_back,      // the driver takes the needle from the forceps
  regrip,         // the forceps takes the needle near its back end, to tie
  draw,           // the driver takes the tail; both hands pull until everything that the technique closes is closed
  throw_,         // one throw of a knot: `which` wraps round the driver, `way` +1 or -1; then the tail is pulled through
  lock_strand,    // the same, pulling the needle's own strand through: the end of a running suture
  cut_long,       // scissors cut the needle's strand a little way from the knot
  cut_tail,       // and the tail
  cut_needle,     // at the needle
  take_both,      // the driver takes both strands of the knot between its jaws
  fresh,          // a fresh needle and thread
  rest            // hands off; what was let go settles
};

struct Task {
  TaskKind kind = TaskKind::rest;
  int which = 0;  // see TaskKind
  int way = 1;
};

struct Plan {
  std::vector<BitePlace> place;
  std::vector<Task> task;
  // How the tools stand about the work: which side of the needle's plane (+1: its `up`) each comes from, and how far above it
  // the hands keep.
  float driver_side = 1, forceps_side = 1;
  float lift = 0;  // [m] along `up`, when the needle is brought to a bite
};

// technique: purse_string, connell, stay, lembert, or running (bites in one bowel end, row under row).
// Throws std::invalid_argument for a technique without a plan, or a picture that does not fit it.
Plan make_plan(const std::string& technique, const PictureModel& picture, const SurgeonSkill& skill);

}  // namespace catgut
