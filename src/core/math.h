// SPDX-License-Identifier: Apache-2.0
// core/math: small fixed-size vectors, quaternions and poses for everything outside the SIMD kernels.
// Frames are right-handed: x to the right, y up, z toward the surgeon. Lengths in meters, angles in radians.
#pragma once
#include <algorithm>
#include <cmath>

#include "core/elementary.h"

namespace catgut {

struct Vec3 {
  float x = 0, y = 0, z = 0;
  constexpr float operator[](int i) const { return i == 0 ? x : i == 1 ? y : z; }
};
constexpr Vec3 operator+(Vec3 a, Vec3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
constexpr Vec3 operator-(Vec3 a, Vec3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
constexpr Vec3 operator-(Vec3 a) { return {-a.x, -a.y, -a.z}; }
constexpr Vec3 operator*(Vec3 a, float s) { return {a.x * s, a.y * s, a.z * s}; }
constexpr Vec3 operator*(float s, Vec3 a) { return a * s; }
constexpr Vec3 operator/(Vec3 a, float s) { return a * (1.0f / s); }
constexpr Vec3& operator+=(Vec3& a, Vec3 b) { return a = a + b; }
constexpr Vec3& operator-=(Vec3& a, Vec3 b) { return a = a - b; }
constexpr Vec3& operator*=(Vec3& a, float s) { return a = a * s; }
constexpr bool operator==(Vec3 a, Vec3 b) { return a.x == b.x && a.y == b.y && a.z == b.z; }
constexpr float dot(Vec3 a, Vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
constexpr Vec3 cross(Vec3 a, Vec3 b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }
constexpr float length2(Vec3 a) { return dot(a, a); }
inline float length(Vec3 a) { return std::sqrt(length2(a)); }
inline float distance(Vec3 a, Vec3 b) { return length(a - b); }
// The unit vector along a; `otherwise` when a is shorter than 1e-20 m.
inline Vec3 normalized(Vec3 a, Vec3 otherwise = {0, 0, 0}) {
  const float l = length(a);
  return l > 1e-20f ? a / l : otherwise;
}
constexpr Vec3 lerp(Vec3 a, Vec3 b, float t) { return a + (b - a) * t; }
inline bool is_finite(Vec3 a) { return std::isfinite(a.x) && std::isfinite(a.y) && std::isfinite(a.z); }
// A unit vector orthogonal to the unit vector n, continuous except at one direction.
inline Vec3 any_perpendicular(Vec3 n) {
  return normalized(std::abs(n.x) < 0.6f ? cross(n, Vec3{1, 0, 0}) : cross(n, Vec3{0, 1, 0}));
}

// Unit quaternion (x, y, z vector part, w scalar part).
struct Quat {
  float x = 0, y = 0, z = 0, w = 1;
};
constexpr Quat operator*(Quat a, Quat b) {
  return {a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y, a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x,
          a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w, a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z};
}
constexpr bool operator==(Quat a, Quat b) { return a.x == b.x && a.y == b.y && a.z == b.z && a.w == b.w; }
constexpr Quat conjugate(Quat q) { return {-q.x, -q.y, -q.z, q.w}; }
inline Quat normalized(Quat q) {
  const float l = std::sqrt(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w);
  return l > 1e-20f ? Quat{q.x / l, q.y / l, q.z / l, q.w / l} : Quat{};
}
constexpr Vec3 rotate(Quat q, Vec3 v) {
  const Vec3 u{q.x, q.y, q.z};
  const Vec3 t = 2.0f * cross(u, v);
  return v + q.w * t + cross(u, t);
}
// Rotation by `angle` about the unit vector `axis`.
inline Quat axis_angle(Vec3 axis, float angle) {
  const float s = portable::sin(0.5f * angle);
  return {axis.x * s, axis.y * s, axis.z * s, portable::cos(0.5f * angle)};
}
// Rotation vector (axis times angle, |angle| <= pi) of a unit quaternion.
inline Vec3 rotation_vector(Quat q) {
  if (q.w < 0) q = {-q.x, -q.y, -q.z, -q.w};
  const Vec3 v{q.x, q.y, q.z};
  const float s = length(v);
  return s < 1e-6f ? 2.0f * v : v * (2.0f * portable::atan2(s, q.w) / s);
}
// The rotation whose columns are the given orthonormal, right-handed axes.
inline Quat from_axes(Vec3 ax, Vec3 ay, Vec3 az) {
  const float t = ax.x + ay.y + az.z;
  Quat q;
  if (t > 0) q = {ay.z - az.y, az.x - ax.z, ax.y - ay.x, 1 + t};
  else if (ax.x > ay.y && ax.x > az.z) q = {1 + ax.x - ay.y - az.z, ax.y + ay.x, az.x + ax.z, ay.z - az.y};
  else if (ay.y > az.z) q = {ax.y + ay.x, 1 - ax.x + ay.y - az.z, ay.z + az.y, az.x - ax.z};
  else q = {az.x + ax.z, ay.z + az.y, 1 - ax.x - ay.y + az.z, ax.y - ay.x};
  return normalized(q);
}
// Normalised linear blend along the shorter arc, t in 0..1.
inline Quat nlerp(Quat a, Quat b, float t) {
  const float s = a.x * b.x + a.y * b.y + a.z * b.z + a.w * b.w < 0 ? -t : t;
  return normalized(Quat{a.x * (1 - t) + b.x * s, a.y * (1 - t) + b.y * s, a.z * (1 - t) + b.z * s, a.w * (1 - t) + b.w * s});
}

// A rigid frame: x_world = p + q x_local.
struct Pose {
  Vec3 p;
  Quat q;
};
constexpr bool operator==(const Pose& a, const Pose& b) { return a.p == b.p && a.q == b.q; }
constexpr Vec3 transform(const Pose& a, Vec3 local) { return a.p + rotate(a.q, local); }
constexpr Vec3 to_local(const Pose& a, Vec3 world) { return rotate(conjugate(a.q), world - a.p); }
// a after b: local coordinates of b's child frame, seen from a's parent.
inline Pose operator*(const Pose& a, const Pose& b) { return {transform(a, b.p), normalized(a.q * b.q)}; }
inline Pose inverse(const Pose& a) { return {rotate(conjugate(a.q), -a.p), conjugate(a.q)}; }

constexpr float kPi = 3.14159265358979f;

}  // namespace catgut
