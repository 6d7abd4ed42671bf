// SPDX-License-Identifier: Apache-2.0
// tests of solver/thread_columns: the partitioned system against a dense solve.
#include "solver/thread_columns.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "core/random.h"

namespace catgut {
namespace {

template <typename T, size_t kRight>
double worst_error(size_t count, double coupling, double reserve, PartitionedTridiagonal<T, kRight>& s) {
  Random r(count);
  const Eigen::Index n = static_cast<Eigen::Index>(count);
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(n, n), right(n, static_cast<Eigen::Index>(kRight));
  std::vector<double> off(count + 1, 0);
  for (size_t i = 1; i < count; ++i) off[i] = -coupling * static_cast<double>(r.uniform());
  for (size_t i = 0; i < count; ++i) {
    const Eigen::Index k = static_cast<Eigen::Index>(i);
    s.diag[i] = static_cast<T>(reserve - off[i] - off[i + 1]);
    s.off[i] = static_cast<T>(off[i + 1]);
    matrix(k, k) = double{s.diag[i]};
    if (i + 1 < count) matrix(k, k + 1) = matrix(k + 1, k) = double{s.off[i]};
    for (size_t j = 0; j < kRight; ++j) {
      s.right[j][i] = static_cast<T>(r.normal());
      right(k, static_cast<Eigen::Index>(j)) = double{s.right[j][i]};
    }
  }
  const Eigen::MatrixXd want = matrix.ldlt().solve(right);
  solve_partitions(s, count);
  double worst = 0;
  for (size_t j = 0; j < kRight; ++j)
    for (size_t i = 0; i < count; ++i)
      worst =
          std::max(worst, std::abs(double{s.right[j][i]} - want(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j))));
  return worst / want.cwiseAbs().maxCoeff();
}

TEST(PartitionedTridiagonal, agree_with_a_dense_solve) {
  PartitionedTridiagonal<double, 1> stretch;
  PartitionedTridiagonal<float, 3> motion;
  stretch.resize(500), motion.resize(500);
  // Longer and shorter alternately: data of a longer system must not affect a shorter one.
  for (const size_t count : {500u, 1u, 2u, 3u, 7u, 8u, 9u, 15u, 16u, 17u, 64u, 101u, 174u, 175u, 500u, 23u}) {
    EXPECT_LT(worst_error(count, 1, 1e-3, stretch), 1e-10) << count;
    EXPECT_LT(worst_error(count, 1, 1e-6, stretch), 1e-8) << count << ", the softest mode of a straight thread";
    EXPECT_LT(worst_error(count, 1000, 1, motion), 1e-3) << count;
    EXPECT_LT(worst_error(count, 1e-4, 1, motion), 1e-6) << count << ", hardly coupled: influences die away";
  }
}

}  // namespace
}  // namespace catgut
