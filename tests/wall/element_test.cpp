// SPDX-License-Identifier: Apache-2.0
// tests/wall: one element in double precision, and the SIMD kernel beside it.
#include "wall/element.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <vector>

#include "core/check.h"
#include "wall/force.h"

namespace catgut::wall {
namespace {

using scalar::Turn;
using Double3 = scalar::Vec3Of<double>;

struct Shape {
  std::vector<Vec3> mid, dir;
};
// A slanted, warped quad of a curved wall, and a triangle.
Shape quad() {
  return {{{0, 0, 0}, {0.0042f, 0.0003f, 0.0002f}, {0.0049f, 0.0040f, -0.0003f}, {0.0008f, 0.0037f, 0.0001f}},
          {{0.0001f, 0, 0.00125f}, {-0.0001f, 0.0001f, 0.0013f}, {0, 0.0002f, 0.0012f}, {0.0001f, 0.0001f, 0.00125f}}};
}
Shape triangle() {
  Shape s = quad();
  s.mid.pop_back(), s.dir.pop_back();
  return s;
}
// Different moduli along and around, layers that couple stretch and bending, fibers that straighten.
Laminate material() {
  std::vector<Layer> layer = bowel_layers(0.0025f, 3e5f, 9e5f, 0.45f);
  layer[1].angle = 0.5f;
  layer[2].stiff_along = 2e6f, layer[2].knee_along = 0.05f;
  layer[2].stiff_around = 3e6f, layer[2].knee_around = 0.04f;
  return laminate(layer);
}

using Vector = Eigen::VectorXd;  // mid-surface point and director of each column

Vector positions(const Shape& s) {
  Vector x(6 * s.mid.size());
  for (size_t i = 0; i < s.mid.size(); ++i)
    for (int k = 0; k < 3; ++k) x[6 * i + k] = s.mid[i][k], x[6 * i + 3 + k] = s.dir[i][k];
  return x;
}
Vector force(const ElementRest& e, const Vector& x, Turn<double>& turn, double* energy = nullptr) {
  const size_t n = x.size() / 6;
  Double3 mid[4]{}, dir[4]{};
  for (size_t i = 0; i < n; ++i)
    mid[i] = {x[6 * i], x[6 * i + 1], x[6 * i + 2]}, dir[i] = {x[6 * i + 3], x[6 * i + 4], x[6 * i + 5]};
  const auto get = [&](uint32_t k) { return e.constant[k]; };
  const bool four = n == 4;
  const auto modes = four ? scalar::quad_modes(mid, dir, 0.25) : scalar::triangle_modes(mid, dir, 0.5, 1.0 / 3);
  const auto f = scalar::element_force(get, modes, turn, 30, energy);
  Double3 fm[4], fd[4];
  if (four) {
    scalar::quad_corners(f, 0.25, fm, fd);
    scalar::guard_corners<4>(get, mid, dir, fm, fd, energy);
  } else {
    scalar::triangle_corners(f, 0.5, 1.0 / 3, fm, fd);
    scalar::guard_corners<3>(get, mid, dir, fm, fd, energy);
  }
  Vector out(x.size());
  for (size_t i = 0; i < n; ++i) {
    out.segment<3>(6 * i) << fm[i].x, fm[i].y, fm[i].z;
    out.segment<3>(6 * i + 3) << fd[i].x, fd[i].y, fd[i].z;
  }
  return out;
}
// Rest, stretched, sheared, bent and turned by about two radians.
Vector deformed(const Shape& s) {
  Vector x = positions(s);
  std::srand(7);
  Eigen::Matrix3d f = Eigen::Matrix3d::Identity() + 0.2 * Eigen::Matrix3d::Random();
  f = Eigen::AngleAxisd(2.0, Eigen::Vector3d(1, -2, 0.5).normalized()).toRotationMatrix() * f;
  for (int i = 0; i < x.size(); i += 3) x.segment<3>(i) = f * x.segment<3>(i) + 2e-4 * Eigen::Vector3d::Random();
  return x;
}
// The same, one corner nearly flat and another inside out.
Vector folded(const Shape& s) {
  Vector x = deformed(s);
  x.segment<3>(9) *= 0.1, x.segment<3>(15) *= -0.2;
  return x;
}

class AnElement : public testing::TestWithParam<bool> {
 protected:
  Shape shape = GetParam() ? quad() : triangle();
  ElementRest rest = element_rest(shape.mid, shape.dir, {1, 0.2f, 0}, material(), "test");
};

TEST_P(AnElement, is_at_rest_where_it_was_made_wherever_it_is_turned) {
  Turn<double> turn = rest.turn;
  const double scale = force(rest, deformed(shape), turn).norm();
  const Eigen::Matrix3d r = Eigen::AngleAxisd(2.5, Eigen::Vector3d(0.3, 1, -0.2).normalized()).toRotationMatrix();
  Vector x = positions(shape);
  for (int i = 0; i < x.size(); i += 3) x.segment<3>(i) = r * x.segment<3>(i);
  turn = rest.turn;
  EXPECT_LT(force(rest, x, turn).norm(), 1e-9 * scale);
}

TEST_P(AnElement, exerts_no_force_and_no_torque_on_itself) {
  for (const Vector& x : {deformed(shape), folded(shape)}) {
    Turn<double> turn = rest.turn;
    const Vector f = force(rest, x, turn);
    Eigen::Vector3d sum = Eigen::Vector3d::Zero(), torque = sum;
    double size = 0;
    for (int i = 0; i < x.size(); i += 3) {
      const Eigen::Vector3d p = x.segment<3>(i), g = f.segment<3>(i);
      if (i % 6 == 0) sum += g;
      torque += p.cross(g), size += p.norm() * g.norm();
    }
    EXPECT_LT(sum.norm(), 1e-12 * f.norm());
    EXPECT_LT(torque.norm(), 1e-9 * size);
  }
}

TEST_P(AnElement, has_a_force_that_is_the_gradient_of_its_energy_and_a_symmetric_jacobian) {
  for (const Vector& x : {deformed(shape), folded(shape)}) {
    const double eps = 1e-8;  // [m]
    Turn<double> turn = rest.turn;
    const Vector f = force(rest, x, turn);
    Eigen::MatrixXd jacobian(x.size(), x.size());
    for (int i = 0; i < x.size(); ++i) {
      double up = 0, down = 0;
      Vector a = x, b = x;
      a[i] += eps, b[i] -= eps;
      const Vector fa = force(rest, a, turn, &up), fb = force(rest, b, turn, &down);
      jacobian.col(i) = (fa - fb) / (2 * eps);
      EXPECT_NEAR(-(up - down) / (2 * eps), f[i], 1e-5 * f.norm());
    }
    EXPECT_LT((jacobian - jacobian.transpose()).norm(), 1e-6 * jacobian.norm());
  }
}

// The force that the guard adds at a corner that is inside out turns it back.
TEST_P(AnElement, resists_at_a_corner_that_turns_inside_out) {
  Vector x = positions(shape);
  const Eigen::Vector3d out = x.segment<3>(3).normalized();
  x.segment<3>(3) *= 0.6;
  Turn<double> turn = rest.turn;
  const double at_60 = force(rest, x, turn).segment<3>(3).dot(out);
  x.segment<3>(3) *= -1;
  turn = rest.turn;
  const double inside_out = force(rest, x, turn).segment<3>(3).dot(out);
  EXPECT_GT(at_60, 0);
  EXPECT_GT(inside_out, 8 * at_60);  // without the guard four times: from a compression of 0.4 to one of 1.6
}

TEST_P(AnElement, has_six_rigid_motions_and_no_other_motion_without_stiffness) {
  const Vector x = positions(shape);
  Turn<double> turn = rest.turn;
  Eigen::MatrixXd k(x.size(), x.size());
  for (int i = 0; i < x.size(); ++i) {
    Vector a = x, b = x;
    a[i] += 1e-7, b[i] -= 1e-7;
    k.col(i) = (force(rest, b, turn) - force(rest, a, turn)) / 2e-7;
  }
  const Eigen::VectorXd eigen = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(0.5 * (k + k.transpose())).eigenvalues();
  const double top = eigen[eigen.size() - 1];
  for (int i = 0; i < 6; ++i) EXPECT_NEAR(eigen[i] / top, 0, 1e-6);
  EXPECT_GT(eigen[6] / top, 1e-4);
}

// Patch test: a plate of irregular elements under an affine map in its plane has the force of the laminate on its edges, and
// none inside. Here one element against the laminate's own stress.
TEST_P(AnElement, stores_the_laminate_s_energy_under_an_affine_map) {
  Shape flat = shape;
  for (size_t i = 0; i < flat.mid.size(); ++i) flat.mid[i].z = 0, flat.dir[i] = {0, 0, 0.00125f};
  const Laminate m = material();
  const ElementRest e = element_rest(flat.mid, flat.dir, {1, 0, 0}, m, "test");
  const double e1 = 1e-4, e2 = -2e-4, e12 = 3e-4;
  Vector x = positions(flat);
  const double e3 = -(m.contraction[0] * e1 + m.contraction[1] * e2);
  for (int i = 0; i < x.size(); i += 3) {
    const double a = x[i], b = x[i + 1];
    x[i] += e1 * a + 0.5 * e12 * b, x[i + 1] += 0.5 * e12 * a + e2 * b, x[i + 2] *= 1 + e3;
  }
  double energy = 0;
  Turn<double> turn = e.turn;
  force(e, x, turn, &energy);
  const Eigen::Vector3d strain(e1, e2, e12);
  Eigen::Matrix3d a;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) a(i, j) = m.a[i][j];
  EXPECT_NEAR(energy / (0.5 * e.area * strain.dot(a * strain)), 1, 1e-4);
}

TEST_P(AnElement, has_the_same_forces_in_the_simd_kernel) {
  for (const Vector& x : {deformed(shape), folded(shape)}) {
    Turn<double> turn = rest.turn;
    const Vector want = force(rest, x, turn);
    ElementBlock block;
    BlockCorners corners;
    BlockTurn frame;
    frame.w.fill(1);
    corners.quads = shape.mid.size() == 4;
    const uint32_t lane = 5;
    for (uint32_t k = 0; k < kConstants; ++k) block.constant[k][lane] = static_cast<float>(rest.constant[k]);
    frame.x[lane] = static_cast<float>(rest.turn.x), frame.y[lane] = static_cast<float>(rest.turn.y);
    frame.z[lane] = static_cast<float>(rest.turn.z), frame.w[lane] = static_cast<float>(rest.turn.w);
    Column<Float4> y;
    for (int i = 0; i < x.size(); i += 3)
      y.push_back({static_cast<float>(x[i]), static_cast<float>(x[i + 1]), static_cast<float>(x[i + 2]), 0});
    for (uint32_t k = 0; k < 4; ++k) corners.column[k][lane] = std::min<uint32_t>(k, static_cast<uint32_t>(y.size() / 2) - 1);
    BlockForce out;
    for (int i = 0; i < 12; ++i) block_forces(&block, &corners, y.data(), &frame, &out, 0, 1);  // the frame turns step by step
    for (size_t k = 0; k < shape.mid.size(); ++k)
      for (int i = 0; i < 3; ++i) {
        EXPECT_NEAR(vec3(out.mid[k][lane])[i], want[6 * k + i], 1e-4 * want.norm());
        EXPECT_NEAR(vec3(out.dir[k][lane])[i], want[6 * k + 3 + i], 1e-4 * want.norm());
      }
    for (uint32_t other = 0; other < kLanesOfBlock; ++other)
      if (other != lane) { EXPECT_EQ(out.mid[0][other], Float4{}); }
  }
}

INSTANTIATE_TEST_SUITE_P(Quad, AnElement, testing::Values(true));
INSTANTIATE_TEST_SUITE_P(Triangle, AnElement, testing::Values(false));

TEST(Material, that_no_tissue_has_is_refused_by_name) {
  Layer l;
  l.poisson = 0.5f;
  EXPECT_THROW(laminate(std::vector<Layer>{l}), InputError);
  l = {}, l.e_along = -1;
  EXPECT_THROW(laminate(std::vector<Layer>{l}), InputError);
  EXPECT_THROW(laminate({}), InputError);
  try {
    l = {}, l.name = "muscle", l.thickness = 0;
    laminate(std::vector<Layer>{l}, "scene.toml:4");
    FAIL();
  } catch (const InputError& e) { EXPECT_NE(std::string(e.what()).find("scene.toml:4, layer muscle"), std::string::npos); }
}

TEST(Material, of_four_equal_layers_is_that_of_one) {
  Layer l;
  std::vector<Layer> four(4, l);
  for (Layer& part : four) part.thickness = l.thickness / 4;
  const Laminate a = laminate(std::vector<Layer>{l}), b = laminate(four);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      EXPECT_NEAR(a.a[i][j], b.a[i][j], 1e-4);
      EXPECT_NEAR(a.d[i][j], b.d[i][j], 1e-9);
      EXPECT_NEAR(b.b[i][j], 0, 1e-6);
    }
}

}  // namespace
}  // namespace catgut::wall
