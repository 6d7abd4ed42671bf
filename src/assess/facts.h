// SPDX-License-Identifier: Apache-2.0
// assess: what was observed in a session, tick by tick, live or from a replay: bites, knots, forces, hands. Reads PictureModel,
// Snapshots and the hands' input; writes Facts, from which assess/metrics computes the Result at any moment.
//
//   Facts facts = begin_facts(picture, setup);
//   for every tick: note(facts, picture, seen, input);
//   Result result = measure(facts, picture, seen);   // assess/metrics.h
//
// A Tally is kept with a saved state; rewind() takes the Facts back to it, as an undone bite does.
#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "assess/cut.h"
#include "assess/result.h"
#include "assess/stitch_map.h"
#include "assess/surface.h"
#include "exchange/picture.h"
#include "exchange/snapshot.h"
#include "exchange/tool_input.h"

namespace catgut::assess {

// Force at which a suture tears out of human small bowel: one standard deviation below the mean, 4.62 - 1.40 N (Gong et al.
// 2023, 10.1115/1.4063951).
constexpr float kTearForce = 3.22f;  // [N]

// Turns are summed between samples so far apart: rounding of an orientation counts for nothing.
constexpr double kTurnStep = 0.1;    // [s]
constexpr float kApproach = 0.010f;  // [m] of the way to an entry that is judged
constexpr double kApproachTime = 5;  // [s] at most
constexpr double kForceStep = 0.1;   // [s] as long as the filter of motion at 10 Hz

struct Setup {
  double tick_s = 1.0 / 60;
  double wall = 2.5;      // [mm] thickness
  std::string technique;  // of the scene
  bool physical = false;  // mechanics: throws are not locked by events, but seen in the thread's shape (assess/tied.h)
};

// A bite in progress.
struct OpenBite {
  uint32_t suture = 0, number = 0;
  uint64_t entered = 0;
  float depth = 0;  // [m]
  double entry_angle = kNotObserved, exit_angle = kNotObserved, grasp_at = kNotObserved, grasp_angle = kNotObserved;
  std::vector<Vec3> center;  // [m] of the needle's circle, one per tick
  std::vector<Vec3> tip;     // [m] likewise
  Quat turned;               // the needle's orientation at entry
  Quat turning;              // and at the last sample of its turn, one per kTurnStep
  double turn = 0;           // [rad] sum over these samples
  Vec3 hole;                 // [m] the entry, as the tip entered
  float shift = 0;           // [m] largest distance of the entry from there
  double drive_speed = kNotObserved, approach = kNotObserved;
  bool out = false;   // the tip has left
  uint64_t left = 0;  // the tick of that
};

struct HandFacts {
  float peak = 0;  // [N] largest force on the tissue held
  uint64_t peak_tick = 0;
  Vec3 peak_where;
  double impulse = 0;  // [N s] on the tissue held
  float strain = 0;    // [N] largest force on the hand
  uint64_t strain_tick = 0;
  Vec3 strain_where;
  Quat turning;     // orientation of the hand at the last sample of its turn, one per kTurnStep
  double turn = 0;  // [rad] sum over these samples
  // To find grasps of nothing.
  bool was_open = false;
  double closed_for = 0;  // [s]
  bool judged = true;
};

struct SutureFacts {
  uint32_t load = 0;     // how often it was replaced
  uint32_t entries = 0;  // of the tip since the last completed bite
  uint32_t grasps = 0;   // of the needle since the last completed bite
  uint64_t throw_began = 0;
  std::vector<Vec3> tip;  // [m] of the needle outside of tissue, one per tick of the last kApproachTime
  bool tied = false;
  float peak = 0;  // [N] largest tension at a suture point
  uint64_t peak_tick = 0;
  Vec3 peak_where;
  double impulse = 0;  // [N s]
  bool overloaded = false;
  // Change of that tension, one sample per kForceStep in which the thread pulls.
  float before = 0;    // [N] at the last sample
  double change2 = 0;  // [(N/s)^2] sum
  uint32_t changes = 0;
};

// What a session has come to, without what never changes and without the paths of the hands.
struct Tally {
  bool begun = false;            // a hand has connected
  uint64_t first = 0, last = 0;  // ticks with hands
  std::vector<double> lumen;     // [m^2] area of each rim when the hands connected
  float opening = 0;             // [m^2] likewise
  std::vector<Bite> bite;
  std::vector<Knot> knot;
  std::vector<OpenBite> open;
  std::array<HandFacts, 2> hand;  // right, left
  std::vector<SutureFacts> suture;
  PenFacts pen;
  // Happenings, each with its place and moment.
  std::vector<Sample> missed_grasp, needle_slip, tissue_slip, withdrawn, undone_throw, rejected_loop, order_error, fault, tail,
      overload, tissue_grasp;
};

struct Facts : Tally {
  Setup setup;
  std::vector<StitchEdge> edge;           // of each wall, at rest
  std::vector<RestSurface> rest;          // one
  uint32_t stride = 1;                    // ticks between two samples of the hands
  std::array<std::vector<Vec3>, 2> path;  // [m] of the right hand and the left, one per `stride` ticks
};

Facts begin_facts(const PictureModel& picture, const Setup& setup);
void note(Facts& facts, const PictureModel& picture, const Snapshot& seen, const TickInput& input);

void rewind(Facts& facts, const Tally& then);

double rim_area(const PictureModel& picture, const std::vector<Vec3>& particle, size_t wall);  // [m^2]
// The knot's kind from the chirality of its throws and their strands; the first throw is the one at the tissue.
KnotKind kind_of(const std::vector<Throw>& thrown);

}  // namespace catgut::assess
