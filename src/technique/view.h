// SPDX-License-Identifier: Apache-2.0
// technique/view: a technique's read-only view of the tick. Plain spans into the simulation's state, valid during the call.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "suture/suture.h"

namespace catgut {

// One end of a bite, for the techniques.
struct StitchPoint {
  Vec3 at;              // [m] current position
  EmbeddedPoint point;  // the same, carried by the tissue
  uint32_t bite = 0;    // index in `bite`
  uint32_t wall = 0;    // bowel end (connell, stay) or layer (lembert: 0 outer, 1 inner)
  bool exit = false;    // the exit end of its bite, else the entry
  bool inside = false;  // on the mucosa, else on the serosa
  float span = 0;       // [m] rest length of thread from this point to the next toward the needle; 0 for the last
};

struct TechniqueState;

struct TechniqueView {
  std::span<const StitchPoint> point;  // the suture points in order of creation
  std::span<const Bite> bite;
  std::span<const Knot> knot;
  const Vec4* x = nullptr;  // particle positions [m]
  float loop = 0;           // [m] rest length of thread from the first suture point to the last
  bool needle_in_tissue = false;
  uint32_t suture_index = 0;  // baked sutures so far: their points and knots are no longer listed
  float dt = 0;               // [s] length of a tick
  // Of every suture of the scene, for rules that see neighbors; `suture` is the index of this one.
  uint32_t suture = 0;
  std::span<const ClosurePlan> plan_of;
  std::span<const TechniqueState> state_of;
};

}  // namespace catgut
