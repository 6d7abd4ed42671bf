// SPDX-License-Identifier: Apache-2.0
// validation: the thread and the attachments: oscillator, hanging chain, catenary, bending.
#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <vector>

#include "validation/checks.h"

namespace catgut::validation {
namespace {

// Period of x(t) sampled every h, from its downward zero crossings by linear interpolation. Averages over `periods`.
double period_of(const std::function<double()>& next, double h, int periods) {
  double before = next(), first = -1;
  int crossings = 0;
  for (int i = 1; i < 100000; ++i) {
    const double now = next();
    if (before > 0 && now <= 0) {
      const double t = (i - 1 + before / (before - now)) * h;
      if (crossings == 0) first = t;
      else if (crossings == periods) return (t - first) / periods;
      ++crossings;
    }
    before = now;
  }
  return 0;
}

// A mass of 1 kg at x0 = 1.5 m on a spring of rest length 1 m and compliance 0.001 m/N, by the thread's distance constraint.
double thread_oscillator(bool direct, int sweeps, float h) {
  const std::vector<Vec3> start{{0, 0, 0}, {1.5f, 0, 0}};
  ThreadRig rig(start, 1, 1, false);
  rig.model.stretch_compliance = 0.001f;
  rig.model.direct = direct;
  rig.model.distance_sweeps = sweeps;
  return period_of([&] { return rig.step(h), double{rig.x[1].x} - 1; }, double{h}, 5);
}

// The same by an attachment to a fixed point.
double attachment_oscillator(int sweeps, float h) {
  Column<Vec4> x{point({1.5f, 0, 0})};
  const float w = 1;
  Vec3 v{};
  Attachment a;
  a.point = particle_point(0);
  a.target = {1, 0, 0};
  a.compliance = 0.001f;
  std::vector<RigidBody> none;
  return period_of(
      [&] {
        const Vec3 prev = xyz(x[0]);
        a.lambda = {};
        add(x[0], v * h);
        for (int s = 0; s < sweeps; ++s) solve_attachment(a, x.data(), &w, {}, none, h);
        v = (xyz(x[0]) - prev) / h;
        return double{x[0].x} - 1;
      },
      double{h}, 5);
}

std::vector<Vec3> line_of(int n, Vec3 step) {
  std::vector<Vec3> p;
  for (int i = 0; i < n; ++i) p.push_back(step * static_cast<float>(i));
  return p;
}

constexpr int kChain = 20;
constexpr double kChainGravity = 9.8, kChainCompliance = 1e-8, kFrame = 1.0 / 60;

// Reference for the hanging chain: implicit Euler solved by Newton's method on positions and multipliers together, in double
// precision and two dimensions, to round-off. Returns the force at the support [N] after every step.
std::vector<double> newton_chain(Vec3 step, double h, int frames) {
  const int n = kChain - 1, unknowns = 3 * n;
  const double alpha = kChainCompliance / (h * h), rest = length(step);
  Eigen::VectorXd x(2 * n), v = Eigen::VectorXd::Zero(2 * n);
  for (int i = 0; i < n; ++i) x[2 * i] = step.x * (i + 1), x[2 * i + 1] = step.y * (i + 1);
  std::vector<double> force;
  for (int f = 0; f < frames; ++f) {
    const Eigen::VectorXd start = x;
    Eigen::VectorXd predicted = x + v * h, lambda = Eigen::VectorXd::Zero(n);
    for (int i = 0; i < n; ++i) predicted[2 * i + 1] -= kChainGravity * h * h;
    x = predicted;
    for (int iteration = 0; iteration < 60; ++iteration) {
      Eigen::MatrixXd a = Eigen::MatrixXd::Zero(unknowns, unknowns);
      Eigen::VectorXd b = Eigen::VectorXd::Zero(unknowns);
      a.topLeftCorner(2 * n, 2 * n).setIdentity();
      b.head(2 * n) = predicted - x;
      for (int k = 0; k < n; ++k) {
        const Eigen::Vector2d at = x.segment<2>(2 * k),
                              before = k > 0 ? Eigen::Vector2d(x.segment<2>(2 * k - 2)) : Eigen::Vector2d(0, 0);
        const Eigen::Vector2d d = at - before;
        const double l = d.norm();
        const Eigen::Vector2d g = d / l;
        // The first iterations omit the geometric term: without it Newton converges from the prediction.
        const Eigen::Matrix2d s = (iteration > 2 ? lambda[k] / l : 0.0) * (Eigen::Matrix2d::Identity() - g * g.transpose());
        a.block<2, 2>(2 * k, 2 * k) -= s;
        a.block<2, 1>(2 * k, 2 * n + k) -= g;
        a.block<1, 2>(2 * n + k, 2 * k) += g.transpose();
        b.segment<2>(2 * k) += g * lambda[k];
        if (k > 0) {
          a.block<2, 2>(2 * k - 2, 2 * k - 2) -= s;
          a.block<2, 2>(2 * k - 2, 2 * k) += s;
          a.block<2, 2>(2 * k, 2 * k - 2) += s;
          a.block<2, 1>(2 * k - 2, 2 * n + k) += g;
          a.block<1, 2>(2 * n + k, 2 * k - 2) -= g.transpose();
          b.segment<2>(2 * k - 2) -= g * lambda[k];
        }
        a(2 * n + k, 2 * n + k) = alpha;
        b[2 * n + k] = -(l - rest) - alpha * lambda[k];
      }
      if (b.lpNorm<Eigen::Infinity>() < 1e-12) break;
      const Eigen::VectorXd d = a.partialPivLu().solve(b);
      x += d.head(2 * n);
      lambda += d.tail(n);
    }
    v = (x - start) / h;
    force.push_back(-lambda[0] / (h * h));
  }
  return force;
}

// Largest relative error of the force at the support over frames [first, frames).
double chain_error(Vec3 step, double h, bool direct, int sweeps, int first, const std::vector<double>& want) {
  ThreadRig rig(line_of(kChain, step), length(step), 1, false);
  rig.model.stretch_compliance = static_cast<float>(kChainCompliance);
  rig.model.direct = direct;
  rig.model.distance_sweeps = sweeps;
  rig.model.gravity = {0, static_cast<float>(-kChainGravity), 0};
  double worst = 0;
  for (size_t f = 0; f < want.size(); ++f) {
    rig.step(static_cast<float>(h));
    if (f >= static_cast<size_t>(first)) worst = std::max(worst, std::abs(rig.thread.tension[0] / want[f] - 1));
  }
  return worst;
}

// The same by sweeps of the same step in double precision.
double chain_error_in_double(double h, int sweeps, int first, const std::vector<double>& want) {
  const double alpha = kChainCompliance / (h * h);
  Eigen::MatrixXd x(2, kChain), v = Eigen::MatrixXd::Zero(2, kChain);
  for (int i = 0; i < kChain; ++i) x.col(i) = Eigen::Vector2d(i, 0);
  double worst = 0;
  for (size_t f = 0; f < want.size(); ++f) {
    const Eigen::MatrixXd before = x;
    v.row(1).array() -= kChainGravity * h;
    v.col(0).setZero();
    x += v * h;
    Eigen::VectorXd lambda = Eigen::VectorXd::Zero(kChain - 1);
    for (int sweep = 0; sweep < sweeps; ++sweep)
      for (int i = 0; i + 1 < kChain; ++i) {
        const Eigen::Vector2d d = x.col(i + 1) - x.col(i);
        const double l = d.norm(), w0 = i == 0 ? 0 : 1;
        const double step = distance_step(l, 1.0, w0 + 1, alpha, lambda[i]);
        lambda[i] += step;
        x.col(i) -= d * (w0 * step / l);
        x.col(i + 1) += d * (step / l);
      }
    v = (x - before) / h;
    if (f >= static_cast<size_t>(first)) worst = std::max(worst, std::abs(-lambda[0] / (h * h) / want[f] - 1));
  }
  return worst;
}

double bend_energy(const std::array<Vec3, 3>& p, double compliance) {
  const double c = double{dot(normalized(p[0] - p[1]), normalized(p[2] - p[1]))} + 1;
  return 0.5 * c * c / compliance;
}
std::array<Vec3, 3> bent(double degrees, float length_a, float length_c) {
  // 180: straight; 0: folded onto itself.
  const float a = static_cast<float>(degrees * 3.14159265358979 / 180);
  return {Vec3{length_a, 0, 0}, Vec3{}, Vec3{std::cos(a), std::sin(a), 0} * length_c};
}
double angle_of(const std::array<Vec3, 3>& p) {
  const Vec3 u = p[0] - p[1], v = p[2] - p[1];
  return std::atan2(double{length(cross(u, v))}, double{dot(u, v)}) * 180 / 3.14159265358979;
}

}  // namespace

void check_oscillator(Lines& out) {
  const double want = 2 * 3.14159265358979 * std::sqrt(0.001);
  const std::string source = "2 pi sqrt(m alpha), XPBD 2016 sec. 6.1; 8 substeps of 1/60 s";
  const float h = 1.0f / 480;
  out.add("oscillator period, attachment", want, attachment_oscillator(1, h), 0.01, "s", source);
  out.add("oscillator period, thread, sweeps", want, thread_oscillator(false, 1, h), 0.01, "s", source);
  out.add("oscillator period, thread, direct", want, thread_oscillator(true, 1, h), 0.01, "s", source);
  double low = 1e9, high = 0;
  for (int sweeps : {1, 4, 16})
    for (float dt : {1.0f / 480, 1.0f / 960, 1.0f / 1920})
      for (int kind = 0; kind < 3; ++kind) {
        const double p = kind == 0 ? attachment_oscillator(sweeps, dt) : thread_oscillator(kind == 2, sweeps, dt);
        low = std::min(low, p), high = std::max(high, p);
      }
  out.add("oscillator period, spread", 0, (high - low) / want, 0.01, "1", "sweeps 1, 4, 16 x substeps 1/480, 1/960, 1/1920 s");
}

void check_hanging_chain(Lines& out) {
  const int frames = 100, fallen = 10;
  const Vec3 level{1, 0, 0};
  const std::vector<double> want = newton_chain(level, kFrame, frames);
  // The paper gives 20 particles of 1 kg, compliance 1e-8 m/N and 100 frames, but not the start of the chain.
  // Assumed: 1 m spacing, released level, frames of 1/60 s without substeps, g 9.8. The first ten frames are omitted: the
  // force rises from zero and a relative error means little. A thousand sweeps are run in double precision, with the same step
  // of the same constraint. In float32, which the thread uses, the error is 2 % there for any chain length
  // (docs/solver.md). The product never uses that many sweeps.
  const std::string source = "XPBD 2016 sec. 6.2; assumed: released level, 1 m spacing, frames 10 to 100";
  struct Published {
    int sweeps;
    double error, tolerance;
  };
  for (const Published& p : {Published{50, 0.06, 0.2}, Published{100, 0.02, 0.4}})
    out.add("chain force error, " + std::to_string(p.sweeps) + " sweeps", p.error,
            chain_error(level, kFrame, false, p.sweeps, fallen, want), p.tolerance, "1", source);
  out.add("chain force error, 1000 sweeps in double", 0.005, chain_error_in_double(kFrame, 1000, fallen, want), 0.3, "1",
          source);
  // Falling, at the scenes' own substep. (At 1/60 s the whip of the chain rotates its segments by a third of a radian per step.
  // The geometric stiffness, which stabilizes fast taut thread, damps it: 5 % there.)
  const double substep = kFrame / 8;
  out.add("chain force error, direct, falling", 0,
          chain_error(level, substep, true, 1, 8 * fallen, newton_chain(level, substep, 8 * frames)), 0.05, "1",
          "Newton in double precision, same steps of 1/480 s");
  out.add("chain force error, direct, hanging at rest", 0,
          chain_error({0, -1, 0}, kFrame, true, 1, 0, newton_chain({0, -1, 0}, kFrame, frames)), 0.001, "1",
          "Newton in double precision, every frame");
}

void check_catenary(Lines& out) {
  struct Case {
    const char* what;
    int nodes;
    float spacing, mass, compliance, h;  // [m] [kg] [m/N] [s]
    int bend_sweeps;
    double span;
  };
  // A heavy chain of a meter, and the suture of the scenes at its own substep: light, finely divided, with bending.
  const Case chain{"1 m chain", 201, 0.005f, 0.001f, 0, 1.0f / 480, 0, 0},
      suture{"suture", 175, 0.0016f, 2e-6f, 1e-6f, 1.0f / 960, 1, 0};
  std::vector<Case> all;
  for (const double span : {0.5, 0.8, 0.95}) all.push_back(chain), all.back().span = span;
  for (const double span : {0.8, 0.95}) all.push_back(suture), all.back().span = span;
  for (const Case& c : all) {
    const double whole = double{c.spacing} * (c.nodes - 1);
    // sinh(d / 2a) = L / 2a, by bisection on u = 1 / 2a, with L = 1.
    double low = 1e-6, high = 100;
    for (int i = 0; i < 200; ++i) {
      const double u = 0.5 * (low + high);
      (std::sinh(u * c.span) > u ? high : low) = u;
    }
    const double a = 0.5 / low, sag = a * (std::cosh(c.span / (2 * a)) - 1), tension = a * std::cosh(c.span / (2 * a));
    std::vector<Vec3> start;  // a V of the right length
    for (int i = 0; i < c.nodes; ++i) {
      const double t = static_cast<double>(i) / (c.nodes - 1), depth = 0.5 * std::sqrt(1 - c.span * c.span);
      start.push_back(
          {static_cast<float>(whole * c.span * t), static_cast<float>(-whole * depth * (1 - std::abs(2 * t - 1))), 0});
    }
    ThreadRig rig(start, c.spacing, c.mass, true);
    rig.model.gravity = {0, -9.81f, 0};
    rig.model.stretch_compliance = c.compliance;
    rig.model.bend_sweeps = c.bend_sweeps;
    rig.model.bend_compliance = 2e4f;
    rig.damping = 10;
    for (int i = 0; i < static_cast<int>(4 / c.h); ++i) rig.step(c.h);
    double lowest = 0;
    for (const Vec4& p : rig.x) lowest = std::max(lowest, -double{p.y});
    // The support also carries half of the first segment's weight, which the chain of particles lumps onto the held node.
    const Vec3 n0 = normalized(xyz(rig.x[1]) - xyz(rig.x[0]));
    const Vec3 pull = n0 * rig.thread.tension[0] - Vec3{0, 0.5f * c.mass * 9.81f, 0};
    const double weight = (c.nodes - 1) * double{c.mass} * 9.81;
    char name[64];
    std::snprintf(name, sizeof name, "catenary, %s, span %.2f L: ", c.what, c.span);
    out.add(std::string(name) + "sag", sag, lowest / whole, 0.005, "L", "y = a cosh(x / a)");
    out.add(std::string(name) + "end force", tension, double{length(pull)} / weight, 0.01, "weight", "y = a cosh(x / a)");
  }
}

void check_bending(Lines& out) {
  // Gradient. With a compliance so large that the multiplier does not depend on it, the point moves by w lambda times it.
  double worst = 0;
  for (const double degrees : {25.0, 60.0, 90.0, 133.0, 165.0})
    for (int which = 0; which < 3; ++which) {
      std::array<Vec3, 3> p = bent(degrees, 0.9f, 1.2f);
      const std::array<Vec3, 3> start = p;
      float lambda = 0;
      std::array<float, 3> w{};
      w[static_cast<size_t>(which)] = 1;
      solve_bend(p[0], p[1], p[2], w[0], w[1], w[2], 20, 1, lambda);
      const Vec3 got = (p[static_cast<size_t>(which)] - start[static_cast<size_t>(which)]) / lambda;
      auto value = [&](int axis, double by) {
        double q[3][3];
        for (size_t i = 0; i < 3; ++i)
          for (int c = 0; c < 3; ++c) q[i][c] = double{start[i][c]};
        q[which][axis] += by;
        double uv = 0, uu = 0, vv = 0;
        for (int c = 0; c < 3; ++c) {
          const double u = q[0][c] - q[1][c], v = q[2][c] - q[1][c];
          uv += u * v, uu += u * u, vv += v * v;
        }
        return uv / std::sqrt(uu * vv) + 1;
      };
      double miss = 0, size = 0;
      for (int c = 0; c < 3; ++c) {
        const double slope = (value(c, 1e-5) - value(c, -1e-5)) / 2e-5;
        miss += (slope - double{got[c]}) * (slope - double{got[c]});
        size += slope * slope;
      }
      worst = std::max(worst, std::sqrt(miss / size));
    }
  out.add("bending gradient", 0, worst, 1e-3, "1", "central differences at 25, 60, 90, 133, 165 degrees");

  // Released at rest: bending energy plus kinetic energy never grows, from any start, singular ones included.
  const float h = 1.0f / 960, mass = 2e-6f, segment = 0.0016f;
  for (const float compliance : {0.0f, 2e4f})
    for (const double degrees : {0.0, 0.5, 90.0, 180.0}) {
      std::array<Vec3, 3> p = bent(degrees, segment, segment);
      std::array<Vec3, 3> v{};
      const double floor = compliance > 0 ? double{compliance} : 1.0;
      const double before = bend_energy(p, floor);
      double most = before;
      bool finite = true;
      for (int i = 0; i < 2000; ++i) {
        const std::array<Vec3, 3> prev = p;
        for (size_t k = 0; k < 3; ++k) p[k] += v[k] * h;
        float lambda = 0;
        solve_bend(p[0], p[1], p[2], 1 / mass, 1 / mass, 1 / mass, compliance, h, lambda);
        double energy = bend_energy(p, floor);
        for (size_t k = 0; k < 3; ++k) {
          v[k] = (p[k] - prev[k]) / h * 0.98f;
          finite = finite && is_finite(p[k]);
          if (compliance > 0) energy += 0.5 * double{mass} * double{length2(v[k])};
        }
        if (compliance > 0 || degrees == 0.0) most = std::max(most, energy);
      }
      char name[96];
      const char* kind = compliance > 0 ? "soft" : "rigid";
      const double scale = 2 / floor;  // energy of a full fold
      std::snprintf(name, sizeof name, "bending from %.1f degrees, %s: energy gained", degrees, kind);
      out.add(name, 0, finite ? (most - before) / scale : 1e9, 1e-6, "of a fold", "implicit step: energy never grows");
      if (degrees > 0) {
        std::snprintf(name, sizeof name, "bending from %.1f degrees, %s: final angle", degrees, kind);
        out.add(name, 180, finite ? angle_of(p) : 0, 0.02, "degrees", "straight is the only stable rest");
      }
    }
}

}  // namespace catgut::validation
