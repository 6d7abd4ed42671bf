// solver/pins: reads pins, moves tissue particles. See the header.
#include "solver/pins.h"

#include <algorithm>
#include <cmath>

namespace catgut {
namespace {

constexpr float kNoLength = 1e-9f;  // [m] a span shorter than this has no direction

// A pin as one sum over all the particles of its two points: their difference is sum(share * x), and a pull of 1 along it moves
// particle k by move[k]. Padded with particles that have no share to a multiple of four: rows of few lengths keep the processor
// from guessing where they end.
struct PinRow {
  uint32_t count = 0;
  float inv_mass = 0;  // [1/kg]
  std::array<uint32_t, 2 * TissuePoint::kMost> particle{};
  std::array<float, 2 * TissuePoint::kMost> share{}, move{};
};

PinRow row_of(const TissuePin& pin, const float* w) {
  PinRow row;
  const auto take = [&](const TissuePoint& t, float sign) {
    for (uint32_t k = 0; k < t.count; ++k) {
      uint32_t at = 0;
      while (at < row.count && row.particle[at] != t.particle[k]) ++at;
      if (at == row.count) row.particle[row.count++] = t.particle[k];
      row.share[at] += sign * t.weight[k];
    }
  };
  take(pin.a, 1);
  take(pin.b, -1);
  for (; row.count % 4; ++row.count) row.particle[row.count] = row.particle[row.count - 1];
  for (uint32_t k = 0; k < row.count; ++k) {
    row.move[k] = row.share[k] * w[row.particle[k]];
    row.inv_mass += row.share[k] * row.move[k];
  }
  return row;
}

// [m] Nothing in the fourth lane, where positions have their 1.
Four span_of(const Vec4* x, const uint32_t* particle, const float* share, uint32_t count) {
  Four even{}, odd{};
  for (uint32_t k = 0; k < count; k += 2) {
    even += load(x[particle[k]]) * share[k];
    odd += load(x[particle[k + 1]]) * share[k + 1];
  }
  Four span = even + odd;
  span[3] = 0;
  return span;
}

// What a pull adds to lambda when the pin is `off` too long, what it pulls already allowed for: it takes back no more than
// that.
float step_of(float off, float give, float lambda) { return std::min(-off * give, -lambda); }
float give_of(float inv_mass, float alpha) { return inv_mass + alpha > 0 ? 1 / (inv_mass + alpha) : 0.0f; }

bool same(const TissuePoint& a, const TissuePoint& b) {
  return a.count == b.count && std::equal(a.particle.begin(), a.particle.begin() + a.count, b.particle.begin()) &&
         std::equal(a.weight.begin(), a.weight.begin() + a.count, b.weight.begin());
}

void find_rows(std::span<const TissuePin> pin, const float* w, PinWeb& web) {
  web.point.clear();
  web.particle.clear();
  web.share.clear();
  web.move.clear();
  web.row.assign(1, 0);
  for (const TissuePin& p : pin) {
    web.point.push_back(p.a);
    web.point.push_back(p.b);
    const PinRow row = row_of(p, w);
    web.particle.insert(web.particle.end(), row.particle.begin(), row.particle.begin() + row.count);
    web.share.insert(web.share.end(), row.share.begin(), row.share.begin() + row.count);
    web.move.insert(web.move.end(), row.move.begin(), row.move.begin() + row.count);
    web.row.push_back(static_cast<uint32_t>(web.particle.size()));
  }
}

void find_strands(size_t pins, uint32_t particles, PinWeb& web) {
  // By particle: the pins that it is part of, and its share there.
  web.start.assign(particles + 2, 0);
  for (const uint32_t k : web.particle) ++web.start[k + 2];
  for (size_t i = 1; i < web.start.size(); ++i) web.start[i] += web.start[i - 1];
  web.pin.resize(web.particle.size());
  web.weight.resize(web.particle.size());
  for (uint32_t i = 0; i < pins; ++i)
    for (uint32_t k = web.row[i]; k < web.row[i + 1]; ++k) {
      const uint32_t at = web.start[web.particle[k] + 1]++;  // runs through its part to where the next begins
      web.pin[at] = i;
      web.weight[at] = web.share[k];
    }

  web.first.assign(1, 0);
  web.strand.clear();
  web.by_pin.assign(pins, 0);
  web.listed.assign(pins, 0);
  for (uint32_t i = 0; i < pins; ++i) {
    web.strand.push_back({i, 0});
    web.listed[i] = 1;
    for (uint32_t k = web.row[i]; k < web.row[i + 1]; ++k)
      for (uint32_t r = web.start[web.particle[k]]; r < web.start[web.particle[k] + 1]; ++r) {
        const uint32_t j = web.pin[r];
        if (!web.listed[j]) web.listed[j] = 1, web.strand.push_back({j, 0});
        web.by_pin[j] += web.move[k] * web.weight[r];
      }
    for (size_t r = web.first.back(); r < web.strand.size(); ++r) {
      PinWeb::Strand& strand = web.strand[r];
      strand.coupling = web.by_pin[strand.pin];
      web.by_pin[strand.pin] = 0;
      web.listed[strand.pin] = 0;
    }
    web.first.push_back(static_cast<uint32_t>(web.strand.size()));
  }
}

}  // namespace

void solve_pin(TissuePin& pin, Vec4* x, const float* w, float h) {
  const PinRow row = row_of(pin, w);
  const Four d = span_of(x, row.particle.data(), row.share.data(), row.count);
  const float l = std::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]), alpha = pin.compliance / (h * h);
  if (l <= pin.length && pin.lambda >= 0) return;
  const float step = step_of(l - pin.length + alpha * pin.lambda, give_of(row.inv_mass, alpha), pin.lambda);
  pin.lambda += step;
  const float pull = step / std::max(l, kNoLength);
  const Four push{d[0] * pull, d[1] * pull, d[2] * pull, 0};
  for (uint32_t k = 0; k < row.count; ++k) store(x[row.particle[k]], load(x[row.particle[k]]) + push * row.move[k]);
}

void weave(std::span<const TissuePin> pin, const float* w, uint32_t particles, PinWeb& web) {
  bool still = web.point.size() == 2 * pin.size();
  for (size_t i = 0; still && i < pin.size(); ++i)
    still = same(web.point[2 * i], pin[i].a) && same(web.point[2 * i + 1], pin[i].b);
  if (!still) {
    find_rows(pin, w, web);
    find_strands(pin.size(), particles, web);
  }
  web.length.resize(pin.size());
  web.compliance.resize(pin.size());
  for (size_t i = 0; i < pin.size(); ++i) web.length[i] = pin[i].length, web.compliance[i] = pin[i].compliance;
}

void solve_pins(std::span<TissuePin> pin, const PinWeb& web, Vec4* x, float h, int sweeps, float tolerance,
                std::vector<PinSpan>& work) {
  // Plain pointers: what is stored through them cannot be taken for a change of where vectors are.
  const uint32_t *const row = web.row.data(), *const particle = web.particle.data(), *const first = web.first.data();
  const float *const share = web.share.data(), *const move = web.move.data();
  const PinWeb::Strand* const strand = web.strand.data();
  const size_t pins = pin.size();
  work.resize(pins);
  PinSpan* const rope = work.data();
  const float inv_h2 = 1.0f / (h * h);
  for (size_t i = 0; i < pins; ++i) {
    PinSpan& r = rope[i];
    store(r.span, span_of(x, particle + row[i], share + row[i], row[i + 1] - row[i]));
    r.pull = {};
    r.length = web.length[i];
    r.alpha = web.compliance[i] * inv_h2;
    r.give = give_of(strand[first[i]].coupling, r.alpha);
    r.lambda = 0;
  }

  for (int sweep = 0; sweep < sweeps; ++sweep)
    for (size_t i = 0; i < pins; ++i) {
      PinSpan& r = rope[i];
      const Four span = load(r.span), square = span * span;
      const float l2 = square[0] + square[1] + square[2];
      if (l2 <= r.length * r.length && r.lambda >= 0) continue;
      const float l = std::sqrt(l2), off = l - r.length + r.alpha * r.lambda;
      if (sweep > 0 && std::abs(off) < tolerance) continue;
      const float step = step_of(off, r.give, r.lambda);
      r.lambda += step;
      const Four pull = span * (step / std::max(l, kNoLength));
      store(r.pull, load(r.pull) + pull);
      for (uint32_t k = first[i]; k < first[i + 1]; ++k) {
        Vec4& other = rope[strand[k].pin].span;
        store(other, load(other) + pull * strand[k].coupling);
      }
    }

  for (size_t i = 0; i < pins; ++i) {
    pin[i].lambda = rope[i].lambda;
    if (rope[i].lambda == 0 && xyz(rope[i].pull) == Vec3{}) continue;
    const Four pull = load(rope[i].pull);
    for (uint32_t k = row[i]; k < row[i + 1]; ++k) store(x[particle[k]], load(x[particle[k]]) + pull * move[k]);
  }
}

}  // namespace catgut
