// SPDX-License-Identifier: Apache-2.0
// physical/awake: the strands that are awake as a thread of their own, and back; see physical/sleep.h.
#include <algorithm>

#include "physical/physical.h"
#include "physical/sleep.h"

namespace catgut::physical {
namespace {

template <typename To, typename From>
void take(To& to, const From& from, std::span<const uint32_t> node) {
  to.resize(node.size());
  for (size_t i = 0; i < node.size(); ++i) to[i] = from[node[i]];
}
template <typename To, typename From>
void put(To& to, const From& from, std::span<const uint32_t> node, size_t count) {
  for (size_t i = 0; i < count; ++i) to[node[i]] = from[i];
}
// The columns of nodes in both threads.
template <typename Visit>
void each_node_column(thread::State& to, const thread::State& from, Visit visit) {
  using thread::Columns3;
  using thread::State;
  for (Columns3 State::*c : {&State::x, &State::fine, &State::v, &State::plane_friction, &State::plane_drift, &State::listed})
    for (thread::Column Columns3::*d : {&Columns3::x, &Columns3::y, &Columns3::z}) visit((to.*c).*d, (from.*c).*d);
  visit(to.warm, from.warm), visit(to.kept, from.kept), visit(to.plane_normal, from.plane_normal);
}

}  // namespace

void AwakeThread::reserve(const State& s) {
  const size_t nodes = s.thread.nodes(), pairs = thread::pair_capacity(nodes);
  each_node_column(part, part, [&](thread::Column& c, const thread::Column&) { c.reserve(nodes); });
  part.rest.reserve(nodes), part.tension.reserve(nodes), part.broken.reserve(nodes);
  part.key.reserve(pairs), part.budget.reserve(pairs), part.crossing.reserve(pairs), part.eyelet.reserve(thread::kMaxEyelets);
  node.reserve(nodes), part_node.reserve(nodes), hold.reserve(256), hold_of.reserve(256), pull.reserve(256);
  point_of.reserve(thread::kMaxEyelets), hole_of.reserve(thread::kMaxEyelets), impulse.reserve(thread::kMaxSoftPoints);
  key.reserve(2 * pairs), budget.reserve(2 * pairs), crossing.reserve(2 * pairs), eyelet.reserve(thread::kMaxEyelets);
  contact.reserve(2 * thread::kMaxSoftPoints), ready.reserve(nodes), disturbed.reserve(nodes), box.reserve(nodes),
      boxed.reserve(nodes), tool.reserve(kMaxThreadCapsules), carry.reserve(nodes), far_due.reserve(nodes),
      load_at.reserve(4 * wall::columns(s.wall)), room.reserve(2 * wall::columns(s.wall));
}

void gather(const State& s, AwakeThread& k) {
  const thread::State& t = s.thread;
  thread::State& p = k.part;
  k.node.clear(), k.part_node.assign(t.nodes(), wall::kNone);
  for (const Sleep::Strand& strand : s.sleep.strand)
    for (uint32_t i = strand.first; i <= strand.last && !strand.asleep; ++i)
      k.part_node[i] = static_cast<uint32_t>(k.node.size()), k.node.push_back(i);
  each_node_column(p, t, [&](thread::Column& to, const thread::Column& from) { take(to, from, k.node); });
  const size_t segments = k.node.size() - 1;
  p.rest.resize(segments), p.tension.resize(segments), p.broken.resize(segments);
  for (size_t i = 0; i < segments; ++i)
    p.rest[i] = t.rest[k.node[i]], p.tension[i] = t.tension[k.node[i]], p.broken[i] = t.broken[k.node[i]];
  p.key.clear(), p.budget.clear(), p.crossing.clear(), p.eyelet.clear();
  for (size_t i = 0; i < t.key.size(); ++i) {
    const uint32_t first = k.part_node[thread::segment_of(t.key[i])], other = thread::partner_of(t.key[i]);
    const uint32_t second = other < thread::kTool ? k.part_node[other] : other;
    if (first == wall::kNone || second == wall::kNone) continue;
    p.key.push_back(first << 16 | second), p.budget.push_back(t.budget[i]), p.crossing.push_back(t.crossing[i]);
  }
  for (thread::Eyelet e : t.eyelet)
    if (k.part_node[e.segment] != wall::kNone) e.segment = k.part_node[e.segment], p.eyelet.push_back(e);
  p.travel = t.travel, p.overflow = t.overflow, p.refreshes = t.refreshes;
}

void show_awake(std::span<const thread::Hold> holds, std::span<const thread::Pull> pulls,
                std::span<thread::SoftContact> contacts, AwakeThread& k) {
  k.hold.clear(), k.hold_of.clear(), k.pull.clear();
  for (uint32_t i = 0; i < holds.size(); ++i) {
    if (k.part_node[holds[i].node] == wall::kNone) continue;
    k.hold.push_back(holds[i]), k.hold_of.push_back(i);
    k.hold.back().node = k.part_node[holds[i].node];
  }
  for (const thread::Pull& pull : pulls) k.pull.push_back({k.part_node[pull.node], pull.force});  // all are awake then
  for (thread::SoftContact& c : contacts) c.node = k.part_node[c.node];
}

void scatter(State& s, AwakeThread& k) {
  thread::State& t = s.thread;
  thread::State& p = k.part;
  each_node_column(t, p, [&](thread::Column& to, const thread::Column& from) { put(to, from, k.node, k.node.size()); });
  for (size_t i = 0; i + 1 < k.node.size(); ++i) t.tension[k.node[i]] = p.tension[i], t.broken[k.node[i]] = p.broken[i];
  // The pairs of sleeping strands stay as they are; both lists are sorted.
  k.key.clear(), k.budget.clear(), k.crossing.clear();
  size_t old = 0;
  const auto keep_until = [&](uint32_t end) {
    for (; old < t.key.size() && t.key[old] < end; ++old) {
      const uint32_t other = thread::partner_of(t.key[old]);
      const bool awake = k.part_node[thread::segment_of(t.key[old])] != wall::kNone;
      if (awake && (other >= thread::kTool || k.part_node[other] != wall::kNone)) continue;
      k.key.push_back(t.key[old]), k.budget.push_back(t.budget[old]), k.crossing.push_back(t.crossing[old]);
    }
  };
  for (size_t i = 0; i < p.key.size(); ++i) {
    const uint32_t other = thread::partner_of(p.key[i]);
    const uint32_t key = k.node[thread::segment_of(p.key[i])] << 16 | (other < thread::kTool ? k.node[other] : other);
    keep_until(key);
    k.key.push_back(key), k.budget.push_back(p.budget[i]), k.crossing.push_back(p.crossing[i]);
  }
  keep_until(UINT32_MAX);
  t.key.assign(k.key.begin(), k.key.end()), t.budget.assign(k.budget.begin(), k.budget.end());
  t.crossing.assign(k.crossing.begin(), k.crossing.end());
  k.eyelet.assign(t.eyelet.begin(), t.eyelet.end());
  t.eyelet.clear();
  size_t mine = 0;
  const auto mine_until = [&](uint32_t segment) {
    for (; mine < p.eyelet.size() && k.node[p.eyelet[mine].segment] < segment; ++mine) {
      thread::Eyelet e = p.eyelet[mine];
      e.segment = k.node[e.segment], t.eyelet.push_back(e);
    }
  };
  for (const thread::Eyelet& e : k.eyelet)
    if (k.part_node[e.segment] == wall::kNone) mine_until(e.segment), t.eyelet.push_back(e);
  mine_until(UINT32_MAX);
  t.travel = p.travel, t.overflow = p.overflow, t.refreshes = p.refreshes;
}

}  // namespace catgut::physical
