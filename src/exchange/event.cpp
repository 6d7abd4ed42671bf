// exchange/event: the names under which events appear in JSON, logs and scene expectations.
#include "exchange/event.h"

namespace catgut {

const char* event_name(EventKind kind) {
  static constexpr const char* kName[] = {
      "needle_grasped",    "needle_released", "thread_grasped",  "thread_released",  "tip_entered",    "particle_attached",
      "particle_released", "tip_exited",      "bite_cancelled",  "suture_point",     "bite_completed", "particle_passed",
      "order_broken",      "ring_complete",   "closure_started", "closure_finished", "thread_ran_out"};
  static_assert(sizeof(kName) / sizeof(kName[0]) == static_cast<size_t>(EventKind::count_));
  return kind < EventKind::count_ ? kName[static_cast<int>(kind)] : "unknown";
}

}  // namespace catgut
