// SPDX-License-Identifier: Apache-2.0
// solver/attach: compliant attachments of tissue. Embedded points are weighted sums of a few particles, so that a bite lies
// where the needle entered instead of at the nearest particle. The paper's nearest particle is the case of one weight 1.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "solver/particles.h"
#include "solver/rigid.h"

namespace catgut {

// A material point: sum of weight * particle. Spread over a neighborhood, it also has the neighborhood's inertia. A thread that
// pulled on three particles alone would displace them by millimeters in a substep, before their neighbors could react.
struct EmbeddedPoint {
  static constexpr uint32_t kMaxParticles = 16;
  uint32_t count = 0;
  std::array<uint32_t, kMaxParticles> particle{};
  std::array<float, kMaxParticles> weight{};  // sum 1
};
inline EmbeddedPoint particle_point(uint32_t i) {
  EmbeddedPoint t;
  t.count = 1;
  t.particle[0] = i;
  t.weight[0] = 1;
  return t;
}
// The smoothest weights over `particle` (at rest positions `rest`) whose weighted sum is `at`. Least squares with linear
// precision, so that the point follows every affine motion of its neighborhood exactly. Uses at most kMaxParticles particles.
EmbeddedPoint spread_point(std::span<const uint32_t> particle, const Vec4* rest, Vec3 at);

// The same rest position, carried by no more than `count` particles, the nearest of those it has.
EmbeddedPoint carried_by(const Vec4* rest, const EmbeddedPoint& point, uint32_t count);
// Midpoint of two embedded points.
EmbeddedPoint midway(const Vec4* rest, const EmbeddedPoint& a, const EmbeddedPoint& b);

inline Vec3 position_of(const EmbeddedPoint& t, const Vec4* x) {
  Four p{};
  for (uint32_t k = 0; k < t.count; ++k) p += load(x[t.particle[k]]) * t.weight[k];
  return {p[0], p[1], p[2]};
}
inline float inverse_mass_of(const EmbeddedPoint& t, const float* w) {
  float s = 0;
  for (uint32_t k = 0; k < t.count; ++k) s += t.weight[k] * t.weight[k] * w[t.particle[k]];
  return s;
}
// Applies the positional impulse p [kg m] at the point.
inline void push(const EmbeddedPoint& t, Vec4* x, const float* w, Vec3 p) {
  const Four four{p.x, p.y, p.z, 0};
  for (uint32_t k = 0; k < t.count; ++k) {
    Vec4& at = x[t.particle[k]];
    store(at, load(at) + four * (w[t.particle[k]] * t.weight[k]));
  }
}

// Particle (or weighted point) to a fixed place in the world, or to a place in a body's frame.
struct Attachment {
  EmbeddedPoint point;
  int body = -1;         // -1: the world
  Vec3 target;           // [m] world, or body frame
  float compliance = 0;  // [m/N]
  uint32_t suture = 0;   // body -1: whose closure plan made it
  Vec3 lambda;           // [N s^2] cleared at the start of a substep; acts on the tissue
};

// The needle's shaft in its track: the tissue point lies on the needle's arc (particle-line attachment). It slides along
// the arc against Coulomb-like drag; `compliance` constrains it laterally.
struct NeedleTrackConstraint {
  EmbeddedPoint point;
  float compliance = 0;   // [m/N] lateral
  float drag = 0;         // [N] maximum force along the shaft
  float at = 0;           // [rad] position on the arc at the start of the substep
  uint32_t suture = 0;    // whose needle
  uint32_t hole = 0;      // hole index, for the stage that made the row
  Vec3 lambda;            // lateral, cleared at the start of a substep
  float drag_lambda = 0;  // along the shaft
};

// The needle's circle in its body frame: center at `center`, in the xy plane, from angle 0 (swage) to `arc` (tip).
struct NeedleArc {
  float radius = 0, arc = 0;
  Vec3 center;  // [m] body frame: the body's origin is the center of mass
  Vec3 point(float phi) const { return center + Vec3{radius * portable::cos(phi), radius * portable::sin(phi), 0}; }
  Vec3 tangent(float phi) const { return {-portable::sin(phi), portable::cos(phi), 0}; }  // toward the tip
  // The angle of the arc point nearest to p (body frame), clamped to the arc.
  float nearest(Vec3 p) const;
};

void solve_attachment(Attachment& a, Vec4* x, const float* w, const std::vector<RigidModel>& model,
                      std::vector<RigidBody>& body, float h);
void solve_needle_track(NeedleTrackConstraint& c, const NeedleArc& arc, Vec4* x, const float* w, const RigidModel& model,
                        RigidBody& needle, float h);

}  // namespace catgut
