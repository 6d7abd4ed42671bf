// exchange: what happened in a tick, in an order that is the same on every run. Nobody calls upward: rooms below tell rooms
// above through these.
#pragma once
#include <cstddef>
#include <cstdint>

#include "core/math.h"

namespace catgut {

enum class EventKind : uint8_t {
  needle_grasped,     // who: hand, value: place on the arc from the swage [0..1]
  needle_released,    // who: hand, value: 0 or the force at which it slipped out [N]
  thread_grasped,     // who: hand, which: particle slot
  thread_released,    // who: hand, which: particle slot, value: as above
  tip_entered,        // which: bite, value: angle to the surface normal [rad]
  particle_attached,  // which: particle (paper 2.2, fig. 4), value: its distance to the tip [m]
  particle_released,  // which: particle, value: how far it was dragged [m] (fig. 5b)
  tip_exited,         // which: bite
  bite_cancelled,     // the needle was drawn back; which: bite
  suture_point,       // which: suture point, value: index of the bite
  bite_completed,     // which: bite, value: length from entry to exit [m]
  particle_passed,    // which: suture point, value: +1 toward the needle, -1 toward the free end (figs. 7, 8)
  order_broken,       // which: suture point that is not next to the one before (2.5.1)
  ring_complete,      // which: number of suture points
  closure_started,    // value: opening area [m^2]
  closure_finished,   // value: opening area [m^2]
  thread_ran_out,     // which: suture point; the free end reached it and holds
  count_
};
const char* event_name(EventKind kind);

struct Event {
  uint64_t tick = 0;
  EventKind kind{};
  uint8_t who = 0;     // hand, where there is one
  uint32_t which = 0;  // see EventKind
  float value = 0;     // see EventKind
  Vec3 where;          // [m]
};

}  // namespace catgut
