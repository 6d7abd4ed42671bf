// SPDX-License-Identifier: Apache-2.0
// solver/bend: cosine bending along a thread (paper 2.1) in SIMD. Every third triplet shares no particle with the next, so the
// triplets have three colors. Nodes are stored by index modulo three, which makes the three points of all triplets of a color
// contiguous columns. The update equals solve_bend (solver/thread.h) lane by lane, with the same bits for any SIMD
// width.
#pragma once
#include <span>

#include "core/math.h"
#include "solver/particles.h"

namespace catgut {

// Nodes i of a thread as columns by i % 3, padded so that kernels may read beyond the end.
struct BendScratch {
  Column<float> x[3], y[3], z[3], w[3];
  Column<float> lambda[3];  // per triplet, by the color of its middle node (i % 3)
  Column<float> whole[3];   // likewise: 0 where one of its pairs is cut, 1 otherwise
  void resize(size_t nodes);
  // Node 3 k + color.
  void set(size_t color, size_t k, Vec3 p, float mass) {
    x[color][k] = p.x, y[color][k] = p.y, z[color][k] = p.z, w[color][k] = mass;
  }
  Vec3 at(size_t color, size_t k) const { return {x[color][k], y[color][k], z[color][k]}; }
};

// `sweeps` Gauss-Seidel sweeps over the three colors. p: positions of the nodes [m]; w: inverse masses, 0 where locked;
// compliance [1/J]; multipliers start at zero.
void solve_bends(BendScratch& scratch, size_t nodes, float compliance, float h, int sweeps);  // of the nodes set in scratch
void solve_bends(std::span<Vec3> p, std::span<const float> w, float compliance, float h, int sweeps, BendScratch& scratch);

}  // namespace catgut
