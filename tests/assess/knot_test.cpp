// SPDX-License-Identifier: Apache-2.0
// tests/assess: names of knots: 100 knots laid in space as a thread, seen by their topology alone, and named.
#include <gtest/gtest.h>

#include <cstdlib>
#include <map>

#include "assess/facts.h"
#include "core/random.h"
#include "thread/observe.h"
#include "validation/knot_scenes.h"

namespace catgut::assess {
namespace {

// As a surgeon names them, from the list of throws as laid.
KnotKind name_as_laid(const std::vector<validation::Throw>& laid) {
  if (laid.size() == 1) return KnotKind::single_throw;
  size_t changes = 0;
  for (size_t i = 1; i < laid.size(); ++i) changes += laid[i].hand != laid[i - 1].hand;
  if (changes == 0) return KnotKind::granny;
  if (changes + 1 < laid.size()) return KnotKind::mixed;
  return laid[0].half_turns >= 5 ? KnotKind::surgeons : KnotKind::square;
}

// Thirty in every build, a hundred with CATGUT_LONG=1 (the nightly run).
TEST(Knots, a_hundred_of_all_kinds_are_named_right) {
  const int knots = std::getenv("CATGUT_LONG") ? 100 : 30;
  Random random(7);
  std::map<KnotKind, int> kinds;
  int right = 0;
  const thread::Settings settings = validation::knot_settings(0.2f);
  for (int k = 0; k < knots; ++k) {
    std::vector<validation::Throw> laid;
    const size_t throws = 1 + static_cast<size_t>(k) % 3;
    // Every kind comes up: from the second throw on the hand changes in two of three.
    for (size_t t = 0; t < throws; ++t) {
      const int last = laid.empty() ? (random.uniform() < 0.5f ? 1 : -1) : laid.back().hand;
      laid.push_back({t == 0 && random.uniform() < 0.5f ? 5 : 3, t > 0 && random.uniform() < 0.6f ? -last : last});
    }
    const validation::LaidKnot knot = validation::lay_knot(laid, 0.35e-3f, 0.49e-3f);
    const thread::SeenKnot seen = thread::observe(settings, knot.state);
    std::vector<Throw> thrown;
    for (uint32_t t = 0; t < seen.throws; ++t) {
      Throw row;
      row.wraps = (seen.item[t].half_turns - 1) / 2, row.hand = seen.item[t].hand;
      thrown.push_back(row);
    }
    const KnotKind expected = name_as_laid(laid), named = kind_of(thrown);
    ++kinds[expected];
    right += named == expected;
    EXPECT_EQ(named, expected) << k << ": " << knot_kind_name(named) << " for " << knot_kind_name(expected);
  }
  EXPECT_EQ(right, knots);
  EXPECT_EQ(kinds.size(), 5u);  // single, granny, square, surgeon's, mixed
}

TEST(Knots, a_strand_that_stays_straight_slides) {
  Throw straight;
  straight.sliding = true;
  EXPECT_EQ(kind_of({Throw{}, straight}), KnotKind::sliding);
  EXPECT_EQ(kind_of({}), KnotKind::none);
}

}  // namespace
}  // namespace catgut::assess
