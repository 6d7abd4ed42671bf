// SPDX-License-Identifier: Apache-2.0
// core/sym3: symmetric 3x3 matrices (stiffness, damping, projections) and their eigenvalues, without allocation and with
// bounded loops: for the servo of a haptic device.
#pragma once
#include <array>

#include "core/math.h"

namespace catgut {

struct Sym3 {
  float xx = 0, yy = 0, zz = 0, xy = 0, xz = 0, yz = 0;
};
constexpr Vec3 operator*(const Sym3& a, Vec3 v) {
  return {a.xx * v.x + a.xy * v.y + a.xz * v.z, a.xy * v.x + a.yy * v.y + a.yz * v.z, a.xz * v.x + a.yz * v.y + a.zz * v.z};
}
constexpr Sym3 operator+(const Sym3& a, const Sym3& b) {
  return {a.xx + b.xx, a.yy + b.yy, a.zz + b.zz, a.xy + b.xy, a.xz + b.xz, a.yz + b.yz};
}
constexpr Sym3 operator*(const Sym3& a, float s) { return {a.xx * s, a.yy * s, a.zz * s, a.xy * s, a.xz * s, a.yz * s}; }
constexpr Sym3& operator+=(Sym3& a, const Sym3& b) { return a = a + b; }
constexpr Sym3 identity(float s) { return {s, s, s, 0, 0, 0}; }
// s v v^T: acts along v alone.
constexpr Sym3 outer(Vec3 v, float s) {
  return {s * v.x * v.x, s * v.y * v.y, s * v.z * v.z, s * v.x * v.y, s * v.x * v.z, s * v.y * v.z};
}
inline bool is_finite(const Sym3& a) { return is_finite(Vec3{a.xx, a.yy, a.zz}) && is_finite(Vec3{a.xy, a.xz, a.yz}); }

// Eigenvalues and unit eigenvectors, by a fixed number of cyclic Jacobi rotations: constant work, exact to rounding.
struct Eigen3 {
  std::array<float, 3> value{};
  std::array<Vec3, 3> vector{};
};
// Diagonalizes the symmetric matrix a; the columns of v, the identity at first, become its eigenvectors.
template <typename T>
inline void diagonalize(T (&a)[3][3], T (&v)[3][3]) {
  for (int sweep = 0; sweep < 6; ++sweep)
    for (int p = 0; p < 2; ++p)
      for (int q = p + 1; q < 3; ++q) {
        if (a[p][q] == 0) continue;
        const T theta = (a[q][q] - a[p][p]) / (2 * a[p][q]);
        // For a huge theta the square overflows; the rotation is then the identity.
        const T t =
            std::abs(theta) > T(1e9) ? 0 : (theta < 0 ? T(-1) : T(1)) / (std::abs(theta) + std::sqrt(theta * theta + 1));
        const T c = 1 / std::sqrt(t * t + 1), d = t * c;
        for (int k = 0; k < 3; ++k) {
          const T kp = a[k][p], kq = a[k][q];
          a[k][p] = c * kp - d * kq, a[k][q] = d * kp + c * kq;
        }
        for (int k = 0; k < 3; ++k) {
          const T pk = a[p][k], qk = a[q][k];
          a[p][k] = c * pk - d * qk, a[q][k] = d * pk + c * qk;
        }
        for (int k = 0; k < 3; ++k) {
          const T kp = v[k][p], kq = v[k][q];
          v[k][p] = c * kp - d * kq, v[k][q] = d * kp + c * kq;
        }
      }
}
inline Eigen3 eigen(const Sym3& s) {
  float a[3][3] = {{s.xx, s.xy, s.xz}, {s.xy, s.yy, s.yz}, {s.xz, s.yz, s.zz}};
  float v[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  diagonalize(a, v);
  return {{a[0][0], a[1][1], a[2][2]},
          {Vec3{v[0][0], v[1][0], v[2][0]}, Vec3{v[0][1], v[1][1], v[2][1]}, Vec3{v[0][2], v[1][2], v[2][2]}}};
}
// The same matrix with its eigenvalues clamped to [least, most].
inline Sym3 clamp_eigenvalues(const Sym3& s, float least, float most) {
  const Eigen3 e = eigen(s);
  Sym3 out;
  for (size_t k = 0; k < 3; ++k) out += outer(e.vector[k], std::clamp(e.value[k], least, most));
  return out;
}
// Two springs in series, one of them the same in every direction: (1/soft + a^-1)^-1, whose eigenvalues are
// soft a / (soft + a). a: positive semidefinite.
inline Sym3 in_series(const Sym3& a, float soft) {
  const Eigen3 e = eigen(a);
  Sym3 out;
  for (size_t k = 0; k < 3; ++k) {
    const float value = std::max(0.0f, e.value[k]);
    out += outer(e.vector[k], soft * value / (soft + value));
  }
  return out;
}

}  // namespace catgut
