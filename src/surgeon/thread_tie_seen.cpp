// SPDX-License-Identifier: Apache-2.0
// surgeon/thread_tie_seen: what ThreadTie sees and feels of tail, strand and knot.
#include <algorithm>
#include <cmath>

#include "exchange/strand.h"
#include "exchange/tying.h"
#include "surgeon/reach.h"
#include "surgeon/thread_tie.h"
#include "surgeon/tie_geometry.h"

namespace catgut {
namespace {

constexpr size_t kHolder = 0;
// Of the strand's length: where it is wound. Lower, the needle that goes round would meet the tail, which stands up from a
// knot.
constexpr float kHigh = 0.62f;
// The same for two turns, which need more of it. Half of the strand's length or less, and the hand meets the tail on the
// tissue.
constexpr float kHighTwice = 0.57f;
constexpr float kBite = 5e-3f;        // [m] of their length, that thread is held by
constexpr float kPinched = 0.8e-3f;   // [m] from there, a strand is held with the tail: a turn on the jaws is farther away
constexpr float kDeep = 4e-3f;        // [m] below the stitch: walls are beside a tail there
constexpr float kRoom = 4e-3f;        // [m] from the tissue's particles: open jaws have none of it between them
constexpr float kStrandRoom = 2e-3f;  // [m] the same from another stitch's thread
constexpr float kFarthest = 9e-3f;    // [m] of the place where a tail is taken, beyond kTailEnd
constexpr float kLasts = 0.2f;        // share of a new value per tick: a finished stitch jerks now and then

}  // namespace

// [m] of tail or strand from its hole to its hand, beyond the straight way from the stitch.
float ThreadTie::slack_of(const Snapshot& seen, bool tail) const {
  const size_t hand = tail ? node_of(seen, seen.tool[kHolder].held_slot) : seen.active().thread_order.size() - 1;
  return length_between(seen, tail ? first_point_node(seen) : last_point_node(seen), hand) -
         distance(node_at(seen, hand), origin_);
}

Vec3 ThreadTie::tail_node(const Snapshot& seen, float from_end) const {
  return node_at(seen, node_along(seen, 0, from_end, 1));
}

// [m] from the tail's end, where the jaws take it: clear of walls, if it hangs down between them, and of other stitches'
// strands. Jaws that close on an edge or a strand beside it tear bites out.
float ThreadTie::tail_place(const Snapshot& seen, float wanted) const {
  const bool deep = tail_node(seen, wanted).y <= origin_.y - kDeep;
  if (!deep && room_at(picture_, seen, tail_node(seen, wanted), false, kRoom) > kStrandRoom) return wanted;
  float best = wanted, most = 0;
  for (float at = wanted; at < wanted + kFarthest && at < tail_ - kKnot; at += 1e-3f) {
    const float room = room_at(picture_, seen, tail_node(seen, at), deep, kRoom);
    if (room > 1.05f * most) best = at, most = room;
  }
  return best;
}

// [m] from the tail's end, where the needle holder takes it next. After two misses where the tail lies highest: in the groove
// between two walls the jaws would stand on both and not reach it.
float ThreadTie::grasp_place(const Snapshot& seen) const {
  if (misses_ < 2) return kTailEnd + kNearer * static_cast<float>(misses_);
  constexpr float kNearest = 3e-3f;  // [m] from the end
  float best = kTailEnd, highest = -1;
  for (float at = kNearest; at < kTailEnd + kFarthest && at < tail_ - kKnot; at += 1e-3f)
    if (const float high = dot(tail_node(seen, at), approach_); high > highest) best = at, highest = high;
  return best;
}

// [rad] of the strand round jaws and shaft of the needle holder, in the sense of the throw. What has slid past the tips does
// not count.
float ThreadTie::wound(const Snapshot& seen) const {
  const Pose& tool = seen.tool[kHolder].pose;
  float sum = 0;
  Vec3 before;
  bool on = false;
  for (size_t i = last_point_node(seen); i < seen.active().thread_order.size(); ++i) {
    const Vec3 p = to_local(tool, node_at(seen, i)), flat{p.x, p.y, 0};
    if (on && p.z > -2e-3f) sum += portable::atan2(before.x * flat.y - before.y * flat.x, dot(before, flat));
    before = flat, on = p.z > -2e-3f;
  }
  return -side_ * sense_ * sum;
}

// The other side, and the free thread beyond the knot, which takes up some millimeters with every throw.
void ThreadTie::measure(const Snapshot& seen) {
  const size_t last = seen.active().thread_order.size() - 1;
  size_t tail_at = first_point_node(seen), strand_at = last_point_node(seen);
  const auto near = [&](size_t i) { return distance(node_at(seen, i), origin_) < kKnot; };
  if (!first_) {
    for (size_t i = 0; i < tail_at; ++i)
      if (near(i)) tail_at = i;
    for (size_t i = last; i > strand_at; --i)
      if (near(i)) strand_at = i;
  }
  const float out = first_ ? 0.0f : kKnot;
  strand_ = length_between(seen, strand_at, last) + out, tail_ = length_between(seen, 0, tail_at) + out;
  height_ = (wraps_ > 1 ? kHighTwice : kHigh) * strand_;
}

// The jaws hold the long strand, too: drawn with the tail, it would tear its bites out.
bool ThreadTie::pinches_strand(const Snapshot& seen) const {
  for (size_t i = last_point_node(seen) + 1; i < seen.active().thread_order.size(); ++i)
    if (length2(from_jaws(seen.tool[kHolder], node_at(seen, i), kBite)) < kPinched * kPinched) return true;
  return false;
}

void ThreadTie::feel(const Snapshot& seen) {
  const SutureView& s = seen.active();
  const float now = s.thread_tension[s.thread_order.size() - 3];
  felt_ += 0.5f * (std::max(0.0f, now) - felt_);
  const ToolView& holder = seen.tool[kHolder];
  float tail = 0;
  if (holder.held == Held::thread) {
    const size_t node = std::clamp<size_t>(node_of(seen, holder.held_slot) + 2, 0, s.thread_tension.size() - 1);
    tail = std::max(0.0f, s.thread_tension[node]);
  }
  tail_felt_ += 0.5f * (tail - tail_felt_);
  foreign_ += kLasts * (largest_tension(seen, s.thread_tension.size()) - foreign_);
}

}  // namespace catgut
