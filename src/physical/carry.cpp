// SPDX-License-Identifier: Apache-2.0
// physical/carry: see the header.
#include "physical/carry.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "physical/physical.h"
#include "physical/rigid_fit.h"

namespace catgut::physical {
namespace {

constexpr float kMoved = 0.5e-6f;   // [m] a strand is not moved for less: its nodes keep all of their bits
constexpr float kColumn = 0.5e-3f;  // [m] nodes nearer than that to a column move as it does

bool in_holes(const thread::State& t, const Sleep::Strand& strand) {
  return std::any_of(t.eyelet.begin(), t.eyelet.end(),
                     [&](const thread::Eyelet& e) { return e.segment >= strand.first && e.segment < strand.last; });
}

}  // namespace

Carry carry_of(const SleepModel& model, std::span<const Sleep::Watched> watched, const wall::State& wall, uint32_t strand) {
  std::array<uint32_t, 512> loaded;  // a small part of them
  size_t found = 0;
  for (uint32_t i = 0; i < watched.size() && found < loaded.size(); ++i)
    if (watched[i].strand == strand && watched[i].may_move < model.nearby) loaded[found++] = i;
  const auto each = [&](auto visit) {
    for (size_t i = 0; i < found; ++i) {
      const Sleep::Watched& w = watched[loaded[i]];
      visit(w.mid, w.director, wall::vec3(wall.motion.x[2 * w.column]), wall::vec3(wall.motion.x[2 * w.column + 1]));
    }
  };
  Carry c;
  float count = 0;
  bool moved = false;
  each([&](Vec3 mid, Vec3 director, Vec3 mid_now, Vec3 director_now) {
    c.from += mid, c.to += mid_now, ++count;
    moved |= !(mid == mid_now) || !(director == director_now);
  });
  if (count < 3) {
    Carry none;
    none.strain = moved ? 1.0f : 0.0f;
    return none;
  }
  c.from = c.from / count, c.to = c.to / count;
  if (!moved) {
    c.to = c.from;
    return c;
  }
  c.turn = best_turn([&](auto visit) {
    each([&](Vec3 mid, Vec3 director, Vec3 mid_now, Vec3 director_now) {
      visit(mid - c.from, mid_now - c.to), visit(director, director_now);
    });
  });
  each([&](Vec3 mid, Vec3 director, Vec3 mid_now, Vec3 director_now) {
    c.strain = std::max({c.strain, distance(c.place(mid), mid_now), distance(rotate(c.turn, director), director_now)});
  });
  return c;
}

std::pair<size_t, size_t> without_tails(const thread::State& t, const Sleep::Strand& strand) {
  size_t low = strand.last, high = strand.first;
  const auto take = [&](size_t segment) {
    if (segment >= strand.first && segment < strand.last) low = std::min(low, segment), high = std::max(high, segment + 1);
  };
  for (const thread::Eyelet& e : t.eyelet) take(e.segment);
  for (size_t i = 0; i < t.key.size(); ++i) {
    if (t.crossing[i].normal_impulse <= 0) continue;
    take(thread::segment_of(t.key[i]));
    if (thread::partner_of(t.key[i]) < thread::kTool) take(thread::partner_of(t.key[i]));
  }
  return {low, high};
}

bool is_above(const thread::State& t, size_t first, size_t last, const thread::Plane& drape, float height) {
  for (size_t i = first; i <= last; ++i)
    if (dot(drape.normal, t.x.at(i)) - drape.offset < height) return false;
  return true;
}

bool only_in_wall(const Model& m, const State& s, const Sleep::Strand& strand, std::span<const thread::Hold> holds,
                  std::span<const thread::ToolCapsule> tools, const thread::Plane* drape) {
  const thread::State& t = s.thread;
  if (!in_holes(t, strand)) return false;
  for (const thread::Hold& hold : holds)
    if (hold.node >= strand.first && hold.node <= strand.last) return false;
  if (const float clear = m.thread.material.diameter; drape && !is_above(t, strand.first, strand.last, *drape, clear)) {
    const auto [low, high] = without_tails(t, strand);
    if (!is_above(t, low, high, *drape, clear)) return false;
  }
  return std::none_of(tools.begin(), tools.end(), [&](const thread::ToolCapsule& c) {
    return touches(t, strand, c.to_a, c.to_b, c.radius + 0.5f * m.thread.material.diameter + 2 * kToolMargin);
  });
}

bool is_carried(const State& s, uint32_t strand) {
  const Sleep& z = s.sleep;
  const auto names = [&](const auto& list) {
    return std::any_of(list.begin(), list.end(), [&](const auto& e) { return e.strand == strand; });
  };
  return z.strand[strand].asleep && in_holes(s.thread, z.strand[strand]) && !names(z.held) && !names(z.touched);
}

void carry(const Model& m, State& s, uint32_t strand, const Carry& by) {
  thread::State& t = s.thread;
  const Sleep::Strand& me = s.sleep.strand[strand];
  const auto away = [&](size_t i) { return length2(by.place(s.sleep.from[i]) - t.x.at(i)) > kMoved * kMoved; };
  if (!by.moves() || (!away(me.first) && !away(me.last) && !away((me.first + me.last) / 2))) {
    for (size_t i = me.first; i <= me.last; ++i) t.v.set(i, {});
    return;
  }
  for (size_t i = me.first; i <= me.last; ++i) {
    const Vec3 p = by.place(s.sleep.from[i]);
    t.v.set(i, (p - t.x.at(i)) / m.wall.step);
    t.x.set(i, p), t.fine.set(i, {});
  }
}

void wake_carried(const Model& m, State& s, uint32_t strand) {
  thread::State& t = s.thread;
  const Sleep::Strand& me = s.sleep.strand[strand];
  const Carry by = carry_of(m.sleep, s.sleep.watched, s.wall, strand);
  // What is left of the wall's motion is small but may be strained: a node goes with the columns nearest to it.
  for (size_t i = me.first; i <= me.last && me.loop > 0 && by.moves(); ++i) {
    const Vec3 p = by.place(s.sleep.from[i]);
    Vec3 sum{};
    float all = 0;
    for (const Sleep::Watched& w : s.sleep.watched) {
      if (w.strand != strand || w.may_move >= m.sleep.nearby) continue;
      const Vec3 at = by.place(w.mid);
      const float far2 = length2(at - p) + kColumn * kColumn, part = 1 / (far2 * far2);
      sum += (wall::vec3(s.wall.motion.x[2 * w.column]) - at) * part, all += part;
    }
    if (all > 0) t.x.set(i, p + sum / all), t.fine.set(i, {});
  }
  if (by.turn == Quat{}) return;
  const auto turn = [&](Vec3& v) { v = rotate(by.turn, v); };
  for (size_t i = 0; i < t.key.size(); ++i)
    if (const uint32_t first = thread::segment_of(t.key[i]); first >= me.first && first < me.last)
      turn(t.crossing[i].normal), turn(t.crossing[i].friction_impulse), turn(t.crossing[i].drift);
  for (thread::SoftContact& c : s.contact)
    if (c.node >= me.first && c.node <= me.last) turn(c.offset), turn(c.normal), turn(c.friction_impulse), turn(c.drift);
}

}  // namespace catgut::physical
