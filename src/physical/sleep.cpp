// SPDX-License-Identifier: Apache-2.0
// physical/sleep: see the header.
#include "physical/sleep.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "geometry/closest.h"
#include "physical/carry.h"
#include "physical/physical.h"
#include "physical/quiet.h"

namespace catgut::physical {
namespace {

constexpr uint32_t kLook = 50;         // [steps] after which it is looked at again within its window
constexpr float kIntoDrape = 0.1e-3f;  // [m] by which the wall may press a tail into the drape
constexpr float kAway = 12e-3f;        // [m] corners of a face that the thread may touch are nearer than this
constexpr size_t kBlock = 8;           // nodes that share a bound

Vec3 mid(const wall::State& w, uint32_t column) { return wall::vec3(w.motion.x[2 * column]); }
Vec3 director(const wall::State& w, uint32_t column) { return wall::vec3(w.motion.x[2 * column + 1]); }

float to_segment(Vec3 p, Vec3 a, Vec3 b) { return distance(p, lerp(a, b, closest_on_segment(p, a, b))); }

// Calls visit(first node of a block, its last node, length of thread [m] from the first one to any other).
template <typename Visit>
bool any_block(const thread::State& t, const Sleep::Strand& strand, Visit visit) {
  for (size_t first = strand.first; first <= strand.last; first += kBlock) {
    const size_t last = std::min(first + kBlock, size_t{strand.last});
    float reach = 0;
    for (size_t i = first; i < last; ++i) reach += 1.05f * t.rest[i];
    if (visit(first, last, reach)) return true;
  }
  return false;
}

// Half a segment beside a node: nothing of the strand is farther from its nearest node.
float half_at(const thread::State& t, size_t i) {
  return 0.55f * std::max(i < t.segments() ? t.rest[i] : 0.0f, i > 0 ? t.rest[i - 1] : 0.0f);
}

AwakeThread::Box box_of(const thread::State& t, const Sleep::Strand& strand) {
  AwakeThread::Box box{t.x.at(strand.first), t.x.at(strand.first)};
  float half = 0;
  for (size_t i = strand.first; i <= strand.last; ++i) {
    const Vec3 p = t.x.at(i);
    box.low = {std::min(box.low.x, p.x), std::min(box.low.y, p.y), std::min(box.low.z, p.z)};
    box.high = {std::max(box.high.x, p.x), std::max(box.high.y, p.y), std::max(box.high.z, p.z)};
    half = std::max(half, half_at(t, i));
  }
  const Vec3 around{half, half, half};
  return {box.low - around, box.high + around};
}
bool apart(const AwakeThread::Box& a, const AwakeThread::Box& b, float reach) {
  return a.low.x > b.high.x + reach || b.low.x > a.high.x + reach || a.low.y > b.high.y + reach || b.low.y > a.high.y + reach ||
         a.low.z > b.high.z + reach || b.low.z > a.high.z + reach;
}

// How far [m] thread reaches beyond its axis: what it may touch in this step or the next.
struct Reach {
  float still, seconds;
  float of(float speed) const { return still + seconds * speed; }
};
Reach reach_of(const Model& m, float share) {
  return {share * (m.thread.material.diameter + kToolMargin), 2 * share * m.wall.step};
}
float fastest(const thread::State& t, size_t first, size_t last) {
  float speed2 = 0;
  for (size_t i = first; i <= last; ++i) speed2 = std::max(speed2, length2(t.v.at(i)));
  return std::sqrt(speed2);
}

// Whether strand a, which moves, may touch strand b.
bool near(const thread::State& t, const Sleep::Strand& a, const Sleep::Strand& b, Reach reach) {
  return any_block(t, a, [&](size_t a_first, size_t a_last, float a_around) {
    const float most = reach.of(fastest(t, a_first, a_last));
    return any_block(t, b, [&](size_t b_first, size_t b_last, float b_around) {
      if (distance(t.x.at(a_first), t.x.at(b_first)) > a_around + b_around + most) return false;
      for (size_t i = a_first; i <= a_last; ++i) {
        // A segment is as fast as the faster one of its nodes.
        const float far = half_at(t, i) + reach.of(fastest(t, i > a_first ? i - 1 : i, std::min(i + 1, a_last)));
        for (size_t j = b_first; j <= b_last; ++j)
          if (distance(t.x.at(i), t.x.at(j)) < far + half_at(t, j)) return true;
      }
      return false;
    });
  });
}

// Steps of a strand's window before its impulses are noted, and those in which they were noted so far.
uint32_t steps_before(const SleepModel& m) { return m.window > kLook ? m.window - kLook : 0; }
uint32_t steps_noted(const SleepModel& m, const Sleep::Strand& strand) {
  const uint32_t before = steps_before(m);
  return strand.quiet > before ? strand.quiet - before : 0;
}

// A list whose entries name their strands, without those of one strand.
template <typename Entries>
void forget(Entries& entries, uint32_t strand) {
  std::erase_if(entries, [&](const auto& e) { return e.strand == strand; });
}

constexpr float kPart = 0.3f;      // of the distance of its faces from the strand, by which a column may move
constexpr float kWatched = 5e-3f;  // [m] beyond kAway: columns nearer than that are watched one by one

// How far [m] a column is from being near a strand.
float away_from(const State& s, const Sleep::Strand& strand, uint32_t column) {
  float far = 1;
  const Vec3 at = mid(s.wall, column);
  any_block(s.thread, strand, [&](size_t first, size_t, float around) {
    far = std::min(far, distance(s.thread.x.at(first), at) - around);
    return false;
  });
  return far - kAway;
}

void wake_one(const Model& m, State& s, uint32_t strand) {
  Sleep& z = s.sleep;
  if (is_carried(s, strand)) wake_carried(m, s, strand);
  if (z.strand[strand].asleep) s.thread.travel = std::max(s.thread.travel, 1.0f);  // its pairs are listed again
  z.strand[strand].asleep = false, z.strand[strand].quiet = 0, z.strand[strand].loop = 0;
  forget(z.load, strand), forget(z.watched, strand), forget(z.held, strand), forget(z.touched, strand);
}

// The strands of the thread. Those that are what they were sleep on.
void list_strands(const Model& m, State& s) {
  Sleep& z = s.sleep;
  const thread::State& t = s.thread;
  const uint32_t n = static_cast<uint32_t>(t.nodes());
  size_t k = 0;
  bool same = !z.strand.empty() && z.from.size() == n;
  uint32_t first = 0;
  for (uint32_t i = 0; i < n && same; ++i) {
    if (i + 1 < n && !t.broken[i]) continue;
    same = k < z.strand.size() && z.strand[k].first == first && z.strand[k].last == i;
    ++k, first = i + 1;
  }
  if (same && k == z.strand.size()) return;
  wake(m, s);
  z.strand.clear(), first = 0;
  for (uint32_t i = 0; i < n; ++i) {
    if (i + 1 < n && !t.broken[i]) continue;
    z.strand.push_back({first, i}), first = i + 1;
  }
  z.from.resize(n), z.tension.resize(t.segments());
}

// How far [m] the faces of each column are from touching a strand; more than kWatched: 1.
void find_room(const Model& m, const State& s, const Sleep::Strand& strand, std::vector<float>& room) {
  const float off = 0.6f * m.wall.laminate.thickness + 0.5f * m.thread.material.diameter;  // of the mid-surface
  room.assign(wall::columns(s.wall), 1);
  for (const wall::BlockCorners& block : s.wall.topology.corners)
    for (size_t lane = 0; lane < wall::kLanesOfBlock; ++lane) {
      std::array<uint32_t, 4> column;
      std::array<Vec3, 4> p;
      for (size_t k = 0; k < 4; ++k) column[k] = block.column[k][lane], p[k] = mid(s.wall, column[k]);
      const Vec3 middle = 0.25f * (p[0] + p[1] + p[2] + p[3]);
      float around = 0, far = kWatched + off;
      for (const Vec3 corner : p) around = std::max(around, distance(corner, middle));
      any_block(s.thread, strand, [&](size_t first, size_t last, float reach) {
        if (distance(s.thread.x.at(first), middle) - reach - around > far) return false;
        for (size_t i = first; i <= last; ++i)
          for (const size_t k : {size_t{1}, size_t{2}}) {
            const Vec3 node = s.thread.x.at(i);
            far = std::min(far, distance(node, closest_on_triangle(node, p[0], p[k], p[k + 1]).point));
          }
        return false;
      });
      if (far >= kWatched + off) continue;
      for (const uint32_t c : column) room[c] = std::min(room[c], far - off);
    }
}

// Where the wall near a strand is, and how far each column may move until it could touch the strand.
void note_wall(const Model& m, State& s, uint32_t strand, std::vector<float>& room) {
  Sleep& z = s.sleep;
  forget(z.watched, strand);
  find_room(m, s, z.strand[strand], room);
  for (uint32_t c = 0; c < wall::columns(s.wall); ++c)
    if (away_from(s, z.strand[strand], c) <= kWatched)
      z.watched.push_back({strand, c, mid(s.wall, c), director(s.wall, c), std::max(m.sleep.nearby, kPart * room[c])});
}

// The columns of a strand's holes, at the beginning of its window.
void note_holes(const Model& m, State& s, uint32_t strand) {
  Sleep& z = s.sleep;
  forget(z.watched, strand);
  for (const thread::Eyelet& e : s.thread.eyelet) {
    if (e.segment < z.strand[strand].first || e.segment >= z.strand[strand].last) continue;
    const wall::Weights w = wall::weights(m.wall, s.wall.topology, s.hole[e.point].place);
    for (const uint32_t c : w.column)
      if (z.watched.size() < z.watched.capacity()) z.watched.push_back({strand, c, mid(s.wall, c), director(s.wall, c), 0});
  }
}

bool sleeps_on(const Model& m, const State& s, uint32_t strand, std::span<const thread::Hold> holds,
               std::span<const thread::ToolCapsule> tools, double wall_moved, AwakeThread& awake) {
  const Sleep& z = s.sleep;
  const Sleep::Strand& me = z.strand[strand];
  const float touched2 = m.sleep.touched * m.sleep.touched;
  if (awake.disturbed[strand]) return false;
  size_t held = 0;
  for (const Sleep::Held& h : z.held) held += h.strand == strand;
  for (const thread::Hold& hold : holds) {
    if (hold.node < me.first || hold.node > me.last) continue;
    const auto known = std::find_if(z.held.begin(), z.held.end(), [&](const Sleep::Held& h) { return h.node == hold.node; });
    if (known == z.held.end() || length2(hold.to - known->to) > touched2) return false;
    --held;
  }
  if (held != 0) return false;
  for (const Sleep::Touched& c : z.touched)
    if (c.strand == strand && (c.tool >= tools.size() || length2(tools[c.tool].to_a - c.a) > touched2 ||
                               length2(tools[c.tool].to_b - c.b) > touched2))
      return false;
  for (uint32_t i = 0; i < tools.size(); ++i) {
    const thread::ToolCapsule& c = tools[i];
    const auto& [box, reach] = awake.tool[i];
    if (apart(box, awake.box[strand], reach) || !touches(s.thread, me, c.to_a, c.to_b, reach)) continue;
    if (std::none_of(z.touched.begin(), z.touched.end(),
                     [&](const Sleep::Touched& t) { return t.strand == strand && t.tool == i; }))
      return false;
  }
  if (wall_moved < awake.far_due[strand]) return true;
  float least = 1;
  const auto watched = [&](uint32_t c) {
    return std::any_of(z.watched.begin(), z.watched.end(),
                       [&](const Sleep::Watched& w) { return w.strand == strand && w.column == c; });
  };
  for (uint32_t c = 0; c < wall::columns(s.wall); ++c)
    if (const float far = away_from(s, me, c); far < least && !watched(c)) least = far;
  awake.far_due[strand] = wall_moved + static_cast<double>(least);
  return least > 0;
}

}  // namespace

bool touches(const thread::State& t, const Sleep::Strand& strand, Vec3 a, Vec3 b, float reach) {
  return any_block(t, strand, [&](size_t first, size_t last, float around) {
    if (to_segment(t.x.at(first), a, b) > around + reach) return false;
    for (size_t i = first; i <= last; ++i) {
      const float half = 0.55f * std::max(i < t.segments() ? t.rest[i] : 0.0f, i > 0 ? t.rest[i - 1] : 0.0f);
      if (to_segment(t.x.at(i), a, b) < half + reach) return true;
    }
    return false;
  });
}

bool Sleep::any() const {
  return std::any_of(strand.begin(), strand.end(), [](const Strand& k) { return k.asleep; });
}
bool Sleep::all() const {
  return !strand.empty() && std::all_of(strand.begin(), strand.end(), [](const Strand& k) { return k.asleep; });
}
bool Sleep::at(uint32_t node) const {
  const auto after = std::partition_point(strand.begin(), strand.end(), [&](const Strand& k) { return k.last < node; });
  return after != strand.end() && after->asleep;
}

void reserve(const State& s, Sleep& z) {
  const size_t nodes = s.thread.nodes(), columns = wall::columns(s.wall);
  z.from.reserve(nodes), z.tension.reserve(nodes), z.strand.reserve(nodes);
  z.load.reserve(8 * columns + 64), z.watched.reserve(16 * columns + 64), z.held.reserve(256), z.touched.reserve(1024);
}

void wake(const Model& m, State& s) {
  Sleep& z = s.sleep;
  for (uint32_t k = 0; k < z.strand.size(); ++k)
    if (is_carried(s, k)) wake_carried(m, s, k);
  if (z.any()) s.thread.travel = std::max(s.thread.travel, 1.0f);  // its pairs are listed again
  for (Sleep::Strand& k : z.strand) k.asleep = false, k.quiet = 0, k.loop = 0;
  z.load.clear(), z.watched.clear(), z.held.clear(), z.touched.clear();
}

void wake_strands(const Model& m, State& s, const Hands& hands, std::span<const thread::Hold> holds,
                  std::span<const thread::ToolCapsule> tools, double wall_moved, AwakeThread& awake) {
  Sleep& z = s.sleep;
  const uint32_t holes = static_cast<uint32_t>(s.thread.eyelet.size());
  list_strands(m, s);
  // Pulled, cut, laced, or a tool was put elsewhere.
  if (!m.sleep.on || !hands.pulls.empty() || s.thread.travel > 1e8f || holes != z.holes) wake(m, s);
  z.holes = holes;
  if (!z.any()) {
    awake.boxed.clear();
    return;
  }
  const uint32_t n = static_cast<uint32_t>(z.strand.size());
  if (awake.far_due.size() != n) awake.far_due.assign(n, -1);
  awake.box.resize(n), awake.carry.assign(n, {});
  for (size_t i = 0; i < z.watched.size();) {  // those of a strand stand together
    const uint32_t k = z.watched[i].strand;
    const size_t first = i;
    while (i < z.watched.size() && z.watched[i].strand == k) ++i;
    if (!is_carried(s, k)) continue;
    awake.carry[k] = carry_of(m.sleep, std::span(z.watched).subspan(first, i - first), s.wall, k);
    carry(m, s, k, awake.carry[k]);
  }
  // A strand that sleeps where it lies keeps its box.
  awake.boxed.resize(n);
  for (uint32_t k = 0; k < n; ++k) {
    const Sleep::Strand& strand = z.strand[k];
    const bool lies = strand.asleep && !is_carried(s, k);
    if (!lies || awake.boxed[k].first != strand.first || awake.boxed[k].last != strand.last)
      awake.box[k] = box_of(s.thread, strand);
    awake.boxed[k] = lies ? strand : Sleep::Strand{1, 0};
  }
  awake.disturbed.assign(n, 0);
  for (const Sleep::Watched& w : z.watched) {
    const Carry& by = awake.carry[w.strand];
    const bool loads = by.moves() && w.may_move < m.sleep.nearby;
    const float slack = z.strand[w.strand].loop > 0 ? m.sleep.slack_strain : 0;
    const float most = std::max(loads ? m.sleep.strain : w.may_move, slack), most2 = most * most;
    if (w.column >= wall::columns(s.wall) || length2(mid(s.wall, w.column) - by.place(w.mid)) > most2 ||
        length2(director(s.wall, w.column) - rotate(by.turn, w.director)) > most2)
      awake.disturbed[w.strand] = 1;
  }
  for (uint32_t k = 0; k < n && hands.plane; ++k) {  // carried down onto the drape
    const float touching = 0.5f * m.thread.material.diameter;
    const auto above = [&](size_t first, size_t last, float height) {
      return is_above(s.thread, first, last, *hands.plane, height);
    };
    const Sleep::Strand& strand = z.strand[k];
    if (!awake.carry[k].moves() || above(strand.first, strand.last, touching)) continue;
    const auto [low, high] = without_tails(s.thread, strand);
    if (!above(low, high, touching) || !above(strand.first, strand.last, touching - kIntoDrape)) awake.disturbed[k] = 1;
  }
  // Of two that sleep beside each other the walls have moved differently.
  for (uint32_t a = 0; a < n; ++a)
    for (uint32_t b = 0; b < a; ++b) {
      const Carry &by_a = awake.carry[a], &by_b = awake.carry[b];
      if (!z.strand[a].asleep || !z.strand[b].asleep || (!by_a.moves() && !by_b.moves())) continue;
      if (apart(awake.box[a], awake.box[b], m.thread.material.diameter + kToolMargin)) continue;
      const Vec3 at = 0.5f * (awake.box[a].low + awake.box[a].high);
      const float most = z.strand[a].loop > 0 && z.strand[b].loop > 0 ? m.sleep.slack_strain : m.sleep.nearby;
      if (length2(by_a.before(at) - by_b.before(at)) > most * most) awake.disturbed[a] = awake.disturbed[b] = 1;
    }
  for (uint32_t k = 0; k < n; ++k)  // a loop without slack would be taut now
    if (const float loop = z.strand[k].asleep ? z.strand[k].loop : 0; loop > 0 && loop_length(m, s, k) > loop + m.sleep.longer)
      awake.disturbed[k] = 1;
  awake.tool.clear();
  for (const thread::ToolCapsule& c : tools) {
    const float step = std::max(distance(c.a, c.to_a), distance(c.b, c.to_b));
    const AwakeThread::Box box{{std::min(c.to_a.x, c.to_b.x), std::min(c.to_a.y, c.to_b.y), std::min(c.to_a.z, c.to_b.z)},
                               {std::max(c.to_a.x, c.to_b.x), std::max(c.to_a.y, c.to_b.y), std::max(c.to_a.z, c.to_b.z)}};
    awake.tool.push_back({box, c.radius + 0.5f * m.thread.material.diameter + kToolMargin + step});
  }
  for (uint32_t k = 0; k < n; ++k)
    if (z.strand[k].asleep && !sleeps_on(m, s, k, holds, tools, wall_moved, awake)) wake_one(m, s, k);
  for (bool more = true; more;) {
    more = false;
    for (uint32_t a = 0; a < n; ++a) {
      if (z.strand[a].asleep) continue;
      const Reach reach = reach_of(m, 1);
      const float most = reach.of(fastest(s.thread, z.strand[a].first, z.strand[a].last));
      for (uint32_t b = 0; b < n; ++b) {
        if (!z.strand[b].asleep || apart(awake.box[a], awake.box[b], most)) continue;
        if (near(s.thread, z.strand[a], z.strand[b], reach)) wake_one(m, s, b), more = true;
      }
    }
  }
  // A piece that broke off may be too short for a thread (thread::make_state): it takes others along.
  uint32_t nodes = 0;
  for (const Sleep::Strand& k : z.strand) nodes += k.asleep ? 0 : k.last - k.first + 1;
  if (nodes > 0 && nodes < thread::kLeastNodes) wake(m, s);
}

void press_asleep(const Sleep& z, const AwakeThread& awake, wall::State& wall, wall::Scratch& k) {
  if (z.load.empty() || !z.any()) return;
  std::fill(k.external.begin(), k.external.end(), wall::Float4{});
  for (const Sleep::Load& load : z.load)
    if (z.strand[load.strand].asleep)
      k.external[load.at] = wall::float4(wall::vec3(k.external[load.at]) + rotate(awake.carry[load.strand].turn, load.impulse));
  wall::apply_impulses(wall, k, k.external);
  std::fill(k.external.begin(), k.external.end(), wall::Float4{});
}

void hold_asleep(const Sleep& z, std::span<thread::Hold> holds, std::span<thread::ToolCapsule> tools) {
  if (z.all()) {  // nothing was stepped
    for (thread::Hold& hold : holds) hold.force = {};
    for (thread::ToolCapsule& tool : tools) tool.force_a = tool.force_b = {};
  }
  for (const Sleep::Held& h : z.held)
    for (thread::Hold& hold : holds)
      if (hold.node == h.node) hold.force = h.force;
  for (const Sleep::Touched& t : z.touched) tools[t.tool].force_a += t.force_a, tools[t.tool].force_b += t.force_b;
}

bool find_quiet(const Model& m, State& s, const Hands& hands, std::span<const thread::Hold> holds,
                std::span<const thread::ToolCapsule> tools, AwakeThread& awake) {
  Sleep& z = s.sleep;
  const thread::State& t = s.thread;
  awake.ready.assign(z.strand.size(), 0);
  const bool disturbed = !m.sleep.on || !hands.pulls.empty() || t.travel > 1e8f;
  bool any = false;
  for (uint32_t k = 0; k < z.strand.size(); ++k) {
    Sleep::Strand& strand = z.strand[k];
    if (strand.asleep) continue;
    if (disturbed) {
      strand.quiet = 0, forget(z.load, k);
      continue;
    }
    const bool begun = strand.quiet > 0;
    if (begun && ++strand.quiet <= m.sleep.window && strand.quiet % kLook != 0) continue;
    bool quiet = begun && is_quiet(m, s, k, {});
    if (begun && !quiet && only_in_wall(m, s, strand, holds, tools, hands.plane))
      if (const Carry by = carry_of(m.sleep, z.watched, s.wall, k); by.strain <= m.sleep.slack_strain)
        quiet = (by.strain <= m.sleep.strain && is_quiet(m, s, k, by)) || is_slack_and_quiet(m, s, k, by);
    if (quiet && strand.quiet <= m.sleep.window) continue;
    awake.ready[k] = quiet, any |= quiet;
    if (quiet) continue;
    strand.quiet = 1, forget(z.load, k);  // a new window
    for (size_t i = strand.first; i <= strand.last; ++i) z.from[i] = t.position(i);
    for (size_t i = strand.first; i < strand.last; ++i) z.tension[i] = t.tension[i];
    note_holes(m, s, k);
  }
  // A strand beside one that moves waits for it.
  for (bool more = any; more;) {
    more = false;
    for (uint32_t a = 0; a < z.strand.size(); ++a) {
      if (z.strand[a].asleep || awake.ready[a]) continue;
      const Reach reach = reach_of(m, 1.5f);
      for (uint32_t b = 0; b < z.strand.size(); ++b)
        if (awake.ready[b] && near(t, z.strand[a], z.strand[b], reach)) awake.ready[b] = 0, more = true;
    }
  }
  return std::any_of(awake.ready.begin(), awake.ready.end(), [](uint8_t r) { return r != 0; });
}

void after_cut(const Model& m, State& s) {
  Sleep& z = s.sleep;
  std::vector<float> room;
  if (std::any_of(z.load.begin(), z.load.end(), [&](const Sleep::Load& l) { return z.strand[l.strand].asleep; })) wake(m, s);
  for (uint32_t k = 0; k < z.strand.size(); ++k) {  // columns may have other numbers now
    if (z.strand[k].asleep) note_wall(m, s, k, room);
    else forget(z.watched, k), forget(z.load, k), z.strand[k].quiet = 0;
  }
}

void note_loads(const Model& m, State& s, wall::Coupling& coupling, wall::Scratch& k, AwakeThread& awake,
                std::span<const thread::SoftContact> contacts) {
  Sleep& z = s.sleep;
  const uint32_t columns = wall::columns(s.wall);
  for (uint32_t strand = 0; strand < z.strand.size(); ++strand) {
    Sleep::Strand& me = z.strand[strand];
    if (me.asleep || steps_noted(m.sleep, me) == 0) continue;
    if (z.load.size() + 2 * columns > z.load.capacity()) {  // without room it stays awake
      me.quiet = 0, forget(z.load, strand);
      continue;
    }
    const auto has = [&](uint32_t node) { return node >= me.first && node <= me.last; };
    awake.impulse.assign(coupling.impulse.begin(), coupling.impulse.end());
    std::fill(coupling.impulse.begin(), coupling.impulse.end(), Vec3{});
    for (const thread::Eyelet& e : s.thread.eyelet)
      if (has(e.segment) && awake.point_of[e.point] != wall::kNone)
        coupling.impulse[awake.point_of[e.point]] = awake.impulse[awake.point_of[e.point]];
    for (const thread::SoftContact& c : contacts)
      if (has(c.node)) coupling.impulse[c.point] = awake.impulse[c.point];
    coupling.spread(k.external);
    std::copy(awake.impulse.begin(), awake.impulse.end(), coupling.impulse.begin());
    awake.load_at.assign(2 * columns, wall::kNone);
    bool first = true;
    for (uint32_t i = 0; i < z.load.size(); ++i)
      if (z.load[i].strand == strand) awake.load_at[z.load[i].at] = i, first = false;
    for (uint32_t i = 0; i < 2 * columns; ++i) {
      const Vec3 impulse = wall::vec3(k.external[i]);
      if (impulse == Vec3{}) continue;
      if (first) me.quiet = steps_before(m.sleep) + 1;  // a state from before this was noted
      first = false;
      if (awake.load_at[i] == wall::kNone) z.load.push_back({strand, i, impulse});
      else z.load[awake.load_at[i]].impulse += impulse;
    }
    std::fill(k.external.begin(), k.external.end(), wall::Float4{});
  }
}

void fall_asleep(const Model& m, State& s, AwakeThread& awake, std::span<const thread::Hold> holds,
                 std::span<const thread::ToolCapsule> tools) {
  Sleep& z = s.sleep;
  const thread::State& t = s.thread;
  const float newtons = 1 / (m.thread.substep * m.thread.substep);
  for (uint32_t strand = 0; strand < z.strand.size(); ++strand) {
    const uint32_t columns = wall::columns(s.wall);
    // Without room for what it would remember it stays awake.
    const auto full = [](const auto& list, size_t more) { return list.size() + more > list.capacity(); };
    Sleep::Strand& me = z.strand[strand];
    const uint32_t noted = steps_noted(m.sleep, me);
    if (!awake.ready[strand] || noted == 0 || full(z.watched, columns) || full(z.held, holds.size()) ||
        full(z.touched, tools.size()))
      continue;
    me.asleep = true, me.loop = is_slack(m, t, me) && has_knot(t, me) ? loop_length(m, s, strand) : 0;
    if (strand < awake.far_due.size()) awake.far_due[strand] = -1;
    const auto has = [&](uint32_t node) { return node >= me.first && node <= me.last; };
    forget(z.watched, strand);
    const size_t remembered = z.watched.size();
    note_wall(m, s, strand, awake.room);
    for (size_t i = me.first; i <= me.last; ++i) z.from[i] = t.position(i);
    // The mean of its last steps: nodes beside each other take turns in pressing.
    awake.load_at.assign(2 * columns, wall::kNone);
    for (uint32_t i = 0; i < z.load.size(); ++i)
      if (z.load[i].strand == strand)
        z.load[i].impulse = z.load[i].impulse / static_cast<float>(noted), awake.load_at[z.load[i].at] = i;
    for (size_t i = remembered; i < z.watched.size(); ++i) {
      const uint32_t at = 2 * z.watched[i].column;
      if (awake.load_at[at] != wall::kNone || awake.load_at[at + 1] != wall::kNone) z.watched[i].may_move = m.sleep.touched;
    }
    for (const thread::Hold& hold : holds)
      if (has(hold.node)) z.held.push_back({strand, hold.node, hold.to, hold.force});
    for (uint32_t i = 0; i < tools.size(); ++i) {
      const thread::ToolCapsule& c = tools[i];
      if (!touches(t, me, c.to_a, c.to_b, c.radius + 0.5f * m.thread.material.diameter + 2 * kToolMargin)) continue;
      Sleep::Touched touched{strand, i, c.to_a, c.to_b, {}, {}};
      for (size_t q = 0; q < t.key.size(); ++q) {
        if (thread::partner_of(t.key[q]) != thread::kTool + i || !has(thread::segment_of(t.key[q]))) continue;
        const thread::Crossing& x = t.crossing[q];
        const Vec3 force = (x.normal * x.normal_impulse + x.friction_impulse) * -newtons;
        touched.force_a += force * (1 - x.t), touched.force_b += force * x.t;
      }
      z.touched.push_back(touched);
    }
    for (size_t i = me.first; i <= me.last; ++i) s.thread.v.set(i, {});
  }
}

}  // namespace catgut::physical
