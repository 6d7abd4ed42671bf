// SPDX-License-Identifier: Apache-2.0
// sim/topology_picture: the visible surface of divided tissue. Reads the scene's surface and the cells; see the
// header of sim/topology.
#include <algorithm>
#include <map>

#include "core/check.h"
#include "sim/cell_graph.h"
#include "sim/topology.h"

namespace catgut {
namespace {

class Divider {
 public:
  Divider(const Model& built, const Model& m) : built_(built), m_(m), graph_(m), family_(built.solver.tissue) {
    for (uint32_t i = 0; i < built.solver.tissue; ++i) family_[i] = {i};
    std::vector<uint8_t> copied(built.solver.tissue, 0);
    for (uint32_t k = 0; k < m.source.size(); ++k)
      family_[m.source[k]].push_back(built.solver.tissue + k), copied[m.source[k]] = 1;
    near_.assign(built.solver.tissue, 0);
    for (uint32_t i = 0; i < built.solver.tissue; ++i)
      for (uint32_t k : cluster_members(built.solver, i)) near_[i] |= copied[k];
  }

  void divide(VisibleMesh& mesh) {
    const size_t vertices = mesh.position.size();
    std::vector<uint8_t> near(vertices, 0);
    for (size_t v = 0; v < vertices; ++v)
      for (uint32_t i : mesh.skin_particle[v]) near[v] |= near_[i];
    const VisibleMesh whole = mesh;
    std::vector<uint32_t> cell(vertices, kNoCell);
    const auto cell_of = [&](uint32_t v) {
      if (cell[v] == kNoCell) cell[v] = locate(whole, v);
      return cell[v];
    };
    for (uint32_t v = 0; v < vertices; ++v)
      if (near[v]) bind(whole, v, cell_of(v), mesh, v);
    // A triangle across the cut belongs to the side of most of its corners. Its other corners are duplicated.
    std::map<std::pair<uint32_t, uint32_t>, uint32_t> twin;  // vertex, cell of the duplicate
    for (std::array<uint32_t, 3>& t : mesh.triangle) {
      if (!near[t[0]] && !near[t[1]] && !near[t[2]]) continue;
      const uint32_t in[3] = {cell_of(t[0]), cell_of(t[1]), cell_of(t[2])};
      int together[3] = {};
      for (size_t a = 0; a < 3; ++a)
        for (size_t b = 0; b < 3; ++b) together[a] += hang_together(in[a], in[b]);
      const size_t main = static_cast<size_t>(std::max_element(together, together + 3) - together);
      if (together[main] == 3) continue;
      for (size_t k = 0; k < 3; ++k) {
        if (hang_together(in[main], in[k])) continue;
        const auto [at, fresh] = twin.try_emplace({t[k], in[main]}, static_cast<uint32_t>(mesh.position.size()));
        if (fresh) {
          mesh.position.push_back(whole.position[t[k]]), mesh.normal.push_back(whole.normal[t[k]]);
          mesh.uv.push_back(whole.uv[t[k]]), mesh.layer.push_back(whole.layer[t[k]]);
          mesh.skin_particle.push_back({}), mesh.skin_weight.push_back({});
          bind(whole, t[k], in[main], mesh, at->second);
        }
        t[k] = at->second;
      }
    }
  }

  // Texture coordinates of cut edges: those of the vertex with the largest weight on a particle.
  void find_nearest(const VisibleMesh& whole) {
    nearest_.assign(built_.solver.tissue, 0);
    std::vector<float> best(built_.solver.tissue, 0);
    for (uint32_t v = 0; v < whole.position.size(); ++v)
      for (size_t k = 0; k < 4; ++k) {
        const uint32_t i = whole.skin_particle[v][k];
        if (whole.skin_weight[v][k] > best[i]) best[i] = whole.skin_weight[v][k], nearest_[i] = v;
      }
  }
  void add_face(VisibleMesh& mesh, const VisibleMesh& whole, const Triangle& face) const {
    const auto rest = [&](uint32_t i) { return xyz(m_.solver.shape.rest[i]); };
    const Vec3 normal = normalized(cross(rest(face[1]) - rest(face[0]), rest(face[2]) - rest(face[0])), {0, 1, 0});
    std::array<uint32_t, 3> t;
    for (size_t k = 0; k < 3; ++k) {
      const uint32_t i = public_index(built_, m_, face[k]);
      t[k] = static_cast<uint32_t>(mesh.position.size());
      mesh.position.push_back(rest(face[k])), mesh.normal.push_back(normal),
          mesh.uv.push_back(whole.uv[nearest_[source_of(m_, face[k])]]);
      mesh.layer.push_back(TissueLayer::cut_edge);
      mesh.skin_particle.push_back({i, i, i, i}), mesh.skin_weight.push_back({1, 0, 0, 0});
    }
    mesh.triangle.push_back(t);
  }

 private:
  uint32_t locate(const VisibleMesh& whole, uint32_t v) {
    std::vector<uint32_t> around;
    for (uint32_t i : whole.skin_particle[v]) around.insert(around.end(), family_[i].begin(), family_[i].end());
    return graph_.locate(around, whole.position[v]);
  }
  // Marks the neighborhood that a cell can reach.
  void see(uint32_t cell, std::span<const uint32_t> source) {
    region_.clear();
    const auto add = [&](uint32_t i) {
      for (uint32_t k : cluster_members(built_.solver, i)) region_.push_back(k);
    };
    for (uint32_t i : source) add(i);
    for (uint32_t i : m_.cell[cell]) add(source_of(m_, i));
    graph_.connected(m_.cell[cell], region_);
  }
  bool hang_together(uint32_t a, uint32_t b) {
    if (a == b) return true;
    const auto [at, fresh] = together_.try_emplace(std::minmax(a, b), false);
    if (!fresh) return at->second;
    std::vector<uint32_t> source;
    for (uint32_t i : m_.cell[b]) source.push_back(source_of(m_, i));
    see(a, source);
    const Tet& t = m_.cell[b];
    at->second = std::all_of(t.begin(), t.end(), [&](uint32_t i) { return graph_.was_connected(i); });
    return at->second;
  }
  // Binds vertex `to` of `mesh` to the particles of vertex `from` that its cell can reach.
  void bind(const VisibleMesh& whole, uint32_t from, uint32_t cell, VisibleMesh& mesh, uint32_t to) {
    see(cell, whole.skin_particle[from]);
    std::array<uint32_t, 4> particle{};
    std::array<float, 4> weight{};
    float sum = 0;
    for (size_t k = 0; k < 4; ++k) {
      const float w = whole.skin_weight[from][k];
      if (w == 0) continue;
      for (uint32_t i : family_[whole.skin_particle[from][k]]) {
        if (!graph_.was_connected(i)) continue;
        particle[k] = i, weight[k] = w, sum += w;
        break;
      }
    }
    if (sum < 0.05f) {  // all are beyond the cut
      sum = 4;
      for (size_t k = 0; k < 4; ++k) particle[k] = m_.cell[cell][k], weight[k] = 1;
    }
    uint32_t some = 0;
    for (size_t k = 0; k < 4; ++k)
      if (weight[k] > 0) some = particle[k];
    for (size_t k = 0; k < 4; ++k) {
      mesh.skin_particle[to][k] = public_index(built_, m_, weight[k] > 0 ? particle[k] : some);
      mesh.skin_weight[to][k] = weight[k] / sum;
    }
  }

  const Model &built_, &m_;
  CellGraph graph_;
  std::vector<std::vector<uint32_t>> family_;  // per particle of the scene's model: the particle and its copies
  std::vector<uint8_t> near_;                  // per particle of the scene's model: its cluster has copies
  std::vector<uint32_t> region_, nearest_;
  std::map<std::pair<uint32_t, uint32_t>, bool> together_;
};

}  // namespace

PictureModel divide_picture(const Model& built, const Model& m, const Topology& topology) {
  PictureModel p = built.picture;
  p.particle_rest.resize(built.solver.count);
  p.wall.resize(built.solver.count);
  for (uint32_t i : m.source) p.particle_rest.push_back(built.picture.particle_rest[i]), p.wall.push_back(built.wall[i]);
  for (size_t w = 0; w < m.rim.size(); ++w) {
    p.rim[w].clear();
    for (uint32_t i : m.rim[w].outer) p.rim[w].push_back(public_index(built, m, i));
  }
  Divider divider(built, m);
  for (size_t b = 0; b < p.body.size(); ++b) {
    const VisibleMesh& whole = built.picture.body[b];
    std::vector<uint8_t> has_wall(m.rim.size(), 0);
    for (const auto& particle : whole.skin_particle)
      for (uint32_t i : particle) has_wall[built.wall[i]] = 1;
    divider.divide(p.body[b]);
    divider.find_nearest(whole);
    for (const Topology::Face& f : topology.face)
      if (has_wall[m.wall[m.cell[f.cell][0]]]) divider.add_face(p.body[b], whole, face_of(m.cell[f.cell], f.face));
  }
  return p;
}

}  // namespace catgut
