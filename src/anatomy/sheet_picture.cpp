// SPDX-License-Identifier: Apache-2.0
// anatomy/sheet_picture: the visible mesh of a body made from a triangulated sheet.
#include "anatomy/sheet_picture.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "geometry/skin.h"
#include "geometry/topology.h"

namespace catgut {

namespace {

// A point on the sheet: weights over three of its vertices.
struct Sample {
  Triangle corner;
  float weight[3];
};

// Every triangle of the sheet split into parts * parts, sharing common points.
struct Subdivision {
  std::vector<Sample> sample;
  std::vector<Triangle> triangle;
  std::map<std::pair<uint64_t, int>, uint32_t> on_edge;  // k-th point from the edge's smaller vertex
  int parts;

  Subdivision(const TriangleMesh& sheet, int p) : parts(p) {
    for (uint32_t v = 0; v < sheet.position.size(); ++v) sample.push_back({{v, v, v}, {1, 0, 0}});
    for (const Triangle& t : sheet.triangle) cut(t);
  }
  uint32_t edge_place(uint32_t a, uint32_t b, int k) {  // k of parts from a to b
    if (k == 0) return a;
    if (k == parts) return b;
    if (a > b) std::swap(a, b), k = parts - k;
    const auto [it, fresh] = on_edge.try_emplace({edge_key(a, b), k}, static_cast<uint32_t>(sample.size()));
    const float w = static_cast<float>(k) / static_cast<float>(parts);
    if (fresh) sample.push_back({{a, b, a}, {1 - w, w, 0}});
    return it->second;
  }
  void cut(const Triangle& t) {
    std::vector<std::vector<uint32_t>> row(static_cast<size_t>(parts) + 1);  // row i: i of parts from corner 0 toward edge 1-2
    for (int i = 0; i <= parts; ++i) {
      for (int j = 0; j <= i; ++j) {
        uint32_t place;
        if (j == 0) place = edge_place(t[0], t[1], i);
        else if (j == i) place = edge_place(t[0], t[2], i);
        else if (i == parts) place = edge_place(t[1], t[2], j);
        else {
          place = static_cast<uint32_t>(sample.size());
          const float n = static_cast<float>(parts);
          sample.push_back({t, {static_cast<float>(parts - i) / n, static_cast<float>(i - j) / n, static_cast<float>(j) / n}});
        }
        row[static_cast<size_t>(i)].push_back(place);
      }
    }
    for (size_t i = 0; i < static_cast<size_t>(parts); ++i) {
      for (size_t j = 0; j <= i; ++j) {
        triangle.push_back({row[i][j], row[i + 1][j], row[i + 1][j + 1]});
        if (j < i) triangle.push_back({row[i][j], row[i + 1][j + 1], row[i][j + 1]});
      }
    }
  }
};

Vec3 blend(const Sample& s, std::span<const Vec3> value) {
  return value[s.corner[0]] * s.weight[0] + value[s.corner[1]] * s.weight[1] + value[s.corner[2]] * s.weight[2];
}

// Phong tessellation (Boubekeur and Alexa 2008): the flat point is moved toward the tangent planes of its corners. It passes
// through the corners, and along an edge depends only on that edge, so neighbors match.
Vec3 curved(const Sample& s, std::span<const Vec3> position, std::span<const Vec3> normal) {
  const Vec3 flat = blend(s, position);
  Vec3 pull;
  for (int k = 0; k < 3; ++k) {
    const Vec3 n = normal[s.corner[k]];
    pull += n * (dot(position[s.corner[k]] - flat, n) * s.weight[k]);
  }
  return flat + pull * 0.75f;
}

// The organ's center line and a frame transported along it without twist, for texture coordinates.
class MiddleLine {
 public:
  MiddleLine(const TriangleMesh& sheet, std::span<const float> along) {
    const float end = *std::max_element(along.begin(), along.end());
    const size_t bins = std::clamp<size_t>(static_cast<size_t>(end / 0.012f), 1, 100);
    step_ = std::max(end, 1e-6f) / static_cast<float>(bins);
    std::vector<float> count(bins, 0), radius(bins, 0);
    center_.resize(bins);
    const auto bin = [&](size_t v) { return std::min(bins - 1, static_cast<size_t>(std::max(along[v], 0.0f) / step_)); };
    for (size_t v = 0; v < along.size(); ++v) center_[bin(v)] += sheet.position[v], count[bin(v)] += 1;
    for (size_t i = 0; i < bins; ++i) center_[i] = count[i] > 0 ? center_[i] / count[i] : i > 0 ? center_[i - 1] : Vec3{};
    double mean = 0;
    for (size_t v = 0; v < along.size(); ++v)
      mean += distance(sheet.position[v], center_[bin(v)]) / static_cast<double>(along.size());
    mean_radius_ = static_cast<float>(mean);
    Vec3 e1 = any_perpendicular(direction(0));
    for (size_t i = 0; i < bins; ++i) {
      const Vec3 d = direction(i);
      e1 = normalized(e1 - d * dot(e1, d), any_perpendicular(d));
      e1_.push_back(e1);
      e2_.push_back(cross(d, e1));
    }
  }
  float mean_radius() const { return mean_radius_; }
  // 0..1 round the line
  float turn(Vec3 p, float along) const {
    const float at = std::clamp(along / step_ - 0.5f, 0.0f, static_cast<float>(center_.size() - 1));
    const size_t i = static_cast<size_t>(at), j = std::min(i + 1, center_.size() - 1);
    const float t = at - static_cast<float>(i);
    const Vec3 d = p - lerp(center_[i], center_[j], t);
    return portable::atan2(dot(d, lerp(e2_[i], e2_[j], t)), dot(d, lerp(e1_[i], e1_[j], t))) / (2 * kPi) + 0.5f;
  }

 private:
  Vec3 direction(size_t i) const {
    const size_t a = i > 0 ? i - 1 : 0, b = std::min(i + 1, center_.size() - 1);
    return normalized(center_[b] - center_[a], Vec3{0, -1, 0});
  }
  std::vector<Vec3> center_, e1_, e2_;
  float step_ = 0, mean_radius_ = 0;
};

struct Builder {
  VisibleMesh mesh;
  void vertex(Vec3 p, Vec3 n, std::array<float, 2> uv, TissueLayer layer) {
    mesh.position.push_back(p);
    mesh.normal.push_back(n);
    mesh.uv.push_back(uv);
    mesh.layer.push_back(layer);
  }
  // Where the texture closes round the organ, triangles get separate corners, one lap further.
  void open_seam(float tiles) {
    std::map<uint32_t, uint32_t> lap;
    for (Triangle& t : mesh.triangle) {
      const float high = std::max({mesh.uv[t[0]][1], mesh.uv[t[1]][1], mesh.uv[t[2]][1]});
      for (uint32_t& v : t) {
        if (mesh.uv[v][1] > high - 0.5f * tiles) continue;
        const auto [it, fresh] = lap.try_emplace(v, static_cast<uint32_t>(mesh.position.size()));
        if (fresh)
          vertex(Vec3{mesh.position[v]}, Vec3{mesh.normal[v]}, {mesh.uv[v][0], mesh.uv[v][1] + tiles},
                 TissueLayer{mesh.layer[v]});
        v = it->second;
      }
    }
  }
};

}  // namespace

VisibleMesh sheet_picture(const TriangleMesh& sheet, const BodyRest& body, std::span<const float> along) {
  const size_t n = sheet.position.size();
  TriangleMesh inside{std::vector<Vec3>(n), sheet.triangle};
  for (size_t v = 0; v < n; ++v) inside.position[v] = body.position[2 * v + 1];
  const std::vector<Vec3> out_normal = vertex_normals(sheet), in_normal = vertex_normals(inside);
  const int parts = std::max(1, static_cast<int>(std::lround(std::sqrt(9500.0 / static_cast<double>(n)))));
  Subdivision cut(sheet, parts);
  const MiddleLine line(sheet, along);
  const float tiles = std::max(1.0f, std::round(2 * kPi * line.mean_radius() / 0.01f));

  Builder b;
  for (const Sample& s : cut.sample) {
    const Vec3 p = curved(s, sheet.position, out_normal);
    const float u = along[s.corner[0]] * s.weight[0] + along[s.corner[1]] * s.weight[1] + along[s.corner[2]] * s.weight[2];
    b.vertex(p, normalized(blend(s, out_normal)), {u / 0.01f, tiles * line.turn(p, u)}, TissueLayer::serosa);
  }
  const uint32_t side = static_cast<uint32_t>(cut.sample.size());
  for (uint32_t i = 0; i < side; ++i) {
    const Sample& s = cut.sample[i];
    b.vertex(curved(s, inside.position, in_normal), -normalized(blend(s, in_normal)), std::array<float, 2>{b.mesh.uv[i]},
             TissueLayer::mucosa);
  }
  for (const Triangle& t : cut.triangle) b.mesh.triangle.push_back(t);
  for (const Triangle& t : cut.triangle) b.mesh.triangle.push_back({side + t[0], side + t[2], side + t[1]});

  for (const auto& loop : boundary_loops(sheet.triangle)) {
    std::vector<uint32_t> fine;
    for (size_t i = 0; i < loop.size(); ++i) {
      for (int k = 0; k < parts; ++k) fine.push_back(cut.edge_place(loop[i], loop[(i + 1) % loop.size()], k));
    }
    constexpr uint32_t steps = 6;
    const uint32_t count = static_cast<uint32_t>(fine.size()), first = static_cast<uint32_t>(b.mesh.position.size());
    for (uint32_t i = 0; i <= steps; ++i) {
      const float a = kPi * static_cast<float>(i) / steps;
      for (uint32_t j = 0; j < count; ++j) {
        const Vec3 o = b.mesh.position[fine[j]], in = b.mesh.position[side + fine[j]];
        const Vec3 tangent = b.mesh.position[fine[(j + 1) % count]] - b.mesh.position[fine[(j + count - 1) % count]];
        const Vec3 half = (o - in) * 0.5f, away = normalized(cross(half, tangent));
        const float swell = 0.7f * length(half);
        const Vec3 p = (o + in) * 0.5f - half * portable::cos(a) + away * (swell * portable::sin(a));
        const Vec3 normal =
            normalized(away * (length(half) * portable::sin(a)) - normalized(half) * (swell * portable::cos(a)));
        const std::array<float, 2> uv = b.mesh.uv[fine[j]];
        b.vertex(p, normal, {uv[0] - 100 * 2 * length(half) * (1 - static_cast<float>(i) / steps), uv[1]},
                 TissueLayer::cut_edge);
      }
    }
    for (uint32_t i = 0; i < steps; ++i) {
      for (uint32_t j = 0; j < count; ++j) {
        const uint32_t here = first + i * count + j, next = first + i * count + (j + 1) % count;
        b.mesh.triangle.push_back({here, here + count, next + count});
        b.mesh.triangle.push_back({here, next + count, next});
      }
    }
  }
  b.open_seam(tiles);
  const double spacing = std::sqrt(surface_area(sheet) / static_cast<double>(n) / 0.8660254);
  bind_skin(b.mesh, body.position, static_cast<float>(2 * spacing), 2);
  return std::move(b.mesh);
}

}  // namespace catgut
