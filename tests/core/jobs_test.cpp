// SPDX-License-Identifier: Apache-2.0
// tests/core: the fork-join, the hash and the random numbers on which reproducibility depends.
#include "core/jobs.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <vector>

#include "core/hash.h"
#include "core/random.h"

namespace catgut {
namespace {

TEST(Jobs, every_index_exactly_once_for_any_number_of_workers) {
  for (const int threads : {1, 2, 3, 5}) {
    Jobs jobs(threads);
    for (const size_t count : {0ul, 1ul, 7ul, 256ul, 257ul, 5000ul})
      for (const size_t block : {1ul, 16ul, 256ul}) {
        std::vector<std::atomic<int>> touched(count);
        std::atomic<bool> in_order{true};
        jobs.each(count, block, [&](size_t first, size_t last) {
          if (first % block != 0 || last <= first || last - first > block || last > count) in_order = false;
          for (size_t i = first; i < last; ++i) touched[i].fetch_add(1);
        });
        EXPECT_TRUE(in_order.load());
        for (size_t i = 0; i < count; ++i)
          ASSERT_EQ(touched[i].load(), 1) << threads << " threads, index " << i << " of " << count;
      }
  }
}

TEST(Jobs, what_a_job_wrote_is_seen_by_the_caller_and_by_the_next_job) {
  Jobs jobs(2);
  std::vector<double> a(1000), b(1000);
  for (int round = 0; round < 300; ++round) {
    jobs.each(a.size(), 100, [&](size_t first, size_t last) {
      for (size_t i = first; i < last; ++i) a[i] = round + static_cast<double>(i);
    });
    jobs.each(b.size(), 100, [&](size_t first, size_t last) {
      for (size_t i = first; i < last; ++i) b[i] = a[a.size() - 1 - i];
    });
    for (size_t i = 0; i < b.size(); ++i) ASSERT_EQ(b[i], round + static_cast<double>(b.size() - 1 - i));
  }
}

TEST(Jobs, many_tiny_jobs) {
  for (const int threads : {1, 2, 4}) {
    Jobs jobs(threads);
    std::atomic<size_t> sum{0};
    for (int i = 0; i < 5000; ++i) jobs.each(3, 1, [&](size_t first, size_t last) { sum += last - first; });
    EXPECT_EQ(sum.load(), 15000u);
  }
}

TEST(Jobs, the_number_of_threads_is_bounded) {
  EXPECT_EQ(Jobs(0).threads(), 1);
  EXPECT_EQ(Jobs(-3).threads(), 1);
  EXPECT_EQ(Jobs(2).threads(), 2);
}

TEST(Jobs, workers_that_fell_asleep_wake_for_the_next_job) {
  Jobs jobs(2);
  for (int round = 0; round < 3; ++round) {
    // Far longer than a worker spins.
    const auto until = std::chrono::steady_clock::now() + std::chrono::milliseconds(20);
    while (std::chrono::steady_clock::now() < until) {}
    std::atomic<int> done{0};
    jobs.each(64, 1, [&](size_t, size_t) { ++done; });
    EXPECT_EQ(done.load(), 64);
  }
}

TEST(Hash, is_the_published_function) {
  EXPECT_EQ(hash_bytes("", 0), 0x2d06800538d394c2ull);  // XXH3_64bits of an empty input
  EXPECT_NE(hash_bytes("catgut", 6), hash_bytes("catguu", 6));
  EXPECT_NE(hash_bytes("catgut", 6, 1), hash_bytes("catgut", 6, 2));
  EXPECT_EQ(hash_bytes("catgut", 6, 7), hash_bytes("catgut", 6, 7));
}

TEST(Random, the_same_seed_gives_the_same_numbers_and_its_state_is_one_integer) {
  Random a(42), b(42), c(43);
  bool differs = false;
  for (int i = 0; i < 100; ++i) {
    const uint32_t x = a.next();
    EXPECT_EQ(x, b.next());
    differs |= x != c.next();
  }
  EXPECT_TRUE(differs);
  Random later;
  later.state = a.state;
  EXPECT_EQ(later.next(), a.next());
}

TEST(Random, uniform_and_normal_have_their_moments) {
  Random r(1);
  double sum = 0, square = 0, flat = 0;
  const int n = 20000;
  for (int i = 0; i < n; ++i) {
    const float u = r.uniform();
    ASSERT_GE(u, 0.0f);
    ASSERT_LT(u, 1.0f);
    flat += double{u};
    const double g = double{r.normal()};
    ASSERT_LE(std::abs(g), 6.0);
    sum += g, square += g * g;
  }
  EXPECT_NEAR(flat / n, 0.5, 0.01);  // five standard errors
  EXPECT_NEAR(sum / n, 0.0, 0.036);
  EXPECT_NEAR(square / n, 1.0, 0.05);
}

}  // namespace
}  // namespace catgut
