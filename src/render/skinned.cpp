// SPDX-License-Identifier: Apache-2.0
// render/skinned: see skinned.h.
#include "render/skinned.h"

namespace catgut {

namespace {

constexpr float kStill = 3e-6f;        // [m] a twentieth of a pixel in a close view
constexpr float kStillTurn = 0.0005f;  // of a quaternion: 1 mrad, with a similar displacement of a vertex

bool still(Quat a, Quat b) {
  return std::abs(a.x - b.x) + std::abs(a.y - b.y) + std::abs(a.z - b.z) + std::abs(a.w - b.w) < kStillTurn;
}

}  // namespace

void find_motion(std::span<const Vec3> particle_rest, std::span<const Vec3> particle, std::span<const Quat> rotation,
                 Motions& motion) {
  const bool first = motion.of.size() != particle_rest.size();
  motion.of.resize(particle_rest.size());
  motion.moved.resize(particle_rest.size());
  motion.seen.resize(particle_rest.size());
  for (size_t i = 0; i < particle_rest.size(); ++i) {
    const Quat q = rotation[i];
    motion.moved[i] = first || !(length2(particle[i] - motion.seen[i]) < kStill * kStill && still(q, motion.of[i].q));
    if (!motion.moved[i]) continue;
    motion.seen[i] = particle[i];
    const Vec3 x = rotate(q, {1, 0, 0}), y = rotate(q, {0, 1, 0}), z = rotate(q, {0, 0, 1});
    const Vec3 p = particle_rest[i], shift = particle[i] - (x * p.x + y * p.y + z * p.z);
    motion.of[i] = {{x.x, x.y, x.z, y.x, y.y, y.z, z.x, z.y, z.z, shift.x, shift.y, shift.z}, q};
  }
}

Skinned follow(const SkinnedVertex& v, std::span<const Motion> motion) {
  const Motion* m[4] = {&motion[v.slot[0]], &motion[v.slot[1]], &motion[v.slot[2]], &motion[v.slot[3]]};
  float b[12];
  for (int j = 0; j < 12; ++j)
    b[j] = v.weight[0] * m[0]->m[j] + v.weight[1] * m[1]->m[j] + v.weight[2] * m[2]->m[j] + v.weight[3] * m[3]->m[j];
  // q and -q are the same rotation: all four on the side of the first, or they would cancel.
  const Quat a = m[0]->q;
  Quat q{a.x * v.weight[0], a.y * v.weight[0], a.z * v.weight[0], a.w * v.weight[0]};
  for (int k = 1; k < 4; ++k) {
    const Quat c = m[k]->q;
    const float w = a.x * c.x + a.y * c.y + a.z * c.z + a.w * c.w < 0 ? -v.weight[size_t(k)] : v.weight[size_t(k)];
    q.x += w * c.x, q.y += w * c.y, q.z += w * c.z, q.w += w * c.w;
  }
  const float l2 = q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w;
  const Vec3 p = v.rest;
  const Vec3 position{b[9] + b[0] * p.x + b[3] * p.y + b[6] * p.z, b[10] + b[1] * p.x + b[4] * p.y + b[7] * p.z,
                      b[11] + b[2] * p.x + b[5] * p.y + b[8] * p.z};
  if (!(l2 > 1e-6f && l2 < 10)) return {position, v.frame};
  const float s = 1 / std::sqrt(l2);
  return {position, Quat{q.x * s, q.y * s, q.z * s, q.w * s} * v.frame};
}

}  // namespace catgut
