// SPDX-License-Identifier: Apache-2.0
// physical/body_internal: small functions shared by body, grip and body_solve.
#pragma once
#include <algorithm>
#include <cmath>

#include "physical/body.h"

namespace catgut::physical {

constexpr float kMaxSpeed = 3, kMaxSpin = 150;  // [m/s], [rad/s]
// The same of a needle that no jaws hold. Thread follows at 0.8 m/s at most (thread::Settings::max_move): a faster swage drew
// itself along its thread.
constexpr float kLooseSpeed = 0.5f, kLooseSpin = 20;
constexpr float kBedDrag = 100;      // [1/s] of a needle that lies on the drape: without it, it trembled at 10 to 30 rad/s
constexpr float kCorrect = 0.2f;     // fraction of an error that a bilateral row undoes per step
constexpr float kBristle = 0.1e-3f;  // [m] elastic give of a grip before it slips
constexpr float kThreadGripGive = 0.2e-3f;  // [m] the same for thread

inline Vec3 across(Vec3 v, Vec3 axis) { return v - axis * dot(v, axis); }
inline Vec3 clamped(Vec3 v, float limit) {
  const float size = length(v);
  return size > limit ? v * (limit / size) : v;
}
inline Quat turned(Quat q, Vec3 rotation) {  // after a rotation by a vector, world frame
  const float angle = length(rotation);
  return angle < 1e-12f ? q : normalized(axis_angle(rotation / angle, angle) * q);
}
inline Vec3 point_speed(const BodiesScratch::Moving& m, Vec3 r) { return m.v + cross(m.w, r); }

inline float nearest_along(Vec3 a, Vec3 b, Vec3 p) {
  const Vec3 d = b - a;
  const float d2 = length2(d);
  return d2 > 0 ? std::clamp(dot(p - a, d) / d2, 0.0f, 1.0f) : 0.0f;
}

// Closest points of two segments, as fractions.
inline void nearest_of_segments(Vec3 a, Vec3 b, Vec3 c, Vec3 d, float& s, float& t) {
  const Vec3 u = b - a, v = d - c, r = a - c;
  const float uu = dot(u, u), vv = dot(v, v), uv = dot(u, v), det = uu * vv - uv * uv;
  s = det > 1e-6f * uu * vv ? std::clamp((uv * dot(v, r) - vv * dot(u, r)) / det, 0.0f, 1.0f) : 0.5f;
  t = vv > 0 ? std::clamp((uv * s + dot(v, r)) / vv, 0.0f, 1.0f) : 0.0f;
  s = uu > 0 ? std::clamp((uv * t - dot(u, r)) / uu, 0.0f, 1.0f) : 0.0f;
}

// Kinds of key: a body's sphere and its axis on the wall, jaws on a thread, a needle on the drape.
constexpr uint64_t kSphereRow = 1, kAxisRow = 2, kThreadGripRow = 6, kDrapeRow = 7;
constexpr uint64_t key_of(uint64_t kind, uint64_t body, uint64_t part, uint64_t patch) {
  return kind << 60 | body << 52 | part << 36 | patch;
}
constexpr uint64_t kind_of(uint64_t key) { return key >> 60; }
constexpr uint32_t part_of(uint64_t key) { return static_cast<uint32_t>(key >> 36 & 0xffff); }
constexpr uint32_t patch_of(uint64_t key) { return static_cast<uint32_t>(key); }

inline const RowMemory* remembered(const Bodies& bodies, uint64_t key) {
  const auto at = std::lower_bound(bodies.memory.begin(), bodies.memory.end(), key,
                                   [](const RowMemory& m, uint64_t k) { return m.key < k; });
  return at != bodies.memory.end() && at->key == key ? &*at : nullptr;
}

}  // namespace catgut::physical
