// SPDX-License-Identifier: Apache-2.0
// solver/strand: see the header.
#include "solver/strand.h"

#include <numeric>

#include "core/check.h"

namespace catgut {

int anchor_of(const Strand& s, uint32_t slot) {
  for (size_t k = 0; k < s.anchor.size(); ++k)
    if (s.anchor[k].slot == slot) return static_cast<int>(k);
  return kNoAnchor;
}

bool is_held(const Strand& s, uint32_t slot) {
  return std::any_of(s.hold.begin(), s.hold.end(), [&](const ThreadHold& h) { return h.slot == slot; });
}
bool is_held_by(const Strand& s, uint32_t slot, int body) {
  return std::any_of(s.hold.begin(), s.hold.end(), [&](const ThreadHold& h) { return h.slot == slot && h.body == body; });
}
bool is_held_by(const Strand& s, uint32_t slot, int body, HoldKind kind) {
  return std::any_of(s.hold.begin(), s.hold.end(),
                     [&](const ThreadHold& h) { return h.slot == slot && h.body == body && h.kind == kind; });
}
bool is_swaged(const Strand& s) {
  return std::any_of(s.hold.begin(), s.hold.end(), [](const ThreadHold& h) { return h.kind == HoldKind::swage; });
}

bool is_whole(const Strand& s, size_t a, size_t b) {
  return std::none_of(s.cut.begin() + static_cast<long>(std::min(a, b)), s.cut.begin() + static_cast<long>(std::max(a, b)),
                      [](uint8_t cut) { return cut != 0; });
}

float tension_outside(const Strand& s, size_t first, size_t last) {
  float tension = 0;
  if (first > 0) tension = std::max(tension, s.tension[first - 1]);
  if (last < s.tension.size()) tension = std::max(tension, s.tension[last]);
  return tension;
}

float rest_between(const Strand& s, size_t a, size_t b) {
  float sum = 0;
  for (size_t i = std::min(a, b); i < std::max(a, b); ++i) sum += s.rest[i];
  return sum;
}
float rest_length(const Strand& s) { return std::accumulate(s.rest.begin(), s.rest.end(), 0.0f); }

Vec3 thread_position(const Strand& s, size_t node, const Vec4* x, const std::vector<RigidBody>& body) {
  const uint32_t slot = s.order[node];
  for (const ThreadAnchor& a : s.anchor)
    if (a.slot == slot) return position_of(a, x);
  for (const ThreadHold& hold : s.hold)
    if (hold.slot == slot) return transform(body[static_cast<size_t>(hold.body)].pose(), hold.local);
  return xyz(x[slot]);
}

float thread_length(const Strand& s, const Vec4* x, const std::vector<RigidBody>& body) {
  float sum = 0;
  for (size_t i = 0; i + 1 < s.order.size(); ++i)
    if (!s.cut[i]) sum += distance(thread_position(s, i, x, body), thread_position(s, i + 1, x, body));
  return sum;
}

void collision_flags(const StrandModel& model, const Strand& s, std::span<uint8_t> collides) {
  std::fill(collides.begin(), collides.end(), uint8_t{1});
  const int nodes = static_cast<int>(s.order.size());
  const auto off = [&](int first, int last) {
    for (int i = std::max(0, first); i <= std::min(nodes - 1, last); ++i)
      collides[s.order[static_cast<size_t>(i)] - model.first_slot] = 0;
  };
  const auto off_beside = [&](uint32_t slot) {
    const int at = static_cast<int>(node_of(s, slot));
    off(at - model.collision_off, at + model.collision_off);
  };
  for (const ThreadAnchor& a : s.anchor) off_beside(a.slot);
  for (const ThreadHold& h : s.hold)
    if (h.kind != HoldKind::loop) off_beside(h.slot);
  // The two ends of such a loop are anchored in sequence.
  const auto travels = [](const ThreadAnchor& a) { return !a.knotted && length2(a.offset) > 0; };
  for (size_t k = 0; k + 1 < s.anchor.size(); ++k) {
    if (!travels(s.anchor[k]) || !travels(s.anchor[k + 1])) continue;
    off(static_cast<int>(node_of(s, s.anchor[k].slot)), static_cast<int>(node_of(s, s.anchor[k + 1].slot)));
    ++k;
  }
}

void reset(const StrandModel& model, Strand& s) {
  s.order.resize(model.count);
  std::iota(s.order.begin(), s.order.end(), model.first_slot);
  const size_t pairs = model.count > 0 ? model.count - 1 : 0;
  s.rest.assign(pairs, model.spacing);
  s.tension.assign(pairs, 0.0f);
  s.cut.assign(pairs, 0);
  s.anchor.clear();
  s.hold.clear();
}

void move_particle(Strand& t, size_t from, size_t after) {
  // Figure 8: the two pairs at the old place become one, the pair at the new place becomes two.
  if (from == after + 1) return;
  CATGUT_CHECK(!t.cut[from - 1] && !t.cut[from] && !t.cut[after]);
  const uint32_t slot = t.order[from];
  const float joined = t.rest[from - 1] + t.rest[from];
  const float half = 0.5f * t.rest[after];
  if (from < after) {
    // rest: [.. from-1, from, from+1 .. after ..] -> [.. joined, from+1 .. after-1, half, half ..]
    t.rest[from - 1] = joined;
    std::move(t.rest.begin() + static_cast<long>(from) + 1, t.rest.begin() + static_cast<long>(after),
              t.rest.begin() + static_cast<long>(from));
    t.rest[after - 1] = t.rest[after] = half;
    std::move(t.cut.begin() + static_cast<long>(from) + 1, t.cut.begin() + static_cast<long>(after),
              t.cut.begin() + static_cast<long>(from));
    t.cut[after - 1] = 0;
    std::move(t.order.begin() + static_cast<long>(from) + 1, t.order.begin() + static_cast<long>(after) + 1,
              t.order.begin() + static_cast<long>(from));
    t.order[after] = slot;
  } else {
    // rest: [.. after, after+1 .. from-2, from-1, from ..] -> [.. half, half, after+1 .. from-2, joined ..]
    t.rest[from] = joined;
    std::move_backward(t.rest.begin() + static_cast<long>(after) + 1, t.rest.begin() + static_cast<long>(from) - 1,
                       t.rest.begin() + static_cast<long>(from));
    t.rest[after] = t.rest[after + 1] = half;
    std::move_backward(t.cut.begin() + static_cast<long>(after) + 1, t.cut.begin() + static_cast<long>(from) - 1,
                       t.cut.begin() + static_cast<long>(from));
    t.cut[after + 1] = 0;
    std::move_backward(t.order.begin() + static_cast<long>(after) + 1, t.order.begin() + static_cast<long>(from),
                       t.order.begin() + static_cast<long>(from) + 1);
    t.order[after + 1] = slot;
  }
}

void cut_pair(Strand& s, size_t pair) {
  s.cut[pair] = 1;
  s.tension[pair] = 0;
}

void release_holds(Strand& s, int body, HoldKind kind) {
  std::erase_if(s.hold, [&](const ThreadHold& h) { return h.body == body && h.kind == kind; });
}

}  // namespace catgut
