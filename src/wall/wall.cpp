// SPDX-License-Identifier: Apache-2.0
// wall: building, and the step. See the header.
#include "wall/wall.h"

#include <algorithm>
#include <cmath>

#include "core/check.h"

namespace catgut::wall {

namespace {

constexpr uint32_t kEdge[6][2] = {{0, 1}, {1, 2}, {2, 3}, {3, 0}, {0, 2}, {1, 3}};
// Of h^2 A^-1 K when built. A cut's free edges increase it to about 1.2; the step is stable below 4 / (1 + 2 tau / h) = 2.67.
constexpr float kLargest = 1.05f;

// Stiffness bound of one element: a graph Laplacian on its corners for mid-surface points, a diagonal for directors.
Model::LaneInertia bound(const ElementRest& e, bool quad, float density) {
  const auto& c = e.constant;
  Model::LaneInertia out{};
  const double thickness = 2 * c[kD0z], n = quad ? 4 : 3;
  out.mass = static_cast<float>(density * thickness * e.area / n);
  const double xi2 = c[kG11] * c[kG11] + c[kG12] * c[kG12], eta2 = c[kG21] * c[kG21] + c[kG22] * c[kG22];
  // Membrane stiffness in the direction of a gradient, stiff branch included.
  const auto along = [&](double gx, double gy, double g2) {
    const double x = gx * gx / g2, y = gy * gy / g2, a1 = c[kA11] + c[kStiff1], a2 = c[kA22] + c[kStiff2];
    return x * x * a1 + y * y * a2 + 2 * x * y * (c[kA12] + 2 * c[kA66]);
  };
  const double shear = std::max(c[kShear1], c[kShear2]);
  const double w1 = (along(c[kG11], c[kG12], xi2) + shear) * xi2 / 8, w2 = (along(c[kG21], c[kG22], eta2) + shear) * eta2 / 8;
  if (quad) out.edge[0] = out.edge[2] = static_cast<float>(w1), out.edge[1] = out.edge[3] = static_cast<float>(w2);
  else out.edge[0] = out.edge[1] = out.edge[4] = static_cast<float>(w1 + w2);
  const double bending = std::max(c[kE11] * xi2, c[kE11] * eta2) + std::max(c[kE22] * xi2, c[kE22] * eta2);
  const double radial = (c[kThick] + shear) * c[kInvD0z] * c[kInvD0z];
  out.dir = static_cast<float>(2.0 * (radial + bending) / n);
  return out;
}

void check(const Spec& spec) {
  const auto fail = [&](const std::string& what, const std::string& next) { throw InputError(spec.mesh.name, what, next); };
  const size_t n = spec.mesh.outer.size();
  if (n < 3 || n > 1000000) fail(std::to_string(n) + " columns make no wall", "give 3 to 1000000");
  if (spec.mesh.inner.size() != n || spec.mesh.held.size() != n)
    fail("lists of columns of different lengths", "give one entry a column");
  if (!spec.mesh.foundation.empty() && spec.mesh.foundation.size() != n)
    fail("a foundation for some columns only", "give one entry a column");
  for (const float k : spec.mesh.foundation)
    if (!(k >= 0 && k <= 1e9f)) fail("a foundation of " + std::to_string(k) + " Pa/m", "give 0 to 1e9");
  if (spec.mesh.face.empty() || spec.mesh.along.size() != spec.mesh.face.size())
    fail("no faces, or faces without directions", "give one direction a face");
  if (!(spec.step >= 1e-5f && spec.step <= 0.02f))
    fail("a step of " + std::to_string(spec.step) + " s", "give 0.00001 to 0.02");
  if (!(spec.density >= 1 && spec.density <= 30000))
    fail("a density of " + std::to_string(spec.density) + " kg/m^3", "give e.g. 1050");
  if (!(spec.drag >= 0 && spec.drag <= 1000)) fail("a drag of " + std::to_string(spec.drag) + " 1/s", "give 0 to 1000");
  for (size_t c = 0; c < n; ++c)
    if (!is_finite(spec.mesh.outer[c]) || !is_finite(spec.mesh.inner[c])) fail("a node that is not a number", "check the mesh");
  std::vector<uint8_t> used(n, 0);
  for (const auto& f : spec.mesh.face)
    for (int k = 0; k < 4; ++k) {
      if (k == 3 && f[k] == kNone) continue;
      if (f[k] >= n) fail("a face that names a column which is not there", "check the mesh");
      used[f[k]] = 1;
    }
  if (std::count(used.begin(), used.end(), 0) > 0) fail("a column that belongs to no face", "leave it out");
}

// Calls visit(lane, inertia, part of the face's mass, part of its stiffness) for every element.
template <typename Visit>
void each_element(const Model& m, const Topology& t, Visit&& visit) {
  for (uint32_t lane = 0; lane < m.face_of_lane.size(); ++lane) {
    const uint32_t face = m.face_of_lane[lane];
    if (face != kNone && (t.first_fragment.empty() || t.first_fragment[face] == kNone))
      visit(lane, m.inertia[lane], 1.0f, 1.0f);
  }
  for (const Fragment& f : t.fragment) visit(f.lane, m.inertia[m.lane_of_face[f.face]], part_of_mass(f), part_of_stiffness(f));
}

// block_forces over the blocks of the model and then those of the fragments.
void all_forces(const ElementBlock* whole, const ElementBlock* extra, uint32_t wholes, const Topology& t, const Float4* y,
                BlockTurn* turn, BlockForce* force, uint32_t first, uint32_t last) {
  if (first < wholes) block_forces(whole, t.corners.data(), y, turn, force, first, std::min(last, wholes));
  if (last > wholes)
    block_forces(extra, t.corners.data() + wholes, y, turn + wholes, force + wholes, std::max(first, wholes) - wholes,
                 last - wholes);
}

// Of the bed in a column's inertia, relative to its mass.
float bed_inertia(const Model& m, const Topology& t, uint32_t c) {
  return m.bed.empty() ? 0 : m.step * m.step * m.bed[t.source[c]].stiffness;
}

// The bed's force on a column's mid-surface point that is `displaced` from its place at rest. Across the normal it is a third
// of that along it, as the shear modulus of an incompressible material is of Young's modulus.
Lanes bed_force(const Model& m, const Topology& t, uint32_t c, Lanes displaced) {
  const Model::Bed& b = m.bed[t.source[c]];
  const Lanes n = load(b.normal);
  const float along = displaced[0] * n[0] + displaced[1] * n[1] + displaced[2] * n[2], k = b.stiffness * t.mass[c];
  return splat(-k / 3) * (displaced + splat(2 * along) * n);
}

// Rows of the factor for every column that is not held, and the factor.
void factor_again(const Model& m, Topology& t) {
  const uint32_t n = static_cast<uint32_t>(t.source.size());
  std::vector<uint32_t> row(n, kNone);
  uint32_t rows = 0;
  for (uint32_t c = 0; c < n; ++c)
    if (!m.mesh.held[t.source[c]]) row[c] = rows++;
  const double scale = static_cast<double>(m.step) * m.step * m.report.scale;
  std::vector<Entry> entry;
  for (uint32_t c = 0; c < n; ++c)
    if (row[c] != kNone) entry.push_back({row[c], row[c], t.mass[c] * (1 + bed_inertia(m, t, c))});
  each_element(m, t, [&](uint32_t lane, const Model::LaneInertia& inertia, float, float part) {
    for (int e = 0; e < 6; ++e) {
      const double w = scale * static_cast<double>(inertia.edge[e] * part);
      if (w == 0) continue;
      const auto& corner = t.corners[lane / kLanesOfBlock].column;
      const uint32_t a = corner[kEdge[e][0]][lane % kLanesOfBlock], b = corner[kEdge[e][1]][lane % kLanesOfBlock];
      if (row[a] != kNone) entry.push_back({row[a], row[a], w});
      if (row[b] != kNone) entry.push_back({row[b], row[b], w});
      if (row[a] != kNone && row[b] != kNone) entry.push_back({std::max(row[a], row[b]), std::min(row[a], row[b]), -w});
    }
  });
  t.factor = factorize(rows, entry);
  t.slot.assign(n, kNone);
  for (uint32_t c = 0; c < n; ++c)
    if (row[c] != kNone) t.slot[c] = t.factor.place[row[c]];
}

// Response to a short push on one column, relative to its own mass: the median over the columns that move.
float apparent_mass(const Topology& t) {
  std::vector<float> ratio;
  Column<Float4> x(t.factor.size);
  const uint32_t n = static_cast<uint32_t>(t.source.size());
  for (uint32_t c = 0; c < n; c += std::max(1u, n / 32)) {
    if (t.slot[c] == kNone) continue;
    std::fill(x.begin(), x.end(), Float4{});
    x[t.slot[c]].x = 1;
    solve(t.factor, x.data());
    ratio.push_back(1 / (x[t.slot[c]].x * t.mass[c]));
  }
  if (ratio.empty()) return 0;
  std::nth_element(ratio.begin(), ratio.begin() + static_cast<long>(ratio.size() / 2), ratio.end());
  return ratio[ratio.size() / 2];
}

// Adds A^-1 p to `to`; p and to: 2 per column, p scaled by `scale`.
void respond(const Topology& t, const Float4* p, float scale, Column<Float4>& rhs, Float4* to) {
  const uint32_t n = static_cast<uint32_t>(t.source.size());
  std::fill(rhs.begin(), rhs.end(), Float4{});
  for (uint32_t c = 0; c < n; ++c)
    if (t.slot[c] != kNone) {
      Float4& b = rhs[t.slot[c]];
      store(b, load(b) + load(p[2 * c]) * splat(scale));
    }
  solve(t.factor, rhs.data());
  for (uint32_t c = 0; c < n; ++c) {
    if (t.slot[c] == kNone) continue;
    store(to[2 * c], load(to[2 * c]) + load(rhs[t.slot[c]]));
    store(to[2 * c + 1], load(to[2 * c + 1]) + load(p[2 * c + 1]) * splat(scale * t.inv_dir[c]));
  }
  // Relative motion of the copies of a cut column, through their diagonal part.
  for (size_t g = 0; g + 1 < t.group_first.size(); ++g) {
    Lanes sum = splat(0), mean = splat(0);
    for (uint32_t k = t.group_first[g]; k < t.group_first[g + 1]; ++k)
      sum = sum + load(p[2 * t.group_member[k]]) * splat(scale);
    for (uint32_t k = t.group_first[g]; k < t.group_first[g + 1]; ++k) {
      const uint32_t c = t.group_member[k];
      const Lanes own = (load(p[2 * c]) * splat(scale) - splat(t.share[c]) * sum) * splat(t.relative[c]);
      store(to[2 * c], load(to[2 * c]) + own);
      mean = mean + splat(t.share[c]) * own;
    }
    for (uint32_t k = t.group_first[g]; k < t.group_first[g + 1]; ++k) {
      Float4& v = to[2 * t.group_member[k]];
      store(v, load(v) - mean);
    }
  }
}

void gather_forces(const Topology& t, const std::vector<BlockForce>& force, uint32_t c, Lanes& mid, Lanes& dir) {
  mid = dir = splat(0);
  for (uint32_t k = t.gather_first[c]; k < t.gather_first[c + 1]; ++k) {
    const uint32_t from = t.gather_from[k], block = from / (4 * kLanesOfBlock), at = from % (4 * kLanesOfBlock);
    mid = mid + load((&force[block].mid[0][0])[at]);
    dir = dir + load((&force[block].dir[0][0])[at]);
  }
}

}  // namespace

uint32_t lane_at(const Model& m, const Topology& t, uint32_t face, uint32_t cell) {
  if (t.first_fragment.empty() || t.first_fragment[face] == kNone) return m.lane_of_face[face];
  uint32_t at = t.first_fragment[face];
  while (!(t.fragment[at].cells >> cell & 1)) ++at;
  return t.fragment[at].lane;
}

void renew_topology(const Model& m, Topology& t, bool again) {
  const uint32_t n = static_cast<uint32_t>(t.source.size());
  t.mass.assign(n, 0);
  std::vector<float> dir(n, 0), diagonal(n, 0);
  std::vector<std::vector<uint32_t>> from(n);
  const float scale = m.step * m.step * m.report.scale;
  each_element(m, t, [&](uint32_t lane, const Model::LaneInertia& w, float part, float stiff) {
    const uint32_t block = lane / kLanesOfBlock, in = lane % kLanesOfBlock;
    const auto& corner = t.corners[block].column;
    for (uint32_t k = 0; k < (t.corners[block].quads ? 4u : 3u); ++k) {
      const uint32_t c = corner[k][in];
      t.mass[c] += w.mass * part, dir[c] += w.dir * stiff;
      from[c].push_back((block * 4 + k) * kLanesOfBlock + in);
    }
    for (int e = 0; e < 6; ++e)
      for (int side = 0; side < 2; ++side)
        if (w.edge[e] > 0) diagonal[corner[kEdge[e][side]][in]] += w.edge[e] * stiff;
  });
  t.inv_dir.assign(n, 0);
  t.gather_first.assign(1, 0), t.gather_from.clear();
  for (uint32_t c = 0; c < n; ++c) {
    if (!m.mesh.held[t.source[c]]) t.inv_dir[c] = 1 / (t.mass[c] / 3 + scale * dir[c]);
    t.gather_from.insert(t.gather_from.end(), from[c].begin(), from[c].end());
    t.gather_first.push_back(static_cast<uint32_t>(t.gather_from.size()));
  }
  if (again) factor_again(m, t);
  // Groups of columns that share a row.
  std::vector<std::vector<uint32_t>> member(t.factor.size);
  for (uint32_t c = 0; c < n; ++c)
    if (t.slot[c] != kNone) member[t.slot[c]].push_back(c);
  t.share.assign(n, 1), t.relative.assign(n, 0), t.spread.assign(n, 0);
  t.group_first.assign(1, 0), t.group_member.clear();
  for (const auto& group : member) {
    if (group.size() < 2) continue;
    float mass = 0;
    for (uint32_t c : group) mass += t.mass[c];
    for (uint32_t c : group) {
      t.share[c] = t.mass[c] / mass;
      t.relative[c] = 1 / (t.mass[c] * (1 + bed_inertia(m, t, c)) + 3 * scale * diagonal[c]);
      t.group_member.push_back(c);
    }
    float spread = 0;
    for (uint32_t c : group) spread += t.share[c] * t.share[c] * t.relative[c];
    for (uint32_t c : group) t.spread[c] = spread;
    t.group_first.push_back(static_cast<uint32_t>(t.group_member.size()));
  }
  ++t.version;
}

Scratch make_scratch(const Model&, const State& state) {
  Scratch k;
  // A cut adds at most one column a corner; room for a third more columns keeps a cut from allocating in most cases.
  const size_t n = 2 * columns(state), room = n + n / 3 + 64;
  for (Column<Float4>* c : {&k.y, &k.force, &k.external, &k.answer}) c->reserve(room), c->resize(n);
  k.rhs.resize(state.topology.factor.size);
  k.block_force.resize(state.topology.corners.size());
  k.flat_corner.reserve(4 * kLanesOfBlock * (k.block_force.size() * 4 / 3 + 4));
  return k;
}

Wall build_wall(const Spec& spec) {
  check(spec);
  Wall w;
  Model& m = w.model;
  m.mesh = spec.mesh;
  m.layer = spec.layer;
  m.laminate = laminate(spec.layer, spec.mesh.name);
  m.step = spec.step, m.drag = spec.drag, m.tau = spec.step / 4, m.gravity = spec.gravity;
  const uint32_t n = static_cast<uint32_t>(m.mesh.outer.size());
  std::vector<Vec3> mid(n), dir(n);
  for (uint32_t c = 0; c < n; ++c)
    mid[c] = (m.mesh.outer[c] + m.mesh.inner[c]) * 0.5f, dir[c] = (m.mesh.outer[c] - m.mesh.inner[c]) * 0.5f;

  // Quads first, then triangles, in blocks of their own.
  Topology& t = w.state.topology;
  m.lane_of_face.resize(m.mesh.face.size());
  for (const bool quad : {true, false}) {
    uint32_t in = kLanesOfBlock;
    for (uint32_t f = 0; f < m.mesh.face.size(); ++f) {
      const auto& face = m.mesh.face[f];
      if ((face[3] != kNone) != quad) continue;
      if (in == kLanesOfBlock) {
        in = 0;
        m.block.emplace_back(), t.corners.emplace_back(), w.state.motion.turn.emplace_back();
        t.corners.back().quads = quad;
        w.state.motion.turn.back().w.fill(1);
        m.face_of_lane.resize(m.block.size() * kLanesOfBlock, kNone);
        m.inertia.resize(m.face_of_lane.size());
      }
      Vec3 p[4], d[4];
      const uint32_t corners = quad ? 4 : 3;
      for (uint32_t k = 0; k < 4; ++k) {
        const uint32_t c = face[k < corners ? k : 2];
        p[k] = mid[c], d[k] = dir[c];
        t.corners.back().column[k][in] = c;
      }
      const ElementRest e = element_rest({p, corners}, {d, corners}, m.mesh.along[f], m.laminate, m.mesh.name);
      for (uint32_t k = 0; k < kConstants; ++k) m.block.back().constant[k][in] = static_cast<float>(e.constant[k]);
      BlockTurn& turn = w.state.motion.turn.back();
      turn.x[in] = static_cast<float>(e.turn.x), turn.y[in] = static_cast<float>(e.turn.y);
      turn.z[in] = static_cast<float>(e.turn.z), turn.w[in] = static_cast<float>(e.turn.w);
      const uint32_t lane = static_cast<uint32_t>(m.block.size() - 1) * kLanesOfBlock + in++;
      m.lane_of_face[f] = lane, m.face_of_lane[lane] = f;
      m.inertia[lane] = bound(e, quad, spec.density);
    }
  }
  t.source.resize(n);
  for (uint32_t c = 0; c < n; ++c) t.source[c] = c;
  if (std::any_of(m.mesh.foundation.begin(), m.mesh.foundation.end(), [](float k) { return k > 0; }))
    for (uint32_t c = 0; c < n; ++c)
      m.bed.push_back({float4(mid[c]), float4(normalized(dir[c])), m.mesh.foundation[c] / (2 * length(dir[c]) * spec.density)});
  m.neighbor = neighbors(m.mesh);
  Motion& motion = w.state.motion;
  const size_t room = n + n / 3 + 32;
  motion.x.reserve(2 * room), motion.v.reserve(2 * room);
  for (uint32_t c = 0; c < n; ++c) motion.x.push_back(float4(mid[c])), motion.x.push_back(float4(dir[c]));
  motion.v.resize(2 * n);

  // The inertia: the smallest scale whose largest eigenvalue stays below the limit, found in a few rounds.
  m.report.scale = 1;
  for (int round = 0; round < 4; ++round) {
    renew_topology(m, t, true);
    w.scratch = make_scratch(m, w.state);
    m.report.largest = largest_eigenvalue(m, w.state, w.scratch, true);
    if (!std::isfinite(m.report.largest))
      throw InputError(m.mesh.name, "a wall whose stiffness cannot be bounded", "check thickness, moduli and the mesh");
    if (m.report.largest <= kLargest && (m.report.largest > 0.9f * kLargest || m.report.scale <= 0.3f)) break;
    if (round == 3 && m.report.largest <= kLargest) break;
    m.report.scale = std::max(0.3f, m.report.scale * m.report.largest / (0.96f * kLargest));
    if (round == 3) m.report.scale *= 1.05f, round = 2;  // continue until it holds
    CATGUT_CHECK(m.report.scale < 1e6f);
  }
  m.report.entries = 0;
  for (const Panel& p : t.factor.panel) m.report.entries += p.width * (p.width + 1) / 2 + p.width * p.count;
  m.report.apparent_mass = apparent_mass(t);
  for (float mass : t.mass) m.report.rest_mass += mass;
  return w;
}

void elastic_forces(const Model& m, State& s, Scratch& k, int turns) {
  for (int i = 0; i < turns; ++i)
    all_forces(m.block.data(), s.topology.extra.data(), static_cast<uint32_t>(m.block.size()), s.topology, s.motion.x.data(),
               s.motion.turn.data(), k.block_force.data(), 0, static_cast<uint32_t>(s.topology.corners.size()));
  for (uint32_t c = 0; c < columns(s); ++c) {
    Lanes mid, dir;
    gather_forces(s.topology, k.block_force, c, mid, dir);
    if (!m.bed.empty()) mid = mid + bed_force(m, s.topology, c, load(s.motion.x[2 * c]) - load(m.bed[s.topology.source[c]].at));
    store(k.force[2 * c], mid), store(k.force[2 * c + 1], dir);
  }
}

void begin_step(const Model& m, State& s, Scratch& k, Jobs& jobs) {
  const Topology& t = s.topology;
  Motion& motion = s.motion;
  const Lanes tau = splat(m.tau);
  jobs.each(motion.x.size(), 1024, [&](size_t first, size_t last) {
    for (size_t i = first; i < last; ++i) store(k.y[i], load(motion.x[i]) + tau * load(motion.v[i]));
  });
  jobs.each(t.corners.size(), 8, [&](size_t first, size_t last) {
    all_forces(m.block.data(), t.extra.data(), static_cast<uint32_t>(m.block.size()), t, k.y.data(), motion.turn.data(),
               k.block_force.data(), static_cast<uint32_t>(first), static_cast<uint32_t>(last));
  });
  // Damped before forces are added: otherwise a held force would be scaled by the damping factor.
  const Lanes keep = splat(portable::exp(-m.drag * m.step));
  const Lanes gravity = load(float4(m.gravity));
  jobs.each(columns(s), 256, [&](size_t first, size_t last) {
    for (size_t c = first; c < last; ++c) {
      Lanes mid, dir;
      gather_forces(t, k.block_force, static_cast<uint32_t>(c), mid, dir);
      if (!m.bed.empty()) mid = mid + bed_force(m, t, static_cast<uint32_t>(c), load(k.y[2 * c]) - load(m.bed[t.source[c]].at));
      store(k.force[2 * c], mid + load(k.external[2 * c]) + splat(t.mass[c]) * gravity);
      store(k.force[2 * c + 1], dir + load(k.external[2 * c + 1]));
      store(k.external[2 * c], splat(0)), store(k.external[2 * c + 1], splat(0));
      store(motion.v[2 * c], load(motion.v[2 * c]) * keep), store(motion.v[2 * c + 1], load(motion.v[2 * c + 1]) * keep);
    }
  });
  respond(t, k.force.data(), m.step, k.rhs, motion.v.data());
}

void apply_impulses(State& s, Scratch& k, const Column<Float4>& impulse) {
  respond(s.topology, impulse.data(), 1, k.rhs, s.motion.v.data());
}

void finish_step(const Model& m, State& s, Jobs& jobs) {
  Motion& motion = s.motion;
  const Lanes h = splat(m.step);
  const float limit2 = m.max_speed * m.max_speed;
  uint64_t clamped = 0;
  // Integer count of clamped columns: independent of the order.
  for (uint32_t c = 0; c < columns(s); ++c) {
    const Vec3 vm = vec3(motion.v[2 * c]), vd = vec3(motion.v[2 * c + 1]);
    const float fastest2 = length2(vm) + length2(vd) + 2 * std::abs(dot(vm, vd));
    if (!(fastest2 <= limit2)) {
      const float slower = std::isfinite(fastest2) ? m.max_speed / std::sqrt(fastest2) : 0;
      for (Float4* v : {&motion.v[2 * c], &motion.v[2 * c + 1]}) *v = slower > 0 ? float4(vec3(*v) * slower) : Float4{};
      ++clamped;
    }
  }
  motion.clamped += clamped;
  jobs.each(motion.x.size(), 1024, [&](size_t first, size_t last) {
    for (size_t i = first; i < last; ++i) store(motion.x[i], load(motion.x[i]) + h * load(motion.v[i]));
  });
}

float largest_eigenvalue(const Model& m, const State& state, Scratch& k, bool stiff, int iterations) {
  std::vector<ElementBlock> block = m.block, extra = state.topology.extra;
  for (std::vector<ElementBlock>* blocks : {&block, &extra})
    for (ElementBlock& b : *blocks)
      for (uint32_t i = 0; stiff && i < kLanesOfBlock; ++i) {
        b.constant[kA11][i] += b.constant[kStiff1][i], b.constant[kA22][i] += b.constant[kStiff2][i];
        b.constant[kStiff1][i] = b.constant[kStiff2][i] = 0;
      }
  const Topology& t = state.topology;
  const uint32_t n = columns(state);
  Motion motion = state.motion;
  const uint32_t wholes = static_cast<uint32_t>(block.size()), blocks = static_cast<uint32_t>(t.corners.size());
  float smallest = 1e30f;  // [m] director: a length of the mesh
  for (uint32_t c = 0; c < n; ++c) smallest = std::min(smallest, length(vec3(motion.x[2 * c + 1])));
  Column<Float4> v(2 * n), kv(2 * n), next(2 * n);
  uint32_t random = 12345;
  const auto draw = [&] {
    return random = random * 1664525u + 1013904223u, static_cast<float>(random >> 8) / 16777216.0f - 0.5f;
  };
  for (uint32_t c = 0; c < n; ++c)
    if (t.slot[c] != kNone)
      for (uint32_t i = 0; i < 2; ++i) v[2 * c + i] = {draw(), draw(), draw(), 0};
  double norm = 1, largest = 0;  // v A v
  for (int it = 0; it < iterations; ++it) {
    float longest = 1e-30f;
    for (const Float4& a : v) longest = std::max(longest, length(vec3(a)));
    const float eps = 0.01f * smallest / longest;
    for (auto& a : kv) a = {};
    for (const float sign : {1.0f, -1.0f}) {
      for (size_t i = 0; i < v.size(); ++i) store(k.y[i], load(state.motion.x[i]) + splat(sign * eps) * load(v[i]));
      motion.turn = state.motion.turn;
      for (int turn = 0; turn < 3; ++turn)
        all_forces(block.data(), extra.data(), wholes, t, k.y.data(), motion.turn.data(), k.block_force.data(), 0, blocks);
      for (uint32_t c = 0; c < n; ++c) {
        if (t.slot[c] == kNone) continue;
        Lanes mid, dir;
        gather_forces(t, k.block_force, c, mid, dir);
        if (!m.bed.empty()) mid = mid + bed_force(m, t, c, splat(sign * eps) * load(v[2 * c]));
        store(kv[2 * c], load(kv[2 * c]) - splat(sign * 0.5f / eps) * mid);
        store(kv[2 * c + 1], load(kv[2 * c + 1]) - splat(sign * 0.5f / eps) * dir);
      }
    }
    std::fill(next.begin(), next.end(), Float4{});
    respond(t, kv.data(), 1, k.rhs, next.data());
    double now = 0;
    for (size_t i = 0; i < next.size(); ++i) now += static_cast<double>(dot(vec3(next[i]), vec3(kv[i])));
    if (!(now > 0)) return it == 0 ? static_cast<float>(now) : static_cast<float>(largest);
    if (it > 0) largest = std::max(largest, static_cast<double>(m.step) * m.step * std::sqrt(now / norm));
    norm = 1;
    const float scale = static_cast<float>(1 / std::sqrt(now));
    for (size_t i = 0; i < v.size(); ++i) store(v[i], load(next[i]) * splat(scale));
  }
  return static_cast<float>(largest);
}

}  // namespace catgut::wall
