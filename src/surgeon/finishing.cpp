// SPDX-License-Identifier: Apache-2.0
// surgeon/finishing: the end of a stitch: scissors, what they cut off, hands away, a new suture; see scripted.h.
#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "surgeon/reach.h"
#include "surgeon/scripted.h"
#include "surgeon/throws.h"

namespace catgut {
namespace {

constexpr float kStump = 0.007f;              // [m] of thread left on a knot
constexpr Vec3 kAside{-0.10f, 0.03f, 0.05f};  // [m] from the center of the field, where a used needle is put down
constexpr float kHandsAway = 5;               // [s]
constexpr float kSlackStrand = 0.8f;          // of the strand's length: where its needle is laid down
constexpr float kTautStrand = 0.2f;           // [N]
constexpr float kOverDrape = 0.004f;          // [m] of a needle that is laid down
constexpr Vec3 kLaidDown{-0.6f, -0.3f, 0.75f};
constexpr float kShortStump = 0.005f;  // [m] of thread left on a knot with physical mechanics, beyond where the strands touch
constexpr float kKnotEnds = 4e-3f;     // [m] of free thread
constexpr float kFarthestCut = 0.03f;  // [m] beyond that: a knot with wide loops
constexpr float kWhole = 1;            // [m]: longer than a thread
// [m] of the blades from the stitch and from any other thread: of two strands between them they cut the wrong one.
constexpr float kStumpClear = 2e-3f;
constexpr size_t kRunsOn = 8;            // nodes
constexpr Vec3 kCutFrom{0, 0.6f, 0.8f};  // unit, from the blades along the shaft
constexpr int kPieceMisses = 3;          // then it is left where it fell
constexpr float kPieceLoad = 1;  // [N] by which a stitch's thread becomes tauter while a loose piece is lifted: it is held too
constexpr float kPieceGrip = 0.008f;          // [m] of the jaws from where it was cut
constexpr float kNearTips = 1.5e-3f;          // [m] from the middle of the jaws, where they take it
constexpr float kPieceStandsOn = 1.5f;        // [N] on jaws that come down for it
constexpr float kPieceUp = 0.06f;             // [m] it is raised: longer than it is
constexpr Vec3 kPieceAside{0.09f, 0, 0.07f};  // [m] from the center of the field, where it is laid down

// The outermost node of a knot on the tail or on the needle's strand: within the knot the two touch each other.
size_t knot_end(const Snapshot& seen, bool tail) {
  const size_t last = seen.active().thread_order.size() - 1, first = first_point_node(seen), end = last_point_node(seen);
  const auto touches = [&](size_t i) {
    for (size_t k = tail ? end + 1 : 0; k < (tail ? last + 1 : first); ++k)
      if (distance(node_at(seen, i), node_at(seen, k)) < kStrandsTouch) return true;
    return false;
  };
  size_t found = tail ? first : end;
  bool met = false;
  float free = 0;
  for (size_t i = found; tail ? i > 0 : i < last;) {
    const size_t next = tail ? i - 1 : i + 1;
    free += distance(node_at(seen, i), node_at(seen, next));
    i = next;
    if (touches(i)) found = i, met = true, free = 0;
    else if (met && free > kKnotEnds) break;
  }
  return found;
}

// The piece from the free end to node `end` runs through tissue.
bool is_sewn(const Snapshot& seen, size_t end) { return !seen.active().suture_point.empty() && first_point_node(seen) < end; }

// [m] from a node to the nearest thread of its suture, but for what runs on from it.
float own_room(const Snapshot& seen, size_t node) {
  float room = kWhole;
  for (size_t k = 0; k < seen.active().thread_order.size(); ++k)
    if (k + kRunsOn < node || k > node + kRunsOn) room = std::min(room, distance(node_at(seen, node), node_at(seen, k)));
  return room;
}

}  // namespace

bool Scripted::leave(const Snapshot& seen) {
  enum { lower, open, away, rise };
  const Vec3 from = stitch(seen);
  if (stage_ == lower && waited_ <= dt_ && plan_.rise && attempts_++ == 0) go(rise);
  switch (stage_) {
    case rise: {  // over the edges: the straight way would lead through them
      const float reach = 0.7f * length_between(seen, last_point_node(seen), seen.active().thread_order.size() - 1);
      if (carry_swage(seen, from + Vec3{0, reach, 0.3f * reach}, 0.5f * skill_.speed) || !patience(3)) go(lower);
      return false;
    }
    case lower: {
      const size_t last = seen.active().thread_order.size() - 1;
      const float reach = kSlackStrand * length_between(seen, last_point_node(seen), last);
      Vec3 down = from + normalized(kLaidDown) * reach;
      // As far as the strand lets it; the needle of a cut strand is laid on the drape, for dropped onto its thread it would
      // jerk it.
      const auto& cut = seen.active().thread_cut;
      const bool off = std::any_of(cut.begin() + static_cast<std::ptrdiff_t>(last_point_node(seen)), cut.end(),
                                   [](uint8_t c) { return c != 0; });
      const float drape = picture_.drape + kOverDrape;
      down.y = off ? drape : std::max(down.y, drape);
      // Slowly with a loose end behind the needle: where the hand stops, it would fly past and catch on the jaws.
      const float gently = (off ? 0.5f : 1.0f) * std::clamp(1 - 4 * needle_tension(seen), 0.0f, 1.0f);
      const bool there = carry_swage(seen, down, std::max(1e-3f, gently * skill_.speed));
      if (there || needle_tension(seen) > kTautStrand || !patience(4)) go(open);
      return false;
    }
    case open:
      if (jaw(kForceps, 1)) go(away);
      return false;
    default:
      rest_aside(seen, kNeedleHolder);
      rest_aside(seen, kForceps);
      return waited_ > kHandsAway;
  }
}

size_t Scripted::node_to_cut(const Snapshot& seen, bool tail, bool begins) const {
  const size_t first = first_point_node(seen), end = last_point_node(seen), last = seen.active().thread_order.size() - 1;
  const bool physical = plan_.pull > 0;
  const size_t from = physical ? knot_end(seen, tail) : tail ? first : end;
  const float wanted = physical ? kStumpClear : kTieClear;
  // After a miss further out, with more room.
  const float near = (physical ? kShortStump : kStump) + 0.004f * static_cast<float>(misses_);
  const float far = near + (physical ? kFarthestCut : 3 * kStump);
  // A knot of wide turns has loops in which the strand touches nothing: whether its throws stay shows where it ends.
  const size_t begin = node_along(seen, first, kWhole, -1);  // a tail that is cut off already does not count
  std::vector<Vec3> thread;
  const bool looks = physical && begins;  // once; then no nearer than that
  for (size_t i = begin; looks && i <= last; ++i) thread.push_back(node_at(seen, i));
  const SeenThrows knot = looks ? see_throws(thread) : SeenThrows{};
  const auto keeps_throws = [&](size_t i) {
    if (!looks) return tail ? i <= cut_at_ : i >= cut_at_;
    const std::span<const Vec3> whole(thread);
    return see_throws(tail ? whole.subspan(i - begin) : whole.first(i - begin + 1)) == knot;
  };
  size_t at = looks || !physical ? (tail ? 1 : last - 1) : cut_at_;
  float clearest = 0;
  for (float out = near; out < far && clearest < wanted; out += 0.002f) {
    const size_t i = std::clamp<size_t>(node_along(seen, from, out, tail ? -1 : 1), 1, last - 1);
    float clear = wanted;
    for (size_t k = first; k <= end; ++k) clear = std::min(clear, distance(node_at(seen, i), node_at(seen, k)));
    if (physical) clear = std::min(clear, room_to_cut(seen, i, wanted));
    if (clear > clearest && (!physical || keeps_throws(i))) clearest = clear, at = i;
  }
  return at;
}

bool Scripted::cut(TaskKind kind, const Snapshot& seen) {
  enum { over, down, snip, away };
  if (stage_ >= kPiece) return take_piece(seen);
  if (kind == TaskKind::cut_needle) {  // the forceps holds the needle by its end: cut right there
    if (stage_ == over) {
      order(CommandKind::cut, kForceps);
      go(away);
    } else if (!seen.active().needle_on_thread || !patience(0.5f)) {
      if (seen.active().needle_on_thread) return miss(over), false;
      return move(kForceps, {hand_[kForceps].pose.p + Vec3{-0.03f, 0.02f, 0}, hand_[kForceps].pose.q}, skill_.speed) ||
             waited_ > 1.5f;
    }
    return false;
  }
  const bool tail = kind == TaskKind::cut_tail;
  const bool physical = plan_.pull > 0;
  const bool begins = stage_ == over && waited_ <= dt_;
  const size_t at = node_to_cut(seen, tail, begins);
  if (begins) cut_at_ = at;
  const Pose goal = physical ? blades_at(seen, at) : tying_pose(kNeedleHolder, node_at(seen, at));
  switch (stage_) {
    case over:
      cuts_before_ = count_cuts(seen);
      jaw(kNeedleHolder, kHalfOpen);
      if (move(kNeedleHolder, raised(goal, 0.015f), skill_.speed) || !patience(5)) go(down);
      return false;
    case down:
      if (move(kNeedleHolder, goal, careful()) || !patience(3)) go(snip);
      return false;
    case snip:
      order(CommandKind::cut, kNeedleHolder);
      go(away);
      return false;
    default:
      move(kNeedleHolder, raised(hand_[kNeedleHolder].pose, 0.015f), skill_.speed);
      if (waited_ < 0.3f) return false;
      if (count_cuts(seen) == cuts_before_) return miss(over), false;
      if (!physical || !tail) return true;
      misses_ = 0;
      go(kPiece);
      return false;
  }
}

Pose Scripted::blades_at(const Snapshot& seen, size_t node) const {
  const Vec3 x = normalized(cross(kCutFrom, node_at(seen, node + 1) - node_at(seen, node - 1)), {1, 0, 0});
  return {node_at(seen, node), from_axes(x, cross(kCutFrom, x), kCutFrom)};
}

float Scripted::room_to_cut(const Snapshot& seen, size_t node, float most) const {
  return std::min(own_room(seen, node), room_at(picture_, seen, node_at(seen, node), false, most));
}

// A node of the cut-off tail that ends with node `end`: as near to the cut as no other thread would come between the jaws, too.
// If the piece runs through tissue, as near to where it leaves that.
size_t Scripted::piece_grip(const Snapshot& seen, size_t end) const {
  if (is_sewn(seen, end)) end = first_point_node(seen);
  size_t at = end;
  float most = -1;
  for (float out = kPieceGrip + 0.004f * static_cast<float>(misses_); most < kStumpClear; out += 0.002f) {
    const size_t i = node_along(seen, end, out, -1);
    const float room = room_to_cut(seen, i, kStumpClear);
    if (room > most) most = room, at = i;
    if (i == 0) break;
  }
  return at;
}

bool Scripted::take_piece(const Snapshot& seen) {
  enum { over = kPiece, down, close, lift, carry, lower, open, let_go };
  const auto& cut = seen.active().thread_cut;
  const size_t end = static_cast<size_t>(std::find(cut.begin(), cut.end(), 1) - cut.begin());  // of the tail's piece
  if (misses_ > kPieceMisses || end >= cut.size()) return true;                                // it lies where it fell
  if (stage_ == over && waited_ <= dt_) {
    cut_at_ = piece_grip(seen, end);
    // Square to the wall that it lies on: else one jaw stands on that before the other one is beside the thread.
    const Vec3 place = node_at(seen, cut_at_), from[] = {wall_normal(picture_, seen, place), kCutFrom, {0, 1, 0}};
    piece_from_ = from[clear_shaft(picture_, seen, place, from)];
  }
  const size_t at = cut_at_;
  // A piece that runs through tissue is drawn out of it.
  const float gently = is_sewn(seen, end) ? std::clamp(1.5f - length(seen.tool[kNeedleHolder].force), 0.02f, 1.0f) : 1;
  const Vec3 x =
      normalized(cross(piece_from_, node_at(seen, std::min(at + 1, end)) - node_at(seen, at > 0 ? at - 1 : 0)), {1, 0, 0});
  const Pose goal{node_at(seen, at) + piece_from_ * kNearTips, from_axes(x, cross(piece_from_, x), piece_from_)};
  const Vec3 place{picture_.focus.x + kPieceAside.x, picture_.drape + kOverDrape, picture_.focus.z + kPieceAside.z};
  const auto missed = [&] { ++retries_, ++misses_, go(let_go); };
  switch (stage_) {
    case over:
      jaw(kNeedleHolder, kHalfOpen);
      if (move(kNeedleHolder, raised(goal, 0.015f), skill_.speed) || !patience(4)) go(down);
      return false;
    case down:  // until they stand on a wall: pressed farther, it is pushed away under its stitch
      if (move(kNeedleHolder, goal, careful()) || length(seen.tool[kNeedleHolder].force) > kPieceStandsOn || !patience(3))
        go(close);
      return false;
    case close:
      if (!jaw(kNeedleHolder, 0) || waited_ < 0.3f) return false;
      if (seen.tool[kNeedleHolder].held != Held::thread || node_of(seen, seen.tool[kNeedleHolder].held_slot) > end ||
          catches_other_thread(picture_, seen, seen.tool[kNeedleHolder]))
        return missed(), false;
      stitch_load_ = largest_tension(seen, end + 1);
      go(lift);
      return false;
    case lift:
      if (largest_tension(seen, end + 1) > stitch_load_ + kPieceLoad) return missed(), false;
      if (move(kNeedleHolder, {stitch(seen) + Vec3{0, kPieceUp, 0}, hand_[kNeedleHolder].pose.q}, careful() * gently) ||
          !patience(6))
        go(carry);
      return false;
    case carry:
      if (move(kNeedleHolder, {place + Vec3{0, kPieceUp, 0}, hand_[kNeedleHolder].pose.q}, skill_.speed) || !patience(4))
        go(lower);
      return false;
    case lower:
      if (move(kNeedleHolder, {place, hand_[kNeedleHolder].pose.q}, skill_.speed) || !patience(3)) go(open);
      return false;
    case let_go:
      if (jaw(kNeedleHolder, kHalfOpen)) go(over);
      return false;
    default:
      if (!jaw(kNeedleHolder, 1)) return false;
      return move(kNeedleHolder, raised(hand_[kNeedleHolder].pose, 0.02f), skill_.speed) || waited_ > 1;
  }
}

size_t Scripted::count_cuts(const Snapshot& seen) {
  size_t n = 0;
  for (const uint8_t c : seen.active().thread_cut) n += c;
  return n;
}

bool Scripted::discard(const Snapshot& seen) {
  enum { aside, let_go };
  rest_aside(seen, kNeedleHolder);
  if (stage_ == aside) {
    if (move(kForceps, {picture_.focus + kAside, hand_[kForceps].pose.q}, skill_.speed) || !patience(2)) go(let_go);
    return false;
  }
  rest_aside(seen, kForceps);
  return waited_ > 0.6f && !holds_needle(seen, kForceps);
}

bool Scripted::fresh(const Snapshot& seen) {
  enum { aside, let_go, ask, wait };
  rest_aside(seen, kNeedleHolder);
  if (stage_ != aside) rest_aside(seen, kForceps);
  switch (stage_) {
    case aside:  // the old needle is not dropped into the wound
      if (move(kForceps, {picture_.focus + kAside, hand_[kForceps].pose.q}, skill_.speed) || !patience(2)) go(let_go);
      return false;
    case let_go:
      if (waited_ > 0.6f) go(ask);
      return false;
    case ask:
      order(CommandKind::new_suture, kNeedleHolder);
      settled_before_ = seen.settled.size();
      go(wait);
      return false;
    default:
      if (waited_ < 0.3f) return false;
      if (seen.settled.size() == settled_before_) return miss(let_go), false;
      return true;
  }
}

bool Scripted::take_both(const Snapshot& seen) {
  enum { lay, over, down, close };
  const size_t first = first_point_node(seen);
  const size_t at = node_along(seen, first, 0.008f + 0.003f * static_cast<float>(misses_ % 3), -1);
  const Vec3 thread = node_at(seen, at), knot = stitch(seen);
  Vec3 way = normalized(thread - knot, {1, 0, 0});
  way = normalized(Vec3{way.x, std::max(way.y, 0.0f), way.z}, {1, 0, 0});
  const float free = length_between(seen, last_point_node(seen), seen.active().thread_order.size() - 1) -
                     (seen.active().suture_point.empty() ? 0 : distance(seen.active().suture_point.back().position, knot));
  const Pose goal = tying_pose(kNeedleHolder, thread);
  const float tension = needle_tension(seen);
  // Over the tissue first, then down beside the tail.
  const float up = stage_ == lay && waited_ < 0.8f ? 1.5f : 0.25f;
  carry_swage(seen, knot + normalized(way + Vec3{0, up, 0}) * (kTieTaut * free),
              skill_.speed * std::clamp(1.2f - tension, 0.0f, 1.0f));
  switch (stage_) {
    case lay:
      jaw(kNeedleHolder, kHalfOpen);
      move(kNeedleHolder, raised(goal, 0.03f), skill_.speed);
      if (waited_ > 2.0f) go(over);
      return false;
    case over:
      jaw(kNeedleHolder, kHalfOpen);
      if (move(kNeedleHolder, raised(goal, 0.02f), skill_.speed) || !patience(4)) go(down);
      return false;
    case down:
      if (move(kNeedleHolder, goal, careful()) || !patience(4)) go(close);
      return false;
    default:
      if (!jaw(kNeedleHolder, 0) || waited_ < 0.35f) return false;
      if (seen.tool[kNeedleHolder].held != Held::thread || seen.tool[kNeedleHolder].held_strands < 2) return miss(over), false;
      return true;
  }
}

}  // namespace catgut
