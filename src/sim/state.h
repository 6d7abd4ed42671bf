// sim/state: everything that changes, and the scratch that stages reuse. What save_state lists is the state; the rest is cache.
#pragma once
#include <array>
#include <vector>

#include "exchange/event.h"
#include "exchange/tool_input.h"
#include "sim/feel.h"
#include "solver/substep.h"
#include "suture/suture.h"
#include "technique/technique.h"

namespace catgut {

struct State {
  uint64_t tick = 0;
  SolverState solver;                   // written by solver/substep, suture/*
  SutureState suture;                   // written by suture/{grasp, puncture, pull}
  TechniqueState technique;             // written by technique
  ClosurePlan plan;                     // written by technique, read by suture/closure
  std::array<Pose, 2> hand;             // where the hands were at the end of the last tick; written by sim/step
  std::array<uint8_t, 2> hand_known{};  // 0 until a hand has first been connected
  // Not saved: events of this tick, working memory.
  std::vector<Event> event;
  std::vector<StitchPoint> stitch;
  std::vector<float> stitch_span;
  SolverScratch scratch;
  Feel feel;  // written by sim/feel, read by publish
};

}  // namespace catgut
