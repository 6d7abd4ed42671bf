// SPDX-License-Identifier: Apache-2.0
// anatomy/wall: thickens a sheet into a wall of particles, clusters, tetrahedra and a watertight surface.
#include "anatomy/wall.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/check.h"
#include "geometry/topology.h"

namespace catgut {

namespace {

constexpr size_t kClusterMembers = 16;
uint32_t outer(uint32_t v) { return 2 * v; }
uint32_t inner(uint32_t v) { return 2 * v + 1; }

// Members by distance from the center: the farthest are dropped first.
void keep_nearest(std::vector<uint32_t>& member, std::span<const Vec3> position) {
  if (member.size() <= kClusterMembers) return;
  const Vec3 c = position[member[0]];
  std::stable_sort(member.begin() + 1, member.end(), [&](uint32_t a, uint32_t b) {
    const float da = length2(position[a] - c), db = length2(position[b] - c);
    return da != db ? da < db : a < b;
  });
  member.resize(kClusterMembers);
  std::sort(member.begin() + 1, member.end());
}

void add_clusters(BodyRest& body, const TriangleMesh& sheet) {
  const uint32_t n = static_cast<uint32_t>(sheet.position.size());
  const auto next = vertex_neighbors(sheet.triangle, n);
  body.cluster.resize(2 * n);
  for (uint32_t v = 0; v < n; ++v) {
    for (const uint32_t side : {0u, 1u}) {
      auto& member = body.cluster[2 * v + side];
      for (uint32_t u : next[v]) member.insert(member.end(), {outer(u), inner(u)});
      member.push_back(2 * v + 1 - side);
      std::sort(member.begin(), member.end());
      member.insert(member.begin(), 2 * v + side);
      keep_nearest(member, body.position);
    }
  }
}

// A prism between the two sides splits into three tetrahedra. Each of its square faces is cut from the inner particle of the
// lower sheet vertex to the outer particle of the higher one. The neighbor, with the same two vertices, makes the same cut.
void add_prism(std::vector<Tet>& tet, Triangle t) {
  // Rotating the smallest to the front keeps the orientation; then at most the last two are out of order.
  std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
  const bool flipped = t[1] > t[2];
  if (flipped) std::swap(t[1], t[2]);
  Tet three[3] = {{inner(t[0]), inner(t[1]), inner(t[2]), outer(t[2])},
                  {inner(t[0]), inner(t[1]), outer(t[2]), outer(t[1])},
                  {inner(t[0]), outer(t[1]), outer(t[2]), outer(t[0])}};
  for (Tet& x : three) {
    if (flipped) std::swap(x[0], x[1]);
    tet.push_back(x);
  }
}

void add_surface(BodyRest& body, const TriangleMesh& sheet) {
  for (const Triangle& t : sheet.triangle) body.surface.push_back({outer(t[0]), outer(t[1]), outer(t[2])});
  for (const Triangle& t : sheet.triangle) body.surface.push_back({inner(t[0]), inner(t[2]), inner(t[1])});
  for (const auto& loop : boundary_loops(sheet.triangle)) {
    Rim rim;
    for (size_t i = 0; i < loop.size(); ++i) {
      // boundary_loops runs against the sheet's own half-edges, which is the direction of the strip along the outer side.
      const uint32_t a = loop[i], b = loop[(i + 1) % loop.size()];
      body.surface.push_back({outer(a), outer(b), inner(b)});
      body.surface.push_back({outer(a), inner(b), inner(a)});
      rim.outer.push_back(outer(a));
      rim.inner.push_back(inner(a));
    }
    body.rim.push_back(std::move(rim));
  }
}

// The odd particle lies in the middle of one prism, connected to its six corners and the rest of the surrounding ring.
void add_extra(BodyRest& body, const Triangle& host) {
  const uint32_t extra = static_cast<uint32_t>(body.position.size());
  std::vector<uint32_t> member{extra};
  Vec3 sum;
  for (uint32_t v : host) {
    member.push_back(outer(v));
    member.push_back(inner(v));
    sum += body.position[outer(v)] + body.position[inner(v)];
  }
  body.position.push_back(sum / 6.0f);
  body.layer.push_back(TissueLayer::mucosa);
  body.cluster.push_back(std::move(member));
  // Its mean share is taken from all others, so that the organ has the correct mass.
  double total = 0;
  for (float m : body.mass) total += m;
  for (float& m : body.mass) m *= static_cast<float>(extra) / static_cast<float>(extra + 1);
  body.mass.push_back(static_cast<float>(total / (extra + 1)));
}

}  // namespace

double tet_volume(std::span<const Vec3> position, const Tet& tet) {
  const Vec3 o = position[tet[0]];
  const Vec3 a = position[tet[1]] - o, b = position[tet[2]] - o, c = position[tet[3]] - o;
  const double cx = static_cast<double>(a.y) * b.z - static_cast<double>(a.z) * b.y;
  const double cy = static_cast<double>(a.z) * b.x - static_cast<double>(a.x) * b.z;
  const double cz = static_cast<double>(a.x) * b.y - static_cast<double>(a.y) * b.x;
  return (cx * c.x + cy * c.y + cz * c.z) / 6.0;
}

std::vector<Vec3> wall_directions(const TriangleMesh& sheet, float thickness) {
  std::vector<Vec3> direction = vertex_normals(sheet);
  const auto next = vertex_neighbors(sheet.triangle, sheet.position.size());
  std::vector<Tet> tet;
  for (const Triangle& t : sheet.triangle) add_prism(tet, t);
  std::vector<Vec3> position(2 * sheet.position.size());
  constexpr int rounds = 40;
  for (int round = 0; round < rounds; ++round) {
    for (size_t v = 0; v < sheet.position.size(); ++v) {
      position[2 * v] = sheet.position[v];
      position[2 * v + 1] = sheet.position[v] - direction[v] * thickness;
    }
    std::vector<uint8_t> folded(sheet.position.size(), 0);
    bool any = false;
    for (const Tet& t : tet) {
      // A margin above zero: slivers make a poor solid.
      const Vec3 o = position[t[0]];
      const float flat = length(cross(position[t[1]] - o, position[t[2]] - o)) * thickness / 6;
      if (tet_volume(position, t) > 0.1 * flat) continue;
      any = true;
      for (uint32_t p : t) folded[p / 2] = 1;
    }
    if (!any) break;
    std::vector<Vec3> smoother = direction;
    for (size_t v = 0; v < folded.size(); ++v) {
      if (!folded[v]) continue;
      for (uint32_t u : next[v]) smoother[v] += direction[u];
      smoother[v] = normalized(smoother[v], direction[v]);
    }
    direction = std::move(smoother);
  }
  return direction;
}

namespace {

// A wall of full thickness would fold over itself inside a sharp bend. It is thinner there, down to a tenth, with a
// transition over the neighbors. Returns the number of inverted tetrahedra, also if half of the wall would be thinner.
size_t thin_where_folded(BodyRest& body, const TriangleMesh& sheet, std::span<const Vec3> normal, float thickness) {
  constexpr float kThinnest = 0.1f, kThinner = 0.75f, kGrowth = 1.4f;
  std::vector<float> share;
  std::vector<std::vector<uint32_t>> next;
  for (int round = 0;; ++round) {
    size_t inverted = 0;
    std::vector<uint8_t> folded(sheet.position.size(), 0);
    for (const Tet& t : body.tet) {
      if (tet_volume(body.position, t) > 0) continue;
      ++inverted;
      for (uint32_t p : t) folded[p / 2] = 1;
    }
    if (inverted == 0 || round == 30) return inverted;
    // A wall that is thinner almost everywhere is not the requested one.
    if (2 * std::count_if(share.begin(), share.end(), [](float f) { return f < 0.99f; }) > static_cast<long>(share.size()))
      return inverted;
    if (share.empty()) share.assign(sheet.position.size(), 1), next = vertex_neighbors(sheet.triangle, sheet.position.size());
    for (size_t v = 0; v < share.size(); ++v)
      if (folded[v]) share[v] = std::max(kThinnest, kThinner * share[v]);
    for (int pass = 0; pass < 4; ++pass)
      for (size_t v = 0; v < share.size(); ++v)
        for (uint32_t u : next[v]) share[v] = std::min(share[v], kGrowth * share[u]);
    for (size_t v = 0; v < share.size(); ++v)
      body.position[inner(static_cast<uint32_t>(v))] = sheet.position[v] - normal[v] * (thickness * share[v]);
  }
}

}  // namespace

BodyRest thicken(const TriangleMesh& sheet, std::span<const Vec3> normal, const WallSpec& wall) {
  CATGUT_CHECK(normal.size() == sheet.position.size() && !sheet.triangle.empty());
  CATGUT_CHECK(wall.thickness > 0 && wall.density > 0);
  BodyRest body;
  const size_t n = sheet.position.size();
  for (size_t v = 0; v < n; ++v) {
    body.position.push_back(sheet.position[v]);
    body.position.push_back(sheet.position[v] - normal[v] * wall.thickness);
    body.layer.insert(body.layer.end(), {TissueLayer::serosa, TissueLayer::mucosa});
  }
  body.radius = 0.5f * wall.thickness;
  for (const Triangle& t : sheet.triangle) add_prism(body.tet, t);
  const size_t inverted = thin_where_folded(body, sheet, normal, wall.thickness);
  std::vector<double> mass(2 * n, 0.0);
  for (const Tet& t : body.tet) {
    const double v = tet_volume(body.position, t);
    for (uint32_t p : t) mass[p] += 0.25 * wall.density * v;
  }
  if (inverted > 0) {
    throw InputError(wall.name,
                     fmt::format("a wall of {:.2f} mm is too thick for this surface: it folds over itself in {} places",
                                 1e3 * wall.thickness, inverted),
                     "give a thinner wall, fewer particles, or smooth the surface where it bends sharply");
  }
  for (double m : mass) body.mass.push_back(static_cast<float>(m));
  add_clusters(body, sheet);
  add_surface(body, sheet);
  if (wall.extra_particle) add_extra(body, sheet.triangle[wall.extra_triangle]);
  body.pinned.assign(body.position.size(), 0);
  return body;
}

}  // namespace catgut
