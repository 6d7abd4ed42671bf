// SPDX-License-Identifier: Apache-2.0
// solver/rigid: six-degree-of-freedom bodies (needle and tools) inside the XPBD substep (Mueller et al. 2020, Detailed rigid
// body simulation with extended position based dynamics). One solver, two-way coupling, one force.
#pragma once
#include <vector>

#include "core/math.h"

namespace catgut {

struct Capsule {
  Vec3 a, b;         // [m] ends of the axis, body frame
  float radius = 0;  // [m]
};

struct RigidModel {
  float inv_mass = 0;            // [1/kg]
  Vec3 inv_inertia;              // [1/(kg m^2)] principal, body frame
  std::vector<Capsule> capsule;  // what it collides with
  bool gravity = false;          // a tool's weight is carried by the hand
};

struct RigidBody {
  Vec3 x;  // [m] center of mass
  Quat q;
  Vec3 v, omega;  // [m/s], [rad/s]
  Vec3 prev_x;    // at the start of the substep
  Quat prev_q;
  Pose pose() const { return {x, q}; }
};

// I^-1 applied to a world vector.
inline Vec3 inverse_inertia(const RigidModel& m, const RigidBody& b, Vec3 t) {
  const Vec3 l = rotate(conjugate(b.q), t);
  return rotate(b.q, {l.x * m.inv_inertia.x, l.y * m.inv_inertia.y, l.z * m.inv_inertia.z});
}
// Inverse mass [1/kg] seen by an impulse along the unit vector n at r = point - x (world).
inline float inverse_mass_at(const RigidModel& m, const RigidBody& b, Vec3 r, Vec3 n) {
  const Vec3 c = cross(r, n);
  return m.inv_mass + dot(c, inverse_inertia(m, b, c));
}
inline void turn(RigidBody& b, Vec3 rotation) {
  const Quat d = Quat{rotation.x, rotation.y, rotation.z, 0} * b.q;
  b.q = normalized(Quat{b.q.x + 0.5f * d.x, b.q.y + 0.5f * d.y, b.q.z + 0.5f * d.z, b.q.w + 0.5f * d.w});
}
// Applies the positional impulse p [kg m] at r = point - x.
inline void push(const RigidModel& m, RigidBody& b, Vec3 p, Vec3 r) {
  b.x += p * m.inv_mass;
  turn(b, inverse_inertia(m, b, cross(r, p)));
}
// Where the material point now at r + x was at the start of the substep.
inline Vec3 previous_point(const RigidBody& b, Vec3 r) { return b.prev_x + rotate(b.prev_q, rotate(conjugate(b.q), r)); }

void predict(const RigidModel& m, RigidBody& b, Vec3 gravity, float h);
// Velocities from the change of pose; `damping` [1/s].
void update_velocity(const RigidModel& m, RigidBody& b, float h, float damping);

// Holds frame `local_a` of body a to frame `local_b` of body b, or, if b < 0, to the world frame `target`: a compliant
// six-degree-of-freedom weld. The multipliers are the force [N] and torque [N m] times h^2.
struct Weld {
  int a = -1, b = -1;
  Pose local_a, local_b, target;
  float compliance = 0;          // [m/N]; negative: the weld is open
  float angular_compliance = 0;  // [rad/(N m)]
  Vec3 lambda, angular_lambda;   // cleared at the start of a substep; act on a
};
void solve_weld(const std::vector<RigidModel>& model, std::vector<RigidBody>& body, Weld& weld, float h);

}  // namespace catgut
