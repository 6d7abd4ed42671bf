// SPDX-License-Identifier: Apache-2.0
// solver/tethers: ropes between two points of tissue. A settled stitch leaves some, and a long procedure has hundreds of them
// that pull at the same tissue, so they are solved among themselves, without the particles that they hang on.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "solver/attach.h"
#include "solver/particles.h"

namespace catgut {

// Who made it: a technique's closure plan, a settled stitch, or one for its passage through a wall, which draws the wall in.
enum class TetherOwner : uint32_t { plan, stitch, passage };

// Two points of tissue that thread holds together: never further apart than `length`. A rope: it does not push.
struct Tether {
  EmbeddedPoint a, b;
  float length = 0;      // [m]
  float compliance = 0;  // [m/N]
  float lambda = 0;      // [N s^2] of the last substep; negative: it pulls
  TetherOwner owner = TetherOwner::plan;
  uint32_t suture = 0;  // whose plan
};

// One XPBD step of a pin (Macklin et al. 2016) on top of what its lambda says that it pulls already.
void solve_tether(Tether& pin, Vec4* x, const float* w, float h);

// What build_graph finds out about the pins of a tick. The span of a pin is the vector from its b to its a.
struct TetherGraph {
  struct Strand {
    uint32_t active = 0;
    float coupling = 0;  // [1/kg] that much does the span of that rope move along each unit of this one's pull
  };
  // Ropes of the web are the pins that pulled in the substep before. All others hang slack, many of them for good: one that
  // gets taut pulls on its own until the next tick.
  std::vector<uint32_t> active, slack;  // pins
  std::vector<uint32_t> first;          // rope n moves the spans of strand[first[n]] .. strand[first[n + 1]], its own the first
  std::vector<Strand> strand;
  // Pin i as one sum over the particles of both its points, row[i] .. row[i + 1]: see TetherRow in pins.cpp.
  std::vector<uint32_t> row, particle;
  std::vector<float> share, move;
  std::vector<float> length, compliance;  // [m], [m/N], by pin
  std::vector<EmbeddedPoint> point;       // of all pins, as they were when the rows were found
  // Working memory of build_graph: the ropes before, ropes by particle and their shares there, couplings by rope and whether
  // they are listed.
  std::vector<uint32_t> before, start, on;
  std::vector<float> weight, by_active;
  std::vector<uint8_t> listed;
};
// Brings the web up to date: to be called whenever pins may have changed, and once a tick, since others of them may pull now.
// w: inverse mass [1/kg] of the particles, which never changes.
void build_graph(std::span<const Tether> pin, const float* w, uint32_t particles, TetherGraph& web);

// Working memory of solve_tethers: all that it reads and writes of a pin while it solves.
struct TetherSpan {
  Vec4 span;                    // [m] as it is with all pulls so far
  Vec4 pull;                    // [N s^2] all that it pulls, still to be given to the particles
  float length = 0, alpha = 0;  // [m], [1/kg]
  float give = 0;               // [kg] lambda of a pull that makes it shorter by a meter
  float lambda = 0;             // [N s^2]
};
// Solves all pins from no pull at all: `sweeps` times solve_tether of each of the web's ropes in turn, then once of each other
// pin. From the second sweep on, ropes that are as they should be to within `tolerance` [m] are left alone; in the first, they
// would twitch. Ropes see each other through the web and give all that they pull to their particles at the end, so a sweep
// costs what ropes that pull have neighbors, however many particles they hang on. (Gauss-Seidel on the multipliers, as Catto,
// "Iterative Dynamics with Temporal Coherence", 2005, has it for contacts.) web: as build_graph left it for these pins; of
// another number it stops the program.
void solve_tethers(std::span<Tether> pin, const TetherGraph& web, Vec4* x, float h, int sweeps, float tolerance,
                   std::vector<TetherSpan>& work);

}  // namespace catgut
