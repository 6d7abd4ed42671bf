// SPDX-License-Identifier: Apache-2.0
// runtime: see cut_measures.h.
#include "runtime/cut_measures.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "geometry/closest.h"

namespace catgut {
namespace {

constexpr float kOnRim = 2e-4f;  // [m] a cut edge so near to an end of the organ is that end

// Vertices that follow the same particles with the same weights are one: those of the wall's sides and of its edges.
using Place = std::vector<std::pair<uint32_t, int>>;
Place place_of(const VisibleMesh& mesh, uint32_t v) {
  Place place;
  for (size_t k = 0; k < 4; ++k)
    if (const int w = static_cast<int>(std::lround(mesh.skin_weight[v][k] * 4096)); w > 0)
      place.push_back({mesh.skin_particle[v][k], w});
  std::sort(place.begin(), place.end());
  return place;
}

// From the rim of the second body to the surface of a cut edge. Its vertices alone lie up to a cell apart: they would show gaps
// of half a cell where walls touch.
void measure_ring(const std::vector<uint32_t>& rim, const std::vector<std::array<Vec3, 3>>& edge, const Snapshot& seen,
                  CutMeasures& out) {
  if (rim.empty() || edge.empty()) return;
  const auto gap = [&](Vec3 p) {
    float least = 1e9f;
    for (const auto& [a, b, c] : edge) least = std::min(least, length2(closest_on_triangle(p, a, b, c).point - p));
    return std::sqrt(static_cast<double>(least));
  };
  for (const uint32_t i : rim) out.ring_gap = std::max(out.ring_gap, gap(seen.particle[i]));
  bool any = false;
  for (const SutureView& suture : seen.suture) {
    const auto& point = suture.suture_point;
    if (point.empty() || point.front().wall == point.back().wall) continue;
    for (size_t k = 0; k + 1 < point.size(); ++k) {
      if (point[k].wall == point[k + 1].wall) continue;
      const double here = static_cast<double>(std::max(point[k].tension_needle, point[k + 1].tension_free));
      out.stitch_tension = any ? std::min(out.stitch_tension, here) : here;
      any = true;
    }
    const Vec3 middle = 0.5f * (point.front().position + point.back().position);
    Vec3 on = seen.particle[rim[0]];
    for (size_t i = 0; i < rim.size(); ++i) {
      const Vec3 a = seen.particle[rim[i]], way = seen.particle[rim[(i + 1) % rim.size()]] - a;
      const Vec3 p = a + way * std::clamp(dot(middle - a, way) / std::max(1e-12f, length2(way)), 0.0f, 1.0f);
      if (distance(p, middle) < distance(on, middle)) on = p;
    }
    out.stitch_gap = std::max(out.stitch_gap, gap(on));
  }
}

// [rad] by which the wall at a triangle of the cut edge is turned outward, toward its outer face, against rest. axis: from the
// edge to what was cut off.
double turned_outward(const VisibleMesh& mesh, const std::array<uint32_t, 3>& t, Vec3 axis, const std::vector<Vec3>& now) {
  Vec3 rest{}, turned{};
  for (size_t k = 0; k < 3; ++k) {
    uint32_t a = t[k], b = t[(k + 1) % 3];
    if ((mesh.through[a] < 0.5f) == (mesh.through[b] < 0.5f)) continue;
    if (mesh.through[a] > 0.5f) std::swap(a, b);  // b: on the inner face
    const Vec3 across = mesh.position[a] - mesh.position[b];
    if (length2(rest) > 0 && length2(across) > length2(rest)) continue;  // the diagonal
    rest = across, turned = now[a] - now[b];
  }
  const Vec3 out = normalized(rest - axis * dot(rest, axis));
  const auto angle = [&](Vec3 d) { return std::atan2(-dot(d, axis), dot(d, out)); };
  return static_cast<double>(angle(turned) - angle(rest));
}

}  // namespace

CutMeasures measure_cut(const SceneSpec& scene, const Snapshot& seen) {
  CutMeasures out;
  if (!seen.topology.picture || scene.body.empty()) return out;
  const BodySpec& first = scene.body.front();
  const Vec3 axis = normalized(first.axis);
  for (size_t b = 0; b < seen.topology.picture->body.size(); ++b) {
    const VisibleMesh& mesh = seen.topology.picture->body[b];
    std::map<Place, uint32_t> known;
    std::vector<uint32_t> root(mesh.position.size());
    for (uint32_t v = 0; v < root.size(); ++v) root[v] = known.try_emplace(place_of(mesh, v), v).first->second;
    const auto find = [&](uint32_t v) {
      while (root[v] != v) v = root[v] = root[root[v]];
      return v;
    };
    for (const auto& t : mesh.triangle)
      for (size_t k = 1; k < 3; ++k) {
        const uint32_t a = find(t[0]), c = find(t[k]);
        root[std::max(a, c)] = std::min(a, c);
      }
    std::vector<uint8_t> drawn(root.size(), 0);
    for (const auto& t : mesh.triangle) {
      drawn[find(t[0])] = 1;
      out.mass += static_cast<double>(dot(mesh.position[t[0]], cross(mesh.position[t[1]], mesh.position[t[2]])) *
                                      scene.body[std::min(b, scene.body.size() - 1)].density / 6);
    }
    const uint32_t here = static_cast<uint32_t>(std::count(drawn.begin(), drawn.end(), 1));
    out.pieces += here;
    if (b > 0) continue;
    const auto depth = [&](uint32_t v) { return dot(first.position - mesh.position[v], axis); };
    uint32_t top = 0;  // a vertex at the rim
    for (uint32_t v = 0; v < root.size(); ++v) {
      if (depth(v) < depth(top)) top = v;
      if (mesh.layer[v] != TissueLayer::cut_edge || depth(v) < kOnRim || depth(v) > first.length - kOnRim) continue;
      out.deviation = std::max(out.deviation, static_cast<double>(std::abs(depth(v) - scene.surgeon.edge_distance)));
    }
    if (here < 2) continue;
    Vec3 way{};
    float count = 0;
    std::vector<Vec3> now(root.size());
    std::vector<std::array<Vec3, 3>> edge;  // of what stays
    const auto stays = [&](uint32_t v) {
      return find(v) != find(top) && mesh.layer[v] == TissueLayer::cut_edge && depth(v) < first.length - kOnRim;
    };
    for (uint32_t v = 0; v < root.size(); ++v) {
      for (size_t k = 0; k < 4; ++k) now[v] += seen.particle[mesh.skin_particle[v][k]] * mesh.skin_weight[v][k];
      if (find(v) == find(top)) way += now[v] - mesh.position[v], ++count;
    }
    for (const auto& t : mesh.triangle)
      if (stays(t[0]) && stays(t[1]) && stays(t[2])) {
        edge.push_back({now[t[0]], now[t[1]], now[t[2]]});
        out.eversion = std::max(out.eversion, turned_outward(mesh, t, axis, now));
      }
    out.way = static_cast<double>(length(way / std::max(count, 1.0f)));
    if (seen.topology.picture->rim.size() > 1) measure_ring(seen.topology.picture->rim[1], edge, seen, out);
  }
  return out;
}

}  // namespace catgut
