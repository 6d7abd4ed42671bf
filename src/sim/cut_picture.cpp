// SPDX-License-Identifier: Apache-2.0
// sim/cut_picture: the visible surface of a wall that a pen has touched, made from the wall's faces: whole ones in a few parts,
// touched ones cell by cell, divided ones with their cut edges. Each vertex follows the columns of its own side of a cut. A
// tick only notes what a picture depends on; the first reader of the picture makes it. Declared in sim/cutting.
#include <algorithm>
#include <array>
#include <cmath>

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

Vec3 middle_of(const wall::Model& m, uint32_t face) {
  Vec3 sum{};
  const uint32_t n = is_quad(m, face) ? 4 : 3;
  for (uint32_t k = 0; k < n; ++k) sum += m.mesh.outer[m.mesh.face[face][k]] + m.mesh.inner[m.mesh.face[face][k]];
  return sum / static_cast<float>(2 * n);
}
// [m] no point of the face is farther from its middle.
float size_of(const wall::Model& m, uint32_t face) {
  const Vec3 middle = middle_of(m, face);
  float far2 = 0;
  for (uint32_t k = 0; k < (is_quad(m, face) ? 4u : 3u); ++k)
    far2 = std::max(far2, length2(m.mesh.outer[m.mesh.face[face][k]] - middle));
  return std::sqrt(far2);
}

// What the shape of the picture depends on.
uint64_t shape_of(const wall::Model& wall, const State& state) {
  const std::vector<uint32_t>& touched = state.physical.cutting.touched;
  uint64_t h = hash_bytes(touched.data(), touched.size() * sizeof(uint32_t), 1);
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
  float turn() const { return turn_; }  // of v; 0: it does not close

 private:
  BodySpec body_;
  Vec3 axis_, e1_;
  float turn_ = 0;
};

}  // namespace

// Lattice points of a face.
struct FaceAtRest {
  Vec3 middle;     // [m]
  float size = 0;  // [m] no point of the face is farther from its middle
  uint32_t points = 0;
  std::array<uint8_t, physical::kLatticePoints> number{};
  std::array<Vec3, physical::kLatticePoints> lattice{};  // [m]
};

// Constant: what every picture of a scene needs.
struct CutPictureSource {
  std::shared_ptr<const PhysicalModel> physical;
  PictureModel whole;                    // its bodies without their surfaces
  std::vector<uint8_t> layer, wall;      // per tissue particle, as in Model
  uint32_t tissue = 0, count = 0;        // particles: of the tissue, all
  std::vector<std::array<float, 2>> uv;  // per column at rest, on the outer side
  std::vector<uint32_t> body;            // per column at rest
  std::vector<float> turn;               // per body: Texture::turn
  std::vector<FaceAtRest> rest;          // per face of the wall
};

namespace {

FaceAtRest at_rest(const wall::Model& m, uint32_t face) {
  FaceAtRest out;
  const bool quad = is_quad(m, face);
  out.middle = middle_of(m, face), out.size = size_of(m, face);
  constexpr int32_t kUnit = wall::kLattice / wall::kRaster;
  for (uint32_t k = 0; k < physical::kLatticePoints; ++k) {
    const int32_t u = static_cast<int32_t>(k % physical::kLatticeSide), v = static_cast<int32_t>(k / physical::kLatticeSide);
    if (!quad && u + v > wall::kRaster) continue;
    wall::Point p{face, 0, 0, 0};
    wall::to_natural(quad, {u * kUnit, v * kUnit}, p.xi, p.eta);
    out.lattice[out.points] = wall::rest_place(m, p), out.number[out.points++] = static_cast<uint8_t>(k);
  }
  return out;
}

std::shared_ptr<const CutPictureSource> make_source(const Model& model) {
  auto made = std::make_shared<CutPictureSource>();
  made->physical = model.physical;
  made->whole = model.picture;
  for (VisibleMesh& mesh : made->whole.body) mesh = {};
  made->layer = model.layer, made->wall = model.wall;
  made->tissue = model.solver.tissue, made->count = model.solver.count;
  uint32_t end = 0;
  for (uint32_t b = 0; b < model.scene.body.size(); ++b) {
    const Texture texture(model.scene.body[b]);
    made->turn.push_back(texture.turn());
    end += static_cast<uint32_t>(model.scene.body[b].particles);
    while (made->uv.size() < (b + 1 < model.scene.body.size() ? end / 2 : columns_at_rest(model))) {
      made->uv.push_back(texture.at(model.physical->world.wall.mesh.outer[made->uv.size()]));
      made->body.push_back(b);
    }
  }
  const wall::Model& m = model.physical->world.wall;
  for (uint32_t f = 0; f < m.mesh.face.size(); ++f) made->rest.push_back(at_rest(m, f));
  return made;
}

// What a picture shows: a copy, which no tick changes.
struct CutShape {
  std::shared_ptr<const CutPictureSource> source;
  wall::Topology topology;                           // only what a picture needs
  std::shared_ptr<const physical::Surface> divided;  // null: nothing is divided
  std::vector<uint32_t> trace;                       // per face: its place among the touched ones; kNone: whole and coarse
  const wall::Model& wall() const { return source->physical->world.wall; }
  const physical::Surface& surface() const { return divided ? *divided : source->physical->world.surface; }
  // Index in Snapshot::particle: the tissue as built, threads, copies.
  uint32_t particle_of(uint32_t column, bool inner) const {
    const uint32_t rest = source->tissue / 2;
    return (column < rest ? 2 * column : source->count + 2 * (column - rest)) + (inner ? 1 : 0);
  }
};

uint32_t scar_of(uint32_t trace, uint32_t lattice, bool inner) {
  return (trace * physical::kLatticePoints + lattice) * 2 + (inner ? 1 : 0);
}

class Builder {
 public:
  Builder(const CutShape& shape, PictureModel& picture)
      : shape_(shape), source_(*shape.source), wall_(shape.wall()), topology_(shape.topology), picture_(picture) {
    normal_.resize(picture.body.size()), inward_.resize(picture.body.size());
  }

  void build() {
    for (uint32_t f = 0; f < wall_.mesh.face.size(); ++f)
      if (!is_divided(topology_, f)) add_whole(f);
    add_divided();
    for (size_t b = 0; b < normal_.size(); ++b)
      for (size_t v = 0; v < normal_[b].size(); ++v) {
        VisibleMesh& mesh = picture_.body[b];
        mesh.normal[v] = normalized(normal_[b][v], {0, 1, 0});
        if (mesh.through[v] < 0.5f || length2(inward_[b][v]) == 0) continue;
        const Vec3 inward = normalized(inward_[b][v]) * (wall_.laminate.thickness / kTexture);
        mesh.uv[v][0] += inward.x, mesh.uv[v][1] += inward.y;
      }
  }

 private:
  size_t body_of(uint32_t face) const { return source_.body[wall_.mesh.face[face][0]]; }

  // A vertex on the outer or the inner side. edge: of a cut or a rim; its normal is that of its triangles. lattice: of the
  // face; kNone: between the lattice points.
  uint32_t add_vertex(const wall::Point& point, const wall::Weights& w, bool inner, bool edge, uint32_t lattice) {
    const wall::Mesh& rest = wall_.mesh;
    const size_t b = body_of(point.face);
    VisibleMesh& mesh = picture_.body[b];
    const uint32_t first = rest.face[point.face][0];
    const std::array<float, 2> near = source_.uv[first];
    Vec3 at{}, out{};
    std::array<float, 2> uv{};
    std::array<uint32_t, 4> particle{};
    for (size_t k = 0; k < 4; ++k) {
      const uint32_t c = w.weight[k] != 0 ? w.column[k] : w.column[0], s = topology_.source[c];
      at += (inner ? rest.inner[s] : rest.outer[s]) * w.weight[k];
      out += (rest.outer[s] - rest.inner[s]) * w.weight[k];
      std::array<float, 2> here = source_.uv[s];
      if (const float turn = source_.turn[b]; turn > 0) here[1] -= turn * std::round((here[1] - near[1]) / turn);
      for (size_t i = 0; i < 2; ++i) uv[i] += here[i] * w.weight[k];
      particle[k] = shape_.particle_of(c, inner);
    }
    mesh.position.push_back(at), mesh.uv.push_back(uv);
    mesh.layer.push_back(edge ? TissueLayer::cut_edge : static_cast<TissueLayer>(source_.layer[2 * first + (inner ? 1 : 0)]));
    mesh.skin_particle.push_back(particle), mesh.skin_weight.push_back(w.weight);
    mesh.normal.push_back({});
    const uint32_t trace = shape_.trace[point.face];
    mesh.scar.push_back(trace == wall::kNone || lattice == wall::kNone ? kNoScar : scar_of(trace, lattice, inner));
    // The renderer's layers of a cut edge lie strictly between 0 and 1.
    mesh.through.push_back(edge ? (inner ? 0.999f : 0.001f) : (inner ? 1.0f : 0.0f));
    normal_[b].push_back(edge ? Vec3{} : inner ? -out : out), inward_[b].push_back({});
    return static_cast<uint32_t>(mesh.position.size()) - 1;
  }
  void add_triangle(uint32_t face, std::array<uint32_t, 3> t, bool edge) {
    const size_t b = body_of(face);
    VisibleMesh& mesh = picture_.body[b];
    const Vec3 n = cross(mesh.position[t[1]] - mesh.position[t[0]], mesh.position[t[2]] - mesh.position[t[0]]);
    mesh.triangle.push_back(t);
    if (!edge) return;
    for (const uint32_t v : t) normal_[b][v] += n;
    // Across the wall the texture continues at a right angle to the edge, so that it is not stretched over the cut. The third
    // vertex lies to the left of an edge from vertex to vertex.
    for (size_t k = 0; k < 3; ++k) {
      const uint32_t from = t[k], to = t[(k + 1) % 3];
      if (mesh.through[from] != mesh.through[to]) continue;
      const float left = mesh.through[from] < 0.5f ? 1.0f : -1.0f, du = mesh.uv[to][0] - mesh.uv[from][0];
      float dv = mesh.uv[to][1] - mesh.uv[from][1];
      if (const float turn = source_.turn[b]; turn > 0) dv -= turn * std::round(dv / turn);
      for (const uint32_t v : t) inward_[b][v] += Vec3{-dv * left, du * left, 0};
    }
  }

  void add_whole(uint32_t face) {
    const wall::Topology& t = topology_;
    const bool quad = is_quad(wall_, face);
    const size_t edges = quad ? 4 : 3;
    const auto is_cut = [&](size_t e) {
      bool cut = false;
      for (uint32_t k = 0; k < wall::kRaster && wall_.neighbor[face][e] != wall::kNone; ++k)
        cut = cut || is_open(wall_, t, face, static_cast<uint32_t>(e), k);
      return cut;
    };
    bool fine = shape_.trace[face] != wall::kNone;
    for (size_t e = 0; e < edges; ++e) fine = fine || is_cut(e);
    const int n = fine ? wall::kRaster : kCoarse;
    const auto natural = [&](int i, int j) {
      const float s = 2.0f / static_cast<float>(n), off = quad ? 1.0f : 0.0f;
      return wall::Point{face, s * static_cast<float>(i) - off, s * static_cast<float>(j) - off, 0};
    };
    const auto add = [&](int i, int j, bool inner, bool edge) {
      wall::Point p = natural(i, j);
      p.zeta = inner ? -1.0f : 1.0f;
      const uint32_t lattice =
          n == wall::kRaster ? static_cast<uint32_t>(j) * physical::kLatticeSide + static_cast<uint32_t>(i) : wall::kNone;
      return add_vertex(p, wall::weights(wall_, t, p), inner, edge, lattice);
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
          if (!quad) {
            triangle(at(i, j), at(i + 1, j), at(i, j + 1));
            if (i + j + 1 < n) triangle(at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
          } else if ((i + j) % 2 == 0) {  // the diagonals of physical/cut_mesh
            triangle(at(i, j), at(i + 1, j), at(i + 1, j + 1)), triangle(at(i, j), at(i + 1, j + 1), at(i, j + 1));
          } else {
            triangle(at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)), triangle(at(i + 1, j), at(i, j + 1), at(i, j));
          }
        }
    }
    // Rims of the organ, and cuts along the face's own edges.
    const std::array<std::array<int, 2>, 4> corner = quad ? std::array<std::array<int, 2>, 4>{{{0, 0}, {n, 0}, {n, n}, {0, n}}}
                                                          : std::array<std::array<int, 2>, 4>{{{0, 0}, {n, 0}, {0, n}, {0, 0}}};
    for (size_t e = 0; e < edges; ++e) {
      if (wall_.neighbor[face][e] != wall::kNone && !is_cut(e)) continue;
      const auto from = corner[e], to = corner[(e + 1) % edges];
      const auto place = [&](int k, size_t d) { return from[d] + (to[d] - from[d]) * k / n; };
      std::array<uint32_t, 2> before{};
      int known = -1;  // the k of `before`
      const auto vertices = [&](int k) {
        return std::array{add(place(k, 0), place(k, 1), true, true), add(place(k, 0), place(k, 1), false, true)};
      };
      for (int k = 0; k < n; ++k) {
        const uint32_t piece = static_cast<uint32_t>(k * wall::kRaster / n);
        if (!is_open(wall_, t, face, static_cast<uint32_t>(e), piece)) continue;
        if (known != k) before = vertices(k);
        const std::array<uint32_t, 2> now = vertices(k + 1);
        add_strip(face, before, now, k % 2 == 0);
        before = now, known = k + 1;
      }
    }
  }
  // a, b: inner and outer vertex at the ends of a piece of an edge, in the order of the face's corners.
  void add_strip(uint32_t face, std::array<uint32_t, 2> a, std::array<uint32_t, 2> b, bool forward) {
    add_triangle(face, {a[0], b[0], forward ? b[1] : a[1]}, true);
    add_triangle(face, {forward ? a[0] : b[0], b[1], a[1]}, true);
  }

  void add_divided() {
    const physical::CutMesh cut = make_cut_mesh(source_.physical->world, topology_, shape_.surface(), false);
    // Edges have vertices of their own, for their normals and their layer.
    std::array<std::vector<uint32_t>, 2> number;
    for (auto& list : number) list.assign(cut.vertex.size(), wall::kNone);
    for (const physical::CutMesh::Face& f : cut.face) {
      const bool edge = f.side == physical::CutSide::cut_edge || f.side == physical::CutSide::rim;
      std::array<uint32_t, 3> t{};
      for (size_t k = 0; k < 3; ++k) {
        const physical::CutMesh::Vertex& v = cut.vertex[f.vertex[k]];
        uint32_t& known = number[edge ? 1 : 0][f.vertex[k]];
        if (known == wall::kNone) known = add_vertex(v.point, v.at, v.point.zeta < 0, edge, v.lattice);
        t[k] = known;
      }
      add_triangle(cut.vertex[f.vertex[0]].point.face, t, edge);
    }
  }

  const CutShape& shape_;
  const CutPictureSource& source_;
  const wall::Model& wall_;
  const wall::Topology& topology_;
  PictureModel& picture_;
  std::vector<std::vector<Vec3>> normal_;  // per body and vertex, not yet unit
  std::vector<std::vector<Vec3>> inward_;  // of edges: in texture coordinates, toward the inner face
};

PictureModel draw(const CutShape& shape) {
  const CutPictureSource& source = *shape.source;
  PictureModel picture = source.whole;
  const wall::Mesh& rest = shape.wall().mesh;
  const std::vector<uint32_t>& columns = shape.topology.source;
  picture.particle_rest.resize(source.count), picture.wall.resize(source.count);
  for (size_t i = source.tissue / 2; i < columns.size(); ++i) {
    picture.particle_rest.push_back(rest.outer[columns[i]]), picture.particle_rest.push_back(rest.inner[columns[i]]);
    picture.wall.insert(picture.wall.end(), 2, source.wall[2 * columns[i]]);
  }
  Builder(shape, picture).build();
  return picture;
}

// Faces that show traces of a cut: they are drawn cell by cell. all: false adds only those that a pen has passed.
void find_touched(const CutPictureSource& source, const physical::Excision& e, const std::vector<physical::Stain>& stain,
                  const std::vector<uint32_t>& was, std::vector<uint32_t>& touched, bool all) {
  constexpr float kVisible = 0.04f;  // of char
  touched.clear();
  size_t next = 0;  // of `was`
  for (uint32_t f = 0; f < e.passed.size(); ++f) {
    while (next < was.size() && was[next] < f) ++next;
    bool shows = e.passed[f].any();
    if (!shows && !all) {
      shows = next < was.size() && was[next] == f;
    } else if (!shows) {
      const auto reaches = [&](const physical::Stain& s) {
        const float far = s.radius + source.rest[f].size;
        return s.away2(source.rest[f].middle) < far * far;
      };
      shows = std::any_of(e.burnt[f].begin(), e.burnt[f].end(), [](float b) { return b > kVisible; }) ||
              std::any_of(stain.begin(), stain.end(), reaches);
    }
    if (shows) touched.push_back(f);
  }
}

constexpr uint32_t kScarsOfFace = 2 * physical::kLatticePoints;

// The scars of faces that were touched before; new ones have none yet.
void carry_scars(const std::vector<uint32_t>& was, const std::vector<uint32_t>& touched, const std::vector<Scar>& from,
                 std::vector<Scar>& to) {
  to.assign(touched.size() * kScarsOfFace, {});
  size_t k = 0;
  for (size_t i = 0; i < touched.size(); ++i) {
    while (k < was.size() && was[k] < touched[i]) ++k;
    if (k == was.size() || was[k] != touched[i]) continue;
    const auto first = from.begin() + static_cast<std::ptrdiff_t>(k * kScarsOfFace);
    std::copy(first, first + kScarsOfFace, to.begin() + static_cast<std::ptrdiff_t>(i * kScarsOfFace));
  }
}

// Char and depth of the grooves at the lattice points of the touched faces.
void find_scars(const Model& model, const Cutting& c, CutScratch& scratch, std::vector<Scar>& out) {
  const wall::Model& m = model.physical->world.wall;
  constexpr uint32_t kPoints = physical::kLatticePoints;
  using Point = CutScratch::ScarPoint;
  std::vector<Point>& point = scratch.point;
  std::vector<uint32_t>& trace = scratch.trace;
  point.assign(c.touched.size() * kPoints, {}), trace.assign(m.mesh.face.size(), wall::kNone);
  for (uint32_t i = 0; i < c.touched.size(); ++i) {
    const uint32_t f = c.touched[i];
    trace[f] = i;
    std::array<float, kPoints> count{};
    const physical::LatticeTable& lattice = physical::lattice(is_quad(m, f));
    for (uint32_t cell = 0; cell < wall::kCells; ++cell)
      for (uint32_t k = 0; k < lattice.corners; ++k) {
        const uint32_t at = lattice.corner[cell][k];
        point[i * kPoints + at].burnt += c.excision.burnt[f][cell], ++count[at];
      }
    for (uint32_t k = 0; k < kPoints; ++k) point[i * kPoints + k].burnt /= std::max(count[k], 1.0f);
  }
  for (const physical::Groove& g : c.excision.groove) {
    if (trace[g.face] == wall::kNone) continue;
    for (const uint32_t end : physical::lattice(is_quad(m, g.face)).border[g.link]) {
      Point& p = point[trace[g.face] * kPoints + end];
      p.depth[0] = std::max(p.depth[0], g.outer), p.depth[1] = std::max(p.depth[1], g.inner);
      p.through = p.through || g.through;
    }
  }
  // Faces that meet show the same on their common edge; where they meet a coarse one, nothing is carved. Twice: corners.
  for (int pass = 0; pass < 2; ++pass)
    for (const uint32_t f : c.touched)
      for (uint32_t e = 0; e < wall::raster(is_quad(m, f)).edges; ++e) {
        const uint32_t over = m.neighbor[f][e];
        const bool fine = over != wall::kNone && trace[over / 4] != wall::kNone;
        const bool turned = over != wall::kNone && m.mesh.face[over / 4][over % 4] != m.mesh.face[f][e];
        for (uint32_t k = 0; k <= wall::kRaster; ++k) {
          const auto at = [&](uint32_t face, uint32_t edge, uint32_t along) -> Point& {
            return point[trace[face] * kPoints + physical::lattice(is_quad(m, face)).on_edge[edge][along]];
          };
          Point& a = at(f, e, k);
          if (!fine) {
            a.through = true;
            continue;
          }
          Point& b = at(over / 4, over % 4, turned ? wall::kRaster - k : k);
          a.burnt = b.burnt = std::max(a.burnt, b.burnt), a.through = b.through = a.through || b.through;
          for (size_t d = 0; d < 2; ++d) a.depth[d] = b.depth[d] = std::max(a.depth[d], b.depth[d]);
        }
      }
  for (size_t i = 0; i < point.size(); ++i)
    for (size_t d = 0; d < 2; ++d) {
      Scar& scar = out[2 * i + d];
      scar.burnt = static_cast<uint8_t>(std::min(255.0f, 255 * point[i].burnt));
      scar.depth = point[i].through ? uint8_t{0} : static_cast<uint8_t>(std::min(255.0f, point[i].depth[d] * 1e5f));
    }
}

// Blood at the same points: on the outer face it runs down, the cut edge and the mucosa get only the drop round the vessel.
// Only of faces that are due.
template <typename Due>
void find_stains(const CutPictureSource& source, const std::vector<uint32_t>& touched,
                 const std::vector<physical::Stain>& stains, std::vector<Scar>& out, Due due) {
  constexpr float kDrop = kExciseLaw.bleed.stain;
  for (uint32_t i = 0; i < touched.size(); ++i) {
    if (!due(touched[i])) continue;
    const FaceAtRest& face = source.rest[touched[i]];
    Scar* scar = out.data() + size_t{i} * kScarsOfFace;
    for (uint32_t k = 0; k < kScarsOfFace; ++k) scar[k].blood = 0;
    for (const physical::Stain& s : stains) {
      const float far = s.radius + face.size;
      if (s.away2(face.middle) > far * far) continue;
      for (uint32_t k = 0; k < face.points; ++k) {
        const Vec3 place = face.lattice[k];
        if (s.away2(place) >= s.radius * s.radius) continue;
        const uint8_t blood = static_cast<uint8_t>(230 * blood_at(s, place));
        Scar* at = scar + 2 * face.number[k];
        at[0].blood = std::max(at[0].blood, blood);
        if (length2(place - s.vessel) < kDrop * kDrop) at[1].blood = std::max(at[1].blood, blood);
      }
    }
  }
}

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

void renew_cut_picture(const Model& model, State& state, CutScratch& k) {
  Cutting& c = state.physical.cutting;
  if (c.mode.empty() || c.excision.passed.empty()) {
    c.picture = {}, c.picture_of = 0;
    return;
  }
  // An active pen, scissors and blood change the wall's look. Blood does so slowly: a sixth of the faces in every
  // tick, and every sixth tick it may reach another face.
  constexpr uint64_t kEvery = 6;  // ticks
  const bool first = !c.picture;
  // A snip along an edge of the mesh cuts without dividing anything: the topology's version does not show it.
  const bool cuts = first || std::any_of(c.mode.begin(), c.mode.end(), [](PenMode m) { return m != PenMode::off; }) ||
                    shape_of(model.physical->world.wall, state) != c.picture_of;
  if (!cuts && c.excision.bleed.empty()) return;
  if (!c.source) c.source = make_source(model);
  const size_t faces = c.excision.passed.size();
  c.touched.reserve(faces), k.was.reserve(faces);
  const Vec3 down = normalized(model.scene.solver.gravity, {0, -1, 0});
  k.stain.clear();
  for (const physical::Bleed& b : c.excision.bleed)
    if (b.on_wall > 0)
      k.stain.push_back(stain_of(kExciseLaw.bleed, wall::rest_place(model.physical->world.wall, b.at), b.on_wall, down));
  const auto due = [&](uint32_t f) { return first || f % kEvery == state.tick % kEvery; };
  k.was.assign(c.touched.begin(), c.touched.end());
  if (first) k.was.clear();
  find_touched(*c.source, c.excision, k.stain, k.was, c.touched, first || state.tick % kEvery == 0);
  const bool same = !first && k.was == c.touched;
  if (!same) carry_scars(k.was, c.touched, c.scar, k.scar), c.scar.swap(k.scar);
  if (cuts || !same) find_scars(model, c, k, c.scar);
  find_stains(*c.source, c.touched, k.stain, c.scar,
              [&](uint32_t f) { return due(f) || (!same && !std::binary_search(k.was.begin(), k.was.end(), f)); });
  if (same && !cuts && state.tick % kEvery != 0) return;
  const uint64_t shape = shape_of(model.physical->world.wall, state);
  if (c.picture && c.picture_of == shape) return;
  const wall::Topology& t = state.physical.world.wall.topology;
  CutShape seen;
  seen.source = c.source;
  seen.topology.version = t.version, seen.topology.corners = t.corners, seen.topology.source = t.source;
  seen.topology.cut = t.cut, seen.topology.first_fragment = t.first_fragment, seen.topology.fragment = t.fragment;
  seen.divided = state.physical.world.cut_surface;
  seen.trace.assign(model.physical->world.wall.mesh.face.size(), wall::kNone);
  for (uint32_t i = 0; i < c.touched.size(); ++i) seen.trace[c.touched[i]] = i;
  c.picture = DividedPicture([shape = std::move(seen)] { return draw(shape); });
  c.picture_of = shape;
}

void renew_cut_picture(const Model& model, State& state) {
  CutScratch scratch;
  renew_cut_picture(model, state, scratch);
}

void publish_cut(const Model& model, const State& state, Snapshot& out) {
  const Cutting& c = state.physical.cutting;
  const wall::State& wall = state.physical.world.wall;
  const uint32_t rest = columns_at_rest(model);
  const std::vector<Quat> turned = rotations(model.physical->world.wall, wall);
  const uint32_t version = static_cast<uint32_t>(wall.topology.fragment.size() + c.touched.size());
  out.topology = {version, c.pieces, c.picture};
  out.scar = c.scar;
  for (const physical::Bleed& b : c.excision.bleed)
    out.wound.bleeding.push_back(
        {wall::place(wall::weights(model.physical->world.wall, wall.topology, b.at), wall.motion), b.flow, b.lost});
  out.wound.thermal_spread = c.excision.heat.spread, out.wound.damaged = c.excision.heat.area;
  out.wound.freed_mass = c.freed_mass, out.wound.freed_at = c.freed_at;
  out.rotation.assign(model.solver.count, {});
  for (uint32_t i = 0; i < rest; ++i) out.rotation[2 * i] = out.rotation[2 * i + 1] = turned[i];
  for (uint32_t i = rest; i < turned.size(); ++i) {
    out.particle.push_back(wall::outer(wall, i)), out.particle.push_back(wall::inner(wall, i));
    out.rotation.insert(out.rotation.end(), 2, turned[i]);
  }
}

}  // namespace catgut
