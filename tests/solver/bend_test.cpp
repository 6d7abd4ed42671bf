// SPDX-License-Identifier: Apache-2.0
// tests of solver/bend: the SIMD sweep that threads run against solve_bend, the scalar form that `catgut validate` checks.
#include "solver/bend.h"

#include <gtest/gtest.h>

#include <vector>

#include "core/random.h"
#include "solver/thread.h"

namespace catgut {
namespace {

TEST(Bend, the_simd_sweep_is_the_scalar_update_by_colors) {
  for (const size_t nodes : {3u, 4u, 5u, 17u, 50u, 175u}) {
    Random r(nodes);
    std::vector<Vec3> p;
    std::vector<float> w;
    for (size_t i = 0; i < nodes; ++i) {
      p.push_back(Vec3{static_cast<float>(i) * 0.0016f, 0, 0} + Vec3{r.normal(), r.normal(), r.normal()} * 0.0006f);
      w.push_back(i % 7 == 3 ? 0 : 5e5f);
    }
    std::vector<Vec3> want = p;
    const std::vector<Vec3> start = p;
    const float compliance = 1e4f, h = 1.0f / 480;
    std::vector<float> lambda(nodes, 0);
    for (int sweep = 0; sweep < 3; ++sweep)
      for (size_t color = 1; color <= 3; ++color)
        for (size_t i = color; i + 1 < nodes; i += 3)
          solve_bend(want[i - 1], want[i], want[i + 1], w[i - 1], w[i], w[i + 1], compliance, h, lambda[i]);
    BendScratch scratch;
    scratch.resize(nodes);
    solve_bends(p, w, compliance, h, 3, scratch);
    float moved = 0;
    for (size_t i = 0; i < nodes; ++i) {
      EXPECT_LT(distance(p[i], want[i]), 1e-8f) << nodes << " nodes, node " << i;
      moved = std::max(moved, distance(p[i], start[i]));
    }
    EXPECT_GT(moved, 1e-6f) << "nothing was bent back: the comparison would be empty";
  }
}

TEST(Bend, a_triplet_that_spans_a_cut_does_not_bend) {
  BendScratch scratch;
  scratch.resize(9);
  std::vector<Vec3> start;
  for (size_t i = 0; i < 9; ++i) {
    start.push_back({static_cast<float>(i) * 0.0016f, i % 2 == 0 ? 0.0004f : 0, 0});
    scratch.set(i % 3, i / 3, start[i], 5e5f);
  }
  for (size_t i : {3u, 4u}) scratch.whole[i % 3][i / 3] = 0;  // pair 3 is cut
  solve_bends(scratch, 9, 1e4f, 1.0f / 480, 3);
  // The two sides are independent.
  BendScratch half;
  half.resize(4);
  for (size_t i = 0; i < 4; ++i) half.set(i % 3, i / 3, start[i], 5e5f);
  solve_bends(half, 4, 1e4f, 1.0f / 480, 3);
  for (size_t i = 0; i < 4; ++i) EXPECT_EQ(distance(scratch.at(i % 3, i / 3), half.at(i % 3, i / 3)), 0) << i;
  EXPECT_GT(distance(scratch.at(1, 0), start[1]), 1e-6f);
}

}  // namespace
}  // namespace catgut
