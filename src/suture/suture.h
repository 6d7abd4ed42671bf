// SPDX-License-Identifier: Apache-2.0
// suture: the data of guided suturing (paper 2.2, 2.3) and its stages, for any number of sutures, in the order of the
// tick:
//   grasp -> loop -> knot -> cut -> bake -> (per substep: solver, slip, puncture, pull, tighten) -> [technique] -> closure.
// Each stage reads and writes live rows of the solver's state (attachments, needle tracks, anchors, order); none touches a
// multiplier.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "exchange/event.h"
#include "exchange/snapshot.h"
#include "exchange/tool_input.h"
#include "instrument/instrument.h"
#include "solver/substep.h"
#include "suture/needle.h"

namespace catgut {

// One end of a bite, continuous: triangle of the tissue's surface and position on it.
struct BiteEnd {
  uint32_t triangle = 0;
  std::array<float, 3> weight{};  // barycentric
  EmbeddedPoint point;            // the same as a weighted point of particles, carried by the tissue
};

struct Bite {
  BiteEnd entry, exit;
  float depth = 0;  // [m] maximum depth of the tip below the surface
  bool has_exit = false;
  bool complete = false;
  bool canceled = false;
  // Torn by its thread: entry and exit have moved away from where the needle made them.
  BiteEnd entry_made, exit_made;  // meaningful where torn > 0
  float torn = 0;                 // [m]
  bool torn_out = false;
  uint32_t nearest = 0;  // the paper's p7: nearest particle at entry of the tip
};

// Progress of the needle through a wall.
enum class NeedlePhase : uint8_t {
  outside,  // in no wall
  tip_in,   // the tip is in the tissue
  through,  // the tip has exited; the shaft is in the track
  back_in,  // the back end has entered: the thread follows
};

// A wall that the needle is in. Its arc is longer than a wall is thick. It can be in several at once, as in one sweep in and
// out again (Connell) or through two layers (Lembert).
struct OpenBite {
  uint32_t bite = 0;
  NeedlePhase phase = NeedlePhase::tip_in;
  uint32_t drawn = 0;     // particles that a hand on the thread has pulled through the tissue since entry
  uint32_t reported = 0;  // 1: needle_in_tissue was reported
};

struct SuturePoint {
  uint32_t bite = 0;
  bool exit = false;
  uint32_t anchor = 0;  // index in Strand::anchor
};

// Turns of thread frozen on a tool (2.4, figure 10). The tool holds its particles from `first` to `last` along the order
// (HoldKind::loop).
struct ToolLoop {
  uint32_t wraps = 0;  // complete turns; 0: no loop
  // +1: traversed away from the tissue, the thread turns round the tool counter-clockwise as seen from the hand; -1: clockwise.
  int32_t chirality = 0;
  uint32_t first = 0, last = 0;            // slots, free-end side first
  LoopReason reported = LoopReason::none;  // the last reported rejection
  uint32_t ignored_until_clear = 0;        // 1: the thread round the tool was released; it counts again once off the tool
  float jaw = 1;                           // of the last tick
  uint32_t suture = 0;                     // whose thread it is
};

// A knot: throws on top of each other, made from loops. While a throw tightens, the ends of its loop are anchored to it with an
// offset from the tissue that shrinks. Thread may slide through it as through a suture point. Locked, the knot holds a
// particle of each of the two strands at one point of the tissue, and nothing slides there again (ThreadAnchor::knotted).
struct Knot {
  KnotPhase phase = KnotPhase::tightening;  // of the current throw
  uint32_t hand = 0;                        // the instrument that tightens it
  uint32_t begun = 0;                       // locked throws when the current throw was started
  EmbeddedPoint target;                     // its destination: the suture point, or the midpoint of the two ends of its stitch
  Vec3 from;                                // [m] offset of the current throw from the target at its start
  float left = 0;                           // [m] of that offset
  Vec3 hand_from;                           // [m] position of the pulling tool at that time
  uint32_t strand = 0;                      // grasped slot: on the free end, on the needle side, or on a bight
  std::array<uint32_t, 2> end{};            // slots of the loop's two ends, free-end side first; anchored while it tightens
  std::array<uint32_t, 2> slot{};           // the particles that it holds once locked: free-end side, needle side
  uint32_t slots = 0;                       // number of valid ones: 1 when tied on one strand alone; 0: none yet
  uint32_t slack_removed = 0;               // 1: the slack between it and the stitch has been pulled through
  uint32_t throws = 0;                      // the current throw included
  uint32_t reported = 0;                    // 1: too few throws were reported
  std::array<KnotThrow, KnotView::kMaxThrows> thrown;
};

// A baked suture: its thread is no longer simulated; every node follows the cluster of one tissue particle.
struct BakedNode {
  uint32_t particle = 0;
  Vec3 offset;  // [m] in the rest frame of that particle's cluster
};
struct BakedSuture {
  std::vector<BakedNode> node, knot;
};

struct SutureModel {
  std::vector<InstrumentModel> instrument;                           // of the scene; row i is rigid body i
  float attach_threshold = 0.006f, release_distance = 0.0022f;       // [m] figures 4 and 5
  float attach_compliance = 1.0f / 1100, track_compliance = 0.002f;  // [m/N]
  float track_drag = 0.12f;                                          // [N] per end of the needle track
  float pass_tension = 0.03f;                                        // [N]
  float capstan_friction = 0.08f;   // thread-tissue friction times the bend angle of the thread at a suture point
  float grasp_reach = 0.003f;       // [m]
  float tissue_compliance = 5e-4f;  // [m/N] of tissue held by a jaw
  float tissue_reach = 0.0015f;     // [m] maximum distance of the surface from a closing jaw
  float cut_reach = 0.004f;         // [m] maximum distance of the thread from the scissors
  int min_throws = 2;               // a knot with fewer does not hold
  float loop_reach = 0.0025f;       // [m] maximum distance of wrapped thread from the tool
  // In rest distances of neighbors: maximum distance of a loop's ends along the tool. The paper uses one, of a coarser thread;
  // hands that cross this finer thread leave 2 to 3 mm.
  float loop_depth = 2;
  float grasp_compliance = 2e-5f, grasp_angular_compliance = 0.02f;  // [m/N], [rad/(N m)]
};

// One needle with its thread, and what has been sutured with it. Its rigid body is SolverModel::needle_body, its thread the
// strand of the same index.
struct Suture {
  std::vector<Bite> bite;
  std::vector<SuturePoint> point;  // in order of creation
  std::vector<OpenBite> open;      // the walls that the needle is in, the one nearest to its back end first
  bool tip_inside = false;
  bool attached = false;      // the newest bite's nearest particle is attached to the tip
  Vec3 attached_from;         // [m] initial position of that particle
  std::vector<Knot> knot;     // in order of their start
  uint32_t suture_index = 0;  // how often needle and thread were replaced
};

struct SutureState {
  std::vector<Suture> suture;
  std::vector<InstrumentState> instrument;  // like SutureModel::instrument
  std::vector<ToolLoop> loop;               // on each instrument
  std::vector<BakedSuture> settled;         // in order of baking
  uint32_t active = 0;                      // the suture whose needle was grasped last: the one that a new suture replaces
};

// The hand that has the instrument, for events; kNoHand if there is none.
inline uint8_t hand_of(const SutureState& s, size_t instrument) { return s.instrument[instrument].hand; }

// Of the newest bite; outside when the needle is in no wall.
inline NeedlePhase phase_of(const Suture& s) { return s.open.empty() ? NeedlePhase::outside : s.open.back().phase; }

// Inputs and outputs of a stage.
struct SutureContext {
  const SolverModel& model;
  SolverState& solver;
  const SolverScratch& scratch;  // for the boxes of the broad phase
  const SutureModel& suture;
  SutureState& state;
  EventList& events;

  // Events of a suture. `hand`: the hand that acted; report_tool: the hand that has that instrument.
  void report(uint32_t of, EventKind kind, uint8_t hand, uint32_t which, float value, Vec3 where, Fault fault = Fault::none,
              LoopReason reason = LoopReason::none) {
    events.add({kind, hand, which, value, where, fault, reason, static_cast<uint16_t>(of)});
  }
  void report_tool(uint32_t of, EventKind kind, uint32_t tool, uint32_t which, float value, Vec3 where,
                   Fault fault = Fault::none, LoopReason reason = LoopReason::none) {
    report(of, kind, hand_of(state, tool), which, value, where, fault, reason);
  }
  // The command changes nothing, and is reported.
  void refuse(const Command& command) {
    report(0, EventKind::instrument_refused, static_cast<uint8_t>(command.hand % kMaxHands), command.argument, 0, {});
  }
  void report_fault(uint32_t of, Fault fault, uint8_t hand, uint32_t which, Vec3 where) {
    report(of, EventKind::technique_fault, hand, which, 0, where, fault);
  }
};

// One of the sutures, with its own model and state.
struct OneSuture {
  SutureContext& all;
  uint32_t index;
  Suture& own;
  Strand& strand;
  const StrandModel& thread;
  const NeedleArc& arc;
  uint32_t needle;  // its body

  OneSuture(SutureContext& c, size_t i)
      : all(c),
        index(static_cast<uint32_t>(i)),
        own(c.state.suture[i]),
        strand(c.solver.strand[i]),
        thread(c.model.strand[i]),
        arc(c.model.needle_arc[i]),
        needle(c.model.needle_body(i)) {}
  const Vec4* x() const { return all.solver.x.data(); }
  Vec3 at(uint32_t slot) const { return xyz(all.solver.x[slot]); }
  RigidBody& body() const { return all.solver.body[needle]; }
  void report(EventKind kind, uint32_t which, float value, Vec3 where) { all.report(index, kind, 0, which, value, where); }
};

// --- grasp.cpp ---------------------------------------------------------------------------------------------------------
// Once per tick, for every instrument in a hand. A jaw that closes within reach of a needle, else of a thread, else of the
// tissue's surface holds it at that position and angle. Opening releases it.
void grasp(SutureContext& c, const HandInputs& hand);

// After every substep: a jaw loaded beyond its grip force (InstrumentModel) lets what it holds slip, so that forces stay
// realistic for a hand. Reported as a release with the force [N] as its value.
void slip(SutureContext& c);
// An instrument releases what it holds. force [N]: 0 when the jaw was opened, else the force at which it slipped.
void release(SutureContext& c, uint32_t who, float force);

// --- loop.cpp ----------------------------------------------------------------------------------------------------------
// Once per tick. Thread wrapped round a tool with empty jaws is frozen there; further turns are added to it. Opening the jaws
// wide, or a pull above thread_grip, releases it.
void find_loops(SutureContext& c);
// Whether a particle is so near to the loop round a tool, along the thread, that closing jaws do not select it.
bool beside_loop(const Strand& thread, const ToolLoop& loop, uint32_t slot);
// The loop leaves its tool, to become a knot or to be released.
void release_loop(SutureContext& c, uint32_t who);

// --- knot.cpp ----------------------------------------------------------------------------------------------------------
// Once per tick. A tool with a loop round it whose jaws have closed on thread beyond the loop starts a throw. Releasing that
// thread before the throw is locked undoes it. A thread is tied only to itself: jaws that grasp another suture's thread remove
// the loop.
void tie(SutureContext& c);
// After every substep: throws move to the tissue as far as the pulling tool moves away, and lock there. A newly locked knot
// pulls the remaining slack under it through.
void tighten(SutureContext& c);
// Undoes every throw of a suture that is not locked, whatever pulls on it.
void undo_throws(OneSuture& s);

// --- cut.cpp -----------------------------------------------------------------------------------------------------------
// Once per tick. A command `cut` cuts the thread of its suture that is nearest to the jaws, within cut_reach. A cut of the last
// pair separates the needle. A cut in a wrong place is reported and stays. Refused without scissors or without that suture.
void cut(SutureContext& c, const TickInput& input);
// A jaw that has just closed on thread also holds the other strands between its tips: the two ends of a stay suture.
void hold_other_strands(SutureContext& c, uint32_t who);

// --- bake.cpp ----------------------------------------------------------------------------------------------------------
// Once per tick. A command `new_suture` replaces its suture. Tied thread is baked, tails included, and tethers take over its
// tension; the rest is removed. A new needle and thread appear on the drape. Bites stay listed. Refused while the needle is in
// tissue. True: at least one was replaced. start: positions of all particles at the start [m]; needle_start: of every needle.
bool new_suture(SutureContext& c, std::span<const Vec3> start, std::span<const Pose> needle_start, const TickInput& input);
// Needle and thread as at the start, held by nothing but the swage.
void fresh_suture(const SolverModel& model, SolverState& solver, size_t suture, std::span<const Vec3> start,
                  const Pose& needle_start);

// --- puncture.cpp ------------------------------------------------------------------------------------------------------
// After every substep: the tip trigger, the attached particle, the back-end trigger (paper 2.2, figures 4 and 5).
void puncture(SutureContext& c);
// Signed distance [m] from p to the tissue's surface (negative inside the wall) and the nearest point on it. False: none
// in reach.
struct SurfaceHit {
  BiteEnd end;
  Vec3 point, normal;
  float distance = 0;
};
// Makes end.point: the position as a weighted point over the cluster of its triangle's nearest corner.
void spread(const SolverModel& model, BiteEnd& end);
bool nearest_surface(const SolverModel& model, const Candidates& candidates, const Vec4* x, Vec3 p, float reach,
                     SurfaceHit& hit);

// --- pull.cpp ----------------------------------------------------------------------------------------------------------
// After every substep: particles that are due pass their suture point (figures 7 to 9), from the needle end to the free end.
// A hand that pulls thread through the tissue while the needle is still in it is reported, once per bite; the thread moves.
void pull(SutureContext& c);
// Moves up to `length` [m] of thread past the locked particle `slot`, toward the needle (direction +1) or the free end (-1).
// The sum of rest lengths stays. Returns the moved length: particles that are locked or at an end of the thread do not pass.
float draw_through(OneSuture& s, uint32_t slot, int direction, float length);
// Locks the next free particle behind the needle to an end of a bite and makes it a suture point (figure 7a). False: no free
// particle there yet. A needle without thread passes (true) and makes none.
bool place_suture_point(OneSuture& s, uint32_t bite, bool exit);
// Unlocks the newest suture point: its thread was withdrawn from the hole. The particle stays where it is, as free
// thread.
void remove_last_suture_point(OneSuture& s);
// Rest length [m] of the thread between the first and the last suture point along the order; 0 with fewer than two. Across a
// cut thread, here and in spans: the whole length of the thread, since it closes nothing.
float length_between_ends(const Strand& strand, const Suture& suture);
// Rest length [m] of the thread from each suture point to the next one made after it; 0 for the last. With a knot between
// them: the length beyond the knot minus the path from the knot to the first of the two.
void spans(const Strand& strand, const Suture& suture, const Vec4* x, std::vector<float>& span);
// Removes the row from Strand::anchor and corrects the indices behind it.
void erase_anchor(Strand& strand, Suture& suture, uint32_t anchor);

// --- closure.cpp -------------------------------------------------------------------------------------------------------
// What a technique closes: points of tissue and their targets. At progress s each is pulled toward from + s (to - from).
struct ClosurePlan {
  struct Pull {
    EmbeddedPoint point;
    Vec3 from, to;  // [m]
  };
  std::vector<Pull> pull;
  float progress = 0;    // 0..1, of the pulls
  float compliance = 0;  // [m/N], of both
  // Two points of tissue that are pulled together, from `start` apart to `end` apart.
  struct Pair {
    EmbeddedPoint a, b;
    float start = 0, end = 0;  // [m]
    float progress = 0;        // 0..1
    uint32_t midpoint = 0;     // 1: between suture points, 0: one of the interpolated pairs (figures 13 and 15)
  };
  std::vector<Pair> pair;  // rows are added, never removed
};
// Once per tick: makes the attachments and tethers of every suture's plan, or moves their targets.
void close(SolverState& solver, std::span<const ClosurePlan> plan);

}  // namespace catgut
