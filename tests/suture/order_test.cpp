// SPDX-License-Identifier: Apache-2.0
// tests/suture: the order list (paper 2.3, figure 8), compared with the paper's own procedure on a list of pairs.
#include <gtest/gtest.h>

#include <numeric>

#include "core/random.h"
#include "suture/suture.h"

namespace catgut {
namespace {

struct Pair {
  uint32_t first, second;
};

// Figure 8 and its text, literally: pp_m is the pair whose first particle is to move, pp_t the one after whose first
// particle it moves.
std::vector<Pair> recalculate(std::vector<Pair> pp, uint32_t moved, uint32_t after) {
  auto at = [&](uint32_t first) {
    return static_cast<size_t>(std::find_if(pp.begin(), pp.end(), [&](const Pair& p) { return p.first == first; }) -
                               pp.begin());
  };
  size_t m = at(moved), t = at(after);
  // "If pp_m is not the first pair in the rope, the second particle in the next available pair (pp_m-1) is set to the second
  // particle of pp_m."
  if (m != 0) pp[m - 1].second = pp[m].second;
  // "A new pair is created where the first particle in the pair is the first particle in pp_t, and the second particle in the
  // pair is the particle that moved. This pair's location is set to be before pp_t in the order of the rope." (figure 8c)
  const Pair made{pp[t].first, moved};
  // "The first particle in pp_t is set to the particle that was moved." (figure 8d)
  pp[t].first = moved;
  pp.insert(pp.begin() + static_cast<long>(t), made);
  if (t <= m) ++m;
  // "After this is completed, pp_m is removed from the rope order."
  pp.erase(pp.begin() + static_cast<long>(m));
  return pp;
}

Strand chain(uint32_t nodes, uint32_t first_slot, uint64_t seed) {
  Random random(seed);
  Strand t;
  for (uint32_t i = 0; i < nodes; ++i) t.order.push_back(first_slot + i);
  for (uint32_t i = 0; i + 1 < nodes; ++i) t.rest.push_back(0.0016f * (0.1f + 1.8f * random.uniform()));
  t.cut.assign(t.rest.size(), 0);
  return t;
}

TEST(Figure8, the_figure_itself) {
  // p1 .. p8; p2 is moved after p5. (c), (d): p1-p3, p3-p4, p4-p5, p5-p2, p2-p6, p6-p7, p7-p8.
  Strand t = chain(8, 1, 3);
  move_particle(t, 1, 4);
  EXPECT_EQ(t.order, (std::vector<uint32_t>{1, 3, 4, 5, 2, 6, 7, 8}));
}

TEST(Figure8, order_is_the_papers_for_every_move) {
  constexpr uint32_t kNodes = 14, kFirst = 100;
  for (size_t from = 1; from + 1 < kNodes; ++from)
    for (size_t after = 0; after + 1 < kNodes; ++after) {
      if (from == after || from == after + 1) continue;
      Strand t = chain(kNodes, kFirst, from * 31 + after);
      const double length = std::accumulate(t.rest.begin(), t.rest.end(), 0.0);
      const std::vector<float> rest = t.rest;
      std::vector<Pair> pp;
      for (uint32_t i = 0; i + 1 < kNodes; ++i) pp.push_back({t.order[i], t.order[i + 1]});
      const std::vector<Pair> want = recalculate(pp, t.order[from], t.order[after]);
      const uint32_t moved = t.order[from], behind = t.order[after], free_side = t.order[from - 1],
                     needle_side = t.order[from + 1];
      move_particle(t, from, after);
      ASSERT_EQ(t.order.size(), size_t{kNodes});
      ASSERT_EQ(t.rest.size(), size_t{kNodes} - 1);
      ASSERT_EQ(want.size(), size_t{kNodes} - 1);
      for (size_t i = 0; i + 1 < kNodes; ++i) {
        ASSERT_EQ(t.order[i], want[i].first) << "move " << from << " after " << after;
        ASSERT_EQ(t.order[i + 1], want[i].second) << "move " << from << " after " << after;
      }
      // Lengths: the two pairs that it left are one, the pair that it split is two halves, no other changed, same sum.
      EXPECT_NEAR(std::accumulate(t.rest.begin(), t.rest.end(), 0.0), length, 1e-7);
      auto pair_of = [&](uint32_t a, uint32_t b) {
        for (size_t i = 0; i + 1 < kNodes; ++i)
          if (t.order[i] == a && t.order[i + 1] == b) return t.rest[i];
        return -1.0f;
      };
      const float half = 0.5f * rest[after];
      EXPECT_FLOAT_EQ(pair_of(behind, moved), half);
      EXPECT_FLOAT_EQ(pair_of(free_side, needle_side), rest[from - 1] + rest[from]);
    }
}

TEST(Figure8, a_particle_already_there_stays) {
  for (size_t from = 1; from < 9; ++from) {
    Strand t = chain(10, 0, from);
    const Strand before = t;
    move_particle(t, from, from - 1);
    EXPECT_EQ(t.order, before.order);
    EXPECT_EQ(t.rest, before.rest);
  }
}

TEST(Figure8, ten_thousand_moves_lose_no_particle_and_no_length) {
  Strand t = chain(40, 7, 5);
  const double length = std::accumulate(t.rest.begin(), t.rest.end(), 0.0);
  Random random(11);
  for (int k = 0; k < 10000; ++k) {
    const size_t from = 1 + random.next() % 38, after = random.next() % 39;
    if (from == after) continue;
    move_particle(t, from, after);
  }
  // Each move rounds a few of the lengths once: no drift beyond that.
  EXPECT_NEAR(std::accumulate(t.rest.begin(), t.rest.end(), 0.0), length, 1e-6);
  EXPECT_EQ(t.order.front(), 7u);
  EXPECT_EQ(t.order.back(), 46u);
  std::sort(t.order.begin(), t.order.end());
  for (uint32_t i = 0; i < 40; ++i) EXPECT_EQ(t.order[i], 7 + i);
}

}  // namespace
}  // namespace catgut
