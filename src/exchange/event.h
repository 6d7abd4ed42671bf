// SPDX-License-Identifier: Apache-2.0
// exchange: events of a tick, in an order that is the same in every run. They are the only way in which lower rooms notify
// higher ones.
#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/math.h"

namespace catgut {

enum class EventKind : uint8_t {
  needle_grasped,     // who: hand, value: fraction of the arc from the swage [0..1]
  needle_released,    // who: hand, value: 0 or the force at which it slipped out [N]
  thread_grasped,     // who: hand, which: particle slot
  thread_released,    // who: hand, which: particle slot, value: as above
  tip_entered,        // which: bite, value: angle to the surface normal [rad]
  particle_attached,  // which: particle (paper 2.2, fig. 4), value: its distance to the tip [m]
  particle_released,  // which: particle, value: its displacement [m] (fig. 5b)
  tip_exited,         // which: bite
  bite_withdrawn,     // the needle was withdrawn, or the thread drawn out of the bite; which: bite
  suture_point,       // which: suture point, value: index of the bite
  bite_completed,     // which: bite, value: length from entry to exit [m]
  particle_passed,    // which: suture point, value: +1 toward the needle, -1 toward the free end (figs. 7, 8)
  bite_out_of_order,  // which: suture point that is not adjacent to the previous one (2.5.1)
  ring_complete,      // which: number of suture points
  closure_started,    // value: opening area [m^2]
  closure_finished,   // value: opening area [m^2]
  thread_exhausted,   // which: suture point; the free end reached it and holds
  tissue_grasped,     // who: hand, which: particle
  tissue_released,    // who: hand, which: particle, value: 0 or the force at which it slipped out [N]
  loop_formed,        // who: hand with the tool inside it, which: wraps, value: +1 or -1, its chirality
  loop_rejected,      // who: hand, reason; reported again only when the reason changes (2.4)
  loop_released,      // who: hand; the loop came off without a knot
  throw_started,      // who: hand that pulls, which: knot, value: wraps
  throw_locked,       // which: knot, value: tension when it was set [N]
  throw_undone,       // which: knot; the free end was released before it reached the tissue
  thread_cut,     // who: hand, which: slot toward the free end, value: thread to the nearest suture point or knot [m], -1: none
  suture_loaded,  // which: number of sutures loaded before; a new needle and thread are ready
  suture_baked,   // which: baked suture; its thread is no longer simulated (3.4)
  seam_closed,    // which: row of SutureView::seam, value: remaining gap [m]
  instrument_taken,      // who: hand, which: instrument
  instrument_laid_down,  // who: hand, which: instrument
  instrument_parked,     // who: hand, which: instrument; it stays on what it holds
  instrument_refused,    // who: hand, which: instrument, value: 1 if the hand is too near a parked one; nothing was done
  technique_fault,       // fault, which: bite, knot or suture (see Fault); nothing is corrected
  pen_activated,         // who: hand, which: instrument, value: power [W]
  pen_deactivated,       // who: hand, which: instrument, value: time since pen_activated [s]
  wall_scored,           // who: hand, which: instrument, value: greatest depth [m]; a pen was deactivated before it was through
  wall_cut_through,      // who: hand, which: instrument, value: distance from the planned line [m], -1: none; first place
                         // where the pen is through since it was activated
  piece_freed,           // who: hand, which: pieces of the tissue now, value: mass of the freed one [kg], where: its center
  tissue_snipped,        // who: hand, which: instrument, value: length of the cut that scissors have made [m]
  tissue_crushed,        // who: hand, which: instrument, value: pressure of a clamp's jaws [Pa]; once per closing
  bleeding_started,      // which: bleeding point, value: flow [m^3/s]
  bleeding_stopped,      // which: bleeding point, value: blood that it has lost [m^3]
  count_
};

// The fault of a technique_fault event.
enum class Fault : uint8_t {
  none,
  wrong_body,         // which: bite; it should lie in the other wall, or the other layer
  wrong_layer,        // which: bite; it goes from outside in instead of from inside out, or vice versa
  one_wall_only,      // which: bite; a stitch that should join two walls was tied through one
  knot_without_bite,  // which: knot; it was started before there was a suture point, or with the bites incomplete
  needle_in_tissue,   // which: bite; thread was tightened or a knot started with the needle still in the tissue
  cut_in_stitch,      // which: slot; the thread was cut between suture points or knots: the stitch is open
  cut_before_knot,    // which: slot; the thread was cut before a knot was tied
  too_few_throws,     // which: knot; it was cut or left with too few throws to hold
  cut_off_line,       // which: instrument, value: distance from the planned line [m]; once until the cut is back on the line
  pulled_attached,    // which: instrument, value: pull [N] on a specimen whose circle is incomplete; once per grasp
  cut_at_suture,      // which: suture; the wall was cut through beside one of its holes; once per suture
  bite_in_char,       // which: bite; its entry or exit lies in charred tissue
  inner_wall_cut,     // which: instrument; another body than the planned one was cut through before its specimen was free
  clamp_torn_out,     // which: instrument, value: force [N]; a closed clamp lost its tissue
  bite_torn,          // which: bite, value: load [N]; thread or needle has torn the wall by a millimeter; once per bite
  bite_torn_out,      // which: bite, value: load [N]; the slit extends to an edge: the thread has come out of the wall
  thread_broken,      // which: slot toward the free end, value: tension [N]; the thread broke under load
  needle_torn_out,    // which: bite; its needle has left the wall sideways
  count_
};
const char* fault_name(Fault fault);

// Why thread round a tool is not a loop (2.4, figure 10), of a loop_rejected event.
enum class LoopReason : uint8_t {
  none,         // it is a loop
  no_crossing,  // the thread touches the tool but does not cross itself in the plane across it
  tip_outside,  // it crosses itself beside the tool: the tip is not inside
  too_deep,     // a helix: its ends are further apart along the tool than one pair of particles
  count_
};
const char* loop_reason_name(LoopReason reason);
const char* event_name(EventKind kind);

struct Event {
  EventKind kind{};
  uint8_t who = 0;     // hand, if any; kNoHand (255): a parked instrument
  uint32_t which = 0;  // see EventKind
  float value = 0;     // see EventKind
  Vec3 where;          // [m]
  Fault fault = Fault::none;
  LoopReason reason = LoopReason::none;
  uint16_t suture = 0;  // index of its suture, if any
  uint64_t tick = 0;
};

// The events of a tick, in order. Stages add them without a time; the list adds the tick.
struct EventList {
  uint64_t tick = 0;
  std::vector<Event> list;

  void start(uint64_t now) { tick = now, list.clear(); }
  void add(Event e) {
    e.tick = tick;
    list.push_back(e);
  }
  void clear() { list.clear(); }
  bool empty() const { return list.empty(); }
  size_t size() const { return list.size(); }
  const Event& operator[](size_t i) const { return list[i]; }
  const Event& back() const { return list.back(); }
  const Event* begin() const { return list.data(); }
  const Event* end() const { return list.data() + list.size(); }
};

}  // namespace catgut
