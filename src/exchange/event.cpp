// SPDX-License-Identifier: Apache-2.0
// exchange/event: the names under which events appear in JSON, logs and scene expectations.
#include "exchange/event.h"

namespace catgut {

const char* event_name(EventKind kind) {
  static constexpr const char* kName[] = {
      "needle_grasped",       "needle_released",   "thread_grasped",     "thread_released", "tip_entered",
      "particle_attached",    "particle_released", "tip_exited",         "bite_withdrawn",  "suture_point",
      "bite_completed",       "particle_passed",   "bite_out_of_order",  "ring_complete",   "closure_started",
      "closure_finished",     "thread_exhausted",  "tissue_grasped",     "tissue_released", "loop_formed",
      "loop_rejected",        "loop_released",     "throw_started",      "throw_locked",    "throw_undone",
      "thread_cut",           "suture_loaded",     "suture_baked",       "seam_closed",     "instrument_taken",
      "instrument_laid_down", "instrument_parked", "instrument_refused", "technique_fault", "pen_activated",
      "pen_deactivated",      "wall_scored",       "wall_cut_through",   "piece_freed",     "tissue_snipped",
      "tissue_crushed",       "bleeding_started",  "bleeding_stopped"};
  static_assert(sizeof(kName) / sizeof(kName[0]) == static_cast<size_t>(EventKind::count_));
  return kind < EventKind::count_ ? kName[static_cast<int>(kind)] : "unknown";
}

const char* fault_name(Fault fault) {
  static constexpr const char* kName[] = {
      "none",           "wrong_body",      "wrong_layer",    "one_wall_only", "knot_without_bite", "needle_in_tissue",
      "cut_in_stitch",  "cut_before_knot", "too_few_throws", "cut_off_line",  "pulled_attached",   "cut_at_suture",
      "bite_in_char",   "inner_wall_cut",  "clamp_torn_out", "bite_torn",     "bite_torn_out",     "thread_broken",
      "needle_torn_out"};
  static_assert(sizeof(kName) / sizeof(kName[0]) == static_cast<size_t>(Fault::count_));
  return fault < Fault::count_ ? kName[static_cast<int>(fault)] : "unknown";
}

const char* loop_reason_name(LoopReason reason) {
  static constexpr const char* kName[] = {"none", "no_crossing", "tip_outside", "too_deep"};
  static_assert(sizeof(kName) / sizeof(kName[0]) == static_cast<size_t>(LoopReason::count_));
  return reason < LoopReason::count_ ? kName[static_cast<int>(reason)] : "unknown";
}

}  // namespace catgut
