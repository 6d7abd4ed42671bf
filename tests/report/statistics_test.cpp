// SPDX-License-Identifier: Apache-2.0
// tests/report: statistics against closed forms and published values.
#include "report/statistics.h"

#include <gtest/gtest.h>

#include <cmath>

namespace catgut {
namespace {

TEST(Statistics, quartiles_are_those_of_type_7) {
  // R: quantile(c(1, 2, 4, 8, 16)), quantile(1:4)
  EXPECT_DOUBLE_EQ(quantile({16, 1, 8, 2, 4}, 0.25), 2);
  EXPECT_DOUBLE_EQ(quantile({16, 1, 8, 2, 4}, 0.75), 8);
  EXPECT_DOUBLE_EQ(quantile({1, 2, 3, 4}, 0.25), 1.75);
  EXPECT_DOUBLE_EQ(quantile({1, 2, 3, 4}, 0.5), 2.5);
  EXPECT_DOUBLE_EQ(quantile({7}, 0.9), 7);
  EXPECT_TRUE(std::isnan(quantile({}, 0.5)));
}

TEST(Statistics, a_box_has_whiskers_at_data_and_outliers_beyond) {
  const Box b = box_of({1, 2, 3, 4, 5, 6, 7, 8, 9, 30});
  EXPECT_DOUBLE_EQ(b.q1, 3.25);
  EXPECT_DOUBLE_EQ(b.q3, 7.75);
  EXPECT_DOUBLE_EQ(b.low, 1);
  EXPECT_DOUBLE_EQ(b.high, 9);
  EXPECT_EQ(b.outliers, std::vector<double>{30});
  EXPECT_DOUBLE_EQ(b.mean, 7.5);
  EXPECT_EQ(box_of({}).n, 0u);
}

TEST(Statistics, percentile_ranks_count_equals_half) {
  EXPECT_DOUBLE_EQ(percentile_rank({1, 2, 3, 4}, 2.5), 50);
  EXPECT_DOUBLE_EQ(percentile_rank({1, 2, 2, 4}, 2), 50);
  EXPECT_DOUBLE_EQ(percentile_rank({1, 2}, 9), 100);
}

// With p0 = 5 %, p1 = 15 %, alpha = beta = 0.1 the published values are s = 0.0924 and limits of 1.81.
TEST(Statistics, cusum_has_the_published_limits_and_steps) {
  const Cusum c = cusum({true, true, false});
  const double p = std::log(3.0), q = std::log(0.95 / 0.85);
  EXPECT_NEAR(c.s, q / (p + q), 1e-12);
  EXPECT_NEAR(c.s, 0.0920, 5e-4);
  EXPECT_NEAR(c.h0, std::log(9.0) / (p + q), 1e-12);
  EXPECT_NEAR(c.h0, 1.816, 1e-3);
  EXPECT_DOUBLE_EQ(c.h0, c.h1);
  ASSERT_EQ(c.line.size(), 3u);
  EXPECT_NEAR(c.line[1], -2 * c.s, 1e-12);
  EXPECT_NEAR(c.line[2], 1 - 3 * c.s, 1e-12);
}

// In the long run the line falls at the acceptable rate of failure and rises at the unacceptable one.
TEST(Statistics, cusum_falls_at_the_acceptable_rate_and_rises_at_the_unacceptable_one) {
  std::vector<bool> acceptable(200, true), not_acceptable(200, true);
  for (size_t i = 0; i < 200; ++i) acceptable[i] = i % 20 != 0, not_acceptable[i] = i % 20 > 2;
  EXPECT_LT(cusum(acceptable).line.back(), -cusum({}).h0);
  EXPECT_GT(cusum(not_acceptable).line.back(), cusum({}).h1);
}

TEST(Statistics, mann_whitney_is_exact) {
  // Two separate samples of 3 and 3: 2 of the 20 divisions are as extreme.
  EXPECT_NEAR(mann_whitney({1, 2, 3}, {4, 5, 6}), 0.1, 1e-12);
  EXPECT_NEAR(mann_whitney({4, 5, 6}, {1, 2, 3}), 0.1, 1e-12);
  // 4 and 5 values without overlap: 2 of 126.
  EXPECT_NEAR(mann_whitney({1, 2, 3, 4}, {5, 6, 7, 8, 9}), 2.0 / 126, 1e-12);
  EXPECT_NEAR(mann_whitney({1, 1, 1}, {1, 1, 1}), 1, 1e-12) << "all tied";
  // By hand: values 1 1 2 | 2 3 3, mean ranks 1.5 1.5 3.5 | 3.5 5.5 5.5. Sums as far as 6.5 from 10.5 are those of the
  // three smallest and the three largest ranks; the tie at 3.5 gives two divisions each: 4 of 20.
  EXPECT_NEAR(mann_whitney({1, 1, 2}, {2, 3, 3}), 0.2, 1e-12);
  EXPECT_TRUE(std::isnan(mann_whitney({}, {1})));
}

}  // namespace
}  // namespace catgut
