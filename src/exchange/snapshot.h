// SPDX-License-Identifier: Apache-2.0
// exchange: the state of the operating field after a tick, for rendering, surgeon, host and (later) assessment.
// Self-contained: plain values, no pointers into the simulation.
#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "core/math.h"
#include "exchange/divided_picture.h"
#include "exchange/event.h"
#include "exchange/force_patch.h"
#include "exchange/instrument.h"
#include "exchange/tool_input.h"

namespace catgut {

// A hand and its instrument. An empty hand: `pose` is the hand's, nothing is held.
struct ToolView {
  int instrument = -1;  // of Snapshot::instrument; -1: the hand is empty
  Pose pose;            // pose of the simulated tool (tissue and thread may hold it back from the hand)
  Pose hand;            // pose of the hand
  float jaw = 1;        // 0 closed .. 1 open
  Held held = Held::nothing;
  float held_at = 0;          // needle: fraction of the arc, 0 swage .. 1 tip
  uint32_t held_slot = 0;     // thread: particle slot; tissue: particle
  uint32_t held_suture = 0;   // needle, thread: index of its suture
  uint32_t held_strands = 0;  // strands of thread between the jaws
  uint32_t loop_wraps = 0;    // turns of thread frozen on it, 0: none
  // Traversed away from the tissue, the thread turns round the tool +1: counter-clockwise, -1: clockwise as seen from its hand.
  int loop_handed = 0;
  uint32_t loop_suture = 0;                // index of its suture
  uint32_t loop_first = 0, loop_last = 0;  // slots of the loop's ends, free-end side first; valid with a loop
  Vec3 force;                              // [N] on the hand
  Vec3 torque;                             // [N m] on the hand, about the tool's origin
};

// Every instrument of the scene, with or without a hand.
struct InstrumentView {
  Pose pose;
  float jaw = 1;  // 0 closed .. 1 open
  InstrumentPlace place = InstrumentPlace::tray;
  uint8_t hand = kNoHand;  // that holds it
  Held held = Held::nothing;
  uint32_t held_slot = 0;  // as ToolView::held_slot
  Vec3 pull;               // [N] on the tissue that it holds
  PenMode pen = PenMode::off;
  float burning = 0;  // [s] since the pen was switched on, while its tip is in tissue; 0: it is not
};

struct NeedleView {
  Pose pose;  // frame at the circle's center: point(phi) = radius (cos phi, sin phi, 0), phi from 0 (swage) to arc (tip)
  bool in_tissue = false;
  uint32_t bite = 0;  // the bite being made, valid while in_tissue
};

struct SuturePointView {
  Vec3 position;  // [m]
  uint32_t bite = 0;
  bool exit = false;                           // the exit end of its bite, else the entry
  uint32_t anchored = 0;                       // slot of the thread particle locked to it
  float tension_needle = 0, tension_free = 0;  // [N] on its two sides
  uint32_t wall = 0;                           // of PictureModel::rim: the bowel end, or the layer, that contains it
};

// One throw of a knot, for rendering and scoring (square, granny, 2-1-1, air knot).
struct KnotThrow {
  uint32_t wraps = 1;
  int32_t chirality = 1;   // of the loop, +1 or -1 (ToolView): the two of a square knot differ, those of a granny knot do not
  int32_t needle_end = 1;  // 1: the end with the needle was wrapped, 0: the free end
  float tension = 0;       // [N] of the pulled strand when it locked
  float gap = 0;           // [m] to the tissue, or to the throw below it, when it locked
};

enum class KnotPhase : uint32_t { tightening, locked };

struct KnotView {
  static constexpr size_t kMaxThrows = 8;
  KnotPhase phase = KnotPhase::tightening;
  Vec3 position;  // [m]
  Vec3 way;       // unit: along its stitch, from the free-end side to the needle side
  uint32_t throws = 0;
  std::array<KnotThrow, kMaxThrows> thrown;
};

// A baked suture: its thread as a curve that the tissue carries, tails included.
struct SettledView {
  std::vector<Vec3> node;
  std::vector<Vec3> knot;
};

// Two points that a technique closes, at one position of the line: a midpoint of 2.5.2, a pair of figure 13 or 15.
struct SeamView {
  Vec3 a, b;              // [m] the two points of tissue
  float start = 0;        // [m] their distance when the pair was made
  float progress = 0;     // 0..1
  bool midpoint = false;  // between suture points; else an interpolated pair
};

struct BiteView {
  Vec3 entry, exit;  // [m] current positions, carried by the tissue
  float depth = 0;   // [m] maximum depth of the tip below the surface
  bool has_exit = false, complete = false;
  uint32_t wall = 0;                               // as in SuturePointView
  bool entry_inside = false, exit_inside = false;  // that end lies on the mucosa
  // A slit that the thread has torn leads from here to `entry` or `exit`. Not torn: the same place.
  Vec3 entry_made, exit_made;  // [m]
  float torn = 0;              // [m] length of the slit
  bool torn_out = false;       // the slit extends to an edge: the thread has come out of the wall
};

// One needle with its thread, and what has been sutured with it.
struct SutureView {
  NeedleView needle;
  std::vector<uint32_t> thread_order;  // particle indices from the free end to the needle
  std::vector<float> thread_tension;   // [N] per pair of thread_order, size thread_order.size() - 1
  std::vector<uint8_t> thread_cut;     // per pair of thread_order: 1 where it was cut through
  float thread_rest = 0;               // [m] rest length of all pairs that are not cut
  bool needle_on_thread = true;        // false once the thread was cut off the needle
  std::vector<SuturePointView> suture_point;
  std::vector<KnotView> knot;
  std::vector<BiteView> bite;
  std::vector<SeamView> seam;
};

// Effect of cuts on the tissue.
struct TopologyView {
  uint32_t version = 0;  // counts changes; 0: as built
  uint32_t pieces = 0;   // connected ones
  // Replaces the scene's model after a division: the same indices, then copies. Constant; false: as built.
  DividedPicture picture;
};

// What an electrosurgical pen has done to a place of the surface.
struct Scar {
  uint8_t burnt = 0;  // char, 0 .. 255
  uint8_t depth = 0;  // [0.01 mm] of the groove; 0 where it is through
  uint8_t blood = 0;  // that lies on it, 0 .. 255
};

// A vessel that a cut has opened.
struct BleedingView {
  Vec3 at;         // [m]
  float flow = 0;  // [m^3/s] now; 0: stopped
  float lost = 0;  // [m^3] so far
};
// Damage of the tissue beside what was intended.
struct WoundView {
  std::vector<BleedingView> bleeding;
  float thermal_spread = 0;  // [m] largest distance of heat-damaged tissue from the path of the pen's tip
  float damaged = 0;         // [m^2] heat-damaged tissue
  float freed_mass = 0;      // [kg] of the heaviest piece of tissue that came free; zero: none did
  Vec3 freed_at;             // [m] its center, then
};

struct Snapshot {
  uint64_t tick = 0;
  double time_s = 0;
  TopologyView topology;
  std::vector<Vec3> particle;  // [m] tissue particles of every body, thread slots, copies of tissue particles
  std::vector<Quat> rotation;  // per particle as above, threads only with copies: rotation of the cluster centered on it
  std::array<ToolView, kMaxHands> tool;  // per hand
  std::vector<InstrumentView> instrument;
  std::vector<SutureView> suture = std::vector<SutureView>(1);  // at least one
  uint32_t active_suture = 0;                                   // the one grasped last
  std::vector<SettledView> settled;
  float opening_area = 0;                   // [m^2] of the rim that is being closed
  float closure = 0;                        // 0 open .. 1 at the anvil
  std::vector<Event> event;                 // of this tick
  std::array<ForcePatch, kMaxHands> patch;  // force patch of each hand until the next tick
  std::vector<Scar> scar;                   // VisibleMesh::scar of topology.picture has indices of these
  WoundView wound;

  // The active suture.
  const SutureView& active() const { return suture[active_suture]; }
  SutureView& active() { return suture[active_suture]; }
};

}  // namespace catgut
