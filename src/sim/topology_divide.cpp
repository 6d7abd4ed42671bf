// SPDX-License-Identifier: Apache-2.0
// sim/topology_divide: divides tissue between two ticks. Reads the cells; writes State::topology and updates all data embedded
// in the tissue. Not for hot paths: it allocates, and derives the model again.
#include <algorithm>
#include <array>

#include "core/check.h"
#include "sim/cell_graph.h"
#include "sim/state.h"
#include "sim/topology.h"

namespace catgut {
namespace {

bool same(const EmbeddedPoint& a, const EmbeddedPoint& b) {
  return a.count == b.count && a.particle == b.particle && a.weight == b.weight;
}

// Changes the weights of `t` as little as possible (least squares in units of the particle distance). Afterward the sum of
// weight * x is `at` [m], and the sum of weights is 1.
void move_to(EmbeddedPoint& t, const Vec4* x, Vec3 at) {
  double unit = 0;
  for (uint32_t k = 0; k < t.count; ++k) unit = std::max(unit, double{distance(xyz(x[t.particle[k]]), at)});
  if (!(unit > 0)) return;
  std::array<std::array<double, 4>, EmbeddedPoint::kMaxParticles> row{};
  double m[4][5] = {};
  m[0][4] = 1;
  for (uint32_t k = 0; k < t.count; ++k) {
    const Vec4& p = x[t.particle[k]];
    row[k] = {1, (double{p.x} - at.x) / unit, (double{p.y} - at.y) / unit, (double{p.z} - at.z) / unit};
    for (size_t i = 0; i < 4; ++i) {
      m[i][4] -= row[k][i] * double{t.weight[k]};
      for (size_t j = 0; j < 4; ++j) m[i][j] += row[k][i] * row[k][j];
    }
  }
  for (size_t i = 0; i < 4; ++i) {
    size_t pivot = i;
    for (size_t j = i + 1; j < 4; ++j)
      if (std::abs(m[j][i]) > std::abs(m[pivot][i])) pivot = j;
    if (std::abs(m[pivot][i]) < 1e-9) return;  // flat: keep the rest weights
    std::swap(m[i], m[pivot]);
    for (size_t j = 0; j < 4; ++j) {
      if (j == i) continue;
      const double factor = m[j][i] / m[i][i];
      for (size_t k = i; k < 5; ++k) m[j][k] -= factor * m[i][k];
    }
  }
  for (uint32_t k = 0; k < t.count; ++k) {
    double change = 0;
    for (size_t i = 0; i < 4; ++i) change += row[k][i] * m[i][4] / m[i][i];
    t.weight[k] = static_cast<float>(t.weight[k] + change);
  }
}

// Moves embedded data from one topology to the next. A point lies in a cell. Its particles beyond the cut are removed, and
// their share goes to particles reachable from its cell. Its position does not change.
class Carry : public Archive<Carry> {
 public:
  Carry(const Model& built, const Model& before, const Model& now, const Vec4* x)
      : built_(built), before_(before), now_(now), graph_(now), x_(x), family_(built.solver.tissue) {
    for (uint32_t i = 0; i < built.solver.tissue; ++i) family_[i] = {i};
    for (uint32_t k = 0; k < now.source.size(); ++k) family_[now.source[k]].push_back(built.solver.tissue + k);
    fresh_.assign(built.solver.tissue, 0);
    for (size_t k = before.source.size(); k < now.source.size(); ++k) fresh_[now.source[k]] = 1;
  }

  // --- as an archive over the state: visits embedded points, and slots, which move.
  template <typename T>
  void operator()(T& v) {
    if constexpr (std::is_same_v<T, EmbeddedPoint>) carry(v);
    else if constexpr (!kLeaf<T>) visit(*this, v);
  }
  template <typename T, typename Alloc>
  void operator()(std::vector<T, Alloc>& v) {
    if constexpr (!kLeaf<T> && !std::is_same_v<T, Vec4>)
      for (T& element : v) (*this)(element);
  }
  void index(auto& v, IndexOf of) {
    uint32_t slot = static_cast<uint32_t>(v);
    if (of != IndexOf::slot) return;
    carry_number(slot);
    v = static_cast<std::remove_reference_t<decltype(v)>>(slot);
  }
  void carry_number(uint32_t& slot) const {
    if (slot >= before_.solver.tissue) slot += now_.solver.tissue - before_.solver.tissue;
  }

  // The point of a bite: its triangle determines the cell.
  void carry(BiteEnd& end) {
    const EmbeddedPoint was = end.point;
    const Triangle& t = now_.solver.collision.surface[end.triangle];
    end.point = carried(was, graph_.owner(t));
    known_.push_back({was, end.point});
    known_.push_back({end.point, end.point});  // the archive visits it as well
  }
  void carry(EmbeddedPoint& t) {
    for (const auto& [was, is] : known_)
      if (same(was, t)) {
        t = is;
        return;
      }
    t = carried(t, kNoCell);
  }
  // The copy of a particle that the cell of `end` can reach.
  uint32_t carried(uint32_t particle, const BiteEnd& end) {
    const uint32_t source = source_of(now_, particle), cell = graph_.owner(now_.solver.collision.surface[end.triangle]);
    if (!fresh_[source] || cell == kNoCell) return particle;
    see(cell, std::span(&source, 1));
    return seen_of(particle, particle);
  }
  // For a position fixed to a particle, at `rest` [m].
  uint32_t carried(uint32_t particle, Vec3 rest) {
    const uint32_t source = source_of(now_, particle);
    if (!fresh_[source]) return particle;
    const uint32_t cell = graph_.locate(family_[source], rest);
    for (uint32_t i : family_[source])
      if (cell != kNoCell && std::find(now_.cell[cell].begin(), now_.cell[cell].end(), i) != now_.cell[cell].end()) return i;
    return particle;
  }
  bool is_of(uint32_t particle, uint32_t other) const { return source_of(now_, particle) == source_of(now_, other); }

 private:
  // Finds the particles of the clusters of `source`s that a cell can reach.
  void see(uint32_t cell, std::span<const uint32_t> source) {
    region_.clear();
    for (uint32_t i : source) {
      const std::span<const uint32_t> near = cluster_members(built_.solver, i);
      region_.insert(region_.end(), near.begin(), near.end());
    }
    for (uint32_t i : now_.cell[cell]) region_.push_back(source_of(now_, i));
    graph_.connected(now_.cell[cell], region_);
  }
  // The particle or its copy that the last `see` reached; else `none`.
  uint32_t seen_of(uint32_t particle, uint32_t none) const {
    if (graph_.was_connected(particle)) return particle;
    for (uint32_t i : family_[source_of(now_, particle)])
      if (graph_.was_connected(i)) return i;
    return none;
  }
  bool near_cut(const EmbeddedPoint& t) const {
    for (uint32_t k = 0; k < t.count; ++k)
      for (uint32_t i : cluster_members(built_.solver, source_of(now_, t.particle[k])))
        if (fresh_[i]) return true;
    return false;
  }

  // cell: the cell that contains the point, or kNoCell.
  EmbeddedPoint carried(const EmbeddedPoint& t, uint32_t cell) {
    if (t.count < 2 || !near_cut(t)) return t;  // a single particle keeps its number
    // A point midway between two pieces of tissue is processed piece by piece.
    std::vector<uint32_t> piece;
    for (uint32_t k = 0; k < t.count; ++k)
      if (const uint32_t p = before_.piece[t.particle[k]]; std::find(piece.begin(), piece.end(), p) == piece.end())
        piece.push_back(p);
    EmbeddedPoint whole;
    for (uint32_t p : piece) {
      EmbeddedPoint part;
      for (uint32_t k = 0; k < t.count; ++k) {
        if (before_.piece[t.particle[k]] != p) continue;
        part.particle[part.count] = t.particle[k];
        part.weight[part.count++] = t.weight[k];
      }
      part = carried_part(part, cell, std::max(5u, EmbeddedPoint::kMaxParticles / static_cast<uint32_t>(piece.size())));
      for (uint32_t k = 0; k < part.count && whole.count < EmbeddedPoint::kMaxParticles; ++k) {
        whole.particle[whole.count] = part.particle[k];
        whole.weight[whole.count++] = part.weight[k];
      }
    }
    return whole;
  }

  EmbeddedPoint carried_part(const EmbeddedPoint& t, uint32_t cell, uint32_t room) {
    float sum = 0;
    for (uint32_t k = 0; k < t.count; ++k) sum += t.weight[k];
    if (!(std::abs(sum) > 1e-6f)) return t;
    const Vec4* rest_of = now_.solver.shape.rest.data();
    const Vec3 rest = position_of(t, rest_of) / sum, at = position_of(t, x_) / sum;
    std::vector<uint32_t> source, near;
    for (uint32_t k = 0; k < t.count; ++k) source.push_back(source_of(now_, t.particle[k]));
    for (uint32_t i : source) near.insert(near.end(), family_[i].begin(), family_[i].end());
    if (cell == kNoCell) cell = graph_.locate(near, rest);
    if (cell == kNoCell) return t;
    see(cell, source);
    EmbeddedPoint kept = t;
    kept.count = 0;
    for (uint32_t k = 0; k < t.count; ++k) {
      const uint32_t i = seen_of(t.particle[k], kNoCell);
      if (i == kNoCell ||
          std::find(kept.particle.begin(), kept.particle.begin() + kept.count, i) != kept.particle.begin() + kept.count)
        continue;
      kept.particle[kept.count] = i;
      kept.weight[kept.count++] = t.weight[k];
    }
    if (kept.count == t.count) return kept;
    // The list contains the corners of the point's cell. They alone can represent any position.
    std::vector<uint32_t> list(kept.particle.begin(), kept.particle.begin() + kept.count);
    const Tet& corner = now_.cell[cell];
    std::erase_if(list, [&](uint32_t i) { return std::find(corner.begin(), corner.end(), i) != corner.end(); });
    std::stable_sort(list.begin(), list.end(),
                     [&](uint32_t i, uint32_t j) { return length2(xyz(rest_of[i]) - rest) < length2(xyz(rest_of[j]) - rest); });
    if (list.size() > room - 4) list.resize(room - 4);
    list.insert(list.begin(), corner.begin(), corner.end());
    EmbeddedPoint p = spread_point(list, rest_of, rest);
    move_to(p, x_, at);
    for (uint32_t k = 0; k < p.count; ++k) p.weight[k] *= sum;
    return p;
  }

  const Model &built_, &before_, &now_;
  CellGraph graph_;
  const Vec4* x_;
  std::vector<std::vector<uint32_t>> family_;  // per particle of the scene's model: the particle and its copies
  std::vector<uint8_t> fresh_;                 // per particle of the scene's model: has a new copy
  std::vector<uint32_t> region_;
  std::vector<std::pair<EmbeddedPoint, EmbeddedPoint>> known_;
};

// Extends columns by the copies' rows. Clusters keep the rotation of their former cluster.
void carry_columns(const Model& before, const Model& now, std::span<const uint32_t> parent, SolverState& s) {
  const uint32_t tissue = before.solver.tissue;
  for (Column<Vec4>* column : {&s.x, &s.v, &s.pair_origin}) {
    Column<Vec4> copies;
    for (uint32_t i : parent) copies.push_back((*column)[i]);
    column->insert(column->begin() + tissue, copies.begin(), copies.end());
  }
  const ClusterRotations was = s.rotation;
  s.rotation.reset(now.solver.shape.clusters);
  for (uint32_t i = now.solver.tissue; i-- > 0;) {  // the first particle of a cluster wins
    const uint32_t from = before.solver.shape.cluster_of[i < tissue ? i : parent[i - tissue]];
    const uint32_t to = now.solver.shape.cluster_of[i];
    s.rotation.x[to] = was.x[from], s.rotation.y[to] = was.y[from];
    s.rotation.z[to] = was.z[from], s.rotation.w[to] = was.w[from];
  }
}

void carry_sutures(const Model& now, Carry& carry, State& state) {
  const ShapeModel& shape = now.solver.shape;
  for (size_t k = 0; k < state.suture.suture.size(); ++k) {
    Suture& u = state.suture.suture[k];
    for (Bite& b : u.bite) {
      const uint32_t was = b.nearest;
      b.nearest = carry.carried(was, b.entry);
      // The spring of figure 4 is attached to that particle.
      if (u.attached && !u.open.empty() && &b == &u.bite[u.open.back().bite])
        for (Attachment& a : state.solver.attach)
          if (a.body == static_cast<int>(now.solver.needle_body(k)) && a.point.count == 1) a.point = particle_point(b.nearest);
      carry.carry(b.entry);
      if (b.has_exit) carry.carry(b.exit);
    }
    for (uint32_t& slot : state.solver.strand[k].order) carry.carry_number(slot);
    for (Knot& knot : u.knot) {
      for (uint32_t& slot : knot.end) carry.carry_number(slot);
      for (uint32_t& slot : knot.slot) carry.carry_number(slot);
    }
  }
  for (BakedSuture& baked : state.suture.settled)
    for (std::vector<BakedNode>* list : {&baked.node, &baked.knot})
      for (BakedNode& n : *list) n.particle = carry.carried(n.particle, xyz(shape.rest[n.particle]) + n.offset);
  for (InstrumentState& i : state.suture.instrument)
    if (i.held == Held::nothing || i.held == Held::needle) carry.carry_number(i.slot);  // of the last held object
  for (ToolLoop& l : state.suture.loop)
    if (l.wraps == 0) carry.carry_number(l.first), carry.carry_number(l.last);
  for (Event& e : state.event.list)
    if (names_particle(e)) carry.carry_number(e.which);
}

void carry_state(const Model& built, const Model& before, std::span<const uint32_t> parent, State& state) {
  const Model& now = current_model(built, state);
  carry_columns(before, now, parent, state.solver);
  Carry carry(built, before, now, state.solver.x.data());
  carry_sutures(now, carry, state);
  carry(state);
  for (size_t i = 0; i < state.suture.instrument.size(); ++i) {
    InstrumentState& tool = state.suture.instrument[i];
    if (tool.held != Held::tissue) continue;
    for (const Attachment& a : state.solver.attach)
      for (uint32_t k = 0; a.body == static_cast<int>(i) && k < a.point.count; ++k)
        if (carry.is_of(a.point.particle[k], tool.slot)) tool.slot = a.point.particle[k];
  }
}

// Cells with corner `particle`, grouped by connectivity across uncut faces. The first group contains the lowest cell.
std::vector<std::vector<uint32_t>> fans(const Model& m, const CellGraph& graph, const std::vector<uint8_t>& cut,
                                        uint32_t particle) {
  std::vector<std::vector<uint32_t>> fan;
  const std::span<const uint32_t> around = graph.cells_around(particle);
  std::vector<uint8_t> done(around.size(), 0);
  const auto place = [&](uint32_t cell) {
    return static_cast<size_t>(std::find(around.begin(), around.end(), cell) - around.begin());
  };
  for (size_t i = 0; i < around.size(); ++i) {
    if (done[i]) continue;
    done[i] = 1;
    std::vector<uint32_t> open{around[i]};
    for (size_t head = 0; head < open.size(); ++head)
      for (uint32_t f = 0; f < 4; ++f) {
        const uint32_t c = open[head];
        if (m.cell[c][f] == particle || cut[4 * c + f]) continue;  // its opposite face excludes it
        const uint32_t other = graph.across(c, f);
        if (other == kNoCell || done[place(other)]) continue;
        done[place(other)] = 1;
        open.push_back(other);
      }
    fan.push_back(std::move(open));
  }
  return fan;
}

}  // namespace

uint32_t divide(const Model& model, State& state, std::span<const Topology::Face> faces) {
  const std::shared_ptr<const Model> keep = state.divided;
  const Model& before = keep ? *keep : model;
  const CellGraph graph(before);
  std::vector<uint8_t> cut(4 * before.cell.size(), 0);
  std::vector<uint32_t> touched;
  for (const Topology::Face& f : faces) {
    CATGUT_CHECK(f.cell < before.cell.size() && f.face < 4);
    const uint32_t other = graph.across(f.cell, f.face);
    if (other == kNoCell) continue;
    const Triangle t = face_of(before.cell[f.cell], f.face);
    cut[4 * f.cell + f.face] = 1;
    for (uint32_t g = 0; g < 4; ++g)
      if (graph.across(other, g) == f.cell) cut[4 * other + g] = 1;
    touched.insert(touched.end(), t.begin(), t.end());
  }
  std::sort(touched.begin(), touched.end());
  touched.erase(std::unique(touched.begin(), touched.end()), touched.end());

  Topology next = state.topology;
  std::vector<Tet> cell = before.cell;
  std::vector<uint32_t> parent;  // per new copy: its parent particle
  for (uint32_t i : touched) {
    const std::vector<std::vector<uint32_t>> fan = fans(before, graph, cut, i);
    for (size_t k = 1; k < fan.size(); ++k) {
      const uint32_t copy = before.solver.tissue + static_cast<uint32_t>(parent.size());
      parent.push_back(i);
      next.source.push_back(source_of(before, i));
      for (uint32_t c : fan[k]) {
        const uint32_t corner = static_cast<uint32_t>(std::find(cell[c].begin(), cell[c].end(), i) - cell[c].begin());
        cell[c][corner] = copy;
        next.corner.push_back({c, corner, copy});
      }
    }
  }
  if (parent.empty()) return 0;
  // Of two entries for a corner copied before, the later one is valid.
  const auto place = [](const Topology::Corner& c) { return uint64_t{c.cell} * 4 + c.corner; };
  std::stable_sort(next.corner.begin(), next.corner.end(), [&](const auto& a, const auto& b) { return place(a) < place(b); });
  std::vector<Topology::Corner> corner;
  for (const Topology::Corner& c : next.corner) {
    if (!corner.empty() && place(corner.back()) == place(c)) corner.back() = c;
    else corner.push_back(c);
  }
  next.corner = std::move(corner);
  const auto set_of = [](Triangle t) {
    std::sort(t.begin(), t.end());
    return t;
  };
  for (uint32_t at = 0; at < cut.size(); ++at) {
    if (!cut[at]) continue;
    const Topology::Face f{at / 4, at % 4};
    const uint32_t other = graph.across(f.cell, f.face);
    for (uint32_t g = 0; g < 4; ++g)
      if (graph.across(other, g) == f.cell && set_of(face_of(cell[f.cell], f.face)) != set_of(face_of(cell[other], g)))
        next.face.push_back(f);
  }
  ++next.version;
  state.topology = std::move(next);
  apply_topology(model, state);
  carry_state(model, before, parent, state);
  return static_cast<uint32_t>(parent.size());
}

uint32_t divide_by_plane(const Model& model, State& state, uint32_t wall, Vec3 point, Vec3 normal) {
  const Model& m = current_model(model, state);
  const Vec4* x = state.solver.x.data();
  const CellGraph graph(m);
  // Prisms are cut as a whole, so that the new edge crosses the wall straight.
  const size_t prisms = m.cell.size() / 3;
  std::vector<uint8_t> beyond(prisms, 0);
  for (size_t p = 0; p < prisms; ++p) {
    Vec3 sum;
    for (size_t k = 0; k < 3; ++k)
      for (uint32_t i : m.cell[3 * p + k]) sum += xyz(x[i]) - point;
    beyond[p] = m.wall[m.cell[3 * p][0]] == wall && dot(sum, normal) > 0;
  }
  const auto each_neighbor = [&](size_t p, auto&& with) {
    for (uint32_t c = static_cast<uint32_t>(3 * p); c < 3 * p + 3; ++c)
      for (uint32_t f = 0; f < 4; ++f)
        if (const uint32_t other = graph.across(c, f); other != kNoCell && other / 3 != p) with(c, f, other / 3);
  };
  // A prism without a neighbor on its side is moved to the other side: no single-prism fragments.
  for (bool again = true; again;) {
    again = false;
    for (size_t p = 0; p < prisms; ++p) {
      bool alone = true;
      size_t neighbors = 0;
      each_neighbor(p, [&](uint32_t, uint32_t, uint32_t other) {
        ++neighbors;
        alone = alone && beyond[other] != beyond[p];
      });
      if (neighbors > 0 && alone) beyond[p] = !beyond[p], again = true;
    }
  }
  std::vector<Topology::Face> face;
  for (size_t p = 0; p < prisms; ++p)
    each_neighbor(p, [&](uint32_t c, uint32_t f, uint32_t other) {
      if (beyond[p] < beyond[other]) face.push_back({c, f});
    });
  return divide(model, state, face);
}

}  // namespace catgut
