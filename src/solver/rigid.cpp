// SPDX-License-Identifier: Apache-2.0
// solver/rigid: reads rigid models, moves rigid bodies. See the header for the paper.
#include "solver/rigid.h"

namespace catgut {
namespace {
constexpr float kTopSpeed = 5, kTopSpin = 300;  // [m/s], [rad/s]: above any tool or needle speed by hand
}

void predict(const RigidModel& m, RigidBody& b, Vec3 gravity, float h) {
  b.prev_x = b.x;
  b.prev_q = b.q;
  if (m.inv_mass == 0) return;
  if (m.gravity) b.v += gravity * h;
  b.x += b.v * h;
  turn(b, b.omega * h);
}

void update_velocity(const RigidModel& m, RigidBody& b, float h, float damping) {
  if (m.inv_mass == 0) return;
  const float keep = 1.0f / (1.0f + damping * h);
  b.v = (b.x - b.prev_x) * (keep / h);
  b.omega = rotation_vector(b.q * conjugate(b.prev_q)) * (keep / h);
  const float speed = length(b.v), spin = length(b.omega);
  if (speed > kTopSpeed) b.v *= kTopSpeed / speed;
  if (spin > kTopSpin) b.omega *= kTopSpin / spin;
}

void solve_weld(const std::vector<RigidModel>& model, std::vector<RigidBody>& body, Weld& weld, float h) {
  if (weld.compliance < 0) return;
  RigidBody& a = body[static_cast<size_t>(weld.a)];
  const RigidModel& ma = model[static_cast<size_t>(weld.a)];
  RigidBody* b = weld.b >= 0 ? &body[static_cast<size_t>(weld.b)] : nullptr;
  const RigidModel* mb = b ? &model[static_cast<size_t>(weld.b)] : nullptr;
  const float inv_h2 = 1.0f / (h * h);

  // Rotation first, so that the lever arm of the positional part is current.
  const Quat qa = a.q * weld.local_a.q;
  const Quat qb = b ? b->q * weld.local_b.q : weld.target.q;
  const Vec3 error = rotation_vector(qb * conjugate(qa));  // turning a by this closes the gap
  const float angle = length(error);
  if (angle > 1e-7f) {
    const Vec3 n = error / angle;
    float w = dot(n, inverse_inertia(ma, a, n));
    if (b) w += dot(n, inverse_inertia(*mb, *b, n));
    const float alpha = weld.angular_compliance * inv_h2;
    const Vec3 d = (error - alpha * weld.angular_lambda) / (w + alpha);
    weld.angular_lambda += d;
    turn(a, inverse_inertia(ma, a, d));
    if (b) turn(*b, inverse_inertia(*mb, *b, -d));
  }

  const Vec3 ra = rotate(a.q, weld.local_a.p);
  const Vec3 rb = b ? rotate(b->q, weld.local_b.p) : Vec3{};
  const Vec3 gap = (b ? b->x + rb : weld.target.p) - (a.x + ra);
  const float distance_now = length(gap);
  const float alpha = weld.compliance * inv_h2;
  const Vec3 residual = gap - alpha * weld.lambda;
  const Vec3 n = normalized(distance_now > 1e-9f ? gap : residual);
  if (length2(n) == 0) return;
  float w = inverse_mass_at(ma, a, ra, n);
  if (b) w += inverse_mass_at(*mb, *b, rb, n);
  const Vec3 d = residual / (w + alpha);
  weld.lambda += d;
  push(ma, a, d, ra);
  if (b) push(*mb, *b, -d, rb);
}

}  // namespace catgut
