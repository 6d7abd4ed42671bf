// SPDX-License-Identifier: Apache-2.0
// tests/solver: shape matching against references in double precision: polar decomposition, rows, workers.
#include "solver/shape_match.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cstring>

#include "core/jobs.h"
#include "core/random.h"
#include "solver/substep.h"

namespace catgut {
namespace {

Eigen::Vector3d eigen(Vec3 p) { return {p.x, p.y, p.z}; }

struct Cluster {
  std::vector<Vec3> rest;
  std::vector<float> mass;
  ShapeModel model;
  ClusterRotations rotation;
  ShapeScratch scratch;
  explicit Cluster(std::vector<Vec3> r, std::vector<float> m = {}) : rest(std::move(r)), mass(std::move(m)) {
    if (mass.empty()) mass.assign(rest.size(), 1.0f);
    std::vector<std::vector<uint32_t>> all(1);
    for (uint32_t i = 0; i < rest.size(); ++i) all[0].push_back(i);
    model = make_shape_model(rest, mass, all);
    rotation.reset(1);
    scratch.resize(model);
  }
  void settle(const std::vector<Vec3>& at, int steps) {
    Column<Vec4> x;
    for (const Vec3& p : at) x.push_back(point(p));
    make_shape_rows(model, x.data(), scratch, 0, model.groups);
    for (int i = 0; i < steps; ++i) solve_shape_clusters(model, rotation, scratch, 0, 1);
  }
  Eigen::Matrix3d found() const {
    const float* f = scratch.transform[0].f;
    Eigen::Matrix3d r;
    for (int column = 0; column < 3; ++column)
      for (int row = 0; row < 3; ++row) r(row, column) = double{f[4 * column + row]};
    return r;
  }
  // The rotation nearest to A = sum m (x - c) q^T, by SVD in double precision; the best one with determinant +1.
  Eigen::Matrix3d wanted(const std::vector<Vec3>& at, double* gap = nullptr) const {
    Eigen::Vector3d c = Eigen::Vector3d::Zero(), q0 = c;
    double total = 0;
    for (size_t i = 0; i < at.size(); ++i)
      c += mass[i] * eigen(at[i]), q0 += mass[i] * eigen(rest[i]), total += double{mass[i]};
    c /= total, q0 /= total;
    Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
    for (size_t i = 0; i < at.size(); ++i) a += mass[i] * (eigen(at[i]) - c) * (eigen(rest[i]) - q0).transpose();
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(a, Eigen::ComputeFullU | Eigen::ComputeFullV);
    Eigen::Vector3d sign(1, 1, (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1);
    // Conditioning of the rotation: the minimum of the sums of two singular values, over the maximum.
    if (gap) *gap = (svd.singularValues()[1] + sign[2] * svd.singularValues()[2]) / svd.singularValues()[0];
    return svd.matrixU() * sign.asDiagonal() * svd.matrixV().transpose();
  }
};

double angle(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) { return Eigen::AngleAxisd(a.transpose() * b).angle(); }

Quat random_rotation(Random& r) { return normalized(Quat{r.normal(), r.normal(), r.normal(), r.normal()}); }
std::vector<Vec3> cloud(Random& r, int n, Vec3 size) {
  std::vector<Vec3> p;
  for (int i = 0; i < n; ++i)
    p.push_back({(r.uniform() - 0.5f) * size.x, (r.uniform() - 0.5f) * size.y, (r.uniform() - 0.5f) * size.z});
  return p;
}

TEST(Polar, random_deformations_agree_with_svd) {
  Random r(3);
  for (int trial = 0; trial < 300; ++trial) {
    Cluster c(cloud(r, 15, {0.01f, 0.01f, 0.01f}));
    const Quat q = random_rotation(r);
    std::vector<Vec3> at;
    for (const Vec3& p : c.rest) at.push_back(rotate(q, p + Vec3{r.normal(), r.normal(), r.normal()} * 0.001f));
    double gap = 0;
    const Eigen::Matrix3d want = c.wanted(at, &gap);
    if (gap < 0.02) continue;
    c.settle(at, 60);
    EXPECT_LT(angle(c.found(), want), 2e-5 / gap) << "trial " << trial << ", gap " << gap;
  }
}

TEST(Polar, from_a_warm_start_one_step_is_enough) {
  Random r(4);
  for (int trial = 0; trial < 200; ++trial) {
    Cluster c(cloud(r, 15, {0.01f, 0.01f, 0.01f}));
    const Quat q = random_rotation(r);
    std::vector<Vec3> at, next;
    for (const Vec3& p : c.rest) at.push_back(rotate(q, p));
    c.settle(at, 60);
    // The rotation of tissue within a substep: a hundredth of a radian.
    const Quat more = axis_angle(normalized(Vec3{r.normal(), r.normal(), r.normal()}), 0.01f);
    for (const Vec3& p : at) next.push_back(rotate(more, p));
    c.settle(next, 1);
    EXPECT_LT(angle(c.found(), c.wanted(next)), 2e-5) << "trial " << trial;
  }
}

TEST(Polar, nearly_flat_clusters) {
  Random r(5);
  for (const float thickness : {1e-3f, 1e-5f, 0.0f})
    for (int trial = 0; trial < 100; ++trial) {
      Cluster c(cloud(r, 15, {0.01f, 0.01f, 0.01f * thickness}));
      const Quat q = random_rotation(r);
      std::vector<Vec3> at;
      for (const Vec3& p : c.rest) at.push_back(rotate(q, p) + Vec3{0.1f, -0.05f, 0.02f});
      c.settle(at, 80);
      double gap = 0;
      const Eigen::Matrix3d want = c.wanted(at, &gap);
      EXPECT_LT(angle(c.found(), want), 1e-4 / gap) << "thickness " << thickness << " trial " << trial;
    }
}

TEST(Polar, half_turns_are_found_in_the_end) {
  Random r(6);
  for (int trial = 0; trial < 100; ++trial) {
    Cluster c(cloud(r, 15, {0.01f, 0.008f, 0.006f}));
    const Quat q = axis_angle(normalized(Vec3{r.normal(), r.normal(), r.normal()}), kPi);
    std::vector<Vec3> at;
    for (const Vec3& p : c.rest) at.push_back(rotate(q, p));
    c.settle(at, 100);
    EXPECT_LT(angle(c.found(), c.wanted(at)), 1e-4) << "trial " << trial;
  }
}

TEST(Polar, a_cluster_shrunk_to_a_point_or_turned_inside_out_stays_a_rotation) {
  Random r(7);
  Cluster c(cloud(r, 15, {0.01f, 0.01f, 0.01f}));
  std::vector<Vec3> point_like(c.rest.size(), Vec3{0.3f, 0.1f, 0}), inside_out;
  for (const Vec3& p : c.rest) inside_out.push_back({-p.x, p.y, p.z});
  for (const auto& at : {point_like, inside_out}) {
    c.settle(at, 50);
    const Eigen::Matrix3d found = c.found();
    ASSERT_TRUE(found.allFinite());
    EXPECT_NEAR(found.determinant(), 1, 1e-5);
    EXPECT_LT((found.transpose() * found - Eigen::Matrix3d::Identity()).norm(), 1e-5);
  }
}

// The kernels against a plain reference in double precision: the same rotations, then the same positions.
void expect_kernels_equal_reference(const std::vector<std::vector<uint32_t>>& cluster) {
  Random r(8);
  const uint32_t n = static_cast<uint32_t>(cluster.size());
  std::vector<Vec3> rest = cloud(r, n, {0.05f, 0.05f, 0.05f});
  std::vector<float> mass, inv_mass;
  for (uint32_t i = 0; i < n; ++i) mass.push_back(0.5f + r.uniform()), inv_mass.push_back(i % 17 == 0 ? 0 : 1 / mass[i]);
  const ShapeModel model = make_shape_model(rest, mass, cluster);
  ShapeScratch scratch;
  scratch.resize(model);
  ClusterRotations rotation;
  rotation.reset(model.clusters);
  Column<Vec4> x;
  for (const Vec3& p : rest) x.push_back(point(p + Vec3{r.normal(), r.normal(), r.normal()} * 0.0005f));
  const Column<Vec4> before = x;
  make_shape_rows(model, x.data(), scratch, 0, model.groups);
  for (int i = 0; i < 30; ++i) solve_shape_clusters(model, rotation, scratch, 0, model.clusters);
  const float s = 0.7f, relaxation = 1.3f;
  for (uint32_t i = 0; i < n; ++i) scratch.moved[i] = {1e-4f, -2e-4f, 3e-4f, 0};
  solve_shape_particles(model, x.data(), inv_mass.data(), s, relaxation, scratch, 0, model.groups);

  std::vector<Eigen::Vector3d> goal(n, Eigen::Vector3d::Zero());
  std::vector<int> holders(n, 0);
  for (uint32_t c = 0; c < n; ++c) {
    Eigen::Vector3d mean = Eigen::Vector3d::Zero(), q0 = mean;
    double total = 0;
    for (uint32_t i : cluster[c])
      mean += mass[i] * eigen(xyz(before[i])), q0 += mass[i] * eigen(rest[i]), total += double{mass[i]};
    mean /= total, q0 /= total;
    const uint32_t k = model.cluster_of[c];
    const Eigen::Quaterniond q(rotation.w[k], rotation.x[k], rotation.y[k], rotation.z[k]);
    for (uint32_t i : cluster[c]) goal[i] += mean + q * (eigen(rest[i]) - q0), ++holders[i];
  }
  for (uint32_t i = 0; i < n; ++i) {
    const Eigen::Vector3d at = eigen(xyz(before[i])), moved(1e-4, -2e-4, 3e-4);
    const Eigen::Vector3d want =
        inv_mass[i] == 0
            ? at
            : Eigen::Vector3d(at + double{relaxation} * (double{s} * (goal[i] / holders[i] - at) - (1 - double{s}) * moved));
    EXPECT_LT((eigen(xyz(x[i])) - want).norm(), 1e-6) << "particle " << i;
    EXPECT_EQ(x[i].w, 1.0f);
  }
}

TEST(ShapeRows, kernels_equal_a_plain_scalar_reference) {
  Random r(8);
  const uint32_t n = 100;
  std::vector<std::vector<uint32_t>> cluster(n);
  for (uint32_t c = 0; c < n; ++c) {
    const uint32_t members = 5 + r.next() % 11;
    for (uint32_t k = 0; k < members; ++k) cluster[c].push_back((c + k * (1 + c % 3)) % n);
    std::sort(cluster[c].begin(), cluster[c].end());
    cluster[c].erase(std::unique(cluster[c].begin(), cluster[c].end()), cluster[c].end());
  }
  expect_kernels_equal_reference(cluster);
}

// A wall of two layers: partners share their clusters, of seven pairs each, and are moved several at a time, but not the
// pinned.
TEST(ShapeRows, kernels_equal_a_plain_scalar_reference_in_a_wall_of_two_layers) {
  for (const uint32_t pairs : {40u, 47u}) {
    std::vector<std::vector<uint32_t>> cluster(2 * pairs);
    for (uint32_t c = 0; c < 2 * pairs; ++c)
      for (uint32_t k = 0; k < 7; ++k)
        for (uint32_t side = 0; side < 2; ++side) cluster[c].push_back(2 * ((c / 2 + k * (1 + c / 2 % 3)) % pairs) + side);
    expect_kernels_equal_reference(cluster);
  }
}

TEST(ShapeRows, the_number_of_workers_does_not_change_a_bit) {
  Random r(9);
  const uint32_t n = 1500;
  const std::vector<Vec3> rest = cloud(r, n, {0.05f, 0.05f, 0.05f});
  const std::vector<float> mass(n, 0.001f), inv_mass(n, 1000.0f);
  std::vector<std::vector<uint32_t>> cluster(n);
  for (uint32_t c = 0; c < n; ++c)
    for (uint32_t k = 0; k < 12; ++k) cluster[c].push_back((c + k) % n);
  const ShapeModel model = make_shape_model(rest, mass, cluster);
  auto result = [&](int workers) {
    Random noise(10);
    Column<Vec4> x;
    for (const Vec3& p : rest) x.push_back(point(p + Vec3{noise.normal(), noise.normal(), noise.normal()} * 0.001f));
    Jobs jobs(workers);
    ShapeScratch scratch;
    scratch.resize(model);
    ClusterRotations rotation;
    rotation.reset(model.clusters);
    make_shape_rows(model, x.data(), scratch, 0, model.groups);
    for (int sweep = 0; sweep < 20; ++sweep) {
      jobs.each(model.clusters, 160, [&](size_t a, size_t b) {
        solve_shape_clusters(model, rotation, scratch, static_cast<uint32_t>(a), static_cast<uint32_t>(b));
      });
      jobs.each(model.groups, 256, [&](size_t a, size_t b) {
        solve_shape_particles(model, x.data(), inv_mass.data(), 0.6f, 1.3f, scratch, static_cast<uint32_t>(a),
                              static_cast<uint32_t>(b));
      });
    }
    return x;
  };
  const Column<Vec4> one = result(1), two = result(2), three = result(3);
  EXPECT_EQ(std::memcmp(one.data(), two.data(), n * sizeof(Vec4)), 0);
  EXPECT_EQ(std::memcmp(one.data(), three.data(), n * sizeof(Vec4)), 0);
}

TEST(Stiffness, converts_between_substeps_as_a_compliance) {
  for (const float s : {0.05f, 0.5f, 0.9f}) {
    EXPECT_FLOAT_EQ(stiffness_at(s, 1.0f / 480, 1.0f / 480), s);
    const float half = stiffness_at(s, 1.0f / 480, 1.0f / 960);
    // alpha / (w h^2) is four times as large at half the substep.
    EXPECT_NEAR((1 - half) / half, 4 * (1 - s) / s, 1e-4 * (1 - s) / s);
    EXPECT_NEAR(stiffness_at(half, 1.0f / 960, 1.0f / 480), s, 1e-6);
  }
  EXPECT_EQ(stiffness_at(1, 0.002f, 0.001f), 1);
  EXPECT_EQ(stiffness_at(0, 0.002f, 0.001f), 0);
}

}  // namespace
}  // namespace catgut
