// SPDX-License-Identifier: Apache-2.0
// solver/attach: reads attachments, moves tissue particles and rigid bodies. XPBD (Macklin et al. 2016) per attachment.
#include "solver/attach.h"

#include <algorithm>
#include <array>

#include "core/sym3.h"

namespace catgut {

EmbeddedPoint spread_point(std::span<const uint32_t> particle, const Vec4* rest, Vec3 at) {
  EmbeddedPoint t;
  t.count = static_cast<uint32_t>(std::min<size_t>(particle.size(), EmbeddedPoint::kMaxParticles));
  using Column = std::array<double, 3>;
  const auto rest_of = [&](uint32_t k) { return Column{rest[particle[k]].x, rest[particle[k]].y, rest[particle[k]].z}; };
  Column mean{};
  for (uint32_t k = 0; k < t.count; ++k)
    for (size_t i = 0; i < 3; ++i) mean[i] += rest_of(k)[i] / t.count;
  double spread[3][3] = {}, axis[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  for (uint32_t k = 0; k < t.count; ++k)
    for (size_t i = 0; i < 3; ++i)
      for (size_t j = 0; j < 3; ++j) spread[i][j] += (rest_of(k)[i] - mean[i]) * (rest_of(k)[j] - mean[j]);
  diagonalize(spread, axis);
  // b_k = 1/n + (q_k - mean)^T S^-1 (at - mean). The pseudo-inverse ignores directions in which the particles do not
  // spread: flat to 1 part in 100,000, squared here.
  constexpr double kFlat = 1e-10;
  const double largest = std::max({spread[0][0], spread[1][1], spread[2][2]});
  const Column away{at.x - mean[0], at.y - mean[1], at.z - mean[2]};
  Column slope{};
  for (size_t e = 0; e < 3; ++e) {
    if (!(spread[e][e] > kFlat * largest)) continue;
    const double along = (axis[0][e] * away[0] + axis[1][e] * away[1] + axis[2][e] * away[2]) / spread[e][e];
    for (size_t i = 0; i < 3; ++i) slope[i] += along * axis[i][e];
  }
  for (uint32_t k = 0; k < t.count; ++k) {
    const Column q = rest_of(k);
    t.particle[k] = particle[k];
    t.weight[k] = static_cast<float>(1.0 / t.count + (q[0] - mean[0]) * slope[0] + (q[1] - mean[1]) * slope[1] +
                                     (q[2] - mean[2]) * slope[2]);
  }
  return t;
}

EmbeddedPoint carried_by(const Vec4* rest, const EmbeddedPoint& point, uint32_t count) {
  if (point.count <= count) return point;
  const Vec3 at = position_of(point, rest);
  std::array<uint32_t, EmbeddedPoint::kMaxParticles> near = point.particle;
  std::sort(near.begin(), near.begin() + point.count, [&](uint32_t i, uint32_t j) {
    const float di = length2(xyz(rest[i]) - at), dj = length2(xyz(rest[j]) - at);
    return di != dj ? di < dj : i < j;
  });
  return spread_point({near.data(), count}, rest, at);
}

EmbeddedPoint midway(const Vec4* rest, const EmbeddedPoint& a, const EmbeddedPoint& b) {
  // An embedded point holds a limited number of particles. Each of the two keeps the half of its particles nearest to it, with
  // weights that preserve its position.
  EmbeddedPoint m;
  for (const EmbeddedPoint* p : {&a, &b}) {
    const EmbeddedPoint part = carried_by(rest, *p, EmbeddedPoint::kMaxParticles / 2);
    for (uint32_t k = 0; k < part.count; ++k) {
      uint32_t row = 0;
      while (row < m.count && m.particle[row] != part.particle[k]) ++row;
      if (row == m.count) m.particle[m.count++] = part.particle[k];
      m.weight[row] += 0.5f * part.weight[k];
    }
  }
  return m;
}

float NeedleArc::nearest(Vec3 p) const {
  float phi = portable::atan2(p.y - center.y, p.x - center.x);
  // Angles in the gap behind the arc are clamped to the nearer end.
  if (phi < 0 && phi < 0.5f * (arc - 2 * kPi)) phi += 2 * kPi;
  return std::clamp(phi, 0.0f, arc);
}

void solve_attachment(Attachment& a, Vec4* x, const float* w, const std::vector<RigidModel>& model,
                      std::vector<RigidBody>& body, float h) {
  const Vec3 p = position_of(a.point, x);
  const float alpha = a.compliance / (h * h);
  float wsum = inverse_mass_of(a.point, w);
  if (a.body < 0) {
    if (wsum + alpha <= 0) return;
    const Vec3 d = (a.target - p - alpha * a.lambda) / (wsum + alpha);
    a.lambda += d;
    push(a.point, x, w, d);
    return;
  }
  RigidBody& b = body[static_cast<size_t>(a.body)];
  const RigidModel& m = model[static_cast<size_t>(a.body)];
  const Vec3 r = rotate(b.q, a.target);
  const Vec3 residual = b.x + r - p - alpha * a.lambda;
  const Vec3 n = normalized(residual);
  if (length2(n) == 0) return;
  wsum += inverse_mass_at(m, b, r, n);
  const Vec3 d = residual / (wsum + alpha);
  a.lambda += d;
  push(a.point, x, w, d);
  push(m, b, -d, r);
}

void solve_needle_track(NeedleTrackConstraint& c, const NeedleArc& arc, Vec4* x, const float* w, const RigidModel& model,
                        RigidBody& needle, float h) {
  const Vec3 p = position_of(c.point, x);
  const Vec3 local = to_local(needle.pose(), p);
  const float phi = arc.nearest(local);
  const Vec3 on_arc = arc.point(phi);
  const Vec3 tangent = rotate(needle.q, arc.tangent(phi));
  const float wp = inverse_mass_of(c.point, w);
  const float inv_h2 = 1.0f / (h * h);

  const Vec3 r = rotate(needle.q, on_arc);
  Vec3 gap = needle.x + r - p;
  gap -= tangent * dot(gap, tangent);  // lateral only: beyond an end of the arc nothing restores it along the shaft
  const float alpha = c.compliance * inv_h2;
  const Vec3 residual = gap - alpha * c.lambda;
  const Vec3 n = normalized(residual);
  if (length2(n) > 0) {
    const Vec3 d = residual / (wp + inverse_mass_at(model, needle, r, n) + alpha);
    c.lambda += d;
    push(c.point, x, w, d);
    push(model, needle, -d, r);
  }

  // Drag: undo the slip since the start of the substep, limited by the maximum force.
  const float slip = arc.radius * (phi - c.at);  // displacement of the tissue toward the tip
  const float wt = wp + inverse_mass_at(model, needle, r, tangent);
  const float limit = c.drag * h * h;
  const float wanted = std::clamp(c.drag_lambda - slip / wt, -limit, limit);
  const float d = wanted - c.drag_lambda;
  c.drag_lambda = wanted;
  push(c.point, x, w, tangent * d);
  push(model, needle, tangent * -d, r);
}

}  // namespace catgut
