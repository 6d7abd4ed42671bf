// SPDX-License-Identifier: Apache-2.0
// physical/lips: contacts of the wall with itself. Declared in physical/surface.h.
#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "physical/surface.h"

namespace catgut::physical {
namespace {

constexpr float kDeep = 1e-3f;     // [m] a point so far inside was never outside
constexpr float kApart = 1.3e-3f;  // [m] a point so far from a face has no contact with it
constexpr float kTurned = 0.5f;    // cosine to the last normal: less is another side
constexpr float kRound = 0.3e-3f;  // [m] beyond a border
// Cosine between a face and the direction out of the point's own wall: more is behind it. Of its own piece, of another one.
constexpr float kBehindOwn = -0.3f, kBehind = 0.3f;
// Grooves.
constexpr float kTouching = 0.1e-3f;                   // [m] a point so near to one face is looked at for others
constexpr float kLike = 0.95f;                         // cosine between normals: more is one face
constexpr float kSame = 1e-6f;                         // [m]
constexpr float kAdjoin = 20e-6f;                      // [m] from the plane of a face to the border of the next one
constexpr float kWide = 0.5e-3f;                       // [m] along it
constexpr float kClosest = kDeep + kWide + kTouching;  // [m] a face beyond that has no part in a groove
constexpr float kCloseBy = kClosest + 0.4e-3f;         // [m] of a column's close faces

Vec3 director(const wall::State& s, uint32_t column) { return wall::vec3(s.motion.x[2 * column + 1]); }

// A point of the wall that may touch another part of it.
struct Lip {
  uint32_t column = 0;
  float zeta = 0;
  Vec3 at;                                // [m]
  std::span<const wall::Contact> before;  // its contacts in the last step
};

// What was on one side of a wall stays there: the nearest side would let two edges hook into each other.
bool is_other_side(const Lip& lip, const Foot& foot) {
  return !lip.before.empty() && std::none_of(lip.before.begin(), lip.before.end(),
                                             [&](const wall::Contact& k) { return dot(foot.normal, k.normal) >= kTurned; });
}

// The wall of the point itself lies behind it, outside the other part: the inner side for a point of a face. A face of another
// piece may stand steeply on it.
bool is_behind(const wall::Model& m, const wall::State& s, const Surface& surface, const Lip& lip, const Foot& foot) {
  if (surface.at_rim[lip.column]) return false;
  const bool own = surface.piece[lip.column] == surface.piece[column_of(m, s, surface.patch[foot.patch].face)];
  const Vec3 up = director(s, lip.column);
  return dot(foot.normal, up) * lip.zeta > (own ? kBehindOwn : kBehind) * length(up);
}

// The nearest point of another part of the wall, on these faces; a gap of 1e9 if there is none. known: the patch that had it in
// the last step, or kNone. speed: of the lip [m/s]. reach [m]: how far it is sought, beside their motion. bound: of the last
// search, becomes that of this one; the patches that are not on these faces are not nearer than `beyond` [m].
Foot find_foot(const wall::Model& m, const wall::State& s, const Surface& surface, SurfaceSearch& search,
               std::span<const uint32_t> faces, const Lip& lip, float speed, float reach, uint32_t known, float beyond,
               SurfaceSearch::LipBound& bound) {
  Foot best;
  best.gap = 1e9f;
  const auto reach_of = [&](const FaceBox& box) {
    return std::min(std::abs(best.gap), std::max(kDeep, reach + 2 * m.step * (box.speed + speed))) + 1e-6f;
  };
  // Returns [m] at least: how far the patch is.
  const auto look = [&](const FaceBox& box, uint32_t q) {
    const float far = least_distance(m, s, surface, search, box, q, lip.at);
    if (far > reach_of(box)) return far;
    if (const float part = least_of_part(surface, search, q, lip.at); part > std::abs(best.gap) + 1e-6f) return part;
    const Foot foot = nearest_on_patch(m, s, surface, q, lip.at, corners_in(search, q));
    if (foot.gap < -kDeep || std::abs(foot.gap) > std::abs(best.gap)) return far;
    if (std::abs(foot.gap) == std::abs(best.gap) && q < best.patch) return far;  // whatever was looked at first
    if (is_other_side(lip, foot)) return far;
    // An edge ends in a sharp border here; a real one is round, and what has come against it still meets it a little beyond.
    const float past = lip.before.empty() ? 0 : kRound;
    if (foot.gap < 0 && foot.on_edge && length2(cross(lip.at - foot.at, foot.facing)) > past * past) return far;
    if (is_behind(m, s, surface, lip, foot)) return far;
    best = foot;
    return far;
  };
  // Most likely still the nearest: the others need not be searched, and not looked at while they cannot have come nearer.
  float far_known = 1e9f;
  if (known != wall::kNone) {
    far_known = look(box_of(m, s, search, surface.patch[known].face), known);
    const float of_other = bound.of_other - 2 * static_cast<float>(search.moved - bound.moved);  // both may move
    if (best.patch == known && best.gap < 1e8f && of_other > std::abs(best.gap) + 2e-6f) {
      bound = {search.moved, std::min(far_known, of_other), of_other};
      return best;
    }
  }
  float of_other = beyond;
  for (const uint32_t face : faces) {
    const FaceBox& box = box_of(m, s, search, face);
    const float far = least_distance(box, lip.at, 0);
    if (far > reach_of(box)) {
      of_other = std::min(of_other, far);
      continue;
    }
    for (uint32_t q = surface.first_of_face[face]; q < surface.first_of_face[face + 1]; ++q) {
      if (q == known) continue;
      const Foot before = best;
      const float far_off = look(box, q);
      // That which was the nearest is another one now.
      if (best.patch != before.patch || before.gap != best.gap) of_other = std::min(of_other, far_known), far_known = far_off;
      else of_other = std::min(of_other, far_off);
    }
  }
  bound = {search.moved, std::min(far_known, of_other), of_other};
  return best;
}

// Whether the faces of both feet make a groove: each lies in front of the other. Beyond the border of `b`, they do where that
// adjoins `a`.
bool make_groove(const Foot& a, const Foot& b) {
  if (a.patch == b.patch || dot(b.facing, a.facing) > kLike) return false;
  const Vec3 between = b.at - a.at;
  if (!b.on_edge) return dot(between, a.facing) > -kSame && dot(between, b.facing) < kSame;
  if (std::abs(dot(between, a.facing)) > kAdjoin || length2(between) > kWide * kWide || dot(b.inward, a.facing) <= 0)
    return false;
  return a.on_edge ? dot(a.inward, b.facing) > 0 : dot(between, b.facing) < kSame;
}

// In a groove a point touches two faces, in a pit three. With the nearest one alone it jumps to and fro between them, and both
// walls shake. Returns how many feet there are. Rims are strips with edges all along: they have one.
uint32_t find_groove(const wall::Model& m, const wall::State& s, const Surface& surface, SurfaceSearch& search,
                     std::span<const uint32_t> faces, const Lip& lip, std::array<Foot, 3>& foot) {
  uint32_t feet = 1;
  if (lip.before.empty() || foot[0].gap > kTouching || surface.patch[foot[0].patch].side == 0 || surface.at_rim[lip.column])
    return feet;
  for (; feet < foot.size(); ++feet) {
    Foot& next = foot[feet];
    next.gap = kTouching;
    for (const uint32_t face : faces) {
      const FaceBox& box = box_of(m, s, search, face);
      if (least_distance(box, lip.at, 0) > kDeep) continue;
      for (uint32_t q = surface.first_of_face[face]; q < surface.first_of_face[face + 1]; ++q) {
        if (surface.patch[q].side == 0 || least_distance(m, s, surface, search, box, q, lip.at) > kDeep ||
            least_of_part(surface, search, q, lip.at) > kDeep)
          continue;
        Foot seen = nearest_on_patch(m, s, surface, q, lip.at, corners_in(search, q));
        if (seen.gap < -kDeep || is_other_side(lip, seen) || is_behind(m, s, surface, lip, seen)) continue;
        // Beyond its border a face of a groove counts as a plane: the other one continues behind it.
        if (seen.on_edge) seen.gap = dot(lip.at - seen.at, seen.facing), seen.normal = seen.facing;
        if (seen.gap >= next.gap || seen.gap < -kDeep) continue;
        if (std::all_of(foot.begin(), foot.begin() + feet, [&](const Foot& f) { return make_groove(f, seen); })) next = seen;
      }
    }
    if (next.gap >= kTouching) break;
    if (foot[0].on_edge && foot[0].gap < 0) foot[0].gap = dot(lip.at - foot[0].at, foot[0].facing);
  }
  return feet;
}

// Which of its three contacts this one continues; `taken` has a bit for each that another foot has.
uint32_t place_of(const Lip& lip, const Foot& foot, uint32_t taken) {
  uint32_t free = ~taken, best = 3;
  float most = kTurned;
  for (const wall::Contact& old : lip.before) {
    const uint32_t at = old.key & 3;
    if (const float like = dot(old.normal, foot.normal); like >= most && !(taken >> at & 1)) most = like, best = at;
    free &= ~(1u << at);
  }
  for (uint32_t at = 0; at < 3 && best == 3; ++at)
    if (free >> at & 1) best = at;
  for (uint32_t at = 0; at < 3 && best == 3; ++at)
    if (!(taken >> at & 1)) best = at;
  return best;
}

// Those of a column's faces that may be nearer to it than kClosest. The others are farther than `least` [m].
std::span<const uint32_t> close_faces(const wall::Model& m, const wall::State& s, const Surface& surface, SurfaceSearch& search,
                                      uint32_t column, std::span<const uint32_t> all, float& least) {
  SurfaceSearch::Close& close = search.column_close[column];
  uint32_t* const list = &search.column_close_face[kClose * column];
  const auto left = [&] { return close.within - 2 * static_cast<float>(search.moved - close.moved); };  // both may move
  if (left() < kClosest) {
    close = {{}, search.moved, 1e9f, 0};
    std::array<Vec3, 3> at;
    for (size_t i = 0; i < at.size(); ++i) at[i] = wall::place(wall::at_column(column, static_cast<float>(i) - 1), s.motion);
    for (const uint32_t face : all) {
      const FaceBox& box = box_of(m, s, search, face);
      float far = std::min(least_distance(box, at[0], 0), least_distance(box, at[2], 0));
      if (surface.at_rim[column]) far = std::min(far, least_distance(box, at[1], 0));
      if (far < kCloseBy && close.count < kClose) list[close.count++] = face;
      else close.within = std::min(close.within, far);
    }
  }
  if (left() < kClosest) return all;
  least = left();
  return {list, close.count};
}

}  // namespace

void find_lips(const wall::Model& m, const wall::State& s, const Surface& surface, SurfaceSearch& search, float friction,
               wall::ContactSolver& solver) {
  const uint32_t columns = wall::columns(s);
  const bool fast = solver.reach + 4 * m.step * search.speed > kDeep;
  auto last = solver.last.begin();  // in the order of keys, as the points below
  for (uint32_t c = 0; c < columns; ++c) {
    if (search.column_first[c] == search.column_first[c + 1] || (!fast && search.moved < search.column_due[c])) continue;
    float beyond = 1e9f, nearest = 1e9f;
    std::span<const uint32_t> faces;
    for (const float zeta : {-1.0f, 0.0f, 1.0f}) {
      if (zeta == 0 && !surface.at_rim[c]) continue;
      const wall::Weights w = wall::at_column(c, zeta);
      const float speed = length(wall::velocity(w, s.motion));
      SurfaceSearch::LipBound& bound = search.lip_bound[3 * c + static_cast<uint32_t>(zeta + 1)];
      // Too far to touch anything in this step.
      const float left = bound.least - 2 * static_cast<float>(search.moved - bound.moved);
      if (left > solver.reach + 2 * m.step * (speed + search.speed) + 2e-6f) {
        nearest = std::min(nearest, left);
        continue;
      }
      if (faces.empty()) {
        faces = {&search.column_face[search.column_first[c]], search.column_first[c + 1] - search.column_first[c]};
        if (!fast) faces = close_faces(m, s, surface, search, c, faces, beyond);
      }
      // States saved before grooves have 1 << 62 and other places of the bits: their contacts match none here.
      const uint64_t key = (uint64_t{3} << 62) | (uint64_t{c} << 4) | (static_cast<uint64_t>(zeta + 1) << 2);
      while (last != solver.last.end() && last->key < key) ++last;
      auto after = last;
      while (after != solver.last.end() && after->key >> 2 == key >> 2) ++after;
      const Lip lip{c, zeta, wall::place(w, s.motion), {last, after}};
      uint32_t& known = search.lip_patch[3 * c + static_cast<uint32_t>(zeta + 1)];
      const Foot best = find_foot(m, s, surface, search, faces, lip, speed, solver.reach, known, beyond, bound);
      nearest = std::min(nearest, bound.least);
      known = best.gap > 1e8f ? wall::kNone : best.patch;
      if (best.gap > 1e8f) continue;
      wall::Contact k;
      k.self = true;
      k.point = w;
      k.other = wall::weights(m, s.topology, best.point);
      if (best.gap > solver.reach &&
          best.gap > solver.reach + 2 * m.step * length(wall::velocity(w, s.motion) - wall::velocity(k.other, s.motion)))
        continue;
      k.friction = friction;
      std::array<Foot, 3> foot{best};
      const uint32_t feet = find_groove(m, s, surface, search, faces, lip, foot);
      uint32_t taken = 0;
      for (uint32_t i = 0; i < feet; ++i) {
        if (i > 0 && solver.contact.size() == solver.contact.capacity()) break;
        const uint32_t at = place_of(lip, foot[i], taken);
        taken |= 1u << at;
        k.key = key + at;
        k.other = wall::weights(m, s.topology, foot[i].point);
        k.normal = foot[i].normal, k.gap = foot[i].gap;
        solver.contact.push_back(k);
      }
    }
    search.column_due[c] = search.moved + 0.5 * static_cast<double>(nearest - kApart);  // both may move
  }
}

}  // namespace catgut::physical
