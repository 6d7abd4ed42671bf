// SPDX-License-Identifier: Apache-2.0
// solver/tethers: reads tethers, moves tissue particles. See the header.
#include "solver/tethers.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/check.h"

namespace catgut {
namespace {

constexpr float kNoLength = 1e-9f;  // [m] a span shorter than this has no direction

// A tether as one sum over all the particles of its two points. Their difference is sum(share * x), and a unit pull along it
// moves particle k by move[k]. The count is even, so that two sums run side by side.
struct TetherRow {
  uint32_t count = 0;
  std::array<uint32_t, 2 * EmbeddedPoint::kMaxParticles> particle{};
  std::array<float, 2 * EmbeddedPoint::kMaxParticles> share{}, move{};
};

// The same at the current positions.
struct RowView {
  const uint32_t* particle;
  const float *share, *move;
  uint32_t count;
};
RowView view(const TetherRow& r) { return {r.particle.data(), r.share.data(), r.move.data(), r.count}; }
RowView row_at(const TetherGraph& web, uint32_t pin) {
  const uint32_t first = web.row[pin];
  return {&web.particle[first], &web.share[first], &web.move[first], web.row[pin + 1] - first};
}

TetherRow row_of(const Tether& pin, const float* w) {
  TetherRow row;
  const auto take = [&](const EmbeddedPoint& t, float sign) {
    for (uint32_t k = 0; k < t.count; ++k) {
      uint32_t at = 0;
      while (at < row.count && row.particle[at] != t.particle[k]) ++at;
      if (at == row.count) row.particle[row.count++] = t.particle[k];
      row.share[at] += sign * t.weight[k];
    }
  };
  take(pin.a, 1);
  take(pin.b, -1);
  if (row.count % 2) row.particle[row.count] = row.particle[row.count - 1], ++row.count;  // with zero share
  for (uint32_t k = 0; k < row.count; ++k) row.move[k] = row.share[k] * w[row.particle[k]];
  return row;
}

// [m] Zero in the fourth lane, where positions have their 1.
Four span_of(const Vec4* x, const RowView& row) {
  Four even{}, odd{};
  for (uint32_t k = 0; k < row.count; k += 2) {
    even += load(x[row.particle[k]]) * row.share[k];
    odd += load(x[row.particle[k + 1]]) * row.share[k + 1];
  }
  Four span = even + odd;
  span[3] = 0;
  return span;
}

void give_pull(Four pull, const RowView& row, Vec4* x) {
  for (uint32_t k = 0; k < row.count; ++k) store(x[row.particle[k]], load(x[row.particle[k]]) + pull * row.move[k]);
}

float length2_of(Four span) {
  const Four square = span * span;
  return square[0] + square[1] + square[2];
}
float length_of(Four span) { return std::sqrt(length2_of(span)); }

// The change of lambda when the tether is `off` too long, including its present pull: it undoes no more than
// that.
float step_of(float off, float give, float lambda) { return std::min(-off * give, -lambda); }
float give_of(float inv_mass, float alpha) { return inv_mass + alpha > 0 ? 1 / (inv_mass + alpha) : 0.0f; }

void solve_row(Tether& pin, const RowView& row, Vec4* x, float h) {
  const Four span = span_of(x, row);
  const float l = length_of(span), alpha = pin.compliance / (h * h);
  if (l <= pin.length && pin.lambda >= 0) return;
  float inv_mass = 0;
  for (uint32_t k = 0; k < row.count; ++k) inv_mass += row.share[k] * row.move[k];
  const float step = step_of(l - pin.length + alpha * pin.lambda, give_of(inv_mass, alpha), pin.lambda);
  pin.lambda += step;
  give_pull(span * (step / std::max(l, kNoLength)), row, x);
}

// Compares bits, unused rows included: the cheapest way to detect a change; a false difference only rebuilds a row.
bool same(const EmbeddedPoint& a, const EmbeddedPoint& b) { return std::memcmp(&a, &b, sizeof a) == 0; }

void find_rows(std::span<const Tether> pin, const float* w, TetherGraph& web) {
  web.point.clear();
  web.particle.clear();
  web.share.clear();
  web.move.clear();
  web.row.assign(1, 0);
  for (const Tether& p : pin) {
    web.point.push_back(p.a);
    web.point.push_back(p.b);
    const TetherRow row = row_of(p, w);
    web.particle.insert(web.particle.end(), row.particle.begin(), row.particle.begin() + row.count);
    web.share.insert(web.share.end(), row.share.begin(), row.share.begin() + row.count);
    web.move.insert(web.move.end(), row.move.begin(), row.move.begin() + row.count);
    web.row.push_back(static_cast<uint32_t>(web.particle.size()));
  }
}

void find_strands(uint32_t particles, TetherGraph& web) {
  const size_t ropes = web.active.size();
  // By particle: the tethers that it is part of, and its share there.
  web.start.assign(particles + 2, 0);
  for (const uint32_t i : web.active)
    for (uint32_t k = web.row[i]; k < web.row[i + 1]; ++k) ++web.start[web.particle[k] + 2];
  for (size_t i = 1; i < web.start.size(); ++i) web.start[i] += web.start[i - 1];
  web.on.resize(web.start.back());
  web.weight.resize(web.start.back());
  for (uint32_t n = 0; n < ropes; ++n)
    for (uint32_t k = web.row[web.active[n]]; k < web.row[web.active[n] + 1]; ++k) {
      const uint32_t at = web.start[web.particle[k] + 1]++;  // advances through its part to the start of the next
      web.on[at] = n;
      web.weight[at] = web.share[k];
    }

  web.first.assign(1, 0);
  web.strand.clear();
  web.by_active.assign(ropes, 0);
  web.listed.assign(ropes, 0);
  for (uint32_t n = 0; n < ropes; ++n) {
    web.strand.push_back({n, 0});
    web.listed[n] = 1;
    for (uint32_t k = web.row[web.active[n]]; k < web.row[web.active[n] + 1]; ++k)
      for (uint32_t r = web.start[web.particle[k]]; r < web.start[web.particle[k] + 1]; ++r) {
        const uint32_t j = web.on[r];
        if (!web.listed[j]) web.listed[j] = 1, web.strand.push_back({j, 0});
        web.by_active[j] += web.move[k] * web.weight[r];
      }
    for (size_t r = web.first.back(); r < web.strand.size(); ++r) {
      TetherGraph::Strand& strand = web.strand[r];
      strand.coupling = web.by_active[strand.active];
      web.by_active[strand.active] = 0;
      web.listed[strand.active] = 0;
    }
    web.first.push_back(static_cast<uint32_t>(web.strand.size()));
  }
}

}  // namespace

void solve_tether(Tether& pin, Vec4* x, const float* w, float h) { solve_row(pin, view(row_of(pin, w)), x, h); }

void build_graph(std::span<const Tether> pin, const float* w, uint32_t particles, TetherGraph& web) {
  bool still = web.point.size() == 2 * pin.size();
  for (size_t i = 0; still && i < pin.size(); ++i)
    still = same(web.point[2 * i], pin[i].a) && same(web.point[2 * i + 1], pin[i].b);
  if (!still) find_rows(pin, w, web);
  web.length.resize(pin.size());
  web.compliance.resize(pin.size());
  web.before.swap(web.active);
  web.active.clear();
  web.slack.clear();
  for (uint32_t i = 0; i < pin.size(); ++i) {
    web.length[i] = pin[i].length;
    web.compliance[i] = pin[i].compliance;
    (pin[i].lambda < 0 ? web.active : web.slack).push_back(i);
  }
  if (!still || web.active != web.before) find_strands(particles, web);
}

void solve_tethers(std::span<Tether> pin, const TetherGraph& web, Vec4* x, float h, int sweeps, float tolerance,
                   std::vector<TetherSpan>& work) {
  CATGUT_CHECK(web.active.size() + web.slack.size() == pin.size());
  // Plain pointers, so that the compiler knows that stores through them do not change the vectors.
  const uint32_t* const first = web.first.data();
  const TetherGraph::Strand* const strand = web.strand.data();
  const size_t ropes = web.active.size();
  work.resize(ropes);
  TetherSpan* const active = work.data();
  const float inv_h2 = 1.0f / (h * h);
  for (size_t n = 0; n < ropes; ++n) {
    TetherSpan& r = active[n];
    const uint32_t i = web.active[n];
    store(r.span, span_of(x, row_at(web, i)));
    r.pull = {};
    r.length = web.length[i];
    r.alpha = web.compliance[i] * inv_h2;
    r.give = give_of(strand[first[n]].coupling, r.alpha);
    r.lambda = 0;
  }

  for (int sweep = 0; sweep < sweeps; ++sweep)
    for (size_t n = 0; n < ropes; ++n) {
      TetherSpan& r = active[n];
      const Four span = load(r.span);
      const float l2 = length2_of(span);
      if (l2 <= r.length * r.length && r.lambda >= 0) continue;
      const float l = std::sqrt(l2), off = l - r.length + r.alpha * r.lambda;
      if (sweep > 0 && std::abs(off) < tolerance) continue;
      const float step = step_of(off, r.give, r.lambda);
      r.lambda += step;
      const Four pull = span * (step / std::max(l, kNoLength));
      store(r.pull, load(r.pull) + pull);
      for (uint32_t k = first[n]; k < first[n + 1]; ++k) {
        Vec4& other = active[strand[k].active].span;
        store(other, load(other) + pull * strand[k].coupling);
      }
    }

  for (size_t n = 0; n < ropes; ++n) {
    const uint32_t i = web.active[n];
    pin[i].lambda = active[n].lambda;
    if (active[n].lambda == 0 && xyz(active[n].pull) == Vec3{}) continue;
    give_pull(load(active[n].pull), row_at(web, i), x);
  }
  for (const uint32_t i : web.slack) {  // nearly all are still slack: detected without a square root
    pin[i].lambda = 0;
    if (length2_of(span_of(x, row_at(web, i))) > web.length[i] * web.length[i]) solve_row(pin[i], row_at(web, i), x, h);
  }
}

}  // namespace catgut
