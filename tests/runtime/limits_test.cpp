// SPDX-License-Identifier: Apache-2.0
// tests/runtime: evaluation in `catgut bench limits`; its measurement is tested in tests/app.
#include <gtest/gtest.h>

#include "procedure/scene_file.h"
#include "runtime/limits.h"

namespace catgut {
namespace {

std::vector<SutureCost> rows(size_t n, double first_ms, double last_ms) {
  std::vector<SutureCost> row(n);
  for (size_t i = 0; i < n; ++i) {
    row[i].suture = static_cast<uint32_t>(i) + 1;
    row[i].solver_ms.median = first_ms + (last_ms - first_ms) * static_cast<double>(i) / static_cast<double>(n - 1);
    row[i].solver_ms.p99 = 2 * row[i].solver_ms.median;
    row[i].fps = 1000 / row[i].solver_ms.median;
  }
  return row;
}

// The sutures that are re-run alternately are the first and the last, tick by tick as recorded.
TEST(Limits, growth_is_measured_on_the_first_and_the_last_suture_sewn_again) {
  const LimitsResult result = measure_limits(read_scene("stress_one_body"), 3, 1, {});
  ASSERT_EQ(result.row.size(), 3u);
  EXPECT_EQ(result.growth.ticks, std::min(result.row[0].ticks, result.row[2].ticks) - 1);
  const std::vector<SutureGrowth::Pass>& pass = result.growth.pass;
  ASSERT_EQ(pass.size(), 5u);
  for (size_t k = 1; k < pass.size(); ++k) EXPECT_LE(pass[k - 1].ratio(), pass[k].ratio());
  EXPECT_EQ(result.growth.middle().ratio(), pass[2].ratio());
  EXPECT_GT(pass[2].ratio(), 0.5);
  EXPECT_LT(pass[2].ratio(), 2);
  EXPECT_NE(limits_table(result, 1).find("sutures 1 and 3 re-run interleaved"), std::string::npos);
  EXPECT_EQ(measure_limits(read_scene("stress_one_body"), 1, 1, {}).growth.pass.size(), 0u) << "nothing to compare with";
}

TEST(Limits, the_table_says_where_it_fell_below_the_limit_and_where_it_did_not) {
  LimitsResult result;
  result.wanted = 20;
  result.row = rows(20, 20, 58);  // 2 ms more each: over 1000 / 24 from the twelfth on
  const std::string text = limits_table(result, 2);
  EXPECT_NE(text.find("20 of 20"), std::string::npos) << text;
  EXPECT_NE(text.find("ours from suture 12"), std::string::npos) << text;
  result.row = rows(20, 1, 1.1);
  EXPECT_NE(limits_table(result, 2).find("ours not reached up to suture 20"), std::string::npos);
  result.row.clear();
  result.run.ended = "surgeon: gave up";
  EXPECT_NE(limits_table(result, 2).find("0 of 20 sutures, 0 s simulated (surgeon: gave up)"), std::string::npos);
}

// The curve is at its values: a factor of two is the same distance everywhere on a logarithmic axis.
TEST(Limits, the_plot_shows_the_numbers) {
  LimitsResult result;
  const auto height_of = [&](double ms) {
    result.row = rows(10, ms, ms);
    const Image image = limits_plot(result, 1, 60);
    int first = -1, last = -1;
    for (int y = 40; y < image.height - 60; ++y)  // the median's color in the middle of the plot
      if (pixel(image, image.width / 2, y) == Color{30, 90, 160, 255}) last = y, first = first < 0 ? y : first;
    EXPECT_GE(first, 0) << ms;
    return 0.5 * (first + last);
  };
  const double one = height_of(1.5), two = height_of(3), four = height_of(6);
  EXPECT_GT(one, two);
  EXPECT_NEAR(one - two, two - four, 1.5);
  result.row.clear();
  EXPECT_GT(limits_plot(result, 2, 60).width, 0) << "nothing measured: an empty plot, no fault";
}

}  // namespace
}  // namespace catgut
