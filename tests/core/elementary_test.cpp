// SPDX-License-Identifier: Apache-2.0
// core/elementary: compared with the C library's long double functions, which are accurate beyond a double's last place.
#include "core/elementary.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/random.h"

namespace catgut {
namespace {

constexpr double kEps = std::numeric_limits<double>::epsilon();

// The largest error of f at n arguments in [low, high], in units of the last place of the larger of |result| and floor.
template <typename F, typename Want>
double worst_error(F f, Want want, double low, double high, double floor) {
  Random random(7);
  double worst = 0;
  for (int i = 0; i < 200000; ++i) {
    const double x = low + (high - low) * (random.uniform() + random.uniform() * 0x1p-24);
    const long double w = want(static_cast<long double>(x));
    const double scale = std::max(std::abs(static_cast<double>(w)), floor);
    worst = std::max(worst, static_cast<double>(std::abs(static_cast<long double>(f(x)) - w)) / (scale * kEps));
  }
  return worst;
}

TEST(Elementary, doubles_are_good_to_the_last_place) {
  using L = long double;
  EXPECT_LT(worst_error([](double x) { return portable::sin(x); }, [](L x) { return std::sin(x); }, -50, 50, 1e-3), 2);
  EXPECT_LT(worst_error([](double x) { return portable::cos(x); }, [](L x) { return std::cos(x); }, -50, 50, 1e-3), 2);
  EXPECT_LT(worst_error([](double x) { return portable::asin(x); }, [](L x) { return std::asin(x); }, -1, 1, 1e-3), 2);
  EXPECT_LT(worst_error([](double x) { return portable::acos(x); }, [](L x) { return std::acos(x); }, -1, 1, 1e-3), 2);
  EXPECT_LT(worst_error([](double x) { return portable::exp(x); }, [](L x) { return std::exp(x); }, -30, 30, 0), 2);
  EXPECT_LT(worst_error([](double x) { return portable::log(x); }, [](L x) { return std::log(x); }, 1e-6, 1e3, 1e-3), 2);
  EXPECT_LT(worst_error([](double x) { return portable::pow(x, 1.7); }, [](L x) { return std::pow(x, 1.7L); }, 1e-3, 2, 0), 12);
  EXPECT_LT(worst_error([](double x) { return portable::atan2(std::sin(x), std::cos(x)); },
                        [](L x) {
                          return std::atan2(static_cast<L>(std::sin(static_cast<double>(x))),
                                            static_cast<L>(std::cos(static_cast<double>(x))));
                        },
                        -3.14, 3.14, 1e-3),
            2);
}

TEST(Elementary, edges) {
  const double inf = HUGE_VAL, pi = 3.141592653589793, nan = std::nan("");
  for (const double y : {0.0, -0.0, 1.0, -1.0, inf, -inf})
    for (const double x : {0.0, -0.0, 1.0, -1.0, inf, -inf})
      EXPECT_EQ(portable::atan2(y, x), std::atan2(y, x)) << y << " " << x;
  EXPECT_EQ(std::signbit(portable::atan2(-0.0, 1.0)), true);
  EXPECT_TRUE(std::isnan(portable::atan2(nan, 1.0)) && std::isnan(portable::sin(inf)) && std::isnan(portable::cos(nan)));
  EXPECT_TRUE(std::isnan(portable::asin(1.5)) && std::isnan(portable::acos(-1.5)) && std::isnan(portable::log(-1.0)));
  EXPECT_EQ(portable::acos(1.0), 0);
  EXPECT_EQ(portable::acos(-1.0), pi);
  EXPECT_EQ(portable::exp(0.0), 1);
  EXPECT_EQ(portable::exp(-inf), 0);
  EXPECT_EQ(portable::exp(800.0), inf);
  EXPECT_EQ(portable::log(1.0), 0);
  EXPECT_EQ(portable::log(0.0), -inf);
  EXPECT_EQ(portable::pow(0.0, 2.0), 0);
  EXPECT_EQ(portable::pow(2.0, 0.0), 1);
  EXPECT_NEAR(portable::sin(1e9), std::sin(1e9), 1e-6);  // beyond the range of a simulation: finite, and near
}

TEST(Elementary, floats_are_the_nearest) {
  Random random(3);
  int other = 0;
  for (int i = 0; i < 200000; ++i) {
    const float x = 8 * random.uniform() - 4;
    other += portable::sin(x) != static_cast<float>(std::sin(static_cast<long double>(x)));
    other += portable::cos(x) != static_cast<float>(std::cos(static_cast<long double>(x)));
  }
  EXPECT_LE(other, 1);
}

}  // namespace
}  // namespace catgut
