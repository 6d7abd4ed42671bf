// SPDX-License-Identifier: Apache-2.0
// sim/topology: the model of a divided tissue, and validation of a loaded topology. See the header.
#include "sim/topology.h"

#include <algorithm>
#include <set>

#include "core/check.h"
#include "sim/cell_graph.h"
#include "sim/state.h"

namespace catgut {
namespace {

uint32_t built_tissue(const Model& m) { return m.solver.tissue - static_cast<uint32_t>(m.source.size()); }

Triangle sorted(Triangle t) {
  std::sort(t.begin(), t.end());
  return t;
}

// Extends a column of the built tissue by the value of each copy's source.
template <typename Column>
void extend(Column& column, const std::vector<uint32_t>& source) {
  for (uint32_t i : source) column.push_back(column[i]);
}

// Inserts the copies' values between tissue and threads, which share the column.
template <typename Column>
void extend_before_threads(Column& column, uint32_t tissue, const std::vector<uint32_t>& source) {
  Column copies;
  for (uint32_t i : source) copies.push_back(column[i]);
  column.insert(column.begin() + tissue, copies.begin(), copies.end());
}

// A particle's mass is a quarter of that of its cells (anatomy/wall). Copies share it as they share the cells: every piece has
// the mass of its volume, and the sum is conserved.
std::vector<double> shares_of_mass(const Model& m) {
  std::vector<double> volume(m.solver.tissue, 0), all(built_tissue(m), 0);
  const Vec4* x = m.solver.shape.rest.data();
  for (const Tet& t : m.cell) {
    const auto at = [&](size_t k) { return xyz(x[source_of(m, t[k])]); };
    const double v = tet_volume(at(0), at(1), at(2), at(3));
    for (uint32_t i : t) volume[i] += v, all[source_of(m, i)] += v;
  }
  std::vector<uint8_t> copied(all.size(), 0);
  for (uint32_t i : m.source) copied[i] = 1;
  std::vector<double> share(m.solver.tissue, 1);
  for (uint32_t i = 0; i < share.size(); ++i)
    if (const uint32_t source = source_of(m, i); copied[source]) share[i] = volume[i] / all[source];
  return share;
}

// Each particle's cluster keeps the members that the particle can still reach.
std::vector<std::vector<uint32_t>> split_clusters(const Model& built, const Model& m, CellGraph& graph) {
  std::vector<uint8_t> copied(built.solver.tissue, 0);
  for (uint32_t i : m.source) copied[i] = 1;
  std::vector<std::vector<uint32_t>> cluster(m.solver.tissue);
  for (uint32_t i = 0; i < m.solver.tissue; ++i) {
    const std::span<const uint32_t> whole = cluster_members(built.solver, source_of(m, i));
    if (std::none_of(whole.begin(), whole.end(), [&](uint32_t k) { return copied[k]; }))
      cluster[i] = {whole.begin(), whole.end()};
    else cluster[i] = graph.connected({&i, 1}, whole);
    if (cluster[i].size() <= EmbeddedPoint::kMaxParticles) continue;
    // At the inner end of a slit, both sides are reachable. Keep the particle itself and the first of the others.
    std::erase(cluster[i], i);
    cluster[i].insert(cluster[i].begin(), i);
    cluster[i].resize(EmbeddedPoint::kMaxParticles);
  }
  return cluster;
}

// Current index of corner `particle` of a cell, or of another cell of its prism.
uint32_t corner_in_prism(const Model& built, const Model& m, uint32_t cell, uint32_t particle) {
  const uint32_t first = cell / 3 * 3;
  for (uint32_t c : {cell, first, first + 1, first + 2})
    for (size_t k = 0; k < 4; ++k)
      if (built.cell[c][k] == particle) return m.cell[c][k];
  return particle;
}

std::vector<Triangle> divide_surface(const Model& built, const Model& m, const Topology& topology) {
  const CellGraph graph(built);
  std::vector<uint8_t> copied(built.solver.tissue, 0);
  for (uint32_t i : m.source) copied[i] = 1;
  std::vector<Triangle> surface = built.solver.collision.surface;
  for (Triangle& t : surface) {
    if (!copied[t[0]] && !copied[t[1]] && !copied[t[2]]) continue;
    const uint32_t c = graph.owner(t);
    CATGUT_CHECK(c != kNoCell);
    for (uint32_t& i : t) i = corner_in_prism(built, m, c, i);
  }
  for (const Topology::Face& f : topology.face) surface.push_back(face_of(m.cell[f.cell], f.face));
  return surface;
}

// A rim continues across a cut: its two ends there are neighbors in the list. Partners keep their common index.
void divide_rims(const Model& built, Model& m) {
  const std::vector<Triangle>&was = built.solver.collision.surface, &now = m.solver.collision.surface;
  // The current index of a corner of the strip triangle (outer to inner rim) that has all of `corners`.
  const auto corner_now = [&](Triangle corners, uint32_t corner) {
    const TissueCollision& c = built.solver.collision;
    for (uint32_t r = c.ring_first[corner]; r < c.ring_first[corner + 1]; ++r) {
      const Triangle& t = was[c.ring[r]];
      if (sorted(t) != sorted(corners)) continue;
      return now[c.ring[r]][static_cast<size_t>(std::find(t.begin(), t.end(), corner) - t.begin())];
    }
    return corner;
  };
  for (Rim& rim : m.rim) {
    const Rim whole = std::move(rim);
    rim = {};
    const size_t n = whole.outer.size();
    const auto add = [&](uint32_t outer, uint32_t inner) {
      if (!rim.outer.empty() && rim.outer.back() == outer && rim.inner.back() == inner) return;
      rim.outer.push_back(outer), rim.inner.push_back(inner);
    };
    for (size_t i = 0; i < n; ++i) {
      const uint32_t a = whole.outer[i], b = whole.outer[(i + 1) % n], in_a = whole.inner[i], in_b = whole.inner[(i + 1) % n];
      const Triangle first{a, in_b, in_a}, second{a, b, in_b};
      add(corner_now(first, a), corner_now(first, in_a));
      add(corner_now(second, b), corner_now(second, in_b));
    }
    if (rim.outer.size() > 1 && rim.outer.front() == rim.outer.back() && rim.inner.front() == rim.inner.back())
      rim.outer.pop_back(), rim.inner.pop_back();
  }
}

}  // namespace

const Model& current_model(const Model& model, const State& state) { return state.divided ? *state.divided : model; }

std::shared_ptr<const Model> derive_model(const Model& built, const Topology& topology) {
  auto model = std::make_shared<Model>(built);
  Model& m = *model;
  SolverModel& s = m.solver;
  const uint32_t copies = static_cast<uint32_t>(topology.source.size()), tissue = built.solver.tissue;
  m.source = topology.source;
  for (const Topology::Corner& c : topology.corner) m.cell[c.cell][c.corner] = c.particle;
  s.tissue += copies;
  s.count += copies;
  for (StrandModel& t : s.strand) t.first_slot += copies;
  extend(m.wall, m.source), extend(m.layer, m.source);
  extend_before_threads(m.start, tissue, m.source);

  std::vector<float> mass{s.shape.relative_mass.begin(), s.shape.relative_mass.end()};
  extend(mass, m.source);
  extend_before_threads(s.inv_mass, tissue, m.source);
  const std::vector<double> share = shares_of_mass(m);
  for (uint32_t i = 0; i < s.tissue; ++i) {
    if (share[i] == 1) continue;
    mass[i] = static_cast<float>(mass[i] * share[i]);
    s.inv_mass[i] = static_cast<float>(s.inv_mass[i] / share[i]);
  }

  CellGraph graph(m);
  std::vector<Vec3> rest;
  for (const Vec4& p : built.solver.shape.rest) rest.push_back(xyz(p));
  extend(rest, m.source);
  s.shape = make_shape_model(rest, mass, split_clusters(built, m, graph));
  if (s.use_volume) s.volume = make_volume_model(rest, m.cell);

  TissueCollision& c = s.collision;
  extend(c.radius, m.source), extend(c.body, m.source), extend(c.rest_reach, m.source);
  const float tool_radius = c.tool_radius;
  c = make_tissue_collision(s.shape.rest, c.radius, c.body, c.rest_reach, divide_surface(built, m, topology));
  c.tool_radius = tool_radius;
  divide_rims(built, m);
  if (m.technique.row) m.technique = make_technique(m.scene, m.rim);
  find_pieces(m);
  m.picture = divide_picture(built, m, topology);
  return model;
}

void apply_topology(const Model& model, State& state) {
  state.divided = state.topology.version == 0 ? nullptr : derive_model(model, state.topology);
  state.scratch = {};
  prepare_scratch(current_model(model, state).solver, state.scratch);
}

std::string topology_error(const Model& model, const Topology& t) {
  const uint32_t tissue = model.solver.tissue, cells = static_cast<uint32_t>(model.cell.size());
  if ((t.version == 0) != t.source.empty()) return "a version without copies, or copies without a version";
  if (t.corner.size() < t.source.size()) return "a copy in no cell";
  if (t.source.size() > size_t{4} * cells) return "more copies than corners";
  for (uint32_t i : t.source)
    if (i >= tissue) return "a copy of a particle that does not exist";
  std::vector<Tet> cell = model.cell;
  uint64_t last = 0;
  for (const Topology::Corner& c : t.corner) {
    const uint64_t place = uint64_t{c.cell} * 4 + c.corner + 1;
    if (c.cell >= cells || c.corner > 3) return "a corner of a cell that does not exist";
    if (place <= last) return "corners out of order";
    last = place;
    if (c.particle - tissue >= t.source.size()) return "a corner that names an original";
    if (t.source[c.particle - tissue] != cell[c.cell][c.corner]) return "a corner that is a copy of another particle";
    cell[c.cell][c.corner] = c.particle;
  }
  std::vector<uint8_t> used(tissue + t.source.size(), 0);
  for (const Tet& each : cell)
    for (uint32_t i : each) used[i] = 1;
  for (const Tet& each : model.cell)
    for (uint32_t i : each)
      if (!used[i]) return "a particle in no cell";
  for (size_t k = 0; k < t.source.size(); ++k)
    if (!used[tissue + k]) return "a copy in no cell";
  // Exposed faces and surface must be the same set.
  const CellGraph graph(model);
  std::set<std::array<uint32_t, 2>> open;
  for (const Topology::Corner& c : t.corner)
    for (uint32_t f = 0; f < 4; ++f) {
      const uint32_t other = f == c.corner ? kNoCell : graph.across(c.cell, f);
      if (other == kNoCell) continue;
      for (uint32_t g = 0; g < 4; ++g)
        if (graph.across(other, g) == c.cell && sorted(face_of(cell[c.cell], f)) != sorted(face_of(cell[other], g)))
          open.insert({c.cell, f}), open.insert({other, g});
    }
  std::set<std::array<uint32_t, 2>> listed;
  for (const Topology::Face& f : t.face)
    if (!listed.insert({f.cell, f.face}).second) return "a face twice";
  if (listed != open) return "faces that are not those laid open";
  return {};
}

uint32_t public_index(const Model& model, const Model& derived, uint32_t particle) {
  const uint32_t tissue = model.solver.tissue, copies = derived.solver.tissue - tissue;
  if (particle < tissue) return particle;
  return particle < derived.solver.tissue ? model.solver.count + (particle - tissue) : particle - copies;
}

bool names_particle(const Event& event) {
  switch (event.kind) {
    case EventKind::thread_grasped:
    case EventKind::thread_released:
    case EventKind::particle_attached:
    case EventKind::particle_released:
    case EventKind::tissue_grasped:
    case EventKind::tissue_released:
    case EventKind::thread_cut:
      return true;
    case EventKind::technique_fault:
      return event.fault == Fault::cut_in_stitch || event.fault == Fault::cut_before_knot ||
             event.fault == Fault::thread_broken;
    default:
      return false;
  }
}

}  // namespace catgut
