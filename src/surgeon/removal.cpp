// SPDX-License-Identifier: Apache-2.0
// surgeon/removal: a stitch that could not be tied is taken out. Without a throw, the thread is drawn out by its needle. Else
// its strand is cut where it leaves the tissue, the needle is laid aside, and the thread is drawn out by its tail. Left lying,
// it would hinder the next stitches. See scripted.h.
#include <algorithm>
#include <array>
#include <vector>

#include "surgeon/reach.h"
#include "surgeon/scripted.h"
#include "surgeon/throws.h"

namespace catgut {
namespace {

constexpr float kNearestCut = 2e-3f, kFarthestCut = 16e-3f;  // [m] along the strand, from where it leaves the tissue
constexpr float kBladesClear = 2e-3f;                        // [m] from any other thread
constexpr float kLaidAt = 0.16f;                             // [m] of the needle, from the center of the field
constexpr float kLaidFree = 0.03f;                           // [m] from the thread of any other suture
constexpr float kOverDrape = 0.004f, kOverField = 0.07f;     // [m]
constexpr float kDrawPatience = 8;                           // [s]
constexpr Vec3 kDrawn{-0.15f, 0.25f, 0.1f};                  // [m] of the needle: the thread is shorter

bool has_throw(const Snapshot& seen) {
  std::vector<Vec3> thread;
  for (size_t i = 0; i < seen.active().thread_order.size(); ++i) thread.push_back(node_at(seen, i));
  const SeenThrows throws = see_throws(thread);
  return throws.right + throws.left > 0;
}

}  // namespace

void Scripted::take_over_to_remove() {
  plan_.task = {{TaskKind::remove}};
  task_ = 0, retries_ = 0;
  gave_up_ = false, takes_over_ = true;
  thread_tie_.reset();
  begin();
}

// The node of the needle's strand where a cut leaves least: beyond the tissue, and no other thread between the blades.
size_t Scripted::node_to_remove(const Snapshot& seen) const {
  const size_t exit = last_point_node(seen), last = seen.active().thread_order.size() - 1;
  size_t at = exit;
  float most = -1;
  for (float out = kNearestCut + 2e-3f * static_cast<float>(misses_); out < kFarthestCut && most < kBladesClear; out += 1e-3f) {
    const size_t i = std::clamp<size_t>(node_along(seen, exit, out, 1), 1, last - 1);
    const float room = room_to_cut(seen, i, kBladesClear);
    if (room > most) most = room, at = i;
  }
  return at;
}

// On the drape, to the left of the field and in front of it or behind, where no other thread lies.
Vec3 Scripted::place_for_needle(const Snapshot& seen) const {
  constexpr std::array<Vec3, 5> kWay{
      Vec3{-0.8f, 0, 0.6f}, {-1, 0, 0}, {-0.5f, 0, 0.85f}, {-0.8f, 0, -0.6f}, {-0.5f, 0, -0.85f}};
  Vec3 best = kWay[0];
  float most = -1;
  for (const Vec3 way : kWay) {
    const Vec3 p{picture_.focus.x + kLaidAt * way.x, picture_.drape, picture_.focus.z + kLaidAt * way.z};
    const float room = room_at(picture_, seen, p, false, kLaidFree);
    if (room > most) most = room, best = p;
  }
  return best;
}

bool Scripted::remove(const Snapshot& seen) {
  enum { pull_out, over, down, snip, rise, carry, lower, open, away };
  if (stage_ >= kPiece) {
    if (!take_piece(seen)) return false;
    gave_up_ |= !seen.active().suture_point.empty();
    return true;
  }
  const float speed = skill_.speed, gently = std::clamp(1.5f - length(seen.tool[kForceps].force), 0.02f, 1.0f);
  switch (stage_) {
    case pull_out:
      rest_aside(seen, kNeedleHolder);
      if (seen.active().suture_point.empty()) go(carry);
      else if ((waited_ <= dt_ && has_throw(seen)) || !holds_needle(seen, kForceps) || !patience(kDrawPatience)) go(over);
      else move(kForceps, {pull_from_.p + kDrawn, hand_[kForceps].pose.q}, 0.5f * gently * speed);
      return false;
    case over:
    case down:
    case snip: {
      const size_t at = stage_ == over ? cut_at_ = node_to_remove(seen) : cut_at_;
      const Pose goal = blades_at(seen, at);
      jaw(kNeedleHolder, kHalfOpen);
      if (stage_ == over) {
        cuts_before_ = count_cuts(seen);
        if (move(kNeedleHolder, raised(goal, 0.015f), speed) || !patience(5)) go(down);
      } else if (stage_ == down) {
        if (move(kNeedleHolder, goal, careful()) || !patience(3)) go(snip);
      } else {
        order(CommandKind::cut, kNeedleHolder);
        go(rise);
      }
      return false;
    }
    case rise:
      move(kNeedleHolder, raised(hand_[kNeedleHolder].pose, 0.015f), speed);
      if (waited_ < 0.3f) return false;
      if (count_cuts(seen) == cuts_before_) return miss(over), false;
      go(carry);
      return false;
    case carry: {  // the strand slides out of what was tied; where it is caught, it is not torn out
      rest_aside(seen, kNeedleHolder);
      if (waited_ <= dt_) laid_at_ = place_for_needle(seen);
      const Vec3 goal = laid_at_ + Vec3{0, kOverField, 0};
      if (!holds_needle(seen, kForceps) || carry_swage(seen, goal, 0.5f * gently * speed) || !patience(kDrawPatience))
        go(lower);
      return false;
    }
    case lower:
      if (!holds_needle(seen, kForceps) || carry_swage(seen, laid_at_ + Vec3{0, kOverDrape, 0}, 0.5f * speed) || !patience(3))
        go(open);
      return false;
    case open:
      if (jaw(kForceps, 1)) go(away);
      return false;
    default:
      rest_aside(seen, kForceps);
      if (waited_ < 1) return false;
      misses_ = 0;
      go(kPiece);
      return false;
  }
}

}  // namespace catgut
