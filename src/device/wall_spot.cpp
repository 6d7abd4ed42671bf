// SPDX-License-Identifier: Apache-2.0
// device: see wall_spot.h.
#include "device/wall_spot.h"

#include <algorithm>

#include "device/steer.h"

namespace catgut {
namespace {

constexpr float kSeen = 0.0045f;  // [m] from the line of sight: two columns
constexpr float kDeep = 0.006f;   // [m] behind the first: still the same face
constexpr float kJaws = 0.002f;   // [m] of the jaws, from the rim
constexpr float kLean = 0.3f;     // of a clamp's shaft, outward

// particle: the outer one of a column.
Vec3 outward(const Snapshot& seen, uint32_t particle, Vec3 otherwise) {
  return normalized(seen.particle[particle] - seen.particle[particle + 1], otherwise);
}

// Copies of columns, which a cut has made, follow the threads.
uint32_t first_copy(const PictureModel& picture) {
  uint32_t first = 2 * picture.columns;
  for (const SuturePicture& s : picture.suture) first = std::max(first, s.thread_first + s.thread_count);
  return first;
}

// Unit, at rest: out of the opening of a wall.
Vec3 rest_axis(const PictureModel& picture, size_t wall) {
  const std::vector<uint32_t>& rim = picture.rim[wall];
  Vec3 center{}, body{}, normal{};
  for (const uint32_t i : rim) center += picture.particle_rest[i] / static_cast<float>(rim.size());
  for (size_t k = 0; k < rim.size(); ++k)
    normal += cross(picture.particle_rest[rim[k]] - center, picture.particle_rest[rim[(k + 1) % rim.size()]] - center);
  for (uint32_t i = 0; i < 2 * picture.columns; ++i)
    if (picture.wall[i] == wall) body += picture.particle_rest[i] - center;
  return normalized(dot(normal, body) > 0 ? -normal : normal, {0, 1, 0});
}

Vec3 turned(const Snapshot& seen, uint32_t particle, Vec3 rest) {
  return particle < seen.rotation.size() ? rotate(seen.rotation[particle], rest) : rest;
}

bool known(const PictureModel& picture, const Snapshot& seen) {
  return picture.columns > 0 && !picture.rim.empty() && seen.particle.size() >= 2 * picture.columns &&
         picture.wall.size() >= 2 * picture.columns;
}

Pose frame_at(Vec3 at, Vec3 x, Vec3 z) {
  z = normalized(z);
  x = normalized(x - z * dot(x, z), any_perpendicular(z));
  return {at, from_axes(x, cross(z, x), z)};
}

}  // namespace

std::optional<WallSpot> wall_under(const ViewFrame& view, Vec3 pointer, const PictureModel& picture, const Snapshot& seen) {
  if (!known(picture, seen)) return {};
  const Vec3 ray = normalized(pointer - view.eye, view.ahead);
  const uint32_t copies = first_copy(picture), all = static_cast<uint32_t>(seen.particle.size());
  const auto each = [&](const auto& look) {
    for (uint32_t i = 0; i < 2 * picture.columns; i += 2) look(i);
    for (uint32_t i = copies; i + 1 < all; i += 2) look(i);  // a cut has two edges
  };
  // Of an outer face that is turned to the eye: the nearest column, then all those around that belong to the same face.
  const auto on_it = [&](uint32_t i, float& deep, float& aside2) {
    const Vec3 off = seen.particle[i] - view.eye;
    deep = dot(off, ray), aside2 = length2(off - ray * deep);
    return aside2 < kSeen * kSeen && dot(seen.particle[i] - seen.particle[i + 1], ray) < 0;
  };
  float first = 1e9f;
  each([&](uint32_t i) {
    if (float deep, aside2; on_it(i, deep, aside2)) first = std::min(first, deep);
  });
  if (first > 1e8f) return {};
  WallSpot spot;
  float weight = 0, nearest = 1e9f;
  uint32_t at = 0;
  each([&](uint32_t i) {
    float deep, aside2;
    if (!on_it(i, deep, aside2) || deep > first + kDeep) return;
    const float w = 1 / (aside2 + 1e-7f);
    spot.at += w * seen.particle[i], spot.out += w * outward(seen, i, -ray), weight += w;
    spot.thick += w * distance(seen.particle[i], seen.particle[i + 1]);
    if (aside2 < nearest) nearest = aside2, at = i;
  });
  spot.at = spot.at / weight, spot.thick /= weight, spot.out = normalized(spot.out, -ray);
  // From the mean place to the line of sight, along the face.
  const float facing = dot(spot.out, ray);
  if (facing < -0.1f) spot.at = view.eye + ray * (dot(spot.at - view.eye, spot.out) / facing);
  const size_t wall = at < picture.wall.size() ? picture.wall[at] : 0;
  const Vec3 axis = turned(seen, at, rest_axis(picture, std::min(wall, picture.rim.size() - 1)));
  spot.up = normalized(axis - spot.out * dot(axis, spot.out), any_perpendicular(spot.out));
  return spot;
}

std::optional<WallSpot> rim_beside(const ViewFrame& view, Vec3 pointer, float reach, const PictureModel& picture,
                                   const Snapshot& seen) {
  if (!known(picture, seen)) return {};
  const Vec3 ray = normalized(pointer - view.eye, view.ahead);
  std::optional<WallSpot> best;
  for (size_t w = 0; w < picture.rim.size(); ++w) {
    const std::vector<uint32_t>& rim = picture.rim[w];
    for (size_t k = 0; k < rim.size(); ++k) {
      const uint32_t a = rim[k] & ~1u, b = rim[(k + 1) % rim.size()] & ~1u;
      if (b + 1 >= 2 * picture.columns || a + 1 >= 2 * picture.columns) continue;
      // The nearest place between two columns to the line of sight.
      const Vec3 from = seen.particle[a] - view.eye, way = seen.particle[b] - seen.particle[a];
      const Vec3 from_across = from - ray * dot(from, ray), way_across = way - ray * dot(way, ray);
      const float s = std::clamp(-dot(from_across, way_across) / std::max(length2(way_across), 1e-12f), 0.0f, 1.0f);
      const float far = length(from_across + way_across * s);
      if (far >= reach) continue;
      reach = far;
      WallSpot spot;
      spot.at = lerp(seen.particle[a], seen.particle[b], s);
      spot.thick = distance(seen.particle[a], seen.particle[a + 1]);
      const Vec3 rest = rest_axis(picture, w), up = lerp(turned(seen, a, rest), turned(seen, b, rest), s);
      spot.out = normalized(lerp(outward(seen, a, -ray), outward(seen, b, -ray), s), -ray);
      spot.up = normalized(up - spot.out * dot(up, spot.out), any_perpendicular(spot.out));
      best = spot;
    }
  }
  return best;
}

Pose tip_on(const WallSpot& s, float above) { return frame_at(s.at + s.out * above, cross(s.up, s.out), s.out + s.up * 0.25f); }
Pose blades_at(const WallSpot& s) { return frame_at(s.at - s.out * (0.5f * s.thick), s.out, s.up); }
Pose jaws_at(const WallSpot& s) {
  return frame_at(s.at - s.out * (0.5f * s.thick) - s.up * kJaws, s.out, s.up + s.out * kLean);
}

}  // namespace catgut
