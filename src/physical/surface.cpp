// SPDX-License-Identifier: Apache-2.0
// physical/surface: see the header.
#include "physical/surface.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

#include "wall/cut.h"
#include "wall/patch.h"

namespace catgut::physical {
namespace {

struct Corners {
  std::array<uint32_t, 4> column{};
  bool quad = true;
  uint32_t count() const { return quad ? 4 : 3; }
};
Corners corners_of(const wall::Model& m, const wall::Topology& t, uint32_t face) {
  const uint32_t lane = m.lane_of_face[face], block = lane / wall::kLanesOfBlock, in = lane % wall::kLanesOfBlock;
  Corners c;
  for (size_t k = 0; k < 4; ++k) c.column[k] = t.corners[block].column[k][in];
  c.quad = t.corners[block].quads != 0;
  return c;
}

Vec3 mid(const wall::State& s, uint32_t column) { return wall::vec3(s.motion.x[2 * column]); }
Vec3 director(const wall::State& s, uint32_t column) { return wall::vec3(s.motion.x[2 * column + 1]); }

// Nearest point of a patch, in its coordinates. Begins with the foot on a parallelogram.
void nearest(const wall::Patch& patch, Vec3 target, float& xi, float& eta) {
  xi = eta = patch.quad ? 0.0f : 0.6f;
  for (int i = 0; i < 5; ++i) {
    const Vec3 a = patch.along_xi(eta), b = patch.along_eta(xi), r = target - patch.at(xi, eta);
    const float aa = dot(a, a), bb = dot(b, b), ab = dot(a, b), det = aa * bb - ab * ab;
    if (!(det > 1e-12f * aa * bb)) return;
    const float low = patch.quad ? -1.0f : 0.0f, high = patch.quad ? 1.0f : 2.0f, x0 = xi, y0 = eta;
    xi = std::clamp(xi + (bb * dot(r, a) - ab * dot(r, b)) / det, low, high);
    eta = std::clamp(eta + (dot(r, b) - ab * (xi - x0)) / bb, low, high);
    if (!patch.quad) eta = std::min(eta, 2 - xi);
    xi = std::clamp(x0 + (dot(r, a) - ab * (eta - y0)) / aa, low, patch.quad ? high : 2 - eta);
    if (std::abs(xi - x0) + std::abs(eta - y0) < 1e-4f) return;
  }
}

}  // namespace

Surface make_surface(const wall::Model& m, const wall::State& s) {
  const wall::Topology& t = s.topology;
  Surface out;
  out.piece = wall::pieces(s);
  const uint32_t faces = static_cast<uint32_t>(m.lane_of_face.size());
  std::map<std::pair<uint32_t, uint32_t>, int> uses;
  std::vector<std::pair<uint32_t, uint32_t>> edges;
  const auto place = [&](uint32_t column) {
    const uint32_t source = t.source[column];
    return (m.mesh.outer[source] + m.mesh.inner[source]) * 0.5f;
  };
  for (uint32_t f = 0; f < faces; ++f) {
    const Corners c = corners_of(m, t, f);
    for (uint32_t k = 0; k < c.count(); ++k) ++uses[std::minmax(c.column[k], c.column[(k + 1) % c.count()])];
  }
  out.at_rim.assign(t.source.size(), 0);
  for (uint32_t f = 0; f < faces; ++f) {
    const Corners c = corners_of(m, t, f);
    out.first_of_face.push_back(static_cast<uint32_t>(out.patch.size()));
    out.patch.push_back({f, 1, 0}), out.patch.push_back({f, -1, 0});
    for (uint32_t k = 0; k < c.count(); ++k) {
      const uint32_t a = c.column[k], b = c.column[(k + 1) % c.count()];
      if (uses[std::minmax(a, b)] != 1) continue;
      out.patch.push_back({f, 0, k});
      out.at_rim[a] = out.at_rim[b] = 1;
      edges.push_back({a, b});
    }
    Vec3 center{};
    for (uint32_t k = 0; k < c.count(); ++k) center += place(c.column[k]) / static_cast<float>(c.count());
    float radius = 0;
    for (uint32_t k = 0; k < c.count(); ++k) radius = std::max(radius, distance(center, place(c.column[k])));
    out.face_radius.push_back(radius + 0.5f * m.laminate.thickness);
  }
  out.first_of_face.push_back(static_cast<uint32_t>(out.patch.size()));
  for (uint32_t column = 0; column < t.source.size(); ++column) {
    float nearest = 1e3f;
    for (const auto& [a, b] : edges) {
      if (out.piece[a] != out.piece[column]) continue;
      const Vec3 from = place(a), along = place(b) - from, p = place(column) - from;
      const float at = std::clamp(dot(p, along) / std::max(length2(along), 1e-20f), 0.0f, 1.0f);
      nearest = std::min(nearest, length(p - along * at));
    }
    out.edge_distance.push_back(nearest);
  }
  return out;
}

uint32_t column_of(const wall::Model& m, const wall::State& s, uint32_t face) {
  return corners_of(m, s.topology, face).column[0];
}

Foot nearest_on_patch(const wall::Model& m, const wall::State& s, const Surface& surface, uint32_t index, Vec3 p) {
  const Patch& patch = surface.patch[index];
  const Corners c = corners_of(m, s.topology, patch.face);
  Foot foot;
  foot.patch = index;
  wall::Patch b;
  float xi = 0, eta = 0;
  if (patch.side != 0) {
    b.quad = c.quad;
    for (uint32_t k = 0; k < c.count(); ++k)
      b.p[k] = mid(s, c.column[k]) + director(s, c.column[k]) * static_cast<float>(patch.side);
    nearest(b, p, xi, eta);
    foot.point = {patch.face, xi, eta, static_cast<float>(patch.side)};
    foot.facing = cross(b.along_xi(eta), b.along_eta(xi)) * static_cast<float>(patch.side);
    foot.on_edge = c.quad ? std::max(std::abs(xi), std::abs(eta)) > 0.9999f : std::min({xi, eta, 2 - xi - eta}) < 1e-4f;
  } else {
    const uint32_t from = c.column[patch.edge], to = c.column[(patch.edge + 1) % c.count()];
    b.p[0] = mid(s, from) - director(s, from), b.p[1] = mid(s, to) - director(s, to);
    b.p[2] = mid(s, to) + director(s, to), b.p[3] = mid(s, from) + director(s, from);
    nearest(b, p, xi, eta);
    foot.facing = cross(b.along_xi(eta), b.along_eta(xi));
    foot.on_edge = std::max(std::abs(xi), std::abs(eta)) > 0.9999f;
    const float q = xi;
    const float quads[4][2] = {{q, -1}, {1, q}, {-q, 1}, {-1, -q}}, prisms[3][2] = {{1 + q, 0}, {1 - q, 1 + q}, {0, 1 - q}};
    const float* at = c.quad ? quads[patch.edge] : prisms[patch.edge];
    foot.point = {patch.face, at[0], at[1], eta};
  }
  foot.facing = normalized(foot.facing, {0, 0, 1});
  foot.at = b.at(xi, eta);
  const Vec3 r = p - foot.at;
  const float far = length(r), front = dot(r, foot.facing);
  foot.normal = foot.facing;
  foot.gap = front;
  if (foot.on_edge) {
    foot.gap = front >= 0 ? far : -far;
    if (front >= 0 && far > 1e-6f) foot.normal = r / far;
  }
  return foot;
}

void SurfaceSearch::reserve(const wall::Model& m, const wall::State& s, size_t nodes) {
  const size_t faces = m.lane_of_face.size(), columns = wall::columns(s);
  node_listed.reserve(nodes), wall_listed.reserve(2 * columns), center.reserve(faces), radius.reserve(faces);
  node_first.reserve(nodes + 1), node_face.reserve(64 * nodes);
  column_first.reserve(2 * columns + 1), column_face.reserve(64 * columns);
  box.resize(faces);
}

const FaceBox& box_of(const wall::Model& m, const wall::State& s, SurfaceSearch& k, uint32_t face) {
  FaceBox& box = k.box[face];
  if (box.step == k.step) return box;
  box.step = k.step;
  const Corners c = corners_of(m, s.topology, face);
  Vec3 center{}, up{};
  for (uint32_t i = 0; i < c.count(); ++i)
    center += mid(s, c.column[i]) / static_cast<float>(c.count()), up += director(s, c.column[i]);
  box.center = center, box.n = normalized(up, {0, 0, 1});
  const Vec3 along = mid(s, c.column[1]) - mid(s, c.column[0]);
  box.a = normalized(along - box.n * dot(along, box.n), any_perpendicular(box.n));
  box.b = cross(box.n, box.a);
  box.half_a = box.half_b = box.speed = 0;
  for (const int side : {0, 1}) {
    box.low[side] = 1e9f, box.high[side] = -1e9f;
    for (uint32_t i = 0; i < c.count(); ++i) {
      const Vec3 d = director(s, c.column[i]), q = mid(s, c.column[i]) + (side == 1 ? d : -d) - center;
      box.half_a = std::max(box.half_a, std::abs(dot(q, box.a))), box.half_b = std::max(box.half_b, std::abs(dot(q, box.b)));
      const float h = dot(q, box.n);
      box.low[side] = std::min(box.low[side], h), box.high[side] = std::max(box.high[side], h);
    }
  }
  for (uint32_t i = 0; i < c.count(); ++i) {
    const uint32_t column = 2 * c.column[i];
    box.speed = std::max(box.speed, length(wall::vec3(s.motion.v[column])) + length(wall::vec3(s.motion.v[column + 1])));
  }
  return box;
}

float least_distance(const FaceBox& box, Vec3 p, int side) {
  const Vec3 q = p - box.center;
  const float h = dot(q, box.n), da = std::max(0.0f, std::abs(dot(q, box.a)) - box.half_a),
              db = std::max(0.0f, std::abs(dot(q, box.b)) - box.half_b);
  const float low = side > 0 ? box.low[1] : side < 0 ? box.low[0] : std::min(box.low[0], box.low[1]);
  const float high = side > 0 ? box.high[1] : side < 0 ? box.high[0] : std::max(box.high[0], box.high[1]);
  const float dn = std::max(0.0f, std::max(low - h, h - high));
  return std::sqrt(da * da + db * db + dn * dn) * 0.9999f;
}

void find_near(const wall::Model& m, const wall::State& s, const Surface& surface, const thread::State& thread,
               SurfaceSearch& k) {
  const size_t nodes = thread.nodes(), columns = wall::columns(s), faces = m.lane_of_face.size();
  ++k.step;
  k.box.resize(faces);
  bool stale = k.node_listed.size() != nodes || k.wall_listed.size() != columns || k.version != s.topology.version;
  const float limit2 = 0.25f * k.margin * k.margin * 0.25f;  // both may move: a quarter of the margin each
  for (size_t i = 0; i < nodes && !stale; ++i) stale = length2(thread.x.at(i) - k.node_listed[i]) > limit2;
  for (uint32_t c = 0; c < columns && !stale; ++c) stale = length2(mid(s, c) - k.wall_listed[c]) > limit2;
  if (!stale) return;
  k.version = s.topology.version;
  k.node_listed.resize(nodes), k.wall_listed.resize(columns), k.center.resize(faces), k.radius.resize(faces);
  for (size_t i = 0; i < nodes; ++i) k.node_listed[i] = thread.x.at(i);
  for (uint32_t c = 0; c < columns; ++c) k.wall_listed[c] = mid(s, c);
  for (uint32_t f = 0; f < faces; ++f) {
    const Corners c = corners_of(m, s.topology, f);
    Vec3 center{};
    for (uint32_t i = 0; i < c.count(); ++i) center += mid(s, c.column[i]) / static_cast<float>(c.count());
    float radius = 0;
    for (uint32_t i = 0; i < c.count(); ++i)
      radius = std::max(radius, distance(center, mid(s, c.column[i])) + length(director(s, c.column[i])));
    k.center[f] = center, k.radius[f] = radius;
  }
  // Blocks of eight nodes share a sphere.
  k.node_first.clear(), k.node_face.clear();
  constexpr size_t kBlock = 8;
  std::array<uint32_t, 256> near{};
  for (size_t b = 0; b < nodes; b += kBlock) {
    const size_t end = std::min(nodes, b + kBlock);
    Vec3 center{};
    for (size_t i = b; i < end; ++i) center += thread.x.at(i) / static_cast<float>(end - b);
    float radius = 0;
    for (size_t i = b; i < end; ++i) radius = std::max(radius, distance(center, thread.x.at(i)));
    size_t count = 0;
    for (uint32_t f = 0; f < faces; ++f) {
      const float reach = radius + k.radius[f] + k.margin;
      if (length2(k.center[f] - center) < reach * reach && count < near.size()) near[count++] = f;
    }
    for (size_t i = b; i < end; ++i) {
      k.node_first.push_back(static_cast<uint32_t>(k.node_face.size()));
      for (size_t j = 0; j < count; ++j) {
        const float reach = k.radius[near[j]] + k.margin;
        if (length2(k.center[near[j]] - thread.x.at(i)) < reach * reach) k.node_face.push_back(near[j]);
      }
    }
  }
  k.node_first.push_back(static_cast<uint32_t>(k.node_face.size()));
  k.column_first.clear(), k.column_face.clear();
  const auto rest = [&](uint32_t column) {
    const uint32_t source = s.topology.source[column];
    return (m.mesh.outer[source] + m.mesh.inner[source]) * 0.5f;
  };
  for (uint32_t c = 0; c < columns; ++c) {
    k.column_first.push_back(static_cast<uint32_t>(k.column_face.size()));
    if (s.topology.slot[c] == wall::kNone) continue;
    const Vec3 at = mid(s, c), at_rest = rest(c);
    const float half = length(director(s, c));
    for (uint32_t f = 0; f < faces; ++f) {
      const float reach = k.radius[f] + half + k.margin;
      if (length2(k.center[f] - at) > reach * reach) continue;
      const Corners corner = corners_of(m, s.topology, f);
      // Columns of one part of the wall that are adjacent at rest are not paired.
      bool beside = false;
      for (uint32_t i = 0; i < corner.count(); ++i)
        beside |= surface.piece[corner.column[i]] == surface.piece[c] &&
                  (corner.column[i] == c || distance(rest(corner.column[i]), at_rest) < 1.2f * surface.face_radius[f]);
      if (!beside) k.column_face.push_back(f);
    }
  }
  k.column_first.push_back(static_cast<uint32_t>(k.column_face.size()));
}

void find_lips(const wall::Model& m, const wall::State& s, const Surface& surface, SurfaceSearch& search, float friction,
               wall::ContactSolver& solver) {
  constexpr float kDeep = 1e-3f;  // [m] a point so far inside was never outside
  const uint32_t columns = wall::columns(s);
  for (uint32_t c = 0; c < columns; ++c) {
    if (search.column_first[c] == search.column_first[c + 1]) continue;
    for (const float zeta : {-1.0f, 0.0f, 1.0f}) {
      if (zeta == 0 && !surface.at_rim[c]) continue;
      const wall::Weights w = wall::at_column(c, zeta);
      const Vec3 p = wall::place(w, s.motion);
      const Vec3 up = director(s, c);
      const float speed = length(wall::velocity(w, s.motion));
      Foot best;
      best.gap = 1e9f;
      for (uint32_t i = search.column_first[c]; i < search.column_first[c + 1]; ++i) {
        const uint32_t face = search.column_face[i];
        const FaceBox& box = box_of(m, s, search, face);
        const float reach =
            std::min(std::abs(best.gap), std::max(kDeep, solver.reach + 2 * m.step * (box.speed + speed))) + 1e-6f;
        if (least_distance(box, p, 0) > reach) continue;
        for (uint32_t q = surface.first_of_face[face]; q < surface.first_of_face[face + 1]; ++q) {
          if (least_distance(box, p, surface.patch[q].side) > reach) continue;
          const Foot foot = nearest_on_patch(m, s, surface, q, p);
          if (foot.gap < -kDeep || std::abs(foot.gap) > std::abs(best.gap)) continue;
          if (foot.gap < 0 && foot.on_edge) continue;
          // The wall of the point itself lies behind it, outside the other part: the inner side for a point of a face.
          if (!surface.at_rim[c] && dot(foot.normal, up) * zeta > -0.3f * length(up)) continue;
          best = foot;
        }
      }
      if (best.gap > 1e8f) continue;
      wall::Contact k;
      k.self = true;
      k.point = w;
      k.other = wall::weights(m, s.topology, best.point);
      if (best.gap > solver.reach &&
          best.gap > solver.reach + 2 * m.step * length(wall::velocity(w, s.motion) - wall::velocity(k.other, s.motion)))
        continue;
      k.key = (uint64_t{1} << 62) | (uint64_t{c} << 2) | static_cast<uint64_t>(zeta + 1);
      k.normal = best.normal, k.gap = best.gap, k.friction = friction;
      solver.contact.push_back(k);
    }
  }
}

}  // namespace catgut::physical
