// SPDX-License-Identifier: Apache-2.0
// wall/mesh: builders of column meshes.
#include "wall/mesh.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "core/check.h"

namespace catgut::wall {

namespace {

size_t corners(const std::array<uint32_t, 4>& face) { return face[3] == kNone ? 3 : 4; }

// At the worst corner: 1 for a rectangle, 0 for a corner of 0 or 180 degrees; below 0 for a non-convex quad.
float quad_quality(const Vec3 (&p)[4]) {
  const Vec3 normal = normalized(cross(p[2] - p[0], p[3] - p[1]));
  float worst = 1;
  for (int i = 0; i < 4; ++i) {
    const Vec3 a = normalized(p[(i + 1) % 4] - p[i]), b = normalized(p[(i + 3) % 4] - p[i]);
    worst = std::min(worst, dot(cross(a, b), normal));
  }
  return worst;
}

}  // namespace

std::vector<std::vector<uint32_t>> rims(const Mesh& mesh) {
  // A rim's edge belongs to one face; seen from outside the face lies on its left, so the opening lies on its right.
  std::map<std::pair<uint32_t, uint32_t>, int> edge;
  for (const auto& f : mesh.face)
    for (size_t i = 0, n = corners(f); i < n; ++i) edge[{f[i], f[(i + 1) % n]}] = 1;
  std::map<uint32_t, uint32_t> next;
  for (const auto& [e, one] : edge)
    if (!edge.count({e.second, e.first})) next[e.second] = e.first;
  std::vector<std::vector<uint32_t>> out;
  while (!next.empty()) {
    std::vector<uint32_t> rim;
    for (auto at = next.begin(); at != next.end();) {
      rim.push_back(at->first);
      const uint32_t to = at->second;
      next.erase(at);
      at = next.find(to);
    }
    out.push_back(std::move(rim));
  }
  std::stable_sort(out.begin(), out.end(), [](const auto& a, const auto& b) { return a.size() > b.size(); });
  return out;
}

std::vector<std::array<uint32_t, 4>> neighbors(const Mesh& mesh) {
  std::map<std::pair<uint32_t, uint32_t>, uint32_t> open;
  std::vector<std::array<uint32_t, 4>> out(mesh.face.size(), {kNone, kNone, kNone, kNone});
  for (uint32_t f = 0; f < mesh.face.size(); ++f)
    for (uint32_t e = 0, n = static_cast<uint32_t>(corners(mesh.face[f])); e < n; ++e) {
      const auto key = std::minmax(mesh.face[f][e], mesh.face[f][(e + 1) % n]);
      const auto other = open.find(key);
      if (other == open.end()) {
        open[key] = 4 * f + e;
        continue;
      }
      out[f][e] = other->second, out[other->second / 4][other->second % 4] = 4 * f + e;
      open.erase(other);
    }
  return out;
}

Mesh tube(const TubeShape& shape) {
  if (shape.around < 4 || shape.rings < 2 || !(shape.thickness > 0) || !(shape.outer_radius > shape.thickness) ||
      !(shape.length > 0))
    throw InputError("tube", "a tube that cannot be built",
                     "give at least 4 columns around, 2 rings, and a radius above the thickness");
  Mesh mesh;
  mesh.name = "tube";
  const Vec3 axis = normalized(shape.axis, {0, 0, 1}), ex = any_perpendicular(axis), ey = cross(axis, ex);
  const double turn = 6.283185307179586 / shape.around;
  for (int i = 0; i < shape.rings; ++i)
    for (int j = 0; j < shape.around; ++j) {
      const float c = static_cast<float>(portable::cos(turn * j)), s = static_cast<float>(portable::sin(turn * j));
      const Vec3 middle = shape.center - axis * (shape.length * static_cast<float>(i) / static_cast<float>(shape.rings - 1));
      const Vec3 radial = ex * c + ey * s;
      mesh.outer.push_back(middle + radial * shape.outer_radius);
      mesh.inner.push_back(middle + radial * (shape.outer_radius - shape.thickness));
      mesh.held.push_back(i >= shape.rings - shape.held_rings);
    }
  for (int i = 0; i + 1 < shape.rings; ++i)
    for (int j = 0; j < shape.around; ++j) {
      const auto at = [&](int r, int k) { return static_cast<uint32_t>(r * shape.around + k % shape.around); };
      mesh.face.push_back({at(i + 1, j), at(i + 1, j + 1), at(i, j + 1), at(i, j)});
      mesh.along.push_back(axis);
    }
  return mesh;
}

Mesh sheet(const SheetShape& shape) {
  if (shape.columns < 2 || shape.rows < 2 || !(shape.thickness > 0) || !(shape.width > 0) || !(shape.height > 0))
    throw InputError("sheet", "a sheet that cannot be built", "give at least 2 columns and 2 rows, and positive lengths");
  Mesh mesh;
  mesh.name = "sheet";
  const uint32_t n = static_cast<uint32_t>(shape.columns);
  for (int j = 0; j < shape.rows; ++j)
    for (int i = 0; i < shape.columns; ++i) {
      const Vec3 p{shape.width * static_cast<float>(i) / static_cast<float>(shape.columns - 1),
                   shape.height * static_cast<float>(j) / static_cast<float>(shape.rows - 1), 0};
      mesh.outer.push_back(p + Vec3{0, 0, 0.5f * shape.thickness});
      mesh.inner.push_back(p - Vec3{0, 0, 0.5f * shape.thickness});
      mesh.held.push_back(0);
      if (i + 1 == shape.columns || j + 1 == shape.rows) continue;
      const uint32_t a = static_cast<uint32_t>(j) * n + static_cast<uint32_t>(i);
      mesh.face.push_back({a, a + 1, a + n + 1, a + n});
      mesh.along.push_back({1, 0, 0});
    }
  return mesh;
}

Mesh from_triangles(std::span<const Vec3> outer, std::span<const Vec3> inner, std::span<const std::array<uint32_t, 3>> triangle,
                    Vec3 along, const std::string& name) {
  Mesh mesh;
  mesh.name = name;
  if (outer.size() != inner.size() || outer.empty())
    throw InputError(name, "outer and inner nodes that do not pair", "give one inner node for each outer node");
  mesh.outer.assign(outer.begin(), outer.end());
  mesh.inner.assign(inner.begin(), inner.end());
  mesh.held.assign(outer.size(), 0);
  const auto mid = [&](uint32_t c) { return (outer[c] + inner[c]) * 0.5f; };

  // Joining two triangles across an edge gives a quad whose diagonal the edge was. Best quads first; equal ones in the order of
  // the triangles, which keeps regular strips regular.
  struct Half {
    uint32_t triangle, corner;
  };
  std::map<std::pair<uint32_t, uint32_t>, Half> half;
  for (uint32_t t = 0; t < triangle.size(); ++t)
    for (uint32_t k = 0; k < 3; ++k) {
      if (triangle[t][k] >= outer.size())
        throw InputError(name, "a triangle that names a column which is not there", "check the mesh");
      half[{triangle[t][k], triangle[t][(k + 1) % 3]}] = {t, k};
    }
  struct Join {
    int rank;  // quality in steps of 0.05, so that nearly equal quads are taken in order
    uint32_t a, b;
    std::array<uint32_t, 4> face;
  };
  std::vector<Join> join;
  const Vec3 axis = normalized(along, {0, 0, 1});
  for (uint32_t t = 0; t < triangle.size(); ++t)
    for (uint32_t k = 0; k < 3; ++k) {
      const uint32_t i = triangle[t][k], j = triangle[t][(k + 1) % 3];
      const auto other = half.find({j, i});
      if (other == half.end() || other->second.triangle <= t) continue;
      const uint32_t far = triangle[other->second.triangle][(other->second.corner + 2) % 3];
      const std::array<uint32_t, 4> face{i, far, j, triangle[t][(k + 2) % 3]};
      const Vec3 p[4] = {mid(face[0]), mid(face[1]), mid(face[2]), mid(face[3])};
      // Edges around the organ are kept, so that rings of the mesh are preserved.
      const float across = std::abs(dot(normalized(p[2] - p[0]), axis));
      const float quality = quad_quality(p) + 0.3f * std::min(across, 0.5f);
      if (quad_quality(p) > 0.4f) join.push_back({static_cast<int>(-20 * quality), t, other->second.triangle, face});
    }
  std::stable_sort(join.begin(), join.end(), [](const Join& a, const Join& b) { return a.rank < b.rank; });
  std::vector<uint8_t> taken(triangle.size(), 0);
  std::vector<std::pair<uint32_t, std::array<uint32_t, 4>>> face;
  for (const Join& q : join)
    if (!taken[q.a] && !taken[q.b]) taken[q.a] = taken[q.b] = 1, face.push_back({q.a, q.face});
  for (uint32_t t = 0; t < triangle.size(); ++t)
    if (!taken[t]) face.push_back({t, {triangle[t][0], triangle[t][1], triangle[t][2], kNone}});
  std::sort(face.begin(), face.end());
  for (const auto& [first, f] : face) mesh.face.push_back(f), mesh.along.push_back(axis);
  return mesh;
}

void append(Mesh& mesh, const Mesh& more) {
  const uint32_t first = static_cast<uint32_t>(mesh.outer.size());
  mesh.outer.insert(mesh.outer.end(), more.outer.begin(), more.outer.end());
  mesh.inner.insert(mesh.inner.end(), more.inner.begin(), more.inner.end());
  mesh.held.insert(mesh.held.end(), more.held.begin(), more.held.end());
  mesh.foundation.resize(first, 0),
      mesh.foundation.insert(mesh.foundation.end(), more.foundation.begin(), more.foundation.end());
  mesh.foundation.resize(mesh.outer.size(), 0);
  mesh.along.insert(mesh.along.end(), more.along.begin(), more.along.end());
  for (auto f : more.face) {
    for (uint32_t& c : f)
      if (c != kNone) c += first;
    mesh.face.push_back(f);
  }
}

}  // namespace catgut::wall
