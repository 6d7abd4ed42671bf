// SPDX-License-Identifier: Apache-2.0
// physical/surface: see the header.
#include "physical/surface.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "core/clones.h"
#include "core/elementary.h"
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
  const uint32_t lane = wall::lane_of_element(m, t, face), block = lane / wall::kLanesOfBlock, in = lane % wall::kLanesOfBlock;
  Corners c;
  for (size_t k = 0; k < 4; ++k) c.column[k] = t.corners[block].column[k][in];
  c.quad = t.corners[block].quads != 0;
  return c;
}

Vec3 mid(const wall::State& s, uint32_t column) { return wall::vec3(s.motion.x[2 * column]); }
Vec3 director(const wall::State& s, uint32_t column) { return wall::vec3(s.motion.x[2 * column + 1]); }

// A place on an element, beyond its cells too.
Vec3 place_on(const wall::State& s, const Corners& c, std::array<float, 2> at, float zeta) {
  const auto [xi, eta] = at;
  float w[4] = {0.25f * (1 - xi) * (1 - eta), 0.25f * (1 + xi) * (1 - eta), 0.25f * (1 + xi) * (1 + eta),
                0.25f * (1 - xi) * (1 + eta)};
  if (!c.quad) w[1] = 0.5f * xi, w[2] = 0.5f * eta, w[0] = 1 - w[1] - w[2];
  Vec3 out{};
  for (uint32_t k = 0; k < c.count(); ++k) out += (mid(s, c.column[k]) + director(s, c.column[k]) * zeta) * w[k];
  return out;
}

// Whether the wall ends at half link k of an edge.
bool open_at(const wall::Model& m, const wall::Topology& t, uint32_t face, uint32_t edge, uint32_t k) {
  const uint32_t over = m.neighbor[face][edge];
  if (over == wall::kNone) return true;
  if (t.cut.empty()) return false;
  const auto quad = [&](uint32_t f) { return m.mesh.face[f][3] != wall::kNone; };
  const bool turned = m.mesh.face[over / 4][over % 4] != m.mesh.face[face][edge];
  return t.cut[face].has(wall::raster(quad(face)).over_edge(edge, k)) ||
         t.cut[over / 4].has(wall::raster(quad(over / 4)).over_edge(over % 4, turned ? wall::kRaster - 1 - k : k));
}

std::array<float, 2> natural(bool quad, wall::LatticePoint p) {
  std::array<float, 2> at{};
  wall::to_natural(quad, p, at[0], at[1]);
  return at;
}

// Patches of a fragment: blocks of cells on both sides, then strips wherever a cell has no neighbor any more.
void add_fragment(const wall::Model& m, const wall::Topology& t, uint32_t element, Surface& out) {
  const wall::Fragment& part = t.fragment[element - m.lane_of_face.size()];
  const bool quad = m.mesh.face[part.face][3] != wall::kNone;
  const wall::Raster& r = wall::raster(quad);
  constexpr int32_t unit = wall::kLattice / wall::kRaster;
  const auto has = [&](uint32_t cell) { return (part.cells >> cell & 1) != 0; };
  const auto both_sides = [&](Patch p) {
    p.face = element, p.part = true, p.quad = quad;
    p.side = 1, out.patch.push_back(p);
    p.side = -1, out.patch.push_back(p);
  };
  if (quad) {
    // Runs of cells in a row, as far up as the rows above have the same run.
    uint64_t left = part.cells;
    while (left) {
      const uint32_t first = static_cast<uint32_t>(__builtin_ctzll(left)), row = first / wall::kRaster,
                     from = first % wall::kRaster;
      uint32_t to = from;
      while (to + 1 < wall::kRaster && left >> (row * wall::kRaster + to + 1) & 1) ++to;
      const uint64_t run = ((uint64_t{2} << (to - from)) - 1) << from;
      uint32_t top = row;
      for (uint32_t j = row; j < wall::kRaster && (left >> (j * wall::kRaster) & run) == run; ++j)
        left &= ~(run << (j * wall::kRaster)), top = j;
      const int32_t u0 = static_cast<int32_t>(from) * unit, u1 = static_cast<int32_t>(to + 1) * unit;
      const int32_t v0 = static_cast<int32_t>(row) * unit, v1 = static_cast<int32_t>(top + 1) * unit;
      Patch p;
      p.at = {natural(true, {u0, v0}), natural(true, {u1, v0}), natural(true, {u1, v1}), natural(true, {u0, v1})};
      both_sides(p);
    }
  } else {
    for (uint32_t cell = 0; cell < wall::kCells; ++cell) {
      if (!has(cell)) continue;
      const wall::LatticePoint c = r.center[cell];
      const int32_t i = c.u / unit, j = c.v / unit;
      const bool down = c.u % unit > unit / 2;
      Patch p;
      if (down)
        p.at = {natural(false, {(i + 1) * unit, j * unit}),
                natural(false, {(i + 1) * unit, (j + 1) * unit}),
                natural(false, {i * unit, (j + 1) * unit}),
                {}};
      else
        p.at = {natural(false, {i * unit, j * unit}),
                natural(false, {(i + 1) * unit, j * unit}),
                natural(false, {i * unit, (j + 1) * unit}),
                {}};
      both_sides(p);
    }
  }
  const auto strip = [&](uint32_t cell, wall::LatticePoint a, wall::LatticePoint b) {
    // The cell lies to the left of the way from a to b, as a face does of its edges.
    const wall::LatticePoint c = r.center[cell];
    if (int64_t{b.u - a.u} * (c.v - a.v) - int64_t{b.v - a.v} * (c.u - a.u) < 0) std::swap(a, b);
    Patch p;
    p.face = element, p.side = 0, p.part = true, p.quad = quad;
    p.at = {natural(quad, a), natural(quad, b), natural(quad, c), {}};
    out.patch.push_back(p);
  };
  for (uint32_t l = 0; l < r.inner; ++l) {
    const wall::Raster::Link& link = r.link[l];
    if (has(link.a) == has(link.b)) continue;
    wall::LatticePoint a, b;
    wall::border_of(quad, link, a, b);
    strip(has(link.a) ? link.a : link.b, a, b);
  }
  for (uint32_t e = 0; e < r.edges; ++e)
    for (uint32_t k = 0; k < wall::kRaster; ++k) {
      const uint32_t cell = r.link[r.over_edge(e, k)].a;
      if (has(cell) && open_at(m, t, part.face, e, k))
        strip(cell, wall::on_edge(quad, e, static_cast<int32_t>(k) * unit),
              wall::on_edge(quad, e, static_cast<int32_t>(k + 1) * unit));
    }
}

// Of a fragment's patch, in the order of wall::Patch.
std::array<Vec3, 4> part_corners(const wall::State& s, const Corners& c, const Patch& patch) {
  std::array<Vec3, 4> p{};
  if (patch.side != 0) {
    for (uint32_t k = 0; k < c.count(); ++k) p[k] = place_on(s, c, patch.at[k], static_cast<float>(patch.side));
  } else {
    p[0] = place_on(s, c, patch.at[0], -1), p[1] = place_on(s, c, patch.at[1], -1);
    p[2] = place_on(s, c, patch.at[1], 1), p[3] = place_on(s, c, patch.at[0], 1);
  }
  return p;
}

// A patch with its corners; of a strip the two on the inner side first. corner: of a fragment's patch, where they are known.
[[gnu::always_inline]] inline wall::Patch patch_corners(const wall::State& s, const Corners& c, const Patch& patch,
                                                        const Vec3* corner = nullptr) {
  wall::Patch b;
  if (patch.part) {
    if (corner) std::copy_n(corner, 4, b.p);
    else std::copy_n(part_corners(s, c, patch).data(), 4, b.p);
    if (patch.side != 0) b.quad = patch.quad;
  } else if (patch.side != 0) {
    b.quad = c.quad;
    for (uint32_t k = 0; k < c.count(); ++k)
      b.p[k] = mid(s, c.column[k]) + director(s, c.column[k]) * static_cast<float>(patch.side);
  } else {
    const uint32_t from = c.column[patch.edge], to = c.column[(patch.edge + 1) % c.count()];
    b.p[0] = mid(s, from) - director(s, from), b.p[1] = mid(s, to) - director(s, to);
    b.p[2] = mid(s, to) + director(s, to), b.p[3] = mid(s, from) + director(s, from);
  }
  return b;
}

}  // namespace

Surface make_surface(const wall::Model& m, const wall::State& s) {
  const wall::Topology& t = s.topology;
  Surface out;
  out.piece = wall::pieces(s);
  const uint32_t faces = static_cast<uint32_t>(m.lane_of_face.size()), elements = wall::elements(m, t);
  struct Edge {
    Vec3 from, to, middle;
    float half;
    uint32_t piece;
  };
  std::vector<Edge> edges;
  const auto place = [&](uint32_t column) {
    const uint32_t source = t.source[column];
    return (m.mesh.outer[source] + m.mesh.inner[source]) * 0.5f;
  };
  out.at_rim.assign(t.source.size(), 0), out.ghost.assign(t.source.size(), 1);
  for (uint32_t f = 0; f < elements; ++f) {
    const Corners c = corners_of(m, t, f);
    out.first_of_face.push_back(static_cast<uint32_t>(out.patch.size()));
    if (f >= faces) {
      const wall::Fragment& part = t.fragment[f - faces];
      const wall::Raster& r = wall::raster(c.quad);
      for (uint32_t k = 0; k < c.count(); ++k) {
        if (!(part.cells >> r.corner_cell(k) & 1)) continue;
        out.ghost[c.column[k]] = 0;
        if (open_at(m, t, part.face, k, 0)) out.at_rim[c.column[k]] = 1;
      }
      const size_t first = out.patch.size();
      add_fragment(m, t, f, out);
      for (size_t q = first; q < out.patch.size(); ++q) {
        const Patch& p = out.patch[q];
        if (p.side != 0) continue;
        edges.push_back({wall::rest_place(m, {part.face, p.at[0][0], p.at[0][1], 0}),
                         wall::rest_place(m, {part.face, p.at[1][0], p.at[1][1], 0}),
                         {},
                         0,
                         out.piece[c.column[0]]});
      }
    } else if (wall::fragments(t, f) == 0) {
      out.patch.push_back({f, 1, 0}), out.patch.push_back({f, -1, 0});
      for (uint32_t k = 0; k < c.count(); ++k) {
        const uint32_t a = c.column[k], b = c.column[(k + 1) % c.count()];
        out.ghost[a] = 0;
        bool open = true;
        for (uint32_t i = 0; i < wall::kRaster && open; ++i) open = open_at(m, t, f, k, i);
        if (!open) continue;
        out.patch.push_back({f, 0, k});
        out.at_rim[a] = out.at_rim[b] = 1;
        edges.push_back({place(a), place(b), {}, 0, out.piece[a]});
      }
    }
    Vec3 center{};
    for (uint32_t k = 0; k < c.count(); ++k) center += place(c.column[k]) / static_cast<float>(c.count());
    float radius = 0;
    for (uint32_t k = 0; k < c.count(); ++k) radius = std::max(radius, distance(center, place(c.column[k])));
    out.face_radius.push_back(radius + 0.5f * m.laminate.thickness);
  }
  out.first_of_face.push_back(static_cast<uint32_t>(out.patch.size()));
  for (Edge& e : edges) e.middle = (e.from + e.to) * 0.5f, e.half = 0.501f * distance(e.from, e.to) + 1e-6f;
  for (uint32_t column = 0; column < t.source.size(); ++column) {
    float nearest = 1e3f;
    const Vec3 here = place(column);
    for (const Edge& e : edges) {
      // Most are too far away to be the nearest.
      const float reach = nearest + e.half;
      if (length2(e.middle - here) > reach * reach || e.piece != out.piece[column]) continue;
      const Vec3 along = e.to - e.from, p = here - e.from;
      const float at = std::clamp(dot(p, along) / std::max(length2(along), 1e-20f), 0.0f, 1.0f);
      nearest = std::min(nearest, length(p - along * at));
    }
    // A corner beyond the cut: negative, so that the distance falls to zero at the cut edge, which lies between corners.
    out.edge_distance.push_back(out.ghost[column] ? -nearest : nearest);
  }
  return out;
}

StripEnds strip_ends(const wall::Model& m, const wall::State& s, const Surface& surface, uint32_t index, float zeta) {
  const Patch& patch = surface.patch[index];
  const Corners c = corners_of(m, s.topology, patch.face);
  if (!patch.part) {
    const uint32_t from = c.column[patch.edge], to = c.column[(patch.edge + 1) % c.count()];
    return {wall::place(wall::at_column(from, zeta), s.motion), wall::place(wall::at_column(to, zeta), s.motion),
            director(s, from) * zeta};
  }
  StripEnds e{place_on(s, c, patch.at[0], zeta), place_on(s, c, patch.at[1], zeta), {}};
  e.up = e.from - place_on(s, c, patch.at[0], 0);
  return e;
}

uint32_t patch_at(const wall::Model& m, const wall::State& s, const Surface& surface, const wall::Point& point, int side) {
  const uint32_t parts = wall::fragments(s.topology, point.face);
  if (parts == 0) return surface.first_of_face[point.face] + (side > 0 ? 0u : 1u);
  const uint32_t cell = wall::cell_at(m.mesh.face[point.face][3] != wall::kNone, point.xi, point.eta);
  uint32_t fragment = s.topology.first_fragment[point.face];
  while (!(s.topology.fragment[fragment].cells >> cell & 1)) ++fragment;
  const size_t element = m.lane_of_face.size() + fragment;
  uint32_t best = surface.first_of_face[element];
  float best_far = 1e9f;
  for (uint32_t q = best; q < surface.first_of_face[element + 1]; ++q) {
    const Patch& patch = surface.patch[q];
    if (patch.side != side) continue;
    float far = 0;
    for (size_t k = 0; k < 2; ++k) {
      const float at = k == 0 ? point.xi : point.eta, a = patch.at[0][k], b = patch.at[patch.quad ? 2 : k + 1][k];
      far = std::max({far, std::min(a, b) - at, at - std::max(a, b)});
    }
    if (far < best_far) best_far = far, best = q;
  }
  return best;
}

uint32_t column_of(const wall::Model& m, const wall::State& s, uint32_t face) {
  return corners_of(m, s.topology, face).column[0];
}

Foot nearest_on_patch(const wall::Model& m, const wall::State& s, const Surface& surface, uint32_t index, Vec3 p,
                      const Vec3* corner) {
  const Patch& patch = surface.patch[index];
  const Corners c = corners_of(m, s.topology, patch.face);
  const wall::Patch b = patch_corners(s, c, patch, corner);
  float xi = 0, eta = 0;
  wall::nearest(b, p, xi, eta);
  Foot foot;
  foot.patch = index;
  foot.facing = cross(b.along_xi(eta), b.along_eta(xi));
  // In a crease a corner of a patch may turn over: the rest of the patch says which side is out.
  if (const Vec3 mean = cross(b.p[2] - b.p[0], b.p[3] - b.p[1]); b.quad && dot(foot.facing, mean) < 0) foot.facing = mean;
  if (patch.side != 0) foot.facing = foot.facing * static_cast<float>(patch.side);
  foot.on_edge = b.quad ? std::max(std::abs(xi), std::abs(eta)) > 0.9999f : std::min({xi, eta, 2 - xi - eta}) < 1e-4f;
  if (patch.part) {
    // Within the patch by a hair, so that the point belongs to this fragment and not to its neighbor.
    constexpr float kWithin = 0.998f;
    const uint32_t face = wall::face_of_element(m, s.topology, patch.face);
    const auto& at = patch.at;
    if (patch.side == 0) {
      const float x = 0.5f * (1 + kWithin * xi), in = 1 - kWithin;
      foot.point = {face, 0, 0, eta};
      foot.point.xi = (at[0][0] + (at[1][0] - at[0][0]) * x) * (1 - in) + at[2][0] * in;
      foot.point.eta = (at[0][1] + (at[1][1] - at[0][1]) * x) * (1 - in) + at[2][1] * in;
    } else if (b.quad) {
      const float x = 0.5f * (1 + kWithin * xi), y = 0.5f * (1 + kWithin * eta);
      foot.point = {face, at[0][0] + (at[1][0] - at[0][0]) * x, at[0][1] + (at[3][1] - at[0][1]) * y, 0};
    } else {
      const float x = 0.5f * (kWithin * xi + (1 - kWithin) * 0.66f), y = 0.5f * (kWithin * eta + (1 - kWithin) * 0.66f);
      foot.point = {face, at[0][0] + (at[1][0] - at[0][0]) * x + (at[2][0] - at[0][0]) * y,
                    at[0][1] + (at[1][1] - at[0][1]) * x + (at[2][1] - at[0][1]) * y, 0};
    }
    if (patch.side != 0) foot.point.zeta = static_cast<float>(patch.side);
  } else if (patch.side != 0) {
    foot.point = {patch.face, xi, eta, static_cast<float>(patch.side)};
  } else {
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
    foot.inward = (b.quad ? b.at(0, 0) : (b.p[0] + b.p[1] + b.p[2]) / 3.0f) - foot.at;
  }
  return foot;
}

void NearestFoot::settle_side(const wall::Model& m, const wall::State& s, const Surface& surface, Vec3 p) {
  if (shared < 3 || !best.on_edge || best.gap <= 0) return;
  Vec3 about{};
  bool behind = false;
  for (uint32_t i = 0; i < shared; ++i) {
    const Patch& patch = surface.patch[sharing[i]];
    const wall::Patch b = patch_corners(s, corners_of(m, s.topology, patch.face), patch);
    const uint32_t n = b.quad ? 4 : 3;
    uint32_t k = 0;
    for (uint32_t c = 1; c < n; ++c)
      if (length2(b.p[c] - best.at) < length2(b.p[k] - best.at)) k = c;
    const Foot foot = nearest_on_patch(m, s, surface, sharing[i], p);
    behind |= dot(p - foot.at, foot.facing) < 0;
    about += foot.facing * acos(dot(normalized(b.p[(k + 1) % n] - b.p[k]), normalized(b.p[(k + n - 1) % n] - b.p[k])));
  }
  if (!behind || dot(p - best.at, about) >= 0) return;
  best.normal = best.facing = normalized(about, best.facing);
  best.gap = -best.gap;
}

void SurfaceSearch::reserve(const wall::Model& m, const wall::State& s, size_t nodes) {
  const size_t faces = wall::elements(m, s.topology), columns = wall::columns(s);
  node_listed.reserve(nodes), wall_listed.reserve(2 * columns), center.reserve(faces), radius.reserve(faces);
  node_first.reserve(nodes + 1), node_face.reserve(64 * nodes);
  column_first.reserve(2 * columns + 1), column_face.reserve(64 * columns);
  near.reserve(2 * faces), far.reserve(2 * faces), box.resize(faces);
  group_center.reserve(2 * faces / kGroup), group_radius.reserve(2 * faces / kGroup);
  lip_patch.reserve(6 * columns), lip_bound.reserve(6 * columns), seen.reserve(2 * columns), column_due.reserve(2 * columns),
      node_due.reserve(nodes), node_seen.reserve(nodes), close.reserve(nodes), close_face.reserve(kClose * nodes);
  column_close.reserve(2 * columns), column_close_face.reserve(2 * kClose * columns);
}

namespace {

// The largest square of a change since the last step, and of a speed: mid-surface points and directors in turn.
CATGUT_CLONES void largest_squares(size_t n, const float* __restrict x, const float* __restrict v, float* __restrict seen,
                                   float* __restrict most) {
  float change[16] = {}, speed[16] = {};
  for (size_t i = 0; i < n; i += 8)  // a column: 4 numbers of its mid-surface point, 4 of its director
    for (size_t k = 0; k < 8; ++k) {
      const float d = x[i + k] - seen[i + k], d2 = d * d, v2 = v[i + k] * v[i + k];
      change[k] = d2 > change[k] ? d2 : change[k];
      speed[k] = v2 > speed[k] ? v2 : speed[k];
      seen[i + k] = x[i + k];
    }
  for (size_t k = 0; k < 8; ++k) most[k] = change[k], most[8 + k] = speed[k];
}
CATGUT_CLONES void largest_changes(size_t n, const float* __restrict x, const float* __restrict seen, float* __restrict most) {
  float change[8] = {};
  for (size_t i = 0; i < n; i += 8)
    for (size_t k = 0; k < 8; ++k) {
      const float d = x[i + k] - seen[i + k], d2 = d * d;
      change[k] = d2 > change[k] ? d2 : change[k];
    }
  for (size_t k = 0; k < 8; ++k) most[k] = change[k];
}
// [m] or [m/s] of any point of the wall, from the largest squares of each coordinate.
float bound_of(const float* most) {
  return 1.001f * (std::sqrt(most[0] + most[1] + most[2]) + std::sqrt(most[4] + most[5] + most[6]));
}

}  // namespace

void watch_wall(const wall::State& s, SurfaceSearch& k) {
  ++k.step;
  const size_t n = s.motion.x.size();
  if (k.seen.size() != n) {
    k.seen.assign(s.motion.x.begin(), s.motion.x.end());
    k.moved += 1e3;  // everything is searched
  }
  float most[16];
  largest_squares(4 * n, &s.motion.x[0].x, &s.motion.v[0].x, &k.seen[0].x, most);
  k.moved += static_cast<double>(bound_of(most)), k.speed = bound_of(most + 8);
}

float moved_since(const wall::State& s, const SurfaceSearch& k) {
  float most[8];
  largest_changes(4 * s.motion.x.size(), &s.motion.x[0].x, &k.seen[0].x, most);
  return bound_of(most);
}

const FaceBox& box_of(const wall::Model& m, const wall::State& s, SurfaceSearch& k, uint32_t face) {
  FaceBox& box = k.box[face];
  if (box.step == k.step) return box;
  box.step = k.step;
  const Corners c = corners_of(m, s.topology, face);
  const float part = 1.0f / static_cast<float>(c.count());
  Vec3 center{}, up{};
  for (uint32_t i = 0; i < c.count(); ++i) center += mid(s, c.column[i]) * part, up += director(s, c.column[i]);
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

PatchBox patch_box(const wall::Model& m, const wall::State& s, const Patch& patch) {
  const Corners c = corners_of(m, s.topology, patch.face);
  PatchBox box;
  box.corner = part_corners(s, c, patch);
  const uint32_t count = patch.side == 0 || patch.quad ? 4 : 3;
  // Both ends of a strip in the same order on either side.
  for (uint32_t i = 0; i < count; ++i)
    box.center += box.corner[patch.side == 0 && i > 1 ? 5 - i : i] / static_cast<float>(count);
  for (uint32_t i = 0; i < count; ++i) box.radius = std::max(box.radius, distance(box.corner[i], box.center));
  box.radius *= 1.0001f;
  const Vec3 along = box.corner[1] - box.corner[0], up = box.corner[count - 1] - box.corner[0];
  box.n = normalized(cross(along, up), {0, 0, 1});
  box.a = normalized(along, any_perpendicular(box.n));
  box.b = cross(box.n, box.a);
  for (uint32_t i = 0; i < count; ++i) {
    const Vec3 q = box.corner[i] - box.center;
    box.half_a = std::max(box.half_a, std::abs(dot(q, box.a))), box.half_b = std::max(box.half_b, std::abs(dot(q, box.b)));
    box.half_n = std::max(box.half_n, std::abs(dot(q, box.n)));
  }
  return box;
}

float PatchBox::to_box(Vec3 p) const {
  const Vec3 q = p - center;
  const float da = std::max(0.0f, std::abs(dot(q, a)) - half_a), db = std::max(0.0f, std::abs(dot(q, b)) - half_b),
              dn = std::max(0.0f, std::abs(dot(q, n)) - half_n);
  return std::sqrt(da * da + db * db + dn * dn) * 0.9999f;
}

namespace {

void group_faces(SurfaceSearch& k) {
  const size_t faces = k.center.size();
  k.group_center.clear(), k.group_radius.clear();
  for (size_t first = 0; first < faces; first += kGroup) {
    const size_t last = std::min(first + kGroup, faces);
    Vec3 center{};
    for (size_t f = first; f < last; ++f) center += k.center[f] / static_cast<float>(last - first);
    float radius = 0;
    for (size_t f = first; f < last; ++f) radius = std::max(radius, distance(center, k.center[f]) + k.radius[f]);
    k.group_center.push_back(center), k.group_radius.push_back(1.001f * radius);
  }
}

// Calls visit(face) for each face whose ball is within `reach` of p, in their order.
template <typename Visit>
void each_near(const SurfaceSearch& k, Vec3 p, float reach, Visit visit) {
  for (size_t g = 0; g < k.group_center.size(); ++g) {
    const float around = k.group_radius[g] + reach;
    if (length2(k.group_center[g] - p) > around * around) continue;
    for (size_t f = g * kGroup; f < std::min((g + 1) * kGroup, k.center.size()); ++f) {
      const float far = k.radius[f] + reach;
      if (length2(k.center[f] - p) < far * far) visit(static_cast<uint32_t>(f));
    }
  }
}

}  // namespace

void find_near(const wall::Model& m, const wall::State& s, const Surface& surface, const thread::State& thread,
               SurfaceSearch& k) {
  const size_t nodes = thread.nodes(), columns = wall::columns(s), faces = wall::elements(m, s.topology);
  k.box.resize(faces), k.part.resize(surface.patch.size());
  const float limit2 = 0.25f * k.margin * k.margin * 0.25f;  // all may move: a quarter of the margin each
  bool wall_stale = k.wall_listed.size() != columns || k.version != s.topology.version;
  for (uint32_t c = 0; c < columns && !wall_stale; ++c) wall_stale = length2(mid(s, c) - k.wall_listed[c]) > limit2;
  bool stale = wall_stale || k.node_listed.size() != nodes;
  for (size_t i = 0; i < nodes && !stale; ++i) stale = length2(thread.x.at(i) - k.node_listed[i]) > limit2;
  if (!stale) return;
  k.node_due.assign(nodes, 0), k.node_seen.assign(nodes, {});
  k.close.assign(nodes, {}), k.close_face.resize(kClose * nodes);
  k.node_listed.resize(nodes), k.center.resize(faces), k.radius.resize(faces);
  for (size_t i = 0; i < nodes; ++i) k.node_listed[i] = thread.x.at(i);
  for (uint32_t f = 0; f < faces; ++f) {
    const Corners c = corners_of(m, s.topology, f);
    const float part = 1.0f / static_cast<float>(c.count());
    Vec3 center{};
    for (uint32_t i = 0; i < c.count(); ++i) center += mid(s, c.column[i]) * part;
    float radius = 0;
    for (uint32_t i = 0; i < c.count(); ++i)
      radius = std::max(radius, distance(center, mid(s, c.column[i])) + length(director(s, c.column[i])));
    k.center[f] = center, k.radius[f] = radius;
  }
  group_faces(k);
  // Blocks of eight nodes share a sphere; thread that was cut is two threads, which may lie anywhere.
  k.node_first.clear(), k.node_face.clear();
  constexpr size_t kBlock = 8;
  for (size_t b = 0, end = 0; b < nodes; b = end) {
    end = b + 1;
    while (end < std::min(nodes, b + kBlock) && !thread.broken[end - 1]) ++end;
    Vec3 center{};
    for (size_t i = b; i < end; ++i) center += thread.x.at(i) / static_cast<float>(end - b);
    float radius = 0;
    for (size_t i = b; i < end; ++i) radius = std::max(radius, distance(center, thread.x.at(i)));
    k.near.clear();
    each_near(k, center, radius + k.margin, [&](uint32_t f) { k.near.push_back(f); });
    for (size_t i = b; i < end; ++i) {
      k.node_first.push_back(static_cast<uint32_t>(k.node_face.size()));
      for (const uint32_t f : k.near) {
        const float reach = k.radius[f] + k.margin;
        if (length2(k.center[f] - thread.x.at(i)) < reach * reach) k.node_face.push_back(f);
      }
    }
  }
  k.node_first.push_back(static_cast<uint32_t>(k.node_face.size()));
  if (!wall_stale) return;  // only the thread has moved
  k.version = s.topology.version;
  k.wall_listed.resize(columns);
  for (uint32_t c = 0; c < columns; ++c) k.wall_listed[c] = mid(s, c);
  k.column_due.assign(columns, 0), k.column_first.clear(), k.column_face.clear();
  k.lip_patch.assign(3 * columns, wall::kNone), k.lip_bound.assign(3 * columns, {});
  k.column_close.assign(columns, {}), k.column_close_face.resize(kClose * columns);
  const auto rest = [&](uint32_t column) {
    const uint32_t source = s.topology.source[column];
    return (m.mesh.outer[source] + m.mesh.inner[source]) * 0.5f;
  };
  for (uint32_t c = 0; c < columns; ++c) {
    k.column_first.push_back(static_cast<uint32_t>(k.column_face.size()));
    if (s.topology.slot[c] == wall::kNone || surface.ghost[c]) continue;
    const Vec3 at = mid(s, c), at_rest = rest(c);
    const float half = length(director(s, c));
    each_near(k, at, half + k.margin, [&](uint32_t f) {
      if (surface.first_of_face[f] == surface.first_of_face[f + 1]) return;
      const Corners corner = corners_of(m, s.topology, f);
      // Columns of one part of the wall that are adjacent at rest are not paired.
      bool beside = false;
      for (uint32_t i = 0; i < corner.count(); ++i)
        beside |= surface.piece[corner.column[i]] == surface.piece[c] &&
                  (corner.column[i] == c || distance(rest(corner.column[i]), at_rest) < 1.2f * surface.face_radius[f]);
      if (!beside) k.column_face.push_back(f);
    });
  }
  k.column_first.push_back(static_cast<uint32_t>(k.column_face.size()));
}

}  // namespace catgut::physical
