// SPDX-License-Identifier: Apache-2.0
// wall/element: the constants of an element from its shape at rest.
#include "wall/element.h"

#include <Eigen/Dense>

#include "core/check.h"

namespace catgut::wall {

namespace {

using namespace scalar;
using Double3 = Vec3Of<double>;
using Eigen::Matrix2d, Eigen::Matrix3d, Eigen::Vector2d, Eigen::Vector3d;

Vector3d eigen(const Double3& v) { return {v.x, v.y, v.z}; }
Matrix3d eigen(const std::array<std::array<double, 3>, 3>& m) {
  Matrix3d out;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) out(i, j) = m[i][j];
  return out;
}

// Stiffness of the xi-eta part of an in-plane displacement, for a membrane of stiffness c: Pian and Sumihara's stresses
// eta a1 a1 and xi a2 a2 on a parallelogram with tangents a1, a2.
Matrix2d warp_stiffness(const Vector2d& a1, const Vector2d& a2, const Matrix3d& c, double area) {
  const Matrix3d compliance = c.inverse();
  Matrix2d out = Matrix2d::Zero();
  for (const Vector2d& a : {a1, a2}) {
    const Vector3d s(a.x() * a.x(), a.y() * a.y(), a.x() * a.y());
    out += area / 3 / s.dot(compliance * s) * a * a.transpose();
  }
  return out;
}

}  // namespace

ElementRest element_rest(std::span<const Vec3> mid, std::span<const Vec3> dir, Vec3 along, const Laminate& laminate,
                         const std::string& where) {
  const bool quad = mid.size() == 4;
  Double3 m[4]{}, d[4]{};
  for (size_t i = 0; i < mid.size(); ++i) m[i] = {mid[i].x, mid[i].y, mid[i].z}, d[i] = {dir[i].x, dir[i].y, dir[i].z};
  const Modes<double> rest = quad ? quad_modes(m, d, 0.25) : triangle_modes(m, d, 0.5, 1.0 / 3);

  const Vector3d w1 = eigen(rest.a1), w2 = eigen(rest.a2);
  Vector3d ez = w1.cross(w2);
  const double det = ez.norm();
  const double size = std::max(w1.norm(), w2.norm());
  if (!(det > 1e-3 * size * size) || !std::isfinite(det))
    throw InputError(where, "an element of the wall without area", "give a mesh of convex quads and triangles");
  ez /= det;
  Vector3d ex(along.x, along.y, along.z);
  ex -= ex.dot(ez) * ez;
  if (!(ex.norm() > 1e-6)) ex = w1;
  ex.normalize();
  Matrix3d frame;
  frame << ex, ez.cross(ex), ez;

  ElementRest out;
  const Eigen::Quaterniond q(frame);
  out.turn = {q.x(), q.y(), q.z(), q.w()};
  auto local = [&](const Double3& v) { return Vector3d(frame.transpose() * eigen(v)); };
  const Vector3d a1 = local(rest.a1), a2 = local(rest.a2), d0 = local(rest.a3);
  const Vector3d h[4] = {local(rest.h1), local(rest.h2), local(rest.h3), local(rest.h4)};
  if (!(d0.z() > 0.1 * d0.norm()))
    throw InputError(where, "an element of the wall that is inside out or leans too far",
                     "give outer and inner nodes that face each other, outer side out");
  out.area = (quad ? 4 : 2) * det;

  auto& c = out.constant;
  Matrix2d tangent;
  tangent << a1.head<2>(), a2.head<2>();
  const Matrix2d g = tangent.inverse();  // rows: gradient of xi, of eta
  c[kG11] = g(0, 0), c[kG12] = g(0, 1), c[kG21] = g(1, 0), c[kG22] = g(1, 1);
  c[kA1x] = a1.x(), c[kA1y] = a1.y(), c[kA2x] = a2.x(), c[kA2y] = a2.y();
  c[kD0x] = d0.x(), c[kD0y] = d0.y(), c[kD0z] = d0.z(), c[kInvD0z] = 1 / d0.z();
  for (int k = 0; k < 4; ++k)
    for (int i = 0; i < 3; ++i) c[kH1x + 3 * k + i] = h[k][i];

  // The laminate scaled to the thickness of the element: membrane proportionally, bending with the cube.
  const double t = 2 * d0.z(), s = t / laminate.thickness, zeta = t / 2;
  const Matrix3d a = eigen(laminate.a) * s, b = eigen(laminate.b) * (s * s / zeta),
                 e = eigen(laminate.d) * (s * s * s / (zeta * zeta));
  // What lies outside the mid-surface of a curved wall has more area.
  Matrix2d director;
  director << h[1].head<2>(), h[2].head<2>();
  const double curved = (g * director).trace();
  const Matrix3d coupling = b + curved * e;
  const int at[6][2] = {{0, 0}, {0, 1}, {1, 1}, {0, 2}, {1, 2}, {2, 2}};
  for (int k = 0; k < 6; ++k) {
    const auto [i, j] = at[k];
    c[kA11 + k] = a(i, j) * out.area, c[kB11 + k] = coupling(i, j) * out.area, c[kE11 + k] = e(i, j) * out.area;
  }
  c[kStiff1] = laminate.stiff[0] * s * out.area, c[kKnee1] = laminate.knee[0];
  c[kStiff2] = laminate.stiff[1] * s * out.area, c[kKnee2] = laminate.knee[1];
  const double thick = laminate.thick * s;
  c[kThick] = thick * out.area, c[kContract1] = laminate.contraction[0], c[kContract2] = laminate.contraction[1];

  // Reduced shear energy in elements that are wide relative to their thickness.
  const double width2 = std::max((2 * w1).squaredNorm(), (2 * w2).squaredNorm());
  const double factor = t * t / (t * t + 0.1 * width2);
  const Vector2d shear(laminate.shear[0] * s * factor, laminate.shear[1] * s * factor);
  c[kShear1] = shear[0] * out.area, c[kShear2] = shear[1] * out.area;
  const Matrix2d edge = g * shear.asDiagonal() * g.transpose() * (out.area / (zeta * zeta));
  if (quad) {
    const Matrix2d plane = warp_stiffness(a1.head<2>(), a2.head<2>(), a, out.area);
    const Matrix2d twist = warp_stiffness(a1.head<2>(), a2.head<2>(), e, out.area);
    c[kInPlane11] = plane(0, 0), c[kInPlane12] = plane(0, 1), c[kInPlane22] = plane(1, 1);
    c[kTwist11] = twist(0, 0), c[kTwist12] = twist(0, 1), c[kTwist22] = twist(1, 1);
    c[kEdge11] = edge(0, 0) / 3, c[kEdge22] = edge(1, 1) / 3;
  } else {  // relative rotation of directors about the normal: the only mode without other stiffness
    const double k = edge.trace() / 12;
    c[kEdge11] = k, c[kEdge22] = k, c[kEdge12] = -k;
  }
  const double varies = thick * out.area / (zeta * zeta) / 3;
  c[kThick2] = c[kThick3] = varies, c[kThick4] = varies / 3;
  return out;
}

}  // namespace catgut::wall
