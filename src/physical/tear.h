// SPDX-License-Identifier: Apache-2.0
// physical/tear: bites that tear through the wall. A bite is a channel with a mouth on each end; thread or the needle lies in
// it. When the force on it exceeds its strength, it moves through the tissue in the force's direction within the wall and
// leaves a slit. At the edge it is out. Reads the impulses of thread and needle; writes State::hole and the needle's channels,
// and takes torn bites off the thread.
//
// Strength [N]: 4.62 +- 1.40 for a full-thickness bite in human small bowel (803 tests; Gong et al.
// 2023, 10.1115/1.4063951). Assumptions: layers carry in proportion to their stiffness, so a bite without submucosa and muscle
// holds little; nearer to an edge than 5 mm the strength falls in proportion to the distance. The wall's elements stay joined
// behind the bite: the slit is recorded and can be drawn, but it does not gape.
#pragma once
#include <span>
#include <vector>

#include "physical/needle.h"
#include "physical/surface.h"
#include "wall/laminate.h"

namespace catgut::physical {

struct Model;
struct State;

struct TearModel {
  bool on = true;
  float strength = 4.6f;    // [N] full thickness, far from an edge
  float full_bite = 5e-3f;  // [m] distance from the edge beyond which the strength no longer grows
  float viscosity = 10;     // [N s/m] force above the strength over the speed of tearing
  float smoothing = 5e-3f;  // [s] the force on a bite is averaged over this time
  // Upper face of each layer, -1 .. 1 from the inner face to the outer one, and its part of the strength.
  struct LayerShare {
    float top = 1, share = 1;
  };
  std::vector<LayerShare> layer{{}};
};
TearModel make_tear(std::span<const wall::Layer> layer);
// Part of the full strength of the layers between two depths, -1 the inner face .. 1 the outer one.
float strength_share(const TearModel& model, float low, float high);

// [m] at rest, from a point to the nearest edge of the wall.
float edge_distance(const Model& model, const State& state, const wall::Point& point);

// Strength [N] of the bite between two holes.
float bite_strength(const Model& model, const State& state, uint32_t entry, uint32_t exit);

// After the thread's step. impulse [N s]: per hole, in this step. Returns true when a bite came out.
bool tear_bites(const Model& model, State& state, std::span<const Vec3> impulse, SurfaceSearch& search);

// After the bodies' step: the shaft of a needle tears the wall across its channel as the thread of a bite does.
void tear_channels(const Model& model, State& state, BodiesScratch& bodies);

}  // namespace catgut::physical
