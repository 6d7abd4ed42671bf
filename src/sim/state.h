// SPDX-License-Identifier: Apache-2.0
// sim/state: everything that changes, and the scratch that stages reuse. Members listed in reflect are the state: saved, hashed
// and published. The others are working memory of a tick.
#pragma once
#include <array>
#include <memory>
#include <vector>

#include "exchange/event.h"
#include "exchange/tool_input.h"
#include "sim/haptic_feedback.h"
#include "sim/physical.h"
#include "sim/topology.h"
#include "solver/substep.h"
#include "suture/reflect.h"
#include "technique/reflect.h"

namespace catgut {

// A hand of the surgeon or of an assistant, and the instrument it holds.
struct HandState {
  Pose pose;            // at the end of the last tick
  Pose grip;            // pose of the instrument in the hand's frame
  int instrument = -1;  // -1: none
  uint32_t known = 0;   // 0 until the hand has connected for the first time
};
constexpr void reflect(auto& a, Like<HandState> auto& h) {
  a(h.pose), a(h.grip), a.index_or_none(h.instrument, IndexOf::instrument), a(h.known);
}

struct State {
  uint64_t tick = 0;
  Topology topology;                      // written by sim/topology_divide, between ticks
  SolverState solver;                     // written by solver/substep, suture/*
  SutureState suture;                     // written by suture
  std::vector<TechniqueState> technique;  // one per suture; written by technique
  std::vector<ClosurePlan> plan;          // one per suture; written by technique, read by suture/closure
  std::array<HandState, kMaxHands> hand;  // written by sim/hands
  PhysicalState physical;                 // written by sim/physical_step; empty with guided mechanics
  HapticFeedback haptics;                 // written by sim/haptic_feedback, read by publish
  EventList event;                        // of the last tick
  std::shared_ptr<const Model> divided;   // what sim/topology derives from `topology`; null: as built
  // Working memory.
  EventList suture_event;  // of one suture, for its technique
  std::vector<StitchPoint> stitch;
  std::vector<float> stitch_span;
  SolverScratch scratch;
};

constexpr void reflect(auto& a, Like<State> auto& s) {
  a(s.tick), a(s.topology), a(s.solver), a(s.suture), a.column(s.plan, IndexOf::strand), a.column(s.technique, IndexOf::strand);
  a(s.hand), a(s.haptics), a(s.event), a(s.physical);
  a.cache(s.divided), a.cache(s.suture_event), a.cache(s.stitch), a.cache(s.stitch_span), a.cache(s.scratch);
}

}  // namespace catgut
