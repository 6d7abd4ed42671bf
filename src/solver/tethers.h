// SPDX-License-Identifier: Apache-2.0
// solver/tethers: inextensible tethers between two points of tissue. A baked suture leaves some; a long procedure has hundreds
// that load the same tissue. They are therefore solved in the space of their multipliers, without their particles.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "solver/attach.h"
#include "solver/particles.h"

namespace catgut {

// The owner: a technique's closure plan, a baked suture, or a baked passage through a wall, which draws the wall in.
enum class TetherOwner : uint32_t { plan, stitch, passage };

// Two points of tissue held together by thread: never further apart than `length`. A tether does not push.
struct Tether {
  EmbeddedPoint a, b;
  float length = 0;      // [m]
  float compliance = 0;  // [m/N]
  float lambda = 0;      // [N s^2] of the last substep; negative: tension
  TetherOwner owner = TetherOwner::plan;
  uint32_t suture = 0;  // whose plan
};

// One XPBD step of a tether (Macklin et al. 2016) in addition to the pull already in its lambda.
void solve_tether(Tether& pin, Vec4* x, const float* w, float h);

// Data that build_graph derives from the tethers of a tick. The span of a tether is the vector from its b to its a.
struct TetherGraph {
  struct Strand {
    uint32_t active = 0;
    float coupling = 0;  // [1/kg] motion of the span of that tether per unit pull of this one
  };
  // Active tethers were taut in the substep before. All others are slack, many of them permanently: one that becomes taut is
  // solved separately until the next tick.
  std::vector<uint32_t> active, slack;  // tethers
  std::vector<uint32_t> first;          // active tether n moves strand[first[n]] .. strand[first[n + 1]], its own the first
  std::vector<Strand> strand;
  // Tether i as one sum over the particles of both its points, row[i] .. row[i + 1]: see TetherRow in tethers.cpp.
  std::vector<uint32_t> row, particle;
  std::vector<float> share, move;
  std::vector<float> length, compliance;  // [m], [m/N], by tether
  std::vector<EmbeddedPoint> point;       // of all tethers, as they were when the rows were built
  // Working memory of build_graph: the active tethers before, active tethers by particle and their shares there, couplings by
  // active tether and whether they are listed.
  std::vector<uint32_t> before, start, on;
  std::vector<float> weight, by_active;
  std::vector<uint8_t> listed;
};
// Updates the graph. Call it whenever tethers may have changed, and once per tick, since others may be taut now.
// w: inverse mass [1/kg] of the particles, which is constant.
void build_graph(std::span<const Tether> pin, const float* w, uint32_t particles, TetherGraph& web);

// Working memory of solve_tethers: all that it reads and writes of a tether while it solves.
struct TetherSpan {
  Vec4 span;                    // [m] with all pulls so far
  Vec4 pull;                    // [N s^2] accumulated pull, not yet applied to the particles
  float length = 0, alpha = 0;  // [m], [1/kg]
  float give = 0;               // [kg] lambda of a pull that shortens it by a meter
  float lambda = 0;             // [N s^2]
};
// Solves all tethers from zero: `sweeps` times solve_tether of each active tether in turn, then once of each other tether.
// From the second sweep on, tethers within `tolerance` [m] of their length are skipped; skipping in the first causes jitter.
// Gauss-Seidel on multipliers (Catto, "Iterative Dynamics with Temporal Coherence", 2005, for contacts): impulses reach the
// particles at the end. The cost per sweep is proportional to couplings between active tethers, not to
// their particles. web: result of build_graph for these tethers. Another number of tethers is a programming error and
// aborts.
void solve_tethers(std::span<Tether> pin, const TetherGraph& web, Vec4* x, float h, int sweeps, float tolerance,
                   std::vector<TetherSpan>& work);

}  // namespace catgut
