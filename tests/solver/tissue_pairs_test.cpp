// SPDX-License-Identifier: Apache-2.0
// tests/solver: the broad phase of tissue compared with testing every pair.
#include "solver/tissue_pairs.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include "core/random.h"

namespace catgut {
namespace {

// Two crumpled sheets of 40 x 23 particles, row by row, interpenetrating.
struct Sheets {
  std::vector<Vec4> rest, x;
  TissueCollision tissue;
};
Sheets make_sheets(uint64_t seed) {
  Sheets s;
  Random random(seed);
  std::vector<float> radius, apart;
  std::vector<uint32_t> body;
  for (uint32_t sheet = 0; sheet < 2; ++sheet)
    for (int row = 0; row < 40; ++row)
      for (int column = 0; column < 23; ++column) {
        const float u = 0.002f * static_cast<float>(column), v = 0.002f * static_cast<float>(row);
        s.rest.push_back({u, 0.01f * static_cast<float>(sheet), v, 1});
        // Rolled up, so that a sheet also touches itself.
        const float turn = v / 0.008f, r = 0.006f + 0.0005f * turn + 0.0004f * static_cast<float>(random.uniform() - 0.5);
        s.x.push_back({u + 0.001f * static_cast<float>(sheet), r * std::cos(turn), r * std::sin(turn), 1});
        radius.push_back(0.0008f + 0.0004f * static_cast<float>(random.uniform()));
        apart.push_back(0.0044f);
        body.push_back(sheet);
      }
  s.tissue = make_tissue_collision(s.rest, radius, body, apart, {});
  return s;
}

std::vector<std::pair<uint32_t, uint32_t>> every_pair_within(const Sheets& s, float margin) {
  std::vector<std::pair<uint32_t, uint32_t>> found;
  for (uint32_t i = 0; i < s.tissue.particles; ++i)
    for (uint32_t j = i + 1; j < s.tissue.particles; ++j) {
      if (distance(xyz(s.x[i]), xyz(s.x[j])) > s.tissue.radius[i] + s.tissue.radius[j] + margin) continue;
      const float apart = std::max(s.tissue.rest_reach[i], s.tissue.rest_reach[j]);
      if (s.tissue.body[i] == s.tissue.body[j] && distance(xyz(s.rest[i]), xyz(s.rest[j])) < apart) continue;
      found.push_back({i, j});
    }
  return found;
}

std::vector<std::pair<uint32_t, uint32_t>> listed(const PairSearch& search) {
  std::vector<std::pair<uint32_t, uint32_t>> pairs;
  for (const PairCandidate& c : search.pair) pairs.push_back({c.a, c.b});
  return pairs;
}

TEST(TissuePairs, finds_what_looking_at_every_pair_finds) {
  for (const uint64_t seed : {1u, 2u, 3u}) {
    const Sheets s = make_sheets(seed);
    for (const int workers : {1, 2, 3}) {
      Jobs jobs(workers);
      Column<Vec4> origin;
      PairSearch search;
      find_tissue_pairs(s.tissue, s.x.data(), origin, search, jobs);
      const auto found = listed(search);
      EXPECT_TRUE(std::is_sorted(found.begin(), found.end()));
      // At the edge of the margin rounding decides; a micrometer inside it nothing may be missing.
      const auto wanted = every_pair_within(s, s.tissue.pair_margin - 1e-6f),
                 most = every_pair_within(s, s.tissue.pair_margin + 1e-6f);
      EXPECT_GT(wanted.size(), 1000u);
      EXPECT_TRUE(std::includes(found.begin(), found.end(), wanted.begin(), wanted.end())) << seed << ", " << workers;
      EXPECT_TRUE(std::includes(most.begin(), most.end(), found.begin(), found.end())) << seed << ", " << workers;
    }
  }
}

// A damaged state may have any values; an invalid position is near nothing, and no other memory is read or
// written.
TEST(TissuePairs, particles_that_are_nowhere_are_near_nothing) {
  for (const float far : {1e19f, 1e25f, 3e38f, HUGE_VALF, -HUGE_VALF, std::nanf("")}) {
    Sheets s = make_sheets(6);
    for (const size_t i : {0u, 40u, 900u, 1839u}) s.x[i] = {far, i == 40 ? -far : far, far, 1};
    Jobs jobs(1);
    Column<Vec4> origin;
    PairSearch search;
    find_tissue_pairs(s.tissue, s.x.data(), origin, search, jobs);
    EXPECT_GT(search.pair.size(), 1000u);
    for (const PairCandidate& c : search.pair) ASSERT_TRUE(c.a < c.b && c.b < s.tissue.particles) << far;
  }
}

TEST(TissuePairs, kept_pairs_hold_all_that_touch_until_they_are_called_stale) {
  Sheets s = make_sheets(4);
  Jobs jobs(1);
  Column<Vec4> origin;
  PairSearch search;
  search.moved.assign(1, 0.0f);
  EXPECT_TRUE(pairs_are_stale(s.tissue, search)) << "nothing was found yet";
  find_tissue_pairs(s.tissue, s.x.data(), origin, search, jobs);
  Random random(9);
  int kept = 0;
  for (int step = 0; step < 100; ++step) {
    for (Vec4& p : s.x)
      for (float* at : {&p.x, &p.y, &p.z}) *at += 2e-5f * static_cast<float>(random.uniform() - 0.45);
    search.moved[0] = furthest_move(s.x.data(), origin.data(), s.x.size());
    if (pairs_are_stale(s.tissue, search)) break;
    ++kept;
    const auto found = listed(search), touching = every_pair_within(s, 0);
    ASSERT_TRUE(std::includes(found.begin(), found.end(), touching.begin(), touching.end())) << step;
  }
  EXPECT_GT(kept, 5);
  EXPECT_LT(kept, 100) << "the sheets went far, and nobody noticed";
}

// Like a hand: it moves a part of the tissue and then another.
TEST(TissuePairs, only_what_moved_is_looked_for_anew_and_nothing_that_touches_is_missed) {
  Sheets s = make_sheets(7);
  Jobs jobs(2);
  Column<Vec4> origin;
  PairSearch search;
  search.moved.assign(1, 0.0f);
  Random random(10);
  size_t searches = 0, blocks = 0;
  std::vector<uint32_t> held;
  Vec3 by;
  for (int step = 0; step < 160; ++step) {
    if (step % 8 == 0) {
      const Vec3 at = xyz(s.x[random.next() % s.x.size()]);
      held.clear();
      for (uint32_t i = 0; i < s.x.size(); ++i)
        if (distance(xyz(s.x[i]), at) < 0.0035f) held.push_back(i);
      by = {random.normal(), random.normal(), random.normal()};
      by *= 0.0005f / length(by);
    }
    for (const uint32_t i : held) s.x[i].x += by.x, s.x[i].y += by.y, s.x[i].z += by.z;
    if (!origin.empty()) search.moved[0] = furthest_move(s.x.data(), origin.data(), s.x.size());
    if (pairs_are_stale(s.tissue, search)) {
      find_tissue_pairs(s.tissue, s.x.data(), origin, search, jobs);
      ++searches;
      for (const PairSearch::Part& part : search.part) blocks += static_cast<size_t>(std::popcount(part.moved));
      // The list after an intermediate save and load.
      PairSearch again;
      list_tissue_pairs(s.tissue, origin, again, jobs);
      ASSERT_EQ(listed(again), listed(search)) << step;
    }
    const auto found = listed(search), touching = every_pair_within(s, 0);
    ASSERT_TRUE(std::is_sorted(found.begin(), found.end()));
    ASSERT_TRUE(std::includes(found.begin(), found.end(), touching.begin(), touching.end())) << step;
  }
  EXPECT_GT(searches, 10u);
  EXPECT_LT(blocks, searches * search.built.blocks / 2) << "most of the tissue did not move";
}

TEST(TissuePairs, the_furthest_move_is_that_of_any_particle_in_any_place) {
  for (const size_t n : {1u, 3u, 8u, 9u, 33u}) {
    const std::vector<Vec4> from(n, Vec4{1, 2, 3, 1});
    for (size_t i = 0; i < n; ++i) {
      std::vector<Vec4> to = from;
      to[i].y -= 0.5f;
      EXPECT_EQ(furthest_move(to.data(), from.data(), n), 0.5f) << i << " of " << n;
    }
    EXPECT_EQ(furthest_move(from.data(), from.data(), n), 0.0f);
  }
}

TEST(TissuePairs, blocks_near_a_box_are_those_with_a_particle_near_it) {
  const Sheets s = make_sheets(5);
  Jobs jobs(2);
  BlockBoxes boxes;
  make_boxes(s.tissue, s.x.data(), boxes, jobs);
  const Vec3 at = xyz(s.x[777]), half{0.001f, 0.001f, 0.001f};
  std::vector<bool> near(boxes.blocks);
  for_blocks_near(boxes, at - half, at + half, [&](uint32_t b) { near[b] = true; });
  size_t with_particle = 0;
  for (uint32_t i = 0; i < s.tissue.particles; ++i) {
    const Vec3 d = xyz(s.x[i]) - at;
    if (std::max({std::abs(d.x), std::abs(d.y), std::abs(d.z)}) > 0.001f) continue;
    EXPECT_TRUE(near[i / kBlock]) << i;
    EXPECT_EQ(distance_to_block2(boxes, i / kBlock, xyz(s.x[i])), 0.0f);
    ++with_particle;
  }
  EXPECT_GT(with_particle, 0u);
  EXPECT_LT(std::count(near.begin(), near.end(), true), static_cast<long>(boxes.blocks / 2));
}

}  // namespace
}  // namespace catgut
