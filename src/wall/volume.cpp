// SPDX-License-Identifier: Apache-2.0
// wall/volume: the least volume of an element's corners, as an inequality on where velocities lead, as of a contact. Its
// impulses keep the wall's momentum and do not rebound.
#include <algorithm>
#include <cmath>
#include <utility>

#include "wall/wall.h"

namespace catgut::wall {
namespace {

constexpr float kLeast = 0.1f;       // of the volume at rest
constexpr float kRecovers = 0.1f;    // of what is missing of that, in a step
constexpr float kFlatAtRest = 0.3f;  // of the mean corner: one below that at rest is left as it is
constexpr int kRounds = 60;          // over corners that share columns
constexpr float kTurns = 0.3f;       // of a director's length, in a step
constexpr float kFast = 0.25f;       // [m/s] of a column: then its corners may lose all of their volume in a step

// [m^3] that the edges and the director of a corner span at rest.
float rest_volume(const ElementBlock& block, uint32_t lane, bool quad, size_t k, float& middle) {
  const auto c = [&](uint32_t i) { return block.constant[i][lane]; };
  middle = 4 * (c(kA1x) * c(kA2y) - c(kA1y) * c(kA2x)) * c(kD0z);
  if (!quad) return middle;
  constexpr float kXi[] = {-1, 1, 1, -1}, kEta[] = {-1, -1, 1, 1};
  const Vec3 h1{c(kH1x), c(kH1y), c(kH1z)}, h4{c(kH4x), c(kH4y), c(kH4z)};
  const Vec3 d0{c(kD0x), c(kD0y), c(kD0z)}, h2{c(kH2x), c(kH2y), c(kH2z)}, h3{c(kH3x), c(kH3y), c(kH3z)};
  const Vec3 a1{c(kA1x), c(kA1y), 0}, a2{c(kA2x), c(kA2y), 0};
  return 4 * dot(cross(a1 + h1 * kEta[k], a2 + h1 * kXi[k]), d0 + h2 * kXi[k] + h3 * kEta[k] + h4 * (kXi[k] * kEta[k]));
}

// True: an impulse was needed.
bool stop(const Topology& t, Motion& motion, const FlatCorner& c, float h) {
  const uint32_t index[] = {2 * c.at, 2 * c.next, 2 * c.last, 2 * c.at + 1};
  Vec3 from[4], to[4];
  for (size_t i = 0; i < 4; ++i) from[i] = vec3(motion.x[index[i]]), to[i] = from[i] + vec3(motion.v[index[i]]) * h;
  const auto volume = [](const Vec3* p) { return dot(cross(p[1] - p[0], p[2] - p[0]), p[3]); };
  const float now = volume(from), aim = now < c.least ? now + (c.least - now) * kRecovers : c.least;
  const float missing = aim - volume(to);
  if (missing <= 0) return false;
  Vec3 way[4];
  way[1] = cross(to[2] - to[0], to[3]), way[2] = cross(to[3], to[1] - to[0]), way[0] = -(way[1] + way[2]);
  way[3] = cross(to[1] - to[0], to[2] - to[0]);
  float w[4], sum = 0;
  for (size_t i = 0; i < 4; ++i) {
    const uint32_t column = index[i] / 2;
    w[i] = t.slot[column] == kNone ? 0.0f : i == 3 ? t.inv_dir[column] : 1 / t.mass[column];
    sum += w[i] * length2(way[i]);
  }
  if (!(sum > 0)) return false;
  const float impulse = missing / (h * sum);
  for (size_t i = 0; i < 4; ++i) motion.v[index[i]] = float4(vec3(motion.v[index[i]]) + way[i] * (w[i] * impulse));
  return true;
}

}  // namespace

void keep_volumes(const Model& m, State& s, Scratch& k) {
  const uint32_t wholes = static_cast<uint32_t>(m.block.size());
  const auto is_fast = [&](uint32_t column) {
    const Float4* v = &s.motion.v[2 * column];
    return std::max(length2(vec3(v[0])), length2(vec3(v[1]))) > kFast * kFast;
  };
  bool any_fast = false;
  for (uint32_t c = 0; c < columns(s) && !any_fast; ++c) any_fast = is_fast(c);
  k.flat_corner.clear();
  for (uint32_t b = 0; b < s.topology.corners.size(); ++b) {
    if (!k.block_force[b].flat && !any_fast) continue;
    const ElementBlock& block = b < wholes ? m.block[b] : s.topology.extra[b - wholes];
    const BlockCorners& corners = s.topology.corners[b];
    const bool quad = corners.quads != 0;
    const size_t n = quad ? 4 : 3;
    for (uint32_t lane = 0; lane < kLanesOfBlock; ++lane) {
      // The lane of a face that is divided is idle.
      if (const uint32_t face = b < wholes ? m.face_of_lane[b * kLanesOfBlock + lane] : kNone;
          face != kNone && fragments(s.topology, face) > 0)
        continue;
      bool fast = false;
      for (size_t i = 0; i < n && any_fast; ++i) fast = fast || is_fast(corners.column[i][lane]);
      if (!k.block_force[b].flat && !fast) continue;
      for (size_t i = 0; i < n; ++i) {
        float middle = 0;
        const float rest = rest_volume(block, lane, quad, i, middle);
        if (rest <= kFlatAtRest * middle) continue;
        k.flat_corner.push_back(
            {corners.column[i][lane], corners.column[(i + 1) % n][lane], corners.column[(i + n - 1) % n][lane], kLeast * rest});
      }
    }
  }
  // What turns or stretches a director farther than that in one step is beyond the derivatives below. Angular momentum is lost.
  for (const FlatCorner& c : k.flat_corner) {
    Float4& v = s.motion.v[2 * c.at + 1];
    const float most = kTurns * length(vec3(s.motion.x[2 * c.at + 1])) / m.step, speed = length(vec3(v));
    if (speed > most) v = float4(vec3(v) * (most / speed));
  }
  bool moved = true;
  for (int round = 0; round < kRounds && std::exchange(moved, false); ++round)
    for (const FlatCorner& c : k.flat_corner) moved |= stop(s.topology, s.motion, c, m.step);
}

}  // namespace catgut::wall
