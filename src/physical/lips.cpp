// SPDX-License-Identifier: Apache-2.0
// physical/lips: contacts of the wall with itself. Declared in physical/surface.h.
#include <algorithm>
#include <cmath>

#include "physical/surface.h"

namespace catgut::physical {
namespace {

Vec3 director(const wall::State& s, uint32_t column) { return wall::vec3(s.motion.x[2 * column + 1]); }

}  // namespace

void find_lips(const wall::Model& m, const wall::State& s, const Surface& surface, SurfaceSearch& search, float friction,
               wall::ContactSolver& solver) {
  constexpr float kDeep = 1e-3f;     // [m] a point so far inside was never outside
  constexpr float kApart = 1.3e-3f;  // [m] a point so far from a face has no contact with it
  const uint32_t columns = wall::columns(s);
  constexpr float kTurned = 0.5f;    // cosine to the last normal: less is another side
  constexpr float kRound = 0.3e-3f;  // [m] beyond a border
  const bool fast = solver.reach + 4 * m.step * search.speed > kDeep;
  auto last = solver.last.begin();  // in the order of keys, as the points below
  for (uint32_t c = 0; c < columns; ++c) {
    if (search.column_first[c] == search.column_first[c + 1] || (!fast && search.moved < search.column_due[c])) continue;
    float nearest_box = 1e9f;
    for (const float zeta : {-1.0f, 0.0f, 1.0f}) {
      if (zeta == 0 && !surface.at_rim[c]) continue;
      const wall::Weights w = wall::at_column(c, zeta);
      const Vec3 p = wall::place(w, s.motion);
      const Vec3 up = director(s, c);
      const float speed = length(wall::velocity(w, s.motion));
      const uint64_t key = (uint64_t{1} << 62) | (uint64_t{c} << 2) | static_cast<uint64_t>(zeta + 1);
      while (last != solver.last.end() && last->key < key) ++last;
      const wall::Contact* before = last != solver.last.end() && last->key == key ? &*last : nullptr;
      Foot best;
      best.gap = 1e9f;
      const auto look = [&](const FaceBox& box, uint32_t q) {
        const float reach =
            std::min(std::abs(best.gap), std::max(kDeep, solver.reach + 2 * m.step * (box.speed + speed))) + 1e-6f;
        if (least_distance(m, s, surface, search, box, q, p) > reach ||
            least_of_part(surface, search, q, p) > std::abs(best.gap) + 1e-6f)
          return;
        const Foot foot = nearest_on_patch(m, s, surface, q, p, corners_in(search, q));
        if (foot.gap < -kDeep || std::abs(foot.gap) > std::abs(best.gap)) return;
        if (std::abs(foot.gap) == std::abs(best.gap) && q < best.patch) return;  // whatever was looked at first
        // What was on one side of a wall stays there: the nearest side would let two edges hook into each other. An edge ends
        // in a sharp border here; a real one is round, and what has come against it still meets it a little beyond.
        if (before && dot(foot.normal, before->normal) < kTurned) return;
        if (foot.gap < 0 && foot.on_edge && length2(cross(p - foot.at, foot.facing)) > (before ? kRound * kRound : 0)) return;
        // The wall of the point itself lies behind it, outside the other part: the inner side for a point of a face.
        if (!surface.at_rim[c] && dot(foot.normal, up) * zeta > -0.3f * length(up)) return;
        best = foot;
      };
      // Most likely still the nearest: the others need not be searched.
      uint32_t& known = search.lip_patch[3 * c + static_cast<uint32_t>(zeta + 1)];
      const uint32_t first = known;
      if (first != wall::kNone) look(box_of(m, s, search, surface.patch[first].face), first);
      for (uint32_t i = search.column_first[c]; i < search.column_first[c + 1]; ++i) {
        const uint32_t face = search.column_face[i];
        const FaceBox& box = box_of(m, s, search, face);
        const float far = least_distance(box, p, 0);
        nearest_box = std::min(nearest_box, far);
        if (far > std::min(std::abs(best.gap), std::max(kDeep, solver.reach + 2 * m.step * (box.speed + speed))) + 1e-6f)
          continue;
        for (uint32_t q = surface.first_of_face[face]; q < surface.first_of_face[face + 1]; ++q)
          if (q != first) look(box, q);
      }
      known = best.gap > 1e8f ? wall::kNone : best.patch;
      if (best.gap > 1e8f) continue;
      wall::Contact k;
      k.self = true;
      k.point = w;
      k.other = wall::weights(m, s.topology, best.point);
      if (best.gap > solver.reach &&
          best.gap > solver.reach + 2 * m.step * length(wall::velocity(w, s.motion) - wall::velocity(k.other, s.motion)))
        continue;
      k.key = key;
      k.normal = best.normal, k.gap = best.gap, k.friction = friction;
      solver.contact.push_back(k);
    }
    search.column_due[c] = search.moved + 0.5 * static_cast<double>(nearest_box - kApart);  // both may move
  }
}

}  // namespace catgut::physical
