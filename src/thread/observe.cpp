// SPDX-License-Identifier: Apache-2.0
// thread/observe: see the header. Allocates; not for inside a step.
#include "thread/observe.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <vector>

#include "thread/topology.h"

namespace catgut::thread {
namespace {

constexpr float kAir = 1e-3f;      // [m]
constexpr float kSliding = 0.55f;  // in 100 ties: up to 0.34 drawn flat, from 0.71 with one strand held taut
constexpr float kOwn = 7;          // diameters of each strand that a snug single throw takes up; half as much more per wrap
constexpr size_t kMaxOrders = 5000;

class Looker {
 public:
  explicit Looker(const State& state) : state_(state) {
    const size_t n = state.nodes();
    Vec3 low = state.position(0), high = low, ends = low + state.position(n - 1), cuts{};
    size_t broken = 0;
    for (size_t i = 0; i < n; ++i) {
      const Vec3 p = state.position(i);
      low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
      high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
      if (i + 1 < n && state.broken[i]) cuts += p + state.position(i + 1), ++broken;
    }
    far_ = 10 * length(high - low);
    if (broken > 0) below_ = normalized(cuts / static_cast<float>(2 * broken) - ends * 0.5f, {0, -1, 0}) * far_;
  }

  // The knot in nodes i..j.
  KnotVote vote(size_t i, size_t j, bool quick) {
    curve_.clear();
    for (size_t k = i; k <= j; ++k) {
      curve_.push_back(state_.position(k));
      if (k < j && state_.broken[k]) {  // two threads: joined below, where the tails do not go
        curve_.push_back(state_.position(k) + below_);
        curve_.push_back(state_.position(k + 1) + below_);
      }
    }
    return vote_knot(curve_, far_, quick);
  }

  float length_of(size_t i, size_t j) const {
    float sum = 0;
    for (size_t k = i; k < j; ++k) sum += state_.broken[k] ? 0.0f : state_.rest[k];
    return sum;
  }
  float turning(size_t i, size_t j) const {
    float sum = 0;
    for (size_t k = std::max<size_t>(i, 1); k < j; ++k) {
      if (state_.broken[k - 1] || state_.broken[k]) continue;
      const Vec3 p = state_.position(k) - state_.position(k - 1), q = state_.position(k + 1) - state_.position(k);
      sum += portable::atan2(length(cross(p, q)), dot(p, q));
    }
    return sum;
  }

 private:
  const State& state_;
  Vec3 below_;     // [m]
  float far_ = 1;  // [m]
  std::vector<Vec3> curve_;
};

bool before(const KnotFactor& a, const KnotFactor& b) { return a.wraps != b.wraps ? a.wraps > b.wraps : a.hand > b.hand; }

// The first `count` throws of an order, as a type; of the last of them only `wraps` if that is above 0.
std::vector<KnotFactor> inner(const std::vector<KnotFactor>& order, size_t count, int wraps = 0) {
  std::vector<KnotFactor> f(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(count));
  if (wraps > 0) f.back().wraps = static_cast<uint8_t>(wraps);
  std::sort(f.begin(), f.end(), before);
  return f;
}
// Does a part of the thread about the bite show this, when the throws lie in this order?
bool explains(const std::vector<KnotFactor>& order, const KnotType& type) {
  if (!type.known) return false;
  if (type.factors.empty()) return true;
  for (size_t k = 1; k <= order.size(); ++k) {
    if (type.factors == inner(order, k)) return true;
    for (int wraps = 1; wraps < order[k - 1].wraps; ++wraps)
      if (type.factors == inner(order, k, wraps)) return true;
  }
  return false;
}

KnotName name_of_order(const std::vector<KnotFactor>& order) {
  if (order.empty()) return KnotName::none;
  if (order.size() == 1) return KnotName::single_throw;
  bool alternating = true, alike = true;
  for (size_t i = 1; i < order.size(); ++i) (order[i].hand == order[i - 1].hand ? alternating : alike) = false;
  if (alternating) return order[0].wraps >= 2 ? KnotName::surgeons : KnotName::square;
  return alike ? KnotName::granny : KnotName::mixed;
}

}  // namespace

std::string_view name_of(KnotName name) {
  constexpr std::string_view names[] = {"none", "single throw", "granny", "square", "surgeon's", "mixed", "other"};
  return names[static_cast<size_t>(name)];
}

SeenKnot observe(const Settings& settings, const State& state, float tight_loop) {
  SeenKnot knot;
  const size_t n = state.nodes();
  Looker look(state);
  const KnotVote whole = look.vote(0, n - 1, false);
  knot.confidence = whole.share;
  if (!whole.type.known || whole.type.factors.size() > kMaxThrows) {
    knot.name = KnotName::other;
    return knot;
  }
  if (whole.type.factors.empty()) return knot;

  // Where the knot begins on either side: without anything farther out it is still whole; and where it ends, toward the bite:
  // without anything before that nothing is left of it.
  auto last_true = [](size_t low, size_t high, auto&& holds) {  // holds(low), not holds(high)
    while (high - low > 1) {
      const size_t middle = (low + high) / 2;
      (holds(middle) ? low : high) = middle;
    }
    return low;
  };
  const size_t first = last_true(0, n - 1, [&](size_t i) { return look.vote(i, n - 1, true).type == whole.type; });
  const size_t last = n - 1 - last_true(0, n - 1, [&](size_t i) { return look.vote(0, n - 1 - i, true).type == whole.type; });
  auto knotted = [](const KnotVote& v) { return !v.type.known || !v.type.factors.empty(); };
  const size_t first_in = last_true(first, n - 1, [&](size_t i) { return knotted(look.vote(i, n - 1, true)); });
  const size_t last_in =
      n - 1 - last_true(n - 1 - last, n - 1, [&](size_t i) { return knotted(look.vote(0, n - 1 - i, true)); });

  // Shortened from one end only, node by node, one throw after the other comes undone, from the outermost to the bite's.
  struct Step {
    size_t node;
    KnotVote vote;
  };
  std::vector<Step> path[2];
  for (size_t i = first; i <= first_in; ++i) path[0].push_back({i, look.vote(i, n - 1, true)});
  for (size_t j = last; j >= last_in && j > 0; --j) path[1].push_back({j, look.vote(0, j, true)});

  // The order of throws that explains most of what was seen on the way.
  std::vector<KnotFactor> order = whole.type.factors, best = order;
  float most = -1, most_named = -1, rival = -1;  // of any, of the best's name, of the best with another name
  size_t tried = 0;
  std::vector<std::pair<KnotName, float>> by_name;
  do {
    float score = 0;
    for (const std::vector<Step>& side : path)
      for (const Step& s : side)
        if (explains(order, s.vote.type)) score += s.vote.share;
    const KnotName name = name_of_order(order);
    auto at = std::find_if(by_name.begin(), by_name.end(), [&](const auto& x) { return x.first == name; });
    if (at == by_name.end()) by_name.emplace_back(name, score);
    else at->second = std::max(at->second, score);
    if (score > most) most = score, best = order;
  } while (std::next_permutation(order.begin(), order.end(), before) && ++tried < kMaxOrders);
  knot.name = name_of_order(best);
  for (const auto& [name, score] : by_name)
    (name == knot.name ? most_named : rival) = std::max(name == knot.name ? most_named : rival, score);
  if (rival >= 0) knot.confidence *= 0.5f + 0.5f * std::min(1.0f, (most_named - rival) / 2);

  // Each throw: the least thread about the bite that holds it and all below.
  const float d = settings.material.diameter;
  float below = tight_loop;
  size_t i_below = first_in, j_below = last_in;
  for (size_t k = 0; k < best.size(); ++k) {
    SeenThrow& t = knot.item[knot.throws++];
    t.half_turns = 2u * best[k].wraps + 1;
    t.hand = best[k].hand;
    t.confidence = whole.share;
    knot.wraps += best[k].wraps;
    const std::vector<KnotFactor> here = inner(best, k + 1);
    auto innermost = [&](const std::vector<Step>& side) {
      const auto at = std::find_if(side.rbegin(), side.rend(),
                                   [&](const Step& s) { return s.vote.type.known && s.vote.type.factors == here; });
      return at == side.rend() ? nullptr : &*at;
    };
    const Step *a = innermost(path[0]), *b = innermost(path[1]);
    if (!a || !b || a->node >= b->node) {
      t.confidence *= 0.5f;
      continue;
    }
    const size_t i = a->node, j = b->node;
    t.loop = look.length_of(i, j);
    const float own = kOwn * d * (0.5f + 0.5f * static_cast<float>(best[k].wraps));
    if (below > 0) t.gap = std::max(0.0f, 0.5f * (t.loop - below) - own);
    const float ta = look.turning(i, i_below), tb = look.turning(j_below, j);
    t.sliding = std::abs(ta - tb) / std::max(1e-3f, ta + tb);
    knot.air |= t.gap > kAir;
    below = t.loop;
    i_below = i, j_below = j;
  }
  // The outermost throw: nothing above holds it in shape. A first throw is bent on both strands by the bite below it.
  knot.sliding = knot.throws > 1 && knot.item[knot.throws - 1].sliding > kSliding;
  return knot;
}

}  // namespace catgut::thread
