// SPDX-License-Identifier: Apache-2.0
// validation: see knot_scenes.h.
#include "validation/knot_scenes.h"

#include <algorithm>
#include <cmath>

#include "thread/topology.h"
#include "validation/swept.h"

namespace catgut::validation {
namespace {

using thread::Hold;
using thread::Pull;
using thread::Settings;
using thread::Surroundings;

constexpr float kRodRadius = 2.5e-3f;  // [m]

Vec3 turned(Vec3 p) { return {-p.x, -p.y, p.z}; }
float half_length(const Throw& t, float d) { return 0.5f * 2.2f * d * static_cast<float>(t.half_turns); }

}  // namespace

std::vector<Vec3> resample(const std::vector<Vec3>& fine, float spacing) {
  std::vector<Vec3> out{fine[0]};
  float left = spacing;
  for (size_t i = 1; i < fine.size(); ++i) {
    Vec3 from = fine[i - 1];
    float piece = distance(from, fine[i]);
    while (piece >= left) {
      from = lerp(from, fine[i], left / piece);
      out.push_back(from);
      piece -= left;
      left = spacing;
    }
    left -= piece;
  }
  return out;
}

Throws single_throw() { return {{3, 1}}; }
Throws granny() { return {{3, 1}, {3, 1}}; }
Throws square() { return {{3, 1}, {3, -1}}; }
Throws surgeons() { return {{5, 1}, {3, -1}}; }
Throws three_throws() { return {{3, 1}, {3, -1}, {3, 1}}; }
Throws surgeons_211() { return {{5, 1}, {3, -1}, {3, 1}}; }

namespace {

// Strand A from its load end upward; `a` is its beginning, up to where it enters the first throw on side -x. Strand B is A
// rotated by half a turn about z, because every throw is symmetric under that rotation. Returns the side on which the tail
// leaves.
float wind(std::span<const Throw> throws, float d, float tail, std::vector<Vec3>& a) {
  const float r = 0.75f * d, bend = 1.5f * d;
  auto line = [&](Vec3 to) {
    const Vec3 from = a.back();
    const int n = std::max(1, static_cast<int>(distance(from, to) / (0.05f * d)));
    for (int i = 1; i <= n; ++i) a.push_back(lerp(from, to, static_cast<float>(i) / static_cast<float>(n)));
  };
  float z = 0, side = -1;  // A enters from this side
  for (size_t k = 0; k < throws.size(); ++k) {
    const float turns = static_cast<float>(throws[k].half_turns * throws[k].hand) * kPi;
    const float half = half_length(throws[k], d);
    // The strand from the left starts below: sin of its first angle is -1.
    const float phase = std::sin(-0.5f * turns) < 0 ? 0 : kPi;
    line({side * half, 0, z - r});
    const int n = throws[k].half_turns * 60;
    for (int i = 1; i <= n; ++i) {
      const float x = half * (2 * static_cast<float>(i) / static_cast<float>(n) - 1), angle = phase + 0.5f * turns * x / half;
      Vec3 p{x, r * std::cos(angle), r * std::sin(angle)};
      if (side > 0) p = turned(p);
      a.push_back(p + Vec3{0, 0, z});
    }
    side = -side;
    if (k + 1 == throws.size()) break;
    const float out = std::max(half, half_length(throws[k + 1], d));
    line({side * out, 0, z + r});
    for (int i = 1; i <= 60; ++i) {
      const float angle = kPi * static_cast<float>(i) / 60;
      a.push_back({side * (out + bend * std::sin(angle)), 0, z + r + bend * (1 - std::cos(angle))});
    }
    z += 2 * bend + 2 * r;
  }
  line(a.back() + Vec3{side * tail, 0, 0.15f * tail});
  return side;
}

}  // namespace

LaidKnot lay_knot(std::span<const Throw> throws, float d, float segment, float load, float tail, float drop) {
  const float r = 0.75f * d;
  std::vector<Vec3> a{{-half_length(throws[0], d) - load * std::cos(drop), 0, -r - load * std::sin(drop)}};
  const float side = wind(throws, d, tail, a);
  const std::vector<Vec3> strand = resample(a, segment);
  std::vector<Vec3> path(strand.rbegin(), strand.rend());
  for (const Vec3& p : strand) path.push_back(turned(p));
  LaidKnot k;
  k.state = thread::make_state(path);
  k.load_a = static_cast<uint32_t>(strand.size()) - 1;
  k.load_b = k.load_a + 1;
  k.state.broken[k.load_a] = 1;
  k.tail_direction_a = {side, 0, 0};
  k.tail_direction_b = {-side, 0, 0};
  return k;
}

LaidKnot lay_on_rod(std::span<const Throw> throws, float d, float segment, float tail) {
  const float r = 0.75f * d, first = half_length(throws[0], d), round = kRodRadius + d;
  std::vector<Vec3> a;  // from the middle of the bite, below the rod
  for (float x = 0; x < first; x += 0.05f * d) a.push_back({-x, 0, -r - 2 * round});
  for (int i = 0; i <= 120; ++i) {
    const float angle = kPi * static_cast<float>(i) / 120;
    a.push_back({-first - round * std::sin(angle), 0, -r - round * (1 + std::cos(angle))});
  }
  const float side = wind(throws, d, tail, a);
  const std::vector<Vec3> strand = resample(a, segment);
  std::vector<Vec3> path(strand.rbegin(), strand.rend());
  for (size_t i = 1; i < strand.size(); ++i) path.push_back(turned(strand[i]));
  LaidKnot k;
  k.state = thread::make_state(path);
  k.load_a = k.load_b = static_cast<uint32_t>(strand.size()) - 1;
  k.tail_direction_a = {side, 0, 0};
  k.tail_direction_b = {-side, 0, 0};
  const Vec3 from{0, -10e-3f, -r - round}, to{0, 10e-3f, -r - round};
  k.rod.push_back({from, to, from, to, kRodRadius, 0.15f, {}, {}});
  return k;
}

Settings knot_settings(float friction) {
  Settings s;
  s.material = thread::properties(thread::Material::silk, thread::Size::usp_0);
  s.material.diameter = 0.35e-3f;
  s.material.axial_stiffness = 500;
  s.material.bending_stiffness = 1e-8f;
  s.material.elastic_curvature = 1 / (4 * s.material.diameter);
  s.material.friction = friction;
  s.material.friction_load = 0.3f;
  s.breaks = false;
  return s;
}

void tighten(const Settings& settings, Tightened& t, float tails, Drawing drawing, float seconds, bool let_go) {
  LaidKnot& k = t.knot;
  std::vector<Pull> pull{{k.tail_a(), {}}, {k.tail_b(), {}}};
  std::vector<Hold> hold(k.rod.empty() ? 2 : 0);
  if (!hold.empty()) hold[0].node = k.load_a, hold[1].node = k.load_b;
  for (Hold& h : hold) h.from = h.to = k.state.position(h.node), h.stiffness = 500;
  const int ticks = static_cast<int>(std::lround(seconds * 1000)), release = let_go ? 50 : 0;
  for (int i = 0; i < ticks + release; ++i) {
    const float on = std::min(1.0f, static_cast<float>(i) / 50),
                off = let_go ? std::min(1.0f, static_cast<float>(ticks + release - i) / 50) : 1.0f;
    const float side = drawing == Drawing::uncrossed ? -1.0f : 1.0f, force = side * tails * on * off;
    // One strand is kept tight at 2.5 times the pull; the other is only wound on it.
    const bool tense = drawing == Drawing::under_tension;
    pull[0].force = k.tail_direction_a * (tense ? 2.5f * force : force);
    pull[1].force = k.tail_direction_b * (tense ? 0.05f * force : force);
    Surroundings around;
    around.pulls = pull, around.holds = hold, around.tools = k.rod;
    t.stepper.step(settings, k.state, around);
  }
}

Holding pull_apart(const Settings& settings, Tightened& t, float tails, float speed, float limit, float distance_limit) {
  const LaidKnot& k = t.knot;
  std::vector<Hold> hold(2);
  hold[0].node = k.load_a, hold[1].node = k.load_b;
  for (Hold& h : hold) h.from = h.to = k.state.position(h.node);
  const std::vector<Pull> pull{{k.tail_a(), k.tail_direction_a * tails}, {k.tail_b(), k.tail_direction_b * tails}};
  Holding result;
  const float step = 0.5f * speed * 1e-3f;
  const int ticks = static_cast<int>(distance_limit / (2 * step));
  double sum = 0;
  float recent = 0;
  for (int i = 0; i < ticks; ++i) {
    for (Hold& h : hold) h.from = h.to;
    hold[0].to.x -= step, hold[1].to.x += step;
    Surroundings around;
    around.holds = hold, around.pulls = pull;
    t.stepper.step(settings, t.knot.state, around);
    const float force = 0.5f * (hold[1].force.x - hold[0].force.x);
    recent += (force - recent) / 5;  // mean over about 5 ms
    result.peak = std::max(result.peak, recent);
    if (i >= ticks / 4) sum += double{force};
    result.slip = 2 * step * static_cast<float>(i + 1);
    if (recent > limit) {
      result.held = true;
      result.mean = limit;
      return result;
    }
  }
  result.mean = static_cast<float>(sum / (ticks - ticks / 4));
  return result;
}

double creep(const Settings& settings, Tightened& t, float load, double seconds, double window) {
  const LaidKnot& k = t.knot;
  std::vector<Pull> pull{{k.load_a, {}}, {k.load_b, {}}};
  const int ticks = static_cast<int>(seconds * 1000), last = static_cast<int>(window * 1000);
  double before = 0;
  auto apart = [&] {
    const Vec3 whole = k.state.x.at(k.load_b) - k.state.x.at(k.load_a),
               rest = k.state.fine.at(k.load_b) - k.state.fine.at(k.load_a);
    return double{whole.x} + double{rest.x};
  };
  for (int i = 0; i < ticks; ++i) {
    const float now = load * std::min(1.0f, 0.1f + static_cast<float>(i) / 100);
    pull[0].force = {-now, 0, 0}, pull[1].force = {now, 0, 0};
    Surroundings around;
    around.pulls = pull;
    t.stepper.step(settings, t.knot.state, around);
    if (i + 1 == ticks - last) before = apart();
  }
  return (apart() - before) / window;
}

std::vector<Vec3> closed_curve(const LaidKnot& k) {
  std::vector<Vec3> p;
  for (size_t i = 0; i < k.state.nodes(); ++i) {
    p.push_back(k.state.position(i));
    if (i == k.load_a) p.push_back(p.back() + Vec3{0, 0, -0.1f}), p.push_back(k.state.position(k.load_b) + Vec3{0, 0, -0.1f});
  }
  return thread::close_curve(p, k.tail_direction_a, k.tail_direction_b);
}

Shaken shake(const Settings& settings, Tightened& t, int cycles, float speed, float load) {
  constexpr float kReach = 5e-3f;  // [m] to each side
  const LaidKnot& k = t.knot;
  Shaken result;
  // Every pair is looked at in every substep. The determinant does not tell: where slack swings round a held end, it changes.
  Settings fine = settings;
  fine.substeps = 1;
  std::vector<Place> before = places(k.state);
  Hold hold[4];
  hold[0].node = k.load_b, hold[1].node = k.tail_a(), hold[2].node = k.tail_b(), hold[3].node = k.load_a;
  for (Hold& h : hold) h.from = h.to = k.state.position(h.node);
  hold[1].stiffness = hold[2].stiffness = 200, hold[3].stiffness = 1000;
  const float stretch = load / hold[3].stiffness, start = hold[3].to.x;
  const Vec3 center = hold[0].to;
  const int ticks = settings.substeps * static_cast<int>(std::ceil(2 * kPi * kReach / speed * 1000));
  for (int i = 0; i < cycles * ticks; ++i) {
    const Vec3 way[] = {{0, 0, 1}, {0, 1, 0}, {1, 0, 0}};
    const float angle = 2 * kPi * static_cast<float>(i % ticks + 1) / static_cast<float>(ticks);
    hold[0].from = hold[0].to;
    hold[0].to = center + way[i / ticks % 3] * (kReach * std::sin(angle));
    hold[3].from = hold[3].to;
    hold[3].to.x = start - stretch * std::min(1.0f, static_cast<float>(i / settings.substeps) / 100);
    Surroundings around;
    around.holds = hold;
    t.stepper.step(fine, t.knot.state, around);
    std::vector<Place> after = places(k.state);
    result.passes += count_passes(before, after, k.state.broken);
    before = std::move(after);
    for (size_t c = 0; c < k.state.key.size(); ++c)
      if (k.state.crossing[c].normal_impulse > 0)
        result.nearest = std::min(result.nearest, 1 + k.state.crossing[c].gap / settings.material.diameter);
  }
  return result;
}

}  // namespace catgut::validation
