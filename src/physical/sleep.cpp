// SPDX-License-Identifier: Apache-2.0
// physical/sleep: see the header.
#include "physical/sleep.h"

#include <algorithm>
#include <cmath>

#include "physical/physical.h"

namespace catgut::physical {
namespace {

constexpr float kMargin = 0.6e-3f;    // [m] a tool that moves wakes a thread that it may touch within this distance
constexpr float kQuietSpeed = 2e-3f;  // [m/s] at the end of the window: a swing that returns is not rest
constexpr float kAway = 12e-3f;       // [m] corners of a face that the thread may touch are nearer than this
constexpr size_t kBlock = 8;          // nodes that share a bound

Vec3 mid(const wall::State& w, uint32_t column) { return wall::vec3(w.motion.x[2 * column]); }
Vec3 director(const wall::State& w, uint32_t column) { return wall::vec3(w.motion.x[2 * column + 1]); }

float to_segment(Vec3 p, Vec3 a, Vec3 b) {
  const Vec3 d = b - a;
  const float d2 = length2(d), at = d2 > 0 ? std::clamp(dot(p - a, d) / d2, 0.0f, 1.0f) : 0.0f;
  return distance(p, a + d * at);
}

// Calls visit(first node of a block, its last node, length of thread [m] from the first one to any other).
template <typename Visit>
bool any_block(const thread::State& t, Visit visit) {
  for (size_t first = 0; first < t.nodes(); first += kBlock) {
    const size_t last = std::min(first + kBlock, t.nodes() - 1);
    float reach = 0;
    for (size_t i = first; i < last; ++i) reach += t.broken[i] ? distance(t.x.at(i), t.x.at(i + 1)) : 1.05f * t.rest[i];
    if (visit(first, last, reach)) return true;
  }
  return false;
}

bool touches(const thread::State& t, Vec3 a, Vec3 b, float reach) {
  return any_block(t, [&](size_t first, size_t last, float around) {
    if (to_segment(t.x.at(first), a, b) > around + reach) return false;
    for (size_t i = first; i <= last; ++i) {
      const float half = 0.55f * std::max(i < t.segments() ? t.rest[i] : 0.0f, i > 0 ? t.rest[i - 1] : 0.0f);
      if (to_segment(t.x.at(i), a, b) < half + reach) return true;
    }
    return false;
  });
}

// Where the wall is, and how far each column may move until it could touch the thread.
void note_wall(const Model& m, State& s) {
  Sleep& z = s.sleep;
  const uint32_t columns = wall::columns(s.wall);
  z.wall.resize(2 * columns), z.may_move.resize(columns);
  for (uint32_t c = 0; c < columns; ++c) {
    z.wall[2 * c] = mid(s.wall, c), z.wall[2 * c + 1] = director(s.wall, c);
    float far = 1;
    any_block(s.thread, [&](size_t first, size_t, float around) {
      far = std::min(far, distance(s.thread.x.at(first), z.wall[2 * c]) - around);
      return false;
    });
    z.may_move[c] = std::max(m.sleep.nearby, 0.3f * (far - kAway));
  }
}

}  // namespace

void reserve(const State& s, Sleep& z) {
  const size_t nodes = s.thread.nodes(), columns = wall::columns(s.wall), room = columns + columns / 3 + 64;
  z.from.reserve(nodes), z.tension.reserve(nodes), z.load.reserve(2 * room), z.wall.reserve(2 * room);
  z.may_move.reserve(room), z.hold.reserve(2 * 256), z.tool.reserve(4 * kMaxThreadCapsules);
}

void wake(Sleep& z) {
  z.asleep = false, z.quiet = 0;
  z.load.clear(), z.wall.clear(), z.may_move.clear(), z.hold.clear(), z.tool.clear();
}

bool sleeps_on(const Model& m, const State& s, const Hands& hands, std::span<const thread::Hold> holds,
               std::span<const thread::ToolCapsule> tools) {
  const Sleep& z = s.sleep;
  const thread::State& t = s.thread;
  const uint32_t columns = wall::columns(s.wall);
  const float touched2 = m.sleep.touched * m.sleep.touched;
  if (!m.sleep.on || !hands.pulls.empty() || t.travel > 1e8f) return false;  // pulled, cut, or a tool was put elsewhere
  if (z.wall.size() != 2 * columns || z.hold.size() != 2 * holds.size() || z.tool.size() != 4 * tools.size()) return false;
  for (size_t i = 0; i < holds.size(); ++i)
    if (length2(holds[i].to - z.hold[2 * i]) > touched2) return false;
  for (uint32_t c = 0; c < columns; ++c) {
    const float most2 = z.may_move[c] * z.may_move[c];
    if (length2(mid(s.wall, c) - z.wall[2 * c]) > most2 || length2(director(s.wall, c) - z.wall[2 * c + 1]) > most2)
      return false;
  }
  for (size_t i = 0; i < tools.size(); ++i) {
    const thread::ToolCapsule& c = tools[i];
    if (length2(c.to_a - z.tool[4 * i]) <= touched2 && length2(c.to_b - z.tool[4 * i + 1]) <= touched2) continue;
    const float step = std::max(distance(c.a, c.to_a), distance(c.b, c.to_b));
    if (touches(t, c.to_a, c.to_b, c.radius + 0.5f * m.thread.material.diameter + kMargin + step)) return false;
  }
  return true;
}

void hold_still(const Sleep& z, wall::State& wall, wall::Scratch& k, std::span<thread::Hold> holds,
                std::span<thread::ToolCapsule> tools) {
  for (size_t i = 0; i < holds.size(); ++i) holds[i].force = z.hold[2 * i + 1];
  for (size_t i = 0; i < tools.size(); ++i) tools[i].force_a = z.tool[4 * i + 2], tools[i].force_b = z.tool[4 * i + 3];
  if (z.load.empty()) return;
  std::fill(k.external.begin(), k.external.end(), wall::Float4{});
  for (const Sleep::Load& load : z.load) k.external[load.at] = wall::float4(load.impulse);
  wall::apply_impulses(wall, k, k.external);
  std::fill(k.external.begin(), k.external.end(), wall::Float4{});
}

bool has_been_quiet(const Model& m, State& s, const Hands& hands) {
  Sleep& z = s.sleep;
  const thread::State& t = s.thread;
  if (!m.sleep.on || !hands.pulls.empty() || t.travel > 1e8f) return z.quiet = 0, false;
  const bool begun = z.quiet > 0 && z.from.size() == t.nodes();
  if (begun && ++z.quiet <= m.sleep.window) return false;
  bool quiet = begun;
  for (size_t i = 0; i < t.nodes() && quiet; ++i)
    quiet = length2(t.position(i) - z.from[i]) <= m.sleep.still * m.sleep.still && length(t.v.at(i)) < kQuietSpeed;
  for (size_t i = 0; i < t.segments() && quiet; ++i)
    quiet = std::abs(t.tension[i] - z.tension[i]) <= m.sleep.steady + 0.01f * std::abs(z.tension[i]);
  if (quiet) return true;
  z.quiet = 1;  // a new window
  z.from.resize(t.nodes());
  for (size_t i = 0; i < t.nodes(); ++i) z.from[i] = t.position(i);
  z.tension.assign(t.tension.begin(), t.tension.end());
  return false;
}

void after_cut(const Model& m, State& s) {
  if (!s.sleep.asleep) return;
  if (s.sleep.load.empty()) note_wall(m, s);  // columns may have other numbers now
  else wake(s.sleep);
}

void fall_asleep(const Model& m, State& s, const wall::Coupling& coupling, wall::Scratch& k,
                 std::span<const thread::Hold> holds, std::span<const thread::ToolCapsule> tools) {
  wake(s.sleep);
  Sleep& z = s.sleep;
  z.asleep = true;
  note_wall(m, s);
  const uint32_t columns = wall::columns(s.wall);
  coupling.spread(k.external);
  for (uint32_t i = 0; i < 2 * columns; ++i) {
    const Vec3 impulse = wall::vec3(k.external[i]);
    if (impulse == Vec3{}) continue;
    z.load.push_back({i, impulse});
    z.may_move[i / 2] = m.sleep.touched;
  }
  std::fill(k.external.begin(), k.external.end(), wall::Float4{});
  for (const thread::Hold& hold : holds) z.hold.push_back(hold.to), z.hold.push_back(hold.force);
  for (const thread::ToolCapsule& tool : tools)
    for (const Vec3 v : {tool.to_a, tool.to_b, tool.force_a, tool.force_b}) z.tool.push_back(v);
  for (thread::Column* v : {&s.thread.v.x, &s.thread.v.y, &s.thread.v.z}) std::fill(v->begin(), v->end(), 0.0f);
}

}  // namespace catgut::physical
