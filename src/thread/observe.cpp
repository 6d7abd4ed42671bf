// SPDX-License-Identifier: Apache-2.0
// thread/observe: see the header. Allocates; not for inside a step.
#include "thread/observe.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace catgut::thread {
namespace {

constexpr float kNear = 0.4f;     // of the diameter: maximum gap of a crossing that counts
constexpr float kCrossed = 0.5f;  // sine of the angle between the strands: smaller ones run side by side
constexpr float kApart = 4.0f;    // diameters of loop length between one throw and the next
constexpr float kBand = 3.0f;     // diameters of loop length beyond a throw's crossings that still turn with it
constexpr float kAir = 1e-3f;     // [m]
constexpr float kSliding = 0.45f;

struct Seen {
  float loop, sign;
  uint32_t a, b;  // segments
};

// Gauss linking integral of two segments, exact: Klenin and Langowski
// 2000, 10.1002/1097-0282(20001015)54:5<307::AID-BIP20>3.0.CO;2-Y.
float gauss(Vec3 a0, Vec3 a1, Vec3 b0, Vec3 b1) {
  const Vec3 r13 = b0 - a0, r14 = b1 - a0, r23 = b0 - a1, r24 = b1 - a1;
  const Vec3 n1 = normalized(cross(r13, r14)), n2 = normalized(cross(r14, r24)), n3 = normalized(cross(r24, r23)),
             n4 = normalized(cross(r23, r13));
  auto arc = [](Vec3 p, Vec3 q) { return std::asin(std::clamp(dot(p, q), -1.0f, 1.0f)); };
  const float area = arc(n1, n2) + arc(n2, n3) + arc(n3, n4) + arc(n4, n1);
  return (dot(cross(b1 - b0, a1 - a0), r13) > 0 ? 1.0f : -1.0f) * area / (4 * kPi);
}

float turning(const State& s, uint32_t from, uint32_t to) {
  float sum = 0;
  for (uint32_t i = from + 1; i <= to; ++i) {
    const Vec3 p = normalized(s.position(i) - s.position(i - 1)), q = normalized(s.position(i + 1) - s.position(i));
    sum += std::atan2(length(cross(p, q)), dot(p, q));
  }
  return sum;
}

SeenThrow look_at(const Settings& settings, const State& state, const std::vector<Seen>& seen, const std::vector<float>& along,
                  size_t first, size_t end) {
  SeenThrow t;
  float sign = 0, all = 0;
  uint32_t a0 = seen[first].a, a1 = a0, b0 = seen[first].b, b1 = b0;
  for (size_t k = first; k < end; ++k) {
    sign += seen[k].sign, all += std::abs(seen[k].sign);
    a0 = std::min(a0, seen[k].a), a1 = std::max(a1, seen[k].a), b0 = std::min(b0, seen[k].b), b1 = std::max(b1, seen[k].b);
    t.loop += seen[k].loop / static_cast<float>(end - first);
  }
  t.hand = sign > 0 ? 1 : -1;
  // Turns of the strands about each other, including a short distance beyond the crossings, where they meet and part.
  const uint32_t more = static_cast<uint32_t>(std::lround(2.5f * settings.material.diameter / state.rest[a0])),
                 last = static_cast<uint32_t>(state.segments()) - 1;
  const uint32_t middle = (a1 + b0) / 2;
  a0 = a0 > more ? a0 - more : 0, a1 = std::min(a1 + more, middle);
  b0 = b0 > middle + more ? b0 - more : middle + 1, b1 = std::min(b1 + more, last - 1);
  // Only pairs whose loop belongs to this throw: pairs of neighboring throws would cancel in an alternating knot.
  const float low = seen[first].loop - kBand * settings.material.diameter,
              high = seen[end - 1].loop + kBand * settings.material.diameter;
  float link = 0;
  for (uint32_t i = a0; i <= a1; ++i)
    for (uint32_t j = b0; j <= b1; ++j) {
      const float loop = 0.5f * (along[j] + along[j + 1] - along[i] - along[i + 1]);
      if (loop > low && loop < high)
        link += gauss(state.position(i), state.position(i + 1), state.position(j), state.position(j + 1));
    }
  const float turns = 2 * std::abs(link);
  t.half_turns = static_cast<uint32_t>(std::max(0.0f, 2 * std::round(0.5f * (turns - 1)))) + 1;
  const float ta = turning(state, a0, a1), tb = turning(state, b0, b1);
  t.sliding = std::abs(ta - tb) / std::max(1e-3f, ta + tb);
  const float off = std::abs(turns - static_cast<float>(t.half_turns));  // 0: centered, 1: halfway to the next
  t.confidence = std::max(0.0f, 1 - off * off) * std::abs(sign) / std::max(1e-6f, all);
  return t;
}

KnotName find_name(const SeenKnot& k) {
  if (k.throws == 0) return KnotName::none;
  if (k.throws == 1) return KnotName::single_throw;
  float sliding = 0;
  bool alternating = true, alike = true;
  for (uint32_t i = 0; i < k.throws; ++i) {
    sliding += k.item[i].sliding / static_cast<float>(k.throws);
    if (i == 0) continue;
    (k.item[i].hand == k.item[i - 1].hand ? alternating : alike) = false;
  }
  if (sliding > kSliding) return KnotName::sliding;
  if (alternating) return k.item[0].half_turns >= 5 ? KnotName::surgeons : KnotName::square;
  return alike ? KnotName::granny : KnotName::mixed;
}

}  // namespace

std::string_view name_of(KnotName name) {
  constexpr std::string_view names[] = {"none", "single throw", "granny", "square", "surgeon's", "sliding", "mixed"};
  return names[static_cast<size_t>(name)];
}

SeenKnot observe(const Settings& settings, const State& state, float tight_loop) {
  const float d = settings.material.diameter;
  std::vector<float> along(state.nodes(), 0.0f);
  for (size_t i = 0; i < state.segments(); ++i) along[i + 1] = along[i] + state.rest[i];
  std::vector<Seen> seen;
  for (size_t k = 0; k < state.key.size(); ++k) {
    const uint32_t i = segment_of(state.key[k]), j = partner_of(state.key[k]);
    const Crossing& c = state.crossing[k];
    if (j >= kTool || c.touch == Touch::unknown || c.gap > kNear * d) continue;
    const Vec3 p = normalized(state.position(i + 1) - state.position(i)),
               q = normalized(state.position(j + 1) - state.position(j));
    const float sign = dot(cross(p, q), c.normal);
    if (std::abs(sign) < kCrossed) continue;
    seen.push_back({along[j] + c.t * state.rest[j] - along[i] - c.s * state.rest[i], sign, i, j});
  }
  std::sort(seen.begin(), seen.end(),
            [](const Seen& x, const Seen& y) { return x.loop != y.loop ? x.loop < y.loop : x.a < y.a; });
  SeenKnot knot;
  float below = tight_loop;
  for (size_t first = 0, k = 1; k <= seen.size() && knot.throws < kMaxThrows; ++k) {
    if (k < seen.size() && seen[k].loop - seen[k - 1].loop < kApart * d) continue;
    SeenThrow t = look_at(settings, state, seen, along, first, k);
    // Each strand takes half of the loop's growth; a tight throw takes up about five diameters of each.
    if (below > 0) t.gap = std::max(0.0f, 0.5f * (seen[first].loop - below) - (knot.throws > 0 ? 5 * d : 0.0f));
    first = k;
    if (t.half_turns < 3) continue;  // strands that only cross
    below = seen[k - 1].loop;
    knot.wraps += (t.half_turns - 1) / 2;
    knot.air |= t.gap > kAir;
    knot.item[knot.throws++] = t;
  }
  knot.name = find_name(knot);
  knot.confidence = 1;
  for (uint32_t i = 0; i < knot.throws; ++i) knot.confidence = std::min(knot.confidence, knot.item[i].confidence);
  return knot;
}

}  // namespace catgut::thread
