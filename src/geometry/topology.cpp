// SPDX-License-Identifier: Apache-2.0
// geometry/topology: adjacency in a triangle mesh; boundary loops, normals, area and volume.
#include "geometry/topology.h"

#include <algorithm>

namespace catgut {

std::vector<std::vector<uint32_t>> vertex_neighbors(std::span<const Triangle> triangle, size_t vertices) {
  std::vector<std::vector<uint32_t>> next(vertices);
  for (const Triangle& t : triangle) {
    for (int k = 0; k < 3; ++k) {
      next[t[k]].push_back(t[(k + 1) % 3]);
      next[t[k]].push_back(t[(k + 2) % 3]);
    }
  }
  for (auto& list : next) {
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
  }
  return next;
}

std::vector<std::vector<uint32_t>> boundary_loops(std::span<const Triangle> triangle) {
  // Half-edge h = 3 t + k runs from corner k to corner k + 1 of triangle t; its twin runs the other way in the neighbor.
  const uint32_t count = static_cast<uint32_t>(3 * triangle.size());
  const auto from = [&](uint32_t h) { return triangle[h / 3][h % 3]; };
  const auto to = [&](uint32_t h) { return triangle[h / 3][(h + 1) % 3]; };
  std::vector<std::pair<uint64_t, uint32_t>> by_edge(count);
  for (uint32_t h = 0; h < count; ++h) by_edge[h] = {edge_key(from(h), to(h)), h};
  std::sort(by_edge.begin(), by_edge.end());
  constexpr uint32_t none = ~0u;
  std::vector<uint32_t> twin(count, none);
  for (uint32_t i = 0; i + 1 < count; ++i) {
    if (by_edge[i].first != by_edge[i + 1].first) continue;
    twin[by_edge[i].second] = by_edge[i + 1].second;
    twin[by_edge[i + 1].second] = by_edge[i].second;
  }
  // Seen from outside, a boundary half-edge has the organ on its left, so it runs clockwise round the opening: traverse
  // backward. The boundary half-edge that ends where h starts is found by rotating about that vertex through the fan.
  std::vector<uint8_t> done(count, 0);
  std::vector<std::vector<uint32_t>> loops;
  for (uint32_t start = 0; start < count; ++start) {
    if (twin[start] != none || done[start]) continue;
    std::vector<uint32_t> loop;
    uint32_t h = start;
    do {
      done[h] = 1;
      loop.push_back(to(h));
      uint32_t in = 3 * (h / 3) + (h + 2) % 3;  // runs into from(h)
      while (twin[in] != none) in = 3 * (twin[in] / 3) + (twin[in] + 2) % 3;
      h = in;
    } while (h != start && !done[h]);
    std::rotate(loop.begin(), std::min_element(loop.begin(), loop.end()), loop.end());
    loops.push_back(std::move(loop));
  }
  std::sort(loops.begin(), loops.end());
  return loops;
}

std::vector<Vec3> vertex_normals(const TriangleMesh& mesh) {
  std::vector<Vec3> normal(mesh.position.size());
  for (const Triangle& t : mesh.triangle) {
    const Vec3 a = mesh.position[t[0]], b = mesh.position[t[1]], c = mesh.position[t[2]];
    const Vec3 n = normalized(cross(b - a, c - a));
    for (int k = 0; k < 3; ++k) {
      const Vec3 u = normalized(mesh.position[t[(k + 1) % 3]] - mesh.position[t[k]]);
      const Vec3 v = normalized(mesh.position[t[(k + 2) % 3]] - mesh.position[t[k]]);
      normal[t[k]] += n * portable::acos(std::clamp(dot(u, v), -1.0f, 1.0f));
    }
  }
  for (Vec3& n : normal) n = normalized(n);
  return normal;
}

double surface_area(const TriangleMesh& mesh) {
  double area = 0;
  for (const Triangle& t : mesh.triangle) {
    area += 0.5 * length(cross(mesh.position[t[1]] - mesh.position[t[0]], mesh.position[t[2]] - mesh.position[t[0]]));
  }
  return area;
}

double enclosed_volume(const TriangleMesh& mesh) {
  // Measured from a vertex: far from the origin the signed sum would lose precision.
  double volume = 0;
  if (mesh.position.empty()) return volume;
  const Vec3 o = mesh.position[0];
  for (const Triangle& t : mesh.triangle) {
    volume += dot(mesh.position[t[0]] - o, cross(mesh.position[t[1]] - o, mesh.position[t[2]] - o)) / 6.0;
  }
  return volume;
}

}  // namespace catgut
