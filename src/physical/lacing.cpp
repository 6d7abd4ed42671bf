// SPDX-License-Identifier: Apache-2.0
// physical/lacing: see the header.
#include "physical/lacing.h"

#include <algorithm>

namespace catgut::physical {
namespace {

constexpr float kBehind = 0.2e-3f;  // [m] the thread's end is this far past a hole when it gets its Eyelet
constexpr float kDone = 1.2e-3f;    // [m] and this far when the bite is complete
constexpr float kTaken = 0.01f;     // [m/s] with which a segment that was made longer becomes as long as it was

bool has_eyelet(const thread::State& t, uint32_t hole) {
  return std::any_of(t.eyelet.begin(), t.eyelet.end(), [&](const thread::Eyelet& e) { return e.point == hole; });
}

// A hole, unless it exists, and an Eyelet in the thread's last segment.
bool lace(const Model& m, State& s, const Needle& n, const Channel& channel, bool entry, uint32_t& index) {
  thread::State& t = s.thread;
  const uint32_t segment = n.thread_node - 1;
  if (t.eyelet.size() >= thread::kMaxEyelets || s.hole.size() >= thread::kMaxEyelets || t.broken[segment]) return false;
  for (const thread::Eyelet& e : t.eyelet)
    if (e.segment == segment) return false;  // two holes need a segment between them
  Hole hole;
  hole.place = channel.point[entry ? 0 : channel.count - 1], hole.within = entry;
  hole.made = channel.made[entry ? 0 : 1], hole.torn = channel.torn[entry ? 0 : 1];
  if (index == wall::kNone) {
    index = static_cast<uint32_t>(s.hole.size());
    s.hole.push_back(hole);
  }
  const Vec3 at = mouth(m, s, hole);
  const float in = distance(t.position(segment), at), out = distance(at, t.position(n.thread_node));
  // The way round the mouth is longer than the segment was: with its old length it would be drawn taut at once, and break.
  t.rest[segment] = std::max(t.rest[segment], in + out);
  thread::Eyelet e;
  e.point = index, e.segment = segment, e.friction = m.needles.thread_friction;
  e.before = t.rest[segment] * in / std::max(in + out, 1e-9f);
  const auto after = std::lower_bound(t.eyelet.begin(), t.eyelet.end(), segment,
                                      [](const thread::Eyelet& x, uint32_t k) { return x.segment < k; });
  t.eyelet.insert(after, e);
  return true;
}

void unlace(State& s, uint32_t& index) {
  std::erase_if(s.thread.eyelet, [&](const thread::Eyelet& e) { return e.point == index; });
  if (index + 1 == s.hole.size()) s.hole.pop_back();
  index = wall::kNone;
}

}  // namespace

void move_body(const Model& m, State& s, uint32_t body, const Pose& pose, float opening) {
  place_body(m.bodies.body[body], s.bodies.body[body], pose, opening);
  std::erase_if(s.bodies.memory, [&](const RowMemory& r) {
    return r.key >> 63 == 0 && (r.key >> 52 & 0xff) == body;  // rows of needles have keys of their own: they die by distance
  });
  uint32_t first = thread::kTool;
  for (uint32_t b = 0; b < body; ++b) first += static_cast<uint32_t>(m.bodies.body[b].thread_capsule.size());
  const uint32_t last = first + static_cast<uint32_t>(m.bodies.body[body].thread_capsule.size());
  thread::State& t = s.thread;
  size_t kept = 0;
  for (size_t i = 0; i < t.key.size(); ++i) {
    const uint32_t other = thread::partner_of(t.key[i]);
    if (other >= first && other < last) continue;
    t.key[kept] = t.key[i], t.budget[kept] = t.budget[i], t.crossing[kept] = t.crossing[i];
    ++kept;
  }
  t.key.resize(kept), t.budget.resize(kept), t.crossing.resize(kept);
  t.travel = 1e9f;  // listed again
}

void lace_threads(const Model& m, State& s) {
  for (size_t i = 0; i < s.needle.size(); ++i) {
    Needle& n = s.needle[i];
    if (n.thread_node != wall::kNone && n.thread_node > 1) {
      float& last = s.thread.rest[n.thread_node - 1];
      last = std::max(std::min(last, s.thread.rest[n.thread_node - 2]), last - kTaken * m.wall.step);
    }
    // The thread comes out with the needle. A hole that is not the last one keeps its place in the list.
    if (n.events & kTornOut && n.torn_hole != wall::kNone) {
      s.hole[n.torn_hole].out = true;
      unlace(s, n.torn_hole);
    }
    if (n.channels == 0) continue;
    const NeedleModel& nm = m.needles.needle[i];
    const Pose& pose = s.bodies.body[nm.body].pose;
    const bool threaded = n.thread_node != wall::kNone && n.thread_node > 0;
    const Vec3 end = threaded ? s.thread.position(n.thread_node) : swage_of(nm, pose), ahead = arc_tangent(nm, pose, 0);
    // [m] by which the end of the thread has passed a point; negative far from it, on the other side of the circle.
    const auto past = [&](const wall::Point& p) {
      const Vec3 at = wall::place(wall::weights(m.wall, s.wall.topology, p), s.wall.motion);
      return distance(at, end) < nm.shape.radius ? dot(end - at, ahead) : -1.0f;
    };
    Channel& c = n.channel[0];
    const bool open = n.inside && n.channels == 1;
    const float entry = past(c.point[0]), exit = open ? -1.0f : past(c.point[c.count - 1]);
    if (threaded) {
      const bool in = c.entry_hole != wall::kNone, out = c.exit_hole != wall::kNone;
      if (!in && entry > kBehind && lace(m, s, n, c, true, c.entry_hole)) n.events |= kThreadIn;
      else if (in && !out && entry > -kDone && entry < 0) unlace(s, c.entry_hole);
      else if (in && entry > kBehind && !has_eyelet(s.thread, c.entry_hole)) lace(m, s, n, c, true, c.entry_hole);
      else if (in && exit > kBehind && (!out || !has_eyelet(s.thread, c.exit_hole))) lace(m, s, n, c, false, c.exit_hole);
      if (c.entry_hole != wall::kNone) {
        float& deepest = s.hole[c.entry_hole].deepest = c.point[0].zeta;
        for (uint32_t k = 1; k < c.count; ++k)
          if (std::abs(c.point[k].zeta - c.point[0].zeta) > std::abs(deepest - c.point[0].zeta)) deepest = c.point[k].zeta;
      }
      if (c.exit_hole == wall::kNone || !has_eyelet(s.thread, c.exit_hole)) continue;
    }
    // Another wall may lie on the exit: its bite begins before this one's thread is far out.
    if (exit < kDone && (n.channels == 1 || past(n.channel[1].point[0]) < 0)) continue;
    n.events |= kThreadOut;
    for (uint32_t k = 0; k + 1 < n.channels; ++k) n.channel[k] = n.channel[k + 1];
    --n.channels;
  }
}

}  // namespace catgut::physical
