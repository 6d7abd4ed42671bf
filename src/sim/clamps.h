// SPDX-License-Identifier: Apache-2.0
// sim/clamps: the clamps on the fixed ends of bowels, which commands move along the bowel's axis (exchange/command). The place
// of a clamp is that of the columns it holds: nothing else is kept, so that a loaded state continues alike. Physical mechanics
// only.
#pragma once
#include <array>

#include "exchange/command.h"
#include "sim/model.h"
#include "sim/state.h"
#include "wall/wall.h"

namespace catgut {

// Whether body `body` is a bowel end with a clamp.
bool has_clamp(const Model& model, size_t body);

// Those that move in a tick. Commands for bodies without a clamp have no effect.
class MovingClamps {
 public:
  // Turns the frames of the wall's elements by one step where a command pulls.
  MovingClamps(const Model& model, State& state, const CommandList& commands, wall::Scratch& scratch);
  void move(const Model& model, State& state, float h) const;  // before each step of h seconds: velocities
  void stop(const Model& model, State& state) const;           // after the last one

 private:
  struct Clamp {
    size_t body = 0;
    Vec3 axis;                             // toward the opening
    float speed = 0, least = 0, most = 0;  // [m/s] along it, [m] from where the scene has it
  };
  size_t count_ = 0;
  std::array<Clamp, CommandList::kCapacity> clamp_{};
};

}  // namespace catgut
