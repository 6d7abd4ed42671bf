// SPDX-License-Identifier: Apache-2.0
// sim/cut_picture: the visible surface of a wall that a pen has touched, made from the wall's faces: whole ones in a few parts,
// touched ones cell by cell, divided ones with their cut edges. Each vertex follows the columns of its own side of a cut.
// Declared in sim/cutting.
#include <algorithm>
#include <array>

#include "core/hash.h"
#include "physical/cut_mesh.h"
#include "sim/cutting.h"
#include "sim/model.h"
#include "sim/state.h"

namespace catgut {
namespace {

constexpr int kCoarse = 4;         // parts of an edge of a face that no pen has touched; of the others: wall::kRaster
constexpr float kTexture = 0.01f;  // [m] per unit of texture coordinates

bool is_quad(const wall::Model& m, uint32_t face) { return m.mesh.face[face][3] != wall::kNone; }
bool is_divided(const wall::Topology& t, uint32_t face) {
  return !t.first_fragment.empty() && t.first_fragment[face] != wall::kNone;
}

// Whether nothing joins a face to its neighbor at piece k of its edge: a rim, or a cut.
bool is_open(const wall::Model& m, const wall::Topology& t, uint32_t face, uint32_t edge, uint32_t k) {
  const uint32_t over = m.neighbor[face][edge];
  if (over == wall::kNone) return true;
  if (t.cut.empty()) return false;
  const bool turned = m.mesh.face[over / 4][over % 4] != m.mesh.face[face][edge];
  const uint32_t there = turned ? wall::kRaster - 1 - k : k;
  return t.cut[face].has(wall::raster(is_quad(m, face)).over_edge(edge, k)) ||
         t.cut[over / 4].has(wall::raster(is_quad(m, over / 4)).over_edge(over % 4, there));
}

// What the shape of the picture depends on.
uint64_t shape_of(const wall::Model& wall, const State& state) {
  const physical::Excision& e = state.physical.cutting.excision;
  uint64_t h = hash_bytes(nullptr, 0, 1);
  for (uint32_t f = 0; f < e.passed.size(); ++f)
    if (e.passed[f].any()) h = hash_bytes(&f, sizeof f, h);
  const std::vector<wall::FaceCut>& cut = state.physical.world.wall.topology.cut;
  for (uint32_t f = 0; f < cut.size(); ++f) {
    if (!cut[f].any()) continue;
    const wall::Raster& r = wall::raster(is_quad(wall, f));
    for (uint32_t link = r.inner; link < r.links; ++link)
      if (cut[f].has(link)) h = hash_bytes(&link, sizeof link, h + f);
  }
  for (const wall::Fragment& part : state.physical.world.wall.topology.fragment) {
    h = hash_bytes(&part.cells, sizeof part.cells, h);
    h = hash_bytes(&part.face, sizeof part.face, h);
  }
  return h;
}

uint32_t columns_at_rest(const Model& model) { return model.solver.tissue / 2; }
// Index in Snapshot::particle: the tissue as built, threads, copies.
uint32_t particle_of(const Model& model, uint32_t column, bool inner) {
  const uint32_t rest = columns_at_rest(model);
  return (column < rest ? 2 * column : model.solver.count + 2 * (column - rest)) + (inner ? 1 : 0);
}

// Texture coordinates of a body, as its own picture has them: along the organ, and round it.
class Texture {
 public:
  explicit Texture(const BodySpec& body) : body_(body), axis_(normalized(body.axis)), e1_(any_perpendicular(axis_)) {
    if (body.kind != "pad") turn_ = std::max(1.0f, std::round(2 * kPi * body.radius / kTexture));
  }
  std::array<float, 2> at(Vec3 p) const {
    const Vec3 d = p - body_.position;
    const float along = -dot(d, axis_) / kTexture;
    if (turn_ <= 0) return {along, dot(d, e1_) / kTexture};
    const float angle = portable::atan2(dot(d, cross(axis_, e1_)), dot(d, e1_)) / (2 * kPi);
    return {along, turn_ * (angle < 0 ? angle + 1 : angle)};
  }
  // The same place of the texture, not a turn away from `near`.
  std::array<float, 2> unwrapped(std::array<float, 2> uv, std::array<float, 2> near) const {
    if (turn_ > 0) uv[1] -= turn_ * std::round((uv[1] - near[1]) / turn_);
    return uv;
  }

 private:
  BodySpec body_;
  Vec3 axis_, e1_;
  float turn_ = 0;  // of v
};

class Builder {
 public:
  Builder(const Model& model, const State& state, PictureModel& picture)
      : model_(model),
        world_(model.physical->world),
        state_(state.physical.world),
        excision_(state.physical.cutting.excision),
        picture_(picture) {
    uint32_t end = 0;
    for (const BodySpec& b : model.scene.body)
      texture_.emplace_back(b), end_.push_back(end += static_cast<uint32_t>(b.particles));
    normal_.resize(picture.body.size());
    for (VisibleMesh& mesh : picture.body) mesh = {};
  }

  void build() {
    const wall::Model& w = world_.wall;
    for (uint32_t f = 0; f < w.mesh.face.size(); ++f)
      if (!is_divided(state_.wall.topology, f)) add_whole(f);
    add_divided();
    for (size_t b = 0; b < normal_.size(); ++b)
      for (size_t v = 0; v < normal_[b].size(); ++v) picture_.body[b].normal[v] = normalized(normal_[b][v], {0, 1, 0});
  }

 private:
  size_t body_of(uint32_t face) const {
    const uint32_t particle = 2 * world_.wall.mesh.face[face][0];
    size_t b = 0;
    while (b + 1 < end_.size() && particle >= end_[b]) ++b;
    return b;
  }

  // A vertex on the outer or the inner side. edge: of a cut or a rim; its normal is that of its triangles.
  uint32_t add_vertex(const wall::Point& point, const wall::Weights& w, bool inner, bool edge) {
    const wall::Mesh& rest = world_.wall.mesh;
    const std::vector<uint32_t>& source = state_.wall.topology.source;
    const size_t b = body_of(point.face);
    VisibleMesh& mesh = picture_.body[b];
    const uint32_t first = rest.face[point.face][0];
    const std::array<float, 2> near = texture_[b].at(rest.outer[first]);
    Vec3 at{}, out{};
    std::array<float, 2> uv{};
    std::array<uint32_t, 4> particle{};
    for (size_t k = 0; k < 4; ++k) {
      const uint32_t c = w.weight[k] != 0 ? w.column[k] : w.column[0], s = source[c];
      at += (inner ? rest.inner[s] : rest.outer[s]) * w.weight[k];
      out += (rest.outer[s] - rest.inner[s]) * w.weight[k];
      const std::array<float, 2> here = texture_[b].unwrapped(texture_[b].at(rest.outer[s]), near);
      for (size_t i = 0; i < 2; ++i) uv[i] += here[i] * w.weight[k];
      particle[k] = particle_of(model_, c, inner);
    }
    mesh.position.push_back(at), mesh.uv.push_back(uv);
    mesh.layer.push_back(edge ? TissueLayer::cut_edge : static_cast<TissueLayer>(model_.layer[2 * first + (inner ? 1 : 0)]));
    mesh.skin_particle.push_back(particle), mesh.skin_weight.push_back(w.weight);
    mesh.normal.push_back({});
    normal_[b].push_back(edge ? Vec3{} : inner ? -out : out);
    return static_cast<uint32_t>(mesh.position.size()) - 1;
  }
  void add_triangle(uint32_t face, std::array<uint32_t, 3> t, bool edge) {
    const size_t b = body_of(face);
    VisibleMesh& mesh = picture_.body[b];
    const Vec3 n = cross(mesh.position[t[1]] - mesh.position[t[0]], mesh.position[t[2]] - mesh.position[t[0]]);
    mesh.triangle.push_back(t);
    for (const uint32_t v : t)
      if (edge) normal_[b][v] += n;
  }

  void add_whole(uint32_t face) {
    const wall::Topology& t = state_.wall.topology;
    const bool quad = is_quad(world_.wall, face);
    const size_t edges = quad ? 4 : 3;
    const auto is_cut = [&](size_t e) {
      bool cut = false;
      for (uint32_t k = 0; k < wall::kRaster && world_.wall.neighbor[face][e] != wall::kNone; ++k)
        cut = cut || is_open(world_.wall, t, face, static_cast<uint32_t>(e), k);
      return cut;
    };
    bool fine = excision_.passed[face].any();
    for (size_t e = 0; e < edges; ++e) fine = fine || is_cut(e);
    const int n = fine ? wall::kRaster : kCoarse;
    const auto natural = [&](int i, int j) {
      const float s = 2.0f / static_cast<float>(n), off = quad ? 1.0f : 0.0f;
      return wall::Point{face, s * static_cast<float>(i) - off, s * static_cast<float>(j) - off, 0};
    };
    const auto add = [&](int i, int j, bool inner, bool edge) {
      wall::Point p = natural(i, j);
      p.zeta = inner ? -1.0f : 1.0f;
      return add_vertex(p, wall::weights(world_.wall, t, p), inner, edge);
    };
    std::vector<uint32_t> row(static_cast<size_t>((n + 1) * (n + 1)));
    for (const bool inner : {false, true}) {
      const auto at = [&](int i, int j) -> uint32_t& { return row[static_cast<size_t>(j * (n + 1) + i)]; };
      for (int j = 0; j <= n; ++j)
        for (int i = 0; i <= (quad ? n : n - j); ++i) at(i, j) = add(i, j, inner, false);
      const auto triangle = [&](uint32_t a, uint32_t b, uint32_t c) {
        add_triangle(face, inner ? std::array{a, c, b} : std::array{a, b, c}, false);
      };
      for (int j = 0; j < n; ++j)
        for (int i = 0; i < (quad ? n : n - j); ++i) {
          triangle(at(i, j), at(i + 1, j), quad ? at(i + 1, j + 1) : at(i, j + 1));
          if (quad) triangle(at(i, j), at(i + 1, j + 1), at(i, j + 1));
          else if (i + j + 1 < n) triangle(at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
        }
    }
    // Rims of the organ, and cuts along the face's own edges.
    const std::array<std::array<int, 2>, 4> corner = quad ? std::array<std::array<int, 2>, 4>{{{0, 0}, {n, 0}, {n, n}, {0, n}}}
                                                          : std::array<std::array<int, 2>, 4>{{{0, 0}, {n, 0}, {0, n}, {0, 0}}};
    for (size_t e = 0; e < edges; ++e) {
      if (world_.wall.neighbor[face][e] != wall::kNone && !is_cut(e)) continue;
      const auto from = corner[e], to = corner[(e + 1) % edges];
      const auto place = [&](int k, size_t d) { return from[d] + (to[d] - from[d]) * k / n; };
      std::array<uint32_t, 2> before{};
      int known = -1;  // the k of `before`
      const auto vertices = [&](int k) {
        return std::array{add(place(k, 0), place(k, 1), true, true), add(place(k, 0), place(k, 1), false, true)};
      };
      for (int k = 0; k < n; ++k) {
        const uint32_t piece = static_cast<uint32_t>(k * wall::kRaster / n);
        if (!is_open(world_.wall, t, face, static_cast<uint32_t>(e), piece)) continue;
        if (known != k) before = vertices(k);
        const std::array<uint32_t, 2> now = vertices(k + 1);
        add_strip(face, before, now);
        before = now, known = k + 1;
      }
    }
  }
  // a, b: inner and outer vertex at the ends of a piece of an edge, in the order of the face's corners.
  void add_strip(uint32_t face, std::array<uint32_t, 2> a, std::array<uint32_t, 2> b) {
    add_triangle(face, {a[0], b[0], b[1]}, true);
    add_triangle(face, {a[0], b[1], a[1]}, true);
  }

  void add_divided() {
    const physical::CutMesh cut = make_cut_mesh(world_, state_, false);
    // Edges have vertices of their own, for their normals and their layer.
    std::array<std::vector<uint32_t>, 2> number;
    for (auto& list : number) list.assign(cut.vertex.size(), wall::kNone);
    for (const physical::CutMesh::Face& f : cut.face) {
      const bool edge = f.side == physical::CutSide::cut_edge || f.side == physical::CutSide::rim;
      std::array<uint32_t, 3> t{};
      for (size_t k = 0; k < 3; ++k) {
        const physical::CutMesh::Vertex& v = cut.vertex[f.vertex[k]];
        uint32_t& known = number[edge ? 1 : 0][f.vertex[k]];
        if (known == wall::kNone) known = add_vertex(v.point, v.at, v.point.zeta < 0, edge);
        t[k] = known;
      }
      add_triangle(cut.vertex[f.vertex[0]].point.face, t, edge);
    }
  }

  const Model& model_;
  const physical::Model& world_;
  const physical::State& state_;
  const physical::Excision& excision_;
  PictureModel& picture_;
  std::vector<Texture> texture_;           // per body
  std::vector<uint32_t> end_;              // per body: particles up to its last
  std::vector<std::vector<Vec3>> normal_;  // per body and vertex, not yet unit
};

// Rotation of each column since rest: mean over its elements of the turn of director and edge.
std::vector<Quat> rotations(const wall::Model& m, const wall::State& s) {
  const wall::Topology& t = s.topology;
  std::vector<Quat> sum(wall::columns(s), Quat{0, 0, 0, 0});
  const auto frame = [](Vec3 normal, Vec3 along) {
    const Vec3 z = normalized(normal, {0, 0, 1}), x = normalized(along - z * dot(along, z), any_perpendicular(z));
    return from_axes(x, cross(z, x), z);
  };
  for (uint32_t e = 0; e < wall::elements(m, t); ++e) {
    const uint32_t face = wall::face_of_element(m, t, e);
    if (e == face && is_divided(t, face)) continue;
    const uint32_t lane = wall::lane_of_element(m, t, e), in = lane % wall::kLanesOfBlock, n = is_quad(m, face) ? 4 : 3;
    const auto& corner = t.corners[lane / wall::kLanesOfBlock].column;
    for (uint32_t k = 0; k < n; ++k) {
      const uint32_t a = corner[k][in], b = corner[(k + 1) % n][in], ra = t.source[a], rb = t.source[b];
      const auto middle = [&](uint32_t c) { return (m.mesh.outer[c] + m.mesh.inner[c]) * 0.5f; };
      const Quat now = frame(wall::vec3(s.motion.x[2 * a + 1]), wall::vec3(s.motion.x[2 * b]) - wall::vec3(s.motion.x[2 * a])),
                 rest = frame(m.mesh.outer[ra] - m.mesh.inner[ra], middle(rb) - middle(ra));
      const Quat q = now * conjugate(rest);
      const float sign = q.x * sum[a].x + q.y * sum[a].y + q.z * sum[a].z + q.w * sum[a].w < 0 ? -1.0f : 1.0f;
      sum[a] = {sum[a].x + sign * q.x, sum[a].y + sign * q.y, sum[a].z + sign * q.z, sum[a].w + sign * q.w};
    }
  }
  for (Quat& q : sum) {
    const float l2 = q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w, scale = l2 > 1e-6f ? 1 / std::sqrt(l2) : 0;
    q = scale > 0 ? Quat{q.x * scale, q.y * scale, q.z * scale, q.w * scale} : Quat{};
  }
  return sum;
}

}  // namespace

void renew_cut_picture(const Model& model, State& state) {
  Cutting& c = state.physical.cutting;
  if (c.mode.empty() || c.excision.passed.empty()) {
    c.picture.reset(), c.picture_of = 0;
    return;
  }
  const uint64_t shape = shape_of(model.physical->world.wall, state);
  if (c.picture && c.picture_of == shape) return;
  auto picture = std::make_shared<PictureModel>(model.picture);
  const wall::Mesh& rest = model.physical->world.wall.mesh;
  const std::vector<uint32_t>& source = state.physical.world.wall.topology.source;
  picture->particle_rest.resize(model.solver.count), picture->wall.resize(model.solver.count);
  for (size_t i = columns_at_rest(model); i < source.size(); ++i) {
    picture->particle_rest.push_back(rest.outer[source[i]]), picture->particle_rest.push_back(rest.inner[source[i]]);
    picture->wall.insert(picture->wall.end(), 2, model.wall[2 * source[i]]);
  }
  Builder(model, state, *picture).build();
  c.picture = std::move(picture), c.picture_of = shape;
}

void publish_cut(const Model& model, const State& state, Snapshot& out) {
  const Cutting& c = state.physical.cutting;
  const wall::State& wall = state.physical.world.wall;
  const uint32_t rest = columns_at_rest(model);
  const std::vector<Quat> turned = rotations(model.physical->world.wall, wall);
  uint32_t version = static_cast<uint32_t>(wall.topology.fragment.size());
  for (const wall::FaceCut& f : c.excision.passed) version += f.any();
  out.topology = {version, c.pieces, c.picture};
  out.rotation.assign(model.solver.count, {});
  for (uint32_t i = 0; i < rest; ++i) out.rotation[2 * i] = out.rotation[2 * i + 1] = turned[i];
  for (uint32_t i = rest; i < turned.size(); ++i) {
    out.particle.push_back(wall::outer(wall, i)), out.particle.push_back(wall::inner(wall, i));
    out.rotation.insert(out.rotation.end(), 2, turned[i]);
  }
}

}  // namespace catgut
