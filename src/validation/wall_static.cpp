// SPDX-License-Identifier: Apache-2.0
// validation: see the header.
#include "validation/wall_static.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>

namespace catgut::validation {

using Eigen::Vector3d, Eigen::VectorXd;
using wall::kNone;
using wall::scalar::Turn;
using Double3 = wall::scalar::Vec3Of<double>;

namespace {

Vector3d point_of(const wall::Weights& w, const VectorXd& x) {
  Vector3d p = Vector3d::Zero();
  for (int k = 0; k < 4; ++k)
    p += static_cast<double>(w.weight[k]) *
         (x.segment<3>(6 * w.column[k]) + static_cast<double>(w.zeta) * x.segment<3>(6 * w.column[k] + 3));
  return p;
}
void add_force(const wall::Weights& w, const Vector3d& f, VectorXd& to) {
  for (int k = 0; k < 4; ++k) {
    to.segment<3>(6 * w.column[k]) += static_cast<double>(w.weight[k]) * f;
    to.segment<3>(6 * w.column[k] + 3) += static_cast<double>(w.weight[k] * w.zeta) * f;
  }
}
VectorXd element_force_of(const wall::ElementRest& e, const VectorXd& x, Turn<double>& turn, double& energy) {
  const long n = x.size() / 6;
  Double3 mid[4]{}, dir[4]{};
  for (long i = 0; i < n; ++i)
    mid[i] = {x[6 * i], x[6 * i + 1], x[6 * i + 2]}, dir[i] = {x[6 * i + 3], x[6 * i + 4], x[6 * i + 5]};
  const auto get = [&](uint32_t k) { return e.constant[k]; };
  const auto modes = n == 4 ? wall::scalar::quad_modes(mid, dir, 0.25) : wall::scalar::triangle_modes(mid, dir, 0.5, 1.0 / 3);
  const auto f = wall::scalar::element_force(get, modes, turn, 5, &energy);
  Double3 fm[4], fd[4];
  if (n == 4) {
    wall::scalar::quad_corners(f, 0.25, fm, fd);
    wall::scalar::guard_corners<4>(get, mid, dir, fm, fd, &energy);
  } else {
    wall::scalar::triangle_corners(f, 0.5, 1.0 / 3, fm, fd);
    wall::scalar::guard_corners<3>(get, mid, dir, fm, fd, &energy);
  }
  VectorXd out(x.size());
  for (long i = 0; i < n; ++i) {
    out.segment<3>(6 * i) << fm[i].x, fm[i].y, fm[i].z;
    out.segment<3>(6 * i + 3) << fd[i].x, fd[i].y, fd[i].z;
  }
  return out;
}

}  // namespace

StaticWall::StaticWall(const wall::Wall& w) : wall_(w) {
  const wall::Mesh& mesh = w.model.mesh;
  const size_t n = mesh.outer.size();
  x_.resize(static_cast<long>(6 * n));
  std::vector<Vec3> mid(n), dir(n);
  for (size_t c = 0; c < n; ++c) {
    mid[c] = (mesh.outer[c] + mesh.inner[c]) * 0.5f, dir[c] = (mesh.outer[c] - mesh.inner[c]) * 0.5f;
    for (int k = 0; k < 3; ++k) x_[static_cast<long>(6 * c) + k] = mid[c][k], x_[static_cast<long>(6 * c) + 3 + k] = dir[c][k];
  }
  held_ = mesh.held;
  for (size_t f = 0; f < mesh.face.size(); ++f) {
    std::vector<uint32_t> corner;
    for (const uint32_t c : mesh.face[f])
      if (c != kNone) corner.push_back(c);
    std::vector<Vec3> p, d;
    for (const uint32_t c : corner) p.push_back(mid[c]), d.push_back(dir[c]);
    rest_.push_back(wall::element_rest(p, d, mesh.along[f], w.model.laminate, mesh.name));
    turn_.push_back(rest_.back().turn);
    corner_.push_back(corner);
  }
}

void StaticWall::start_from(const wall::State& s) {
  for (size_t i = 0; i < s.motion.x.size(); ++i)
    for (int k = 0; k < 3; ++k) x_[static_cast<long>(3 * i) + k] = static_cast<double>(wall::vec3(s.motion.x[i])[k]);
  for (size_t f = 0; f < turn_.size(); ++f) {
    const uint32_t lane = wall_.model.lane_of_face[f];
    const wall::BlockTurn& t = s.motion.turn[lane / wall::kLanesOfBlock];
    const uint32_t in = lane % wall::kLanesOfBlock;
    turn_[f] = {t.x[in], t.y[in], t.z[in], t.w[in]};
  }
}

Vector3d StaticWall::at(const wall::Weights& w) const { return point_of(w, x_); }
std::vector<std::array<long, 2>> StaticWall::links(const StaticString& s) {
  const long n = static_cast<long>(s.through.size());
  std::vector<std::array<long, 2>> out;
  for (long i = 0; i + 1 < n; ++i) out.push_back({i, i + 1});
  if (s.end.empty()) out.push_back({n - 1, 0});
  else out.push_back({-1, 0}), out.push_back({n - 1, -2});
  return out;
}
double StaticWall::length(const StaticString& s) const {
  const auto where = [&](long i) { return i < 0 ? s.end[static_cast<size_t>(-1 - i)] : at(s.through[static_cast<size_t>(i)]); };
  double sum = 0;
  for (const auto& [i, j] : links(s)) sum += (where(j) - where(i)).norm();
  return sum;
}
double StaticWall::tension(const StaticString& s) const { return s.stiffness * std::max(0.0, length(s) - s.length); }

double StaticWall::energy_and_force(const VectorXd& x, VectorXd* force, bool keep_turns) {
  double sum = 0;
  if (force) force->setZero(x.size());
  for (size_t f = 0; f < rest_.size(); ++f) {
    VectorXd local(static_cast<long>(6 * corner_[f].size()));
    for (size_t i = 0; i < corner_[f].size(); ++i) local.segment<6>(static_cast<long>(6 * i)) = x.segment<6>(6 * corner_[f][i]);
    Turn<double> turn = turn_[f];
    double energy = 0;
    const VectorXd g = element_force_of(rest_[f], local, turn, energy);
    if (keep_turns) turn_[f] = turn;
    sum += energy;
    if (force)
      for (size_t i = 0; i < corner_[f].size(); ++i)
        force->segment<6>(6 * corner_[f][i]) += g.segment<6>(static_cast<long>(6 * i));
  }
  for (const StaticLoad& l : load_) {
    sum -= l.force.dot(point_of(l.at, x));
    if (force) add_force(l.at, l.force, *force);
  }
  for (const StaticString& s : string_) {
    const auto where = [&](long i) {
      return i < 0 ? s.end[static_cast<size_t>(-1 - i)] : point_of(s.through[static_cast<size_t>(i)], x);
    };
    double length = 0;
    for (const auto& [i, j] : links(s)) length += (where(j) - where(i)).norm();
    const double over = std::max(0.0, length - s.length);
    sum += 0.5 * s.stiffness * over * over;
    if (force)
      for (const auto& [i, j] : links(s)) {
        const Vector3d u = (where(j) - where(i)).normalized() * (s.stiffness * over);
        if (i >= 0) add_force(s.through[static_cast<size_t>(i)], u, *force);
        if (j >= 0) add_force(s.through[static_cast<size_t>(j)], -u, *force);
      }
  }
  if (force)
    for (size_t c = 0; c < held_.size(); ++c)
      if (held_[c]) force->segment<6>(static_cast<long>(6 * c)).setZero();
  return sum;
}

double StaticWall::solve(const std::vector<StaticLoad>& load, const std::vector<StaticString>& string, double string_from,
                         int steps) {
  using Sparse = Eigen::SparseMatrix<double>;
  std::vector<long> dof(held_.size(), -1);
  long unknowns = 0;
  for (size_t c = 0; c < held_.size(); ++c)
    if (!held_[c]) dof[c] = unknowns, unknowns += 6;
  double residual = 1;
  for (int step = 1; step <= steps; ++step) {
    const double part = static_cast<double>(step) / steps;
    load_ = load, string_ = string;
    for (StaticLoad& l : load_) l.force *= part;
    for (StaticString& s : string_) s.length = string_from + part * (s.length - string_from);
    VectorXd force;
    double energy = energy_and_force(x_, &force, true);
    for (int newton = 0; newton < 40; ++newton) {
      std::vector<Eigen::Triplet<double>> entry;
      for (size_t f = 0; f < rest_.size(); ++f) {
        const auto& corner = corner_[f];
        const long n = static_cast<long>(6 * corner.size());
        VectorXd local(n);
        for (size_t i = 0; i < corner.size(); ++i) local.segment<6>(static_cast<long>(6 * i)) = x_.segment<6>(6 * corner[i]);
        Eigen::MatrixXd k(n, n);
        const double eps = 1e-8;  // [m]
        for (long j = 0; j < n; ++j) {
          VectorXd a = local, b = local;
          a[j] += eps, b[j] -= eps;
          Turn<double> ta = turn_[f], tb = turn_[f];
          double unused;
          k.col(j) = (element_force_of(rest_[f], b, tb, unused) - element_force_of(rest_[f], a, ta, unused)) / (2 * eps);
        }
        for (long i = 0; i < n; ++i)
          for (long j = 0; j < n; ++j) {
            const long r = dof[corner[static_cast<size_t>(i / 6)]], c = dof[corner[static_cast<size_t>(j / 6)]];
            if (r >= 0 && c >= 0 && r + i % 6 >= c + j % 6) entry.emplace_back(r + i % 6, c + j % 6, 0.5 * (k(i, j) + k(j, i)));
          }
      }
      // Strings: k g g' and the tension's own stiffness, by points and then by columns.
      for (const StaticString& s : string_) {
        const long n = static_cast<long>(s.through.size());
        Eigen::MatrixXd h = Eigen::MatrixXd::Zero(3 * n, 3 * n);
        VectorXd g = VectorXd::Zero(3 * n);
        double length = 0;
        for (int pass = 0; pass < 2; ++pass)
          for (const auto& [i, j] : links(s)) {
            const auto where = [&](long k) {
              return k < 0 ? s.end[static_cast<size_t>(-1 - k)] : point_of(s.through[static_cast<size_t>(k)], x_);
            };
            const Vector3d d = where(j) - where(i);
            const double l = d.norm();
            if (pass == 0) {
              length += l;
              if (j >= 0) g.segment<3>(3 * j) += d / l;
              if (i >= 0) g.segment<3>(3 * i) -= d / l;
              continue;
            }
            const double t = s.stiffness * std::max(0.0, length - s.length);
            const Eigen::Matrix3d m = t / l * (Eigen::Matrix3d::Identity() - d * d.transpose() / (l * l));
            if (i >= 0) h.block<3, 3>(3 * i, 3 * i) += m;
            if (j >= 0) h.block<3, 3>(3 * j, 3 * j) += m;
            if (i >= 0 && j >= 0) h.block<3, 3>(3 * i, 3 * j) -= m, h.block<3, 3>(3 * j, 3 * i) -= m;
          }
        if (length > s.length) h += s.stiffness * g * g.transpose();
        else h.setZero();
        for (long a = 0; a < n; ++a)
          for (long b = 0; b < n; ++b)
            for (int i = 0; i < 4; ++i)
              for (int j = 0; j < 4; ++j) {
                const wall::Weights &wa = s.through[static_cast<size_t>(a)], &wb = s.through[static_cast<size_t>(b)];
                const long r = dof[wa.column[i]], c = dof[wb.column[j]];
                if (r < 0 || c < 0 || wa.weight[i] == 0 || wb.weight[j] == 0) continue;
                for (long p = 0; p < 6; ++p)
                  for (long q = 0; q < 6; ++q) {
                    const double weight = static_cast<double>(wa.weight[i] * wb.weight[j]) *
                                          static_cast<double>((p < 3 ? 1 : wa.zeta) * (q < 3 ? 1 : wb.zeta));
                    if (weight != 0 && r + p >= c + q)
                      entry.emplace_back(r + p, c + q, weight * h(3 * a + p % 3, 3 * b + q % 3));
                  }
              }
      }
      VectorXd rhs(unknowns);
      for (size_t c = 0; c < held_.size(); ++c)
        if (dof[c] >= 0) rhs.segment<6>(dof[c]) = force.segment<6>(static_cast<long>(6 * c));
      Sparse k(unknowns, unknowns);
      k.setFromTriplets(entry.begin(), entry.end());
      Eigen::SimplicialLLT<Sparse, Eigen::Lower> llt;
      llt.analyzePattern(k);
      for (double shift = 0; shift < 1e6; shift = shift == 0 ? 1 : 4 * shift) {  // [N/m]
        llt.setShift(shift);
        llt.factorize(k);
        if (llt.info() == Eigen::Success) break;
      }
      const VectorXd d = llt.solve(rhs);
      // Backtrack until the energy falls.
      double scale = 1;
      for (int tries = 0; tries < 20; ++tries, scale *= 0.5) {
        VectorXd trial = x_;
        for (size_t c = 0; c < held_.size(); ++c)
          if (dof[c] >= 0) trial.segment<6>(static_cast<long>(6 * c)) += scale * d.segment<6>(dof[c]);
        const double now = energy_and_force(trial, nullptr, false);
        if (now <= energy + 1e-13 * std::abs(energy) + 1e-18) {
          x_ = trial;
          break;
        }
      }
      energy = energy_and_force(x_, &force, true);
      double loads = 1e-9;
      for (const StaticLoad& l : load_) loads += l.force.norm();
      for (const StaticString& s : string_) loads += tension(s);
      residual = force.norm() / loads;
      if (residual < 1e-8 || (d * scale).norm() < 1e-13) break;
    }
  }
  return residual;
}

}  // namespace catgut::validation
