// SPDX-License-Identifier: Apache-2.0
// wall/points: see the header.
#include "wall/points.h"

#include <algorithm>
#include <cmath>

#include "core/check.h"
#include "core/clones.h"

namespace catgut::wall {

Weights weights(const Model& m, const Topology& t, const Point& p) {
  const uint32_t lane = lane_at(m, t, p.face, p.xi, p.eta), block = lane / kLanesOfBlock, in = lane % kLanesOfBlock;
  Weights w;
  w.zeta = p.zeta;
  for (int k = 0; k < 4; ++k) w.column[k] = t.corners[block].column[k][in];
  if (t.corners[block].quads) {
    const float a = 1 - p.xi, b = 1 + p.xi, c = 1 - p.eta, d = 1 + p.eta;
    w.weight[0] = 0.25f * a * c, w.weight[1] = 0.25f * b * c, w.weight[2] = 0.25f * b * d, w.weight[3] = 0.25f * a * d;
  } else {
    w.weight[1] = 0.5f * p.xi, w.weight[2] = 0.5f * p.eta, w.weight[0] = 1 - w.weight[1] - w.weight[2];
  }
  return w;
}

Weights at_column(uint32_t column, float zeta) { return {{column, column, column, column}, {1, 0, 0, 0}, zeta}; }

namespace {
Vec3 sum(const Weights& w, const Column<Float4>& of) {
  Vec3 out{};
  for (int k = 0; k < 4; ++k)
    if (w.weight[k] != 0) out += (vec3(of[2 * w.column[k]]) + vec3(of[2 * w.column[k] + 1]) * w.zeta) * w.weight[k];
  return out;
}
}  // namespace

Vec3 place(const Weights& w, const Motion& motion) { return sum(w, motion.x); }
Vec3 velocity(const Weights& w, const Motion& motion) { return sum(w, motion.v); }

void add_to(Column<Float4>& list, const Weights& w, Vec3 amount) {
  for (int k = 0; k < 4; ++k) {
    if (w.weight[k] == 0) continue;
    Float4 &mid = list[2 * w.column[k]], &dir = list[2 * w.column[k] + 1];
    mid = float4(vec3(mid) + amount * w.weight[k]);
    dir = float4(vec3(dir) + amount * (w.weight[k] * w.zeta));
  }
}

Point nearest_point(const Model& m, const State& s, Vec3 p, float zeta) {
  Point best;
  float best2 = 1e30f;
  const auto search = [&](uint32_t f, uint32_t lane, uint64_t cells) {
    const uint32_t block = lane / kLanesOfBlock, in = lane % kLanesOfBlock;
    const bool quad = s.topology.corners[block].quads;
    Vec3 c[4];
    for (int k = 0; k < 4; ++k) c[k] = place(at_column(s.topology.corners[block].column[k][in], zeta), s.motion);
    const auto look = [&](float xi, float eta) {
      const Weights w = weights(m, s.topology, {f, xi, eta, zeta});
      const Vec3 at = c[0] * w.weight[0] + c[1] * w.weight[1] + c[2] * w.weight[2] + c[3] * w.weight[3];
      const float d2 = length2(p - at);
      if (d2 < best2 && (cells == ~uint64_t{0} || cells >> cell_at(quad, xi, eta) & 1)) best2 = d2, best = {f, xi, eta, zeta};
      return at;
    };
    // Gauss-Newton on the bilinear patch; a few steps suffice for nearly flat faces.
    float xi = quad ? 0 : 0.6f, eta = xi;
    for (int step = 0; step < 6; ++step) {
      const Vec3 r = p - look(xi, eta);
      const Vec3 a = quad ? ((c[1] - c[0]) * (1 - eta) + (c[2] - c[3]) * (1 + eta)) * 0.25f : (c[1] - c[0]) * 0.5f;
      const Vec3 b = quad ? ((c[3] - c[0]) * (1 - xi) + (c[2] - c[1]) * (1 + xi)) * 0.25f : (c[2] - c[0]) * 0.5f;
      const float aa = dot(a, a), bb = dot(b, b), ab = dot(a, b), det = aa * bb - ab * ab;
      if (!(det > 0)) break;
      const float low = quad ? -1.0f : 0.0f, high = quad ? 1.0f : 2.0f;
      const float next_xi = std::clamp(xi + (bb * dot(r, a) - ab * dot(r, b)) / det, low, high);
      float next_eta = std::clamp(eta + (dot(r, b) - ab * (next_xi - xi)) / bb, low, high);
      if (!quad) next_eta = std::min(next_eta, 2 - next_xi);
      xi = next_xi, eta = next_eta;
    }
    if (cells == ~uint64_t{0}) return;
    for (uint32_t cell = 0; cell < kCells; ++cell) {  // the foot may lie beyond the fragment
      if (!(cells >> cell & 1)) continue;
      to_natural(quad, raster(quad).center[cell], xi, eta);
      look(xi, eta);
    }
  };
  for (uint32_t f = 0; f < m.lane_of_face.size(); ++f) {
    const uint32_t parts = fragments(s.topology, f);
    if (parts == 0) search(f, m.lane_of_face[f], ~uint64_t{0});
    for (uint32_t i = 0; i < parts; ++i) {
      const Fragment& part = s.topology.fragment[s.topology.first_fragment[f] + i];
      search(f, part.lane, part.cells);
    }
  }
  return best;
}

void Inverse::need(const Topology& t, std::span<const Weights> points) {
  if (version_ != t.version || rows_ != t.factor.size || entry_.empty()) {
    version_ = t.version, rows_ = t.factor.size, next_ = 0, round_ = 0;
    capacity_ = std::min(asked_, rows_);
    entry_.assign(rows_, kNone);
    slot_.clear(), used_.clear();
    slot_.reserve(capacity_), used_.reserve(capacity_);
    value_.resize(size_t{capacity_} * rows_);
    solve_.resize(rows_);
  }
  ++round_;
  uint32_t missing[4], count = 0;
  const auto compute = [&] {  // up to four at once, one per lane
    std::fill(solve_.begin(), solve_.end(), Float4{});
    for (uint32_t i = 0; i < count; ++i) (&solve_[missing[i]].x)[i] = 1;
    solve(t.factor, solve_.data());
    for (uint32_t i = 0; i < count; ++i) {
      float* to = value_.data() + size_t{entry_[missing[i]]} * rows_;
      for (uint32_t r = 0; r < rows_; ++r) to[r] = (&solve_[r].x)[i];
    }
    count = 0;
  };
  // Marks first, so that a new column never replaces one that is needed now.
  for (const Weights& w : points)
    for (int k = 0; k < 4; ++k) {
      const uint32_t s = w.weight[k] != 0 ? t.slot[w.column[k]] : kNone;
      if (s != kNone && entry_[s] != kNone) used_[entry_[s]] = round_;
    }
  for (const Weights& w : points)
    for (int k = 0; k < 4; ++k) {
      const uint32_t s = w.weight[k] != 0 ? t.slot[w.column[k]] : kNone;
      if (s == kNone || entry_[s] != kNone) continue;
      uint32_t e = static_cast<uint32_t>(slot_.size());
      if (e < capacity_) slot_.push_back(s), used_.push_back(round_);
      else {
        uint32_t looked = 0;
        while (used_[next_] == round_ && looked++ <= capacity_) next_ = (next_ + 1) % capacity_;
        CATGUT_CHECK(looked <= capacity_);  // more points at once than the capacity
        e = next_, next_ = (next_ + 1) % capacity_;
        entry_[slot_[e]] = kNone;
        slot_[e] = s, used_[e] = round_;
      }
      entry_[s] = e;
      missing[count++] = s;
      if (count == 4) compute();
    }
  if (count > 0) compute();
}

Terms Inverse::terms(const Topology& t, const Weights& w) const {
  Terms out;
  out.zeta = w.zeta;
  for (size_t k = 0; k < 4; ++k) {
    const uint32_t c = w.column[k], slot = t.slot[c];
    if (w.weight[k] == 0 || slot == kNone) continue;
    out.column[out.count] = c, out.slot[out.count] = slot, out.weight[out.count] = w.weight[k];
    out.row[out.count] = value_.data() + size_t{entry_[slot]} * rows_;
    ++out.count;
  }
  return out;
}

namespace {
// Copies of a cut column, and the director of the same column.
float shared_of(const Topology& t, uint32_t a, uint32_t b, float zetas) {
  float v = (a == b ? t.relative[a] : 0) - t.share[a] * t.relative[a] - t.share[b] * t.relative[b] + t.spread[a];
  if (a == b) v += zetas * t.inv_dir[a];
  return v;
}
CATGUT_CLONES void add_scaled(size_t n, float f, const float* __restrict from, float* __restrict to) {
  for (size_t i = 0; i < n; ++i) to[i] += f * from[i];
}
}  // namespace

float Inverse::compliance(const Topology& t, const Terms& a, const Terms& b) const {
  float sum = 0;
  for (uint32_t i = 0; i < a.count; ++i) {
    float part = 0;
    for (uint32_t j = 0; j < b.count; ++j) {
      float v = a.row[i][b.slot[j]];
      if (a.slot[i] == b.slot[j]) v += shared_of(t, a.column[i], b.column[j], a.zeta * b.zeta);
      part += b.weight[j] * v;
    }
    sum += a.weight[i] * part;
  }
  return sum;
}

void Inverse::add_answer(const Terms& a, float sign, std::span<float> slots) const {
  for (uint32_t i = 0; i < a.count; ++i) add_scaled(slots.size(), sign * a.weight[i], a.row[i], slots.data());
}

float Inverse::shared(const Topology& t, const Terms& a, const Terms& b) {
  float sum = 0;
  for (uint32_t i = 0; i < a.count; ++i)
    for (uint32_t j = 0; j < b.count; ++j)
      if (a.slot[i] == b.slot[j]) sum += a.weight[i] * b.weight[j] * shared_of(t, a.column[i], b.column[j], a.zeta * b.zeta);
  return sum;
}

namespace {
// Sum over the columns of a point: directors (1) or mid-surface points (0).
Vec3 sum_of(const Weights& w, const Column<Float4>& of, uint32_t which) {
  Vec3 out{};
  for (int k = 0; k < 4; ++k)
    if (w.weight[k] != 0) out += vec3(of[2 * w.column[k] + which]) * w.weight[k];
  return out;
}
}  // namespace

void Coupling::set_points(const Model& m, const Topology& t, std::span<const Point> points, std::span<const float> offsets) {
  material_.assign(points.begin(), points.end());
  const size_t n = points.size();
  point.resize(n), at.assign(n, {}), speed.assign(n, {}), impulse.assign(n, {}), w.assign(n * n, 0);
  offset.assign(n, 0), axis.assign(n, {}), lever_.assign(n, 0), tilt_first.assign(n + 1, 0), tilt.clear();
  for (size_t i = 0; i < n; ++i) {
    if (!offsets.empty()) offset[i] = offsets[i];
    if (offset[i] != 0) material_[i].zeta = 0;
    point[i] = weights(m, t, material_[i]);
  }
  version = t.version - 1;  // W is made in `begin`
}

void Coupling::reserve(size_t n) {
  material_.reserve(n), point.reserve(n), at.reserve(n), speed.reserve(n), impulse.reserve(n), w.reserve(n * n);
  offset.reserve(n), axis.reserve(n), lever_.reserve(n), tilt_first.reserve(n + 1), tilt.reserve(16 * n);
  terms_.reserve(n);
}

namespace {
// 1 where a director stands on its face, 0 where it is tilted by more than 72 degrees: the wall's formula has no stiffness left
// there, and a load would lay the director into the face.
float upright(const Weights& w, const Motion& motion, Vec3 axis) {
  constexpr float kLow = 0.3f, kHigh = 0.6f;
  const Vec3 a = vec3(motion.x[2 * w.column[0]]), b = vec3(motion.x[2 * w.column[1]]), c = vec3(motion.x[2 * w.column[2]]);
  const Vec3 n = cross(b - a, c - a);
  const float size = length(n);
  return size > 0 ? std::clamp((std::abs(dot(n, axis)) / size - kLow) / (kHigh - kLow), 0.0f, 1.0f) : 1.0f;
}
}  // namespace

void Coupling::begin(const Model& m, const State& s) {
  const size_t n = point.size();
  step = m.step;
  if (version != s.topology.version) {
    version = s.topology.version;
    for (size_t i = 0; i < n; ++i) point[i] = weights(m, s.topology, material_[i]);
    inverse.need(s.topology, point);
    terms_.clear();
    for (size_t i = 0; i < n; ++i) terms_.push_back(inverse.terms(s.topology, point[i]));
    for (size_t i = 0; i < n; ++i)
      for (size_t j = 0; j <= i; ++j) w[i * n + j] = w[j * n + i] = inverse.compliance(s.topology, terms_[i], terms_[j]);
  }
  for (size_t i = 0; i < n; ++i) {
    at[i] = place(point[i], s.motion), speed[i] = velocity(point[i], s.motion), impulse[i] = {};
    if (offset[i] == 0) continue;
    const Vec3 director = sum_of(point[i], s.motion.x, 1), turn = sum_of(point[i], s.motion.v, 1);
    const float size = std::max(length(director), 1e-9f);
    axis[i] = director / size;
    at[i] += axis[i] * offset[i];
    lever_[i] = offset[i] / size * upright(point[i], s.motion, axis[i]);
    speed[i] += (turn - axis[i] * dot(turn, axis[i])) * lever_[i];
  }
  tilt.clear();
  for (size_t i = 0; i < n; ++i) {
    tilt_first[i] = static_cast<uint32_t>(tilt.size());
    for (size_t j = 0; offset[i] != 0 && j < n; ++j) {
      if (offset[j] == 0) continue;
      float sum = 0;
      for (int a = 0; a < 4; ++a)
        for (int b = 0; b < 4; ++b)
          if (point[i].column[a] == point[j].column[b])
            sum += point[i].weight[a] * point[j].weight[b] * s.topology.inv_dir[point[i].column[a]];
      if (sum != 0) tilt.push_back({static_cast<uint32_t>(j), sum * lever_[i] * lever_[j]});
    }
  }
  tilt_first[n] = static_cast<uint32_t>(tilt.size());
}

Vec3 Coupling::now(size_t i, const State& s) const {
  const Vec3 at_i = place(point[i], s.motion);
  return offset[i] == 0 ? at_i : at_i + normalized(sum_of(point[i], s.motion.x, 1)) * offset[i];
}

void Coupling::spread(Column<Float4>& to) const {
  std::fill(to.begin(), to.end(), Float4{});
  for (size_t i = 0; i < point.size(); ++i) {
    add_to(to, point[i], impulse[i]);
    if (offset[i] == 0) continue;
    const Vec3 moment = (impulse[i] - axis[i] * dot(impulse[i], axis[i])) * lever_[i];
    for (int c = 0; c < 4; ++c) {
      if (point[i].weight[c] == 0) continue;
      Float4& dir = to[2 * point[i].column[c] + 1];
      dir = float4(vec3(dir) + moment * point[i].weight[c]);
    }
  }
}

void Coupling::end(State& s, Scratch& k) {
  spread(k.external);
  apply_impulses(s, k, k.external);
  std::fill(k.external.begin(), k.external.end(), Float4{});
}

void apply_hold(const Model& m, State& s, Scratch& k, Hold& hold) {
  const size_t n = hold.point.size();
  if (n == 0) return;
  hold.force.assign(n, {});
  hold.inverse.need(s.topology, hold.point);
  hold.matrix.resize(n * (n + 3));
  double* a = hold.matrix.data();
  double* x = a + n * n;
  for (size_t i = 0; i < n; ++i) {
    for (size_t j = 0; j <= i; ++j)
      a[i * n + j] = static_cast<double>(hold.inverse.compliance(s.topology, hold.point[i], hold.point[j]));
    // h W p + softness p / h = error; a small softness keeps points that move together from being singular.
    a[i * n + i] = a[i * n + i] * (1 + 1e-6) + static_cast<double>(hold.softness) / (static_cast<double>(m.step) * m.step);
    const Vec3 missing = (hold.target[i] - place(hold.point[i], s.motion)) / m.step - velocity(hold.point[i], s.motion);
    for (size_t d = 0; d < 3; ++d) x[3 * i + d] = static_cast<double>(missing[static_cast<int>(d)]);
  }
  // Cholesky in place, then both triangles.
  for (size_t j = 0; j < n; ++j)
    for (size_t i = j; i < n; ++i) {
      double v = a[i * n + j];
      for (size_t l = 0; l < j; ++l) v -= a[i * n + l] * a[j * n + l];
      if (i == j) a[i * n + i] = std::sqrt(std::max(v, 1e-12));
      else a[i * n + j] = v / a[j * n + j];
    }
  for (size_t d = 0; d < 3; ++d) {
    for (size_t i = 0; i < n; ++i) {
      for (size_t l = 0; l < i; ++l) x[3 * i + d] -= a[i * n + l] * x[3 * l + d];
      x[3 * i + d] /= a[i * n + i];
    }
    for (size_t i = n; i-- > 0;) {
      for (size_t l = i + 1; l < n; ++l) x[3 * i + d] -= a[l * n + i] * x[3 * l + d];
      x[3 * i + d] /= a[i * n + i];
    }
  }
  std::fill(k.external.begin(), k.external.end(), Float4{});
  for (size_t i = 0; i < n; ++i) {
    const Vec3 p{static_cast<float>(x[3 * i]), static_cast<float>(x[3 * i + 1]), static_cast<float>(x[3 * i + 2])};
    add_to(k.external, hold.point[i], p);
    hold.force[i] = p / m.step;
  }
  apply_impulses(s, k, k.external);
  std::fill(k.external.begin(), k.external.end(), Float4{});
}

}  // namespace catgut::wall
