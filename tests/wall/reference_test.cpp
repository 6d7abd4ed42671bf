// SPDX-License-Identifier: Apache-2.0
// tests/wall: the wall compared with independent finite elements: three-dimensional Lagrange hexahedra with full Gauss
// integration on the true cylinder, linear, in double precision. Quadratic ones, refined, are the reference; trilinear ones on
// the wall's own mesh are a common choice in research. Small loads: poke on the flank and at the rim, pull, pinch.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <Eigen/SparseCholesky>
#include <array>
#include <cmath>
#include <cstdio>
#include <map>
#include <vector>

#include "wall/points.h"

namespace catgut::wall {
namespace {

constexpr double kTurn = 6.283185307179586, kE = 6e5, kNu = 0.45, kOuter = 0.020, kThickness = 0.0025, kLength = 0.070;

double lagrange(int order, int i, double x, bool slope) {  // on nodes -1..1
  const auto node = [&](int k) { return -1 + 2.0 * k / order; };
  double value = 1, sum = 0;
  for (int k = 0; k <= order; ++k) {
    if (k == i) continue;
    value *= (x - node(k)) / (node(i) - node(k));
    double part = 1 / (node(i) - node(k));
    for (int l = 0; l <= order; ++l)
      if (l != i && l != k) part *= (x - node(l)) / (node(i) - node(l));
    sum += part;
  }
  return slope ? sum : value;
}

// Half a tube, theta 0..pi with mirrors at both ends, z 0..-70 mm (far end held), through the thickness from outside to inside.
class HexTube {
 public:
  HexTube(int order, int around, int along, int through)
      : p_(order), na_(around * order + 1), nz_(along * order + 1), nt_(through * order + 1) {
    const long n = static_cast<long>(na_) * nz_ * nt_;
    x_.resize(static_cast<size_t>(n));
    for (int a = 0; a < na_; ++a)
      for (int z = 0; z < nz_; ++z)
        for (int t = 0; t < nt_; ++t) x_[id(a, z, t)] = place(a / double(na_ - 1), z / double(nz_ - 1), t / double(nt_ - 1));
    assemble(around, along, through);
  }
  // u: parts of the half turn, of the length and of the thickness.
  static Eigen::Vector3d place(double u, double v, double w) {
    const double r = kOuter - kThickness * w, angle = 0.5 * kTurn * u;
    return {r * std::cos(angle), r * std::sin(angle), -kLength * v};
  }
  struct At {
    std::vector<std::pair<size_t, double>> node;
  };
  At at(double u, double v, double w) const {
    const auto split = [&](double s, int n, int& first, double& local) {
      const int elements = (n - 1) / p_, e = std::min(elements - 1, static_cast<int>(s * elements));
      first = e * p_, local = 2 * (s * elements - e) - 1;
    };
    int a, z, t;
    double la, lz, lt;
    split(u, na_, a, la), split(v, nz_, z, lz), split(w, nt_, t, lt);
    At out;
    for (int i = 0; i <= p_; ++i)
      for (int j = 0; j <= p_; ++j)
        for (int k = 0; k <= p_; ++k)
          out.node.push_back(
              {id(a + i, z + j, t + k), lagrange(p_, i, la, false) * lagrange(p_, j, lz, false) * lagrange(p_, k, lt, false)});
    return out;
  }
  // Work-conjugate displacement of loads (mirrored: each stands for itself and its image).
  double solve(const std::vector<std::pair<At, Eigen::Vector3d>>& load) {
    Eigen::VectorXd f = Eigen::VectorXd::Zero(k_.rows());
    for (const auto& [where, force] : load)
      for (const auto& [node, weight] : where.node)
        for (int d = 0; d < 3; ++d)
          if (dof_[3 * node + d] >= 0) f[dof_[3 * node + d]] += weight * force[d];
    return f.dot(llt_.solve(f));
  }
  long unknowns() const { return k_.rows(); }

 private:
  size_t id(int a, int z, int t) const { return (static_cast<size_t>(a) * nz_ + z) * nt_ + t; }
  void assemble(int around, int along, int through) {
    dof_.assign(3 * x_.size(), 0);
    for (int a = 0; a < na_; ++a)
      for (int z = 0; z < nz_; ++z)
        for (int t = 0; t < nt_; ++t) {
          const size_t n = 3 * id(a, z, t);
          if (z == nz_ - 1) dof_[n] = dof_[n + 1] = dof_[n + 2] = -1;
          if (a == 0 || a == na_ - 1) dof_[n + 1] = -1;
        }
    long count = 0;
    for (long& d : dof_)
      if (d >= 0) d = count++;
    const double g = kE / (2 * (1 + kNu)), lambda = kE * kNu / ((1 + kNu) * (1 - 2 * kNu));
    const std::array<double, 3> gauss3{-std::sqrt(0.6), 0, std::sqrt(0.6)}, weight3{5.0 / 9, 8.0 / 9, 5.0 / 9};
    const std::array<double, 3> gauss2{-1 / std::sqrt(3.0), 1 / std::sqrt(3.0), 0}, weight2{1, 1, 0};
    const auto &gauss = p_ == 2 ? gauss3 : gauss2, &weight = p_ == 2 ? weight3 : weight2;
    const int q = p_ + 1, n = (p_ + 1) * (p_ + 1) * (p_ + 1);
    std::vector<Eigen::Triplet<double>> entry;
    for (int ea = 0; ea < around; ++ea)
      for (int ez = 0; ez < along; ++ez)
        for (int et = 0; et < through; ++et) {
          if (ea > 0) {  // every element of a ring is the first one turned
            continue;
          }
          std::vector<size_t> node;
          for (int i = 0; i <= p_; ++i)
            for (int j = 0; j <= p_; ++j)
              for (int k = 0; k <= p_; ++k) node.push_back(id(i, ez * p_ + j, et * p_ + k));
          Eigen::MatrixXd stiffness = Eigen::MatrixXd::Zero(3 * n, 3 * n);
          for (int a = 0; a < q; ++a)
            for (int b = 0; b < q; ++b)
              for (int c = 0; c < q; ++c) {
                Eigen::MatrixXd slope(n, 3);
                int m = 0;
                for (int i = 0; i <= p_; ++i)
                  for (int j = 0; j <= p_; ++j)
                    for (int k = 0; k <= p_; ++k, ++m)
                      for (int d = 0; d < 3; ++d)
                        slope(m, d) = lagrange(p_, i, gauss[a], d == 0) * lagrange(p_, j, gauss[b], d == 1) *
                                      lagrange(p_, k, gauss[c], d == 2);
                Eigen::Matrix3d jacobian = Eigen::Matrix3d::Zero();
                for (m = 0; m < n; ++m) jacobian += x_[node[m]] * slope.row(m);
                const Eigen::MatrixXd grad = slope * jacobian.inverse();
                const double w = weight[a] * weight[b] * weight[c] * std::abs(jacobian.determinant());
                for (int i = 0; i < n; ++i)
                  for (int j = 0; j < n; ++j) {
                    const Eigen::Vector3d gi = grad.row(i), gj = grad.row(j);
                    stiffness.block<3, 3>(3 * i, 3 * j) += w * (lambda * gi * gj.transpose() + g * gj * gi.transpose() +
                                                                g * gi.dot(gj) * Eigen::Matrix3d::Identity());
                  }
              }
          for (int turn = 0; turn < around; ++turn) {
            const double angle = 0.5 * kTurn * turn / around;
            const Eigen::Matrix3d r = Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()).toRotationMatrix();
            for (int i = 0; i < n; ++i)
              for (int j = 0; j < n; ++j) {
                const Eigen::Matrix3d k = r * stiffness.block<3, 3>(3 * i, 3 * j) * r.transpose();
                const size_t ni = node[i] + id(turn * p_, 0, 0), nj = node[j] + id(turn * p_, 0, 0);
                for (int a = 0; a < 3; ++a)
                  for (int b = 0; b < 3; ++b) {
                    const long row = dof_[3 * ni + a], column = dof_[3 * nj + b];
                    if (row >= column && column >= 0) entry.emplace_back(row, column, k(a, b));
                  }
              }
          }
        }
    k_.resize(count, count);
    k_.setFromTriplets(entry.begin(), entry.end());
    llt_.compute(k_);
  }
  int p_, na_, nz_, nt_;
  std::vector<Eigen::Vector3d> x_;
  std::vector<long> dof_;
  Eigen::SparseMatrix<double> k_;
  Eigen::SimplicialLLT<Eigen::SparseMatrix<double>> llt_;
};

struct Load {
  const char* name;
  // Places (parts of the half turn, of the length, of the thickness) with y >= 0, and their forces; images are implied.
  std::vector<std::pair<std::array<double, 3>, Eigen::Vector3d>> at;
};

std::vector<Load> loads() {
  std::vector<Load> out;
  const auto disc = [](const char* name, double angle, double z, double force) {
    Load l{name, {}};
    for (int i = -6; i <= 6; ++i)
      for (int j = 0; j <= 6; ++j) {
        const double dz = 0.00025 * i, dy = 0.00025 * (j + 0.5);
        if (dz * dz + dy * dy > 0.0015 * 0.0015 || z + dz > 0) continue;
        const double theta = angle > 0 ? 0.5 * kTurn - dy / kOuter : dy / kOuter;
        l.at.push_back({{theta / (0.5 * kTurn), -(z + dz) / kLength, 0}, {angle > 0 ? force : -force, 0, 0}});
      }
    for (auto& [where, f] : l.at) f /= 2.0 * static_cast<double>(l.at.size());
    return l;
  };
  out.push_back(disc("poke, flank", 0, -0.035, 1e-3));
  out.push_back(disc("poke, 2 mm from the rim", 0, -0.002, 1e-3));
  Load pull{"pull", {}};
  for (int i = 0; i < 64; ++i) pull.at.push_back({{(i + 0.5) / 64, 0, 0.5}, {0, 0, 0.1 / 128}});
  out.push_back(pull);
  Load pinch = disc("pinch at half length", 0, -0.035, 1e-3);
  const Load other = disc("", 1, -0.035, 1e-3);
  pinch.at.insert(pinch.at.end(), other.at.begin(), other.at.end());
  out.push_back(pinch);
  return out;
}

// [N/m] squared force over work.
double stiffness(HexTube& hex, const Load& l) {
  std::vector<std::pair<HexTube::At, Eigen::Vector3d>> load;
  double force = 0;
  for (const auto& [p, f] : l.at) load.push_back({hex.at(p[0], p[1], p[2]), f}), force += f.norm();
  return force * force / hex.solve(load) * 2;  // both halves
}
double stiffness(Wall w, const Load& l, double seconds) {
  std::vector<std::pair<Weights, Vec3>> load;
  double force = 0;
  for (const auto& [p, f] : l.at)
    for (const double side : {1.0, -1.0}) {
      const Eigen::Vector3d x = HexTube::place(side * p[0], p[1], p[2]);
      const Vec3 at{static_cast<float>(x[0]), static_cast<float>(x[1]), static_cast<float>(x[2])};
      load.push_back({weights(w.model, w.state.topology, nearest_point(w.model, w.state, at, static_cast<float>(1 - 2 * p[2]))),
                      Vec3{static_cast<float>(f[0]), static_cast<float>(f[1]), static_cast<float>(f[2])}});
      force += f.norm();
    }
  std::vector<Vec3> before;
  for (const auto& [at, f] : load) before.push_back(place(at, w.state.motion));
  Jobs jobs(1);
  Column<Float4> each(w.state.motion.x.size());
  const float larger = 20;  // single precision needs deflections of some tens of micrometers; still linear
  for (const auto& [at, f] : load) add_to(each, at, f * larger);
  for (int i = 0; i < static_cast<int>(seconds * 1000); ++i) {
    w.scratch.external = each;
    begin_step(w.model, w.state, w.scratch, jobs);
    finish_step(w.model, w.state, jobs);
  }
  double work = 0;
  for (size_t i = 0; i < load.size(); ++i)
    work += static_cast<double>(dot(load[i].second, place(load[i].first, w.state.motion) - before[i])) /
            static_cast<double>(larger);
  return force * force / work;
}

Wall tube_wall(int around, int rings) {
  Spec s;
  TubeShape shape;
  shape.around = around, shape.rings = rings, shape.axis = {0, 0, 1};
  s.mesh = tube(shape);
  s.drag = 20;
  return build_wall(s);
}

TEST(Reference, finite_elements_that_share_nothing_with_the_wall_agree) {
  const bool lengthy = std::getenv("CATGUT_LONG") != nullptr;
  HexTube reference(2, lengthy ? 32 : 16, lengthy ? 36 : 18, 1), plain(1, 16, 18, 1);
  const Wall x1 = tube_wall(32, 19), x4 = tube_wall(64, 37);
  std::printf("stiffness [N/m] %28s %9s %9s %16s\n", "H27, refined", "wall x1", "wall x4", "trilinear hex x1");
  for (const Load& l : loads()) {
    const double want = stiffness(reference, l), got1 = stiffness(x1, l, 1.0), got4 = stiffness(x4, l, 1.0),
                 hex = stiffness(plain, l);
    std::printf("%-28s %16.1f %9.1f %9.1f %16.1f   ratios %.3f %.3f %.3f\n", l.name, want, got1, got4, hex, got1 / want,
                got4 / want, hex / want);
    EXPECT_NEAR(got1 / want, 1, 0.10) << l.name;
    EXPECT_NEAR(got4 / want, 1, 0.10) << l.name;
  }
}

}  // namespace
}  // namespace catgut::wall
