// SPDX-License-Identifier: Apache-2.0
// physical/cut_mesh: see the header.
#include "physical/cut_mesh.h"

#include <algorithm>
#include <map>

namespace catgut::physical {
namespace {

using wall::LatticePoint;

constexpr int32_t kUnit = wall::kLattice / wall::kRaster;
uint32_t key_of(LatticePoint p) { return static_cast<uint32_t>(p.v / kUnit * (wall::kRaster + 1) + p.u / kUnit); }

// Corners of a cell, counter-clockwise.
uint32_t corners_of_cell(bool quad, const wall::Raster& r, uint32_t cell, std::array<LatticePoint, 4>& out) {
  const int32_t u = r.center[cell].u / kUnit * kUnit, v = r.center[cell].v / kUnit * kUnit;
  if (quad) return out = {{{u, v}, {u + kUnit, v}, {u + kUnit, v + kUnit}, {u, v + kUnit}}}, 4;
  if (r.center[cell].u % kUnit > kUnit / 2) return out = {{{u + kUnit, v}, {u + kUnit, v + kUnit}, {u, v + kUnit}, {}}}, 3;
  return out = {{{u, v}, {u + kUnit, v}, {u, v + kUnit}, {}}}, 3;
}

// Places of the lattice points of a face. The steps of a cut between cells are smoothed, on both lips alike.
std::array<std::array<float, 2>, 81> smoothed(const wall::Topology& t, uint32_t face, bool quad) {
  const wall::Raster& r = wall::raster(quad);
  std::array<std::array<float, 2>, 81> at{}, out{};
  std::array<std::array<uint32_t, 2>, 81> beside{};
  std::array<uint8_t, 81> count{};
  for (int32_t j = 0; j <= wall::kRaster; ++j)
    for (int32_t i = 0; i <= wall::kRaster; ++i)
      wall::to_natural(quad, {i * kUnit, j * kUnit}, at[static_cast<size_t>(j * 9 + i)][0],
                       at[static_cast<size_t>(j * 9 + i)][1]);
  out = at;
  const uint32_t first = t.first_fragment[face];
  const auto fragment_of = [&](uint32_t cell) {
    uint32_t f = first;
    while (!(t.fragment[f].cells >> cell & 1)) ++f;
    return f;
  };
  for (uint32_t l = 0; l < r.inner; ++l) {
    if (fragment_of(r.link[l].a) == fragment_of(r.link[l].b)) continue;
    LatticePoint a, b;
    wall::border_of(quad, r.link[l], a, b);
    for (const auto& [from, to] : {std::pair{key_of(a), key_of(b)}, std::pair{key_of(b), key_of(a)}})
      if (count[from]++ < 2) beside[from][count[from] - 1u] = to;
  }
  for (uint32_t k = 0; k < 81; ++k) {
    const int32_t i = static_cast<int32_t>(k % 9), j = static_cast<int32_t>(k / 9);
    const bool border = i == 0 || j == 0 || (quad ? i == wall::kRaster || j == wall::kRaster : i + j == wall::kRaster);
    if (border || count[k] != 2) continue;
    for (size_t d = 0; d < 2; ++d) out[k][d] = 0.5f * at[k][d] + 0.25f * (at[beside[k][0]][d] + at[beside[k][1]][d]);
  }
  return out;
}

}  // namespace

const LatticeTable& lattice(bool quad) {
  static const auto make = [](bool q) {
    LatticeTable out;
    const wall::Raster& r = wall::raster(q);
    for (uint32_t cell = 0; cell < wall::kCells; ++cell) {
      std::array<LatticePoint, 4> c;
      out.corners = corners_of_cell(q, r, cell, c);
      for (uint32_t k = 0; k < out.corners; ++k) out.corner[cell][k] = static_cast<uint8_t>(key_of(c[k]));
    }
    for (uint32_t e = 0; e < r.edges; ++e)
      for (uint32_t k = 0; k <= wall::kRaster; ++k)
        out.on_edge[e][k] = static_cast<uint8_t>(key_of(wall::on_edge(q, e, static_cast<int32_t>(k) * kUnit)));
    for (uint32_t l = 0; l < r.links; ++l) {
      if (l >= r.inner) {
        const uint32_t e = (l - r.inner) / wall::kRaster, k = (l - r.inner) % wall::kRaster;
        out.border[l] = {out.on_edge[e][k], out.on_edge[e][k + 1]};
        continue;
      }
      LatticePoint a, b;
      wall::border_of(q, r.link[l], a, b);
      out.border[l] = {static_cast<uint8_t>(key_of(a)), static_cast<uint8_t>(key_of(b))};
    }
    return out;
  };
  static const LatticeTable quads = make(true), triangles = make(false);
  return quad ? quads : triangles;
}

namespace {

// Where a strip lies on the face's own edges. kNone: within the face.
struct OnEdge {
  uint32_t edge = wall::kNone, piece = 0;
};
OnEdge edge_of(const LatticeTable& lattice, uint32_t edges, uint32_t a, uint32_t b) {
  for (uint32_t e = 0; e < edges; ++e)
    for (uint32_t k = 0; k < wall::kRaster; ++k) {
      const uint32_t from = lattice.on_edge[e][k], to = lattice.on_edge[e][k + 1];
      if ((from == a && to == b) || (from == b && to == a)) return {e, k};
    }
  return {};
}

}  // namespace

CutMesh make_cut_mesh(const Model& m, const wall::Topology& t, const Surface& surface, bool layers) {
  CutMesh out;
  out.version = t.version;
  // Borders of the layers, from the inner face.
  std::vector<float> level{-1};
  for (const TearModel::LayerShare& l : m.tear.layer)
    if (layers) level.push_back(l.top);
  if (!layers) level.push_back(1);
  level.back() = 1;
  const uint32_t faces = static_cast<uint32_t>(m.wall.lane_of_face.size());
  std::array<std::array<float, 2>, 81> at{};
  for (uint32_t e = faces; e < wall::elements(m.wall, t); ++e) {
    const wall::Fragment& part = t.fragment[e - faces];
    const bool quad = m.wall.mesh.face[part.face][3] != wall::kNone;
    const wall::Raster& r = wall::raster(quad);
    if (out.hidden.empty() || out.hidden.back() != part.face) {
      out.hidden.push_back(part.face);
      at = smoothed(t, part.face, quad);
    }
    std::map<std::pair<uint32_t, size_t>, uint32_t> known;  // lattice point and level
    const auto vertex = [&](LatticePoint p, size_t l, uint32_t cell) {
      const auto [found, is_new] = known.try_emplace({key_of(p), l}, static_cast<uint32_t>(out.vertex.size()));
      if (!is_new) return found->second;
      CutMesh::Vertex v;
      v.point = {part.face, 0, 0, level[l]};
      wall::to_natural(quad, r.center[cell], v.point.xi, v.point.eta);  // in this part
      v.lattice = key_of(p);
      v.at = wall::weights(m.wall, t, v.point);
      const auto [xi, eta] = at[key_of(p)];
      if (quad)
        v.at.weight = {0.25f * (1 - xi) * (1 - eta), 0.25f * (1 + xi) * (1 - eta), 0.25f * (1 + xi) * (1 + eta),
                       0.25f * (1 - xi) * (1 + eta)};
      else v.at.weight = {1 - 0.5f * (xi + eta), 0.5f * xi, 0.5f * eta, 0};
      out.vertex.push_back(v);
      return found->second;
    };
    const size_t top = level.size() - 1;
    for (uint32_t cell = 0; cell < wall::kCells; ++cell) {
      if (!(part.cells >> cell & 1)) continue;
      std::array<LatticePoint, 4> c;
      const uint32_t n = corners_of_cell(quad, r, cell, c);
      if (n == 4 && (c[0].u + c[0].v) / kUnit % 2) std::rotate(c.begin(), c.begin() + 1, c.end());  // the other diagonal
      for (uint32_t k = 1; k + 1 < n; ++k) {
        out.face.push_back(
            {{vertex(c[0], top, cell), vertex(c[k], top, cell), vertex(c[k + 1], top, cell)}, CutSide::outer, 0});
        out.face.push_back({{vertex(c[0], 0, cell), vertex(c[k + 1], 0, cell), vertex(c[k], 0, cell)}, CutSide::inner, 0});
      }
    }
    for (uint32_t q = surface.first_of_face[e]; q < surface.first_of_face[e + 1]; ++q) {
      const Patch& p = surface.patch[q];
      if (p.side != 0) continue;
      const auto to_lattice_point = [&](std::array<float, 2> x) {
        const float half = 0.5f * wall::kRaster, off = quad ? 1.0f : 0.0f;
        return LatticePoint{static_cast<int32_t>((x[0] + off) * half + 0.5f) * kUnit,
                            static_cast<int32_t>((x[1] + off) * half + 0.5f) * kUnit};
      };
      const LatticePoint a = to_lattice_point(p.at[0]), b = to_lattice_point(p.at[1]);
      const uint32_t cell = wall::cell_at(quad, p.at[2][0], p.at[2][1]);
      const OnEdge on = edge_of(lattice(quad), r.edges, key_of(a), key_of(b));
      const bool rim = on.edge != wall::kNone && m.wall.neighbor[part.face][on.edge] == wall::kNone;  // of the uncut wall
      // The same diagonal as on the other lip.
      const bool forward = on.edge == wall::kNone
                               ? key_of(a) < key_of(b)
                               : (lattice(quad).on_edge[on.edge][on.piece] == key_of(a)) == (on.piece % 2 == 0);
      for (size_t l = 0; l < top; ++l) {
        const CutSide side = rim ? CutSide::rim : CutSide::cut_edge;
        const uint32_t a0 = vertex(a, l, cell), b0 = vertex(b, l, cell), a1 = vertex(a, l + 1, cell),
                       b1 = vertex(b, l + 1, cell);
        out.face.push_back({forward ? std::array{a0, b0, b1} : std::array{a0, b0, a1}, side, static_cast<uint8_t>(l)});
        out.face.push_back({forward ? std::array{a0, b1, a1} : std::array{b0, b1, a1}, side, static_cast<uint8_t>(l)});
      }
    }
  }
  return out;
}

}  // namespace catgut::physical
