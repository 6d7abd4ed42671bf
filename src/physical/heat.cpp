// SPDX-License-Identifier: Apache-2.0
// physical/heat: see the header.
#include "physical/heat.h"

#include <algorithm>
#include <cmath>

#include "core/elementary.h"
#include "physical/near_faces.h"

namespace catgut::physical {
namespace {

constexpr float kFelt = 1e-4f;                               // [K] a face with less is at the body's temperature
constexpr float kLogRate = 226.78f, kEnergyOverGas = 75536;  // ln(3.1e98), 6.28e5 J/mol over 8.314 J/(mol K) [K]

bool is_quad(const wall::Model& m, uint32_t face) { return m.mesh.face[face][3] != wall::kNone; }
Vec3 middle(const wall::Model& m, uint32_t column) { return (m.mesh.outer[column] + m.mesh.inner[column]) * 0.5f; }

// [m] of a face's cells along its two directions; [m2] of one cell.
struct CellSize {
  float u = 0, v = 0, area = 0;
};
CellSize cell_size(const wall::Model& m, uint32_t face) {
  const auto& c = m.mesh.face[face];
  const bool quad = is_quad(m, face);
  const Vec3 a = middle(m, c[0]), b = middle(m, c[1]), d = middle(m, quad ? c[3] : c[2]);
  Vec3 u = b - a, v = d - a;
  if (quad) u = (u + middle(m, c[2]) - d) * 0.5f, v = (v + middle(m, c[2]) - b) * 0.5f;
  const float area = length(cross(u, v)) * (quad ? 1.0f : 0.5f) / wall::kCells;
  return {length(u) / wall::kRaster, length(v) / wall::kRaster, area};
}

// [m] of a cell's border on edge e, and from the border to the cell's center.
struct Border {
  float length = 0, depth = 0;
};
Border border_at(const wall::Model& m, uint32_t face, uint32_t e, float area) {
  const auto& c = m.mesh.face[face];
  const bool quad = is_quad(m, face);
  const float length = distance(middle(m, c[e]), middle(m, c[(e + 1) % (quad ? 4 : 3)])) / wall::kRaster;
  return {length, (quad ? 0.5f : 2.0f / 3) * area / length};
}

void add_warm(std::vector<uint32_t>& warm, uint32_t face) {
  const auto at = std::lower_bound(warm.begin(), warm.end(), face);
  if (at == warm.end() || *at != face) warm.insert(at, face);
}

Vec3 center_of(const wall::Model& m, uint32_t face, uint32_t cell) {
  wall::Point p{face, 0, 0, 0};
  wall::to_natural(is_quad(m, face), wall::raster(is_quad(m, face)).center[cell], p.xi, p.eta);
  return wall::rest_place(m, p);
}

}  // namespace

void heat_at(const HeatModel& law, const wall::Model& m, const wall::Point& tip, float power, bool coagulate, float h,
             Heat& heat) {
  const size_t faces = m.mesh.face.size();
  if (heat.warmer.empty()) heat.warmer.assign(faces, {}), heat.damage.assign(faces, {}), heat.warm.reserve(faces);
  const float radius = coagulate ? law.radius_coagulate : law.radius_cut;
  const float energy = (coagulate ? law.share_coagulate : law.share_cut) * power * h;
  std::array<uint32_t, 40> near;
  const size_t count = near_faces(m, tip.face, near);
  wall::Point mid = tip;
  mid.zeta = 0;
  const Vec3 at = wall::rest_place(m, mid);
  struct Spot {
    uint32_t face = 0, cell = 0;
    float weight = 0, area = 0;
  };
  std::array<Spot, 1024> spot;
  size_t spots = 0;
  float sum = 0;
  for (size_t i = 0; i < count; ++i) {
    if (is_beyond(m, near[i], at, 2 * radius)) continue;
    const CellSize size = cell_size(m, near[i]);
    for (uint32_t c = 0; c < wall::kCells && spots < spot.size(); ++c) {
      const float d2 = length2(center_of(m, near[i], c) - at) / (radius * radius);
      if (d2 > 4) continue;
      spot[spots] = {near[i], c, portable::exp(-d2) * size.area, size.area};
      sum += spot[spots++].weight;
    }
  }
  for (size_t i = 0; i < spots; ++i) {
    const Spot& s = spot[i];
    float& warmer = heat.warmer[s.face][s.cell];
    warmer = std::min(kBoiling, warmer + energy * s.weight / (sum * law.capacity * m.laminate.thickness * s.area));
    add_warm(heat.warm, s.face);
  }
}

void conduct(const HeatModel& law, const wall::Model& m, const wall::Topology& t, std::span<const wall::Point> path, float h,
             HeatScratch& scratch, Heat& heat) {
  if (heat.warm.empty()) return;
  // Heat enters the neighbors of warm faces.
  std::vector<uint32_t>& active = scratch.active;
  active.reserve(m.mesh.face.size()), scratch.next.reserve(m.mesh.face.size());
  active.assign(heat.warm.begin(), heat.warm.end());
  for (const uint32_t f : heat.warm)
    for (const uint32_t over : m.neighbor[f])
      if (over != wall::kNone) add_warm(active, over / 4);
  std::vector<std::array<float, wall::kCells>>& next = scratch.next;
  next.resize(active.size());
  for (size_t i = 0; i < active.size(); ++i) {
    const uint32_t f = active[i];
    const bool quad = is_quad(m, f);
    const wall::Raster& r = wall::raster(quad);
    const CellSize size = cell_size(m, f);
    // Per direction of the borders between its cells: along the face's edges. Triangles: the centers are two thirds of a height
    // apart, twice. Explicit steps of the diffusion equation are stable up to a quarter.
    std::array<float, 3> part{};
    for (uint32_t e = 0; e < (quad ? 2u : 3u); ++e) {
      const float border = border_at(m, f, e, size.area).length;
      const float apart = quad ? (e == 0 ? size.v : size.u) : 4 * size.area / (3 * border);
      part[e] = std::min(0.2f, law.diffusivity * h * (quad ? 1 / apart : border / size.area) / apart);
    }
    const auto& here = heat.warmer[f];
    auto& out = next[i] = here;
    const auto is_cut = [&](uint32_t face, uint32_t link) { return !t.cut.empty() && t.cut[face].has(link); };
    for (uint32_t link = 0; link < r.inner; ++link) {
      if (is_cut(f, link)) continue;
      const auto& l = r.link[link];
      wall::LatticePoint from, to;
      wall::border_of(quad, l, from, to);
      const float k = part[from.v == to.v ? 0 : quad ? 1 : from.u == to.u ? 2 : 1];
      const float flow = k * (here[l.b] - here[l.a]);
      out[l.a] += flow, out[l.b] -= flow;
    }
    for (uint32_t e = 0; e < r.edges; ++e) {
      const uint32_t over = m.neighbor[f][e];
      if (over == wall::kNone) continue;
      const uint32_t other = over / 4, edge = over % 4;
      const wall::Raster& there = wall::raster(is_quad(m, other));
      const bool turned = m.mesh.face[other][edge] != m.mesh.face[f][e];
      // Both faces find the same flow of energy.
      const Border mine_at = border_at(m, f, e, size.area), its_at = border_at(m, other, edge, cell_size(m, other).area);
      const float k = std::min(0.2f, law.diffusivity * h * mine_at.length / ((mine_at.depth + its_at.depth) * size.area));
      for (uint32_t n = 0; n < wall::kRaster; ++n) {
        const uint32_t mine = r.over_edge(e, n), its = there.over_edge(edge, turned ? wall::kRaster - 1 - n : n);
        if (is_cut(f, mine) || is_cut(other, its)) continue;
        out[r.link[mine].a] += k * (heat.warmer[other][there.link[its].a] - here[r.link[mine].a]);
      }
    }
  }
  heat.warm.clear();
  const float keep = 1 - std::min(1.0f, h / law.cooling);
  for (size_t i = 0; i < active.size(); ++i) {
    const uint32_t f = active[i];
    bool warm = false;
    for (uint32_t c = 0; c < wall::kCells; ++c) {
      float& now = heat.warmer[f][c];
      now = next[i][c] * keep;
      warm = warm || now > kFelt;
      float& damage = heat.damage[f][c];
      if (now < 8 || damage >= 1) continue;
      damage += h * portable::exp(kLogRate - kEnergyOverGas / (kBody + now));
      if (damage < 1) continue;
      damage = 1;
      heat.area += cell_size(m, f).area;
      const Vec3 at = center_of(m, f, c);
      float least = 1;
      for (wall::Point p : path) p.zeta = 0, least = std::min(least, length2(wall::rest_place(m, p) - at));
      if (!path.empty()) heat.spread = std::max(heat.spread, std::sqrt(least));
    }
    if (warm) heat.warm.push_back(f);
    else heat.warmer[f] = {};
  }
}

}  // namespace catgut::physical
