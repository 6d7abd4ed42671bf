// SPDX-License-Identifier: Apache-2.0
// physical/quiet: see the header.
#include "physical/quiet.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "physical/physical.h"
#include "physical/rigid_fit.h"

namespace catgut::physical {
namespace {

constexpr float kQuietSpeed = 20e-3f;  // [m/s] when it is looked at: a swing that returns is not rest
constexpr float kInBite = 40e-6f;      // [m] in a window, of thread in a bite
constexpr size_t kBeside = 3;          // [nodes] beyond its holes
constexpr float kSettled = 0.1e-3f;    // [m] in a window: rest of tails, and of a strand that carries nothing

bool has(const Sleep::Strand& strand, size_t segment) { return segment >= strand.first && segment < strand.last; }

// Thread that lies about unloaded unbends for a minute, ever more slowly, because its drag is high. Nothing depends on where.
bool carries_nothing(const Model& m, const thread::State& t, const Sleep::Strand& strand) {
  for (const thread::Eyelet& e : t.eyelet)
    if (has(strand, e.segment)) return false;
  for (size_t i = strand.first; i < strand.last; ++i)
    if (std::abs(t.tension[i]) > m.sleep.steady) return false;
  return true;
}

// The segments of a strand's outer holes; none: the last one is the smaller.
std::pair<size_t, size_t> outer_holes(const thread::State& t, const Sleep::Strand& strand) {
  size_t first = strand.last, last = strand.first;
  for (const thread::Eyelet& e : t.eyelet)
    if (has(strand, e.segment)) first = std::min(first, size_t{e.segment}), last = std::max(last, size_t{e.segment});
  return {first, last};
}

// Calls visit(segment, segment) where the strand presses on itself beyond its outer holes.
template <typename Visit>
void each_crossing_of_knot(const thread::State& t, const Sleep::Strand& strand, Visit visit) {
  const std::pair<size_t, size_t> holes = outer_holes(t, strand);
  const auto beyond = [&](size_t k) { return has(strand, k) && (k <= holes.first || k >= holes.second); };
  for (size_t i = 0; i < t.key.size(); ++i) {
    const size_t a = thread::segment_of(t.key[i]), b = thread::partner_of(t.key[i]);
    if (t.crossing[i].normal_impulse > 0 && b < thread::kTool && beyond(a) && beyond(b)) visit(a, b);
  }
}

}  // namespace

bool is_quiet(const Model& m, const State& s, uint32_t k, const Carry& by) {
  const Sleep& z = s.sleep;
  const thread::State& t = s.thread;
  const Sleep::Strand& strand = z.strand[k];
  const float still = carries_nothing(m, t, strand) ? kSettled : m.sleep.still + 2 * by.strain;
  const Vec3 speed = (by.to - by.from) / (static_cast<float>(strand.quiet) * m.wall.step);  // of the wall
  const auto [low, high] = without_tails(t, strand);
  // Thread in a bite creeps to and fro in its holes when the wall beside it is strained. Its tension says what that does.
  size_t bite_low = strand.last + 1, bite_high = strand.first;
  for (const thread::Eyelet& e : t.eyelet)
    if (by.moves() && has(strand, e.segment))
      bite_low = std::min(bite_low, e.segment - std::min(kBeside, size_t{e.segment})), bite_high = e.segment + 1 + kBeside;
  for (size_t i = strand.first; i <= strand.last; ++i) {
    const bool tail = i < low || i > high, bite = i >= bite_low && i <= bite_high;
    const float most = tail ? kSettled : bite ? std::max(still, kInBite) : still;
    if (length2(t.position(i) - by.place(z.from[i])) > most * most || length(t.v.at(i) - speed) >= kQuietSpeed) return false;
  }
  for (size_t i = strand.first; i < strand.last; ++i)
    if (std::abs(t.tension[i] - z.tension[i]) > m.sleep.steady + 0.05f * std::abs(z.tension[i])) return false;
  return true;
}

bool is_slack(const Model& m, const thread::State& t, const Sleep::Strand& strand) {
  for (size_t i = strand.first; i < strand.last; ++i)
    if (std::abs(t.tension[i]) > m.sleep.slack) return false;
  return true;
}

bool is_slack_and_quiet(const Model& m, const State& s, uint32_t k, const Carry& by) {
  const Sleep& z = s.sleep;
  const thread::State& t = s.thread;
  const Sleep::Strand& strand = z.strand[k];
  if (!is_slack(m, t, strand)) return false;
  for (size_t i = strand.first; i <= strand.last; ++i)
    if (length2(t.position(i) - by.place(z.from[i])) > m.sleep.slack_swing * m.sleep.slack_swing) return false;
  for (size_t i = strand.first; i < strand.last; ++i)
    if (std::abs(t.tension[i] - z.tension[i]) > m.sleep.slack_steady) return false;
  return knot_change(t, strand, z.from) <= std::min(m.sleep.still + by.strain, m.sleep.slack_knot);
}

bool has_knot(const thread::State& t, const Sleep::Strand& strand) {
  bool found = false;
  each_crossing_of_knot(t, strand, [&](size_t, size_t) { found = true; });
  return found;
}

float knot_change(const thread::State& t, const Sleep::Strand& strand, std::span<const Vec3> from) {
  const auto each = [&](auto visit) {
    each_crossing_of_knot(t, strand, [&](size_t a, size_t b) {
      for (const size_t i : {a, a + 1, b, b + 1}) visit(from[i], t.position(i));
    });
  };
  Carry c;
  float count = 0;
  each([&](Vec3 was, Vec3 is) { c.from += was, c.to += is, ++count; });
  if (count == 0) return 1;
  c.from = c.from / count, c.to = c.to / count;
  c.turn = best_turn([&](auto visit) { each([&](Vec3 was, Vec3 is) { visit(was - c.from, is - c.to); }); });
  float sum = 0;
  each([&](Vec3 was, Vec3 is) { sum += length2(c.place(was) - is); });
  return std::sqrt(sum / count);
}

float loop_length(const Model& m, const State& s, uint32_t strand) {
  float way = 0;
  Vec3 first{}, last{};
  bool any = false;
  for (const thread::Eyelet& e : s.thread.eyelet) {  // in their order along the thread
    if (!has(s.sleep.strand[strand], e.segment)) continue;
    const Vec3 at = mouth(m, s, s.hole[e.point]);
    if (any) way += distance(last, at);
    else first = at;
    last = at, any = true;
  }
  return any ? way + distance(last, first) : 0;
}

}  // namespace catgut::physical
