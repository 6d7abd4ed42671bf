// SPDX-License-Identifier: Apache-2.0
// surgeon/biting: tasks of Scripted with the needle: picking it up, a bite, taking it back; see scripted.h.
#include <algorithm>
#include <cmath>
#include <utility>

#include "surgeon/reach.h"
#include "surgeon/scripted.h"

namespace catgut {
namespace {

constexpr float kDriveOn = 0.08f;  // [rad] per miss of the tip
constexpr int kDriveOnAtMost = 4;
constexpr float kRoomToTie = 0.42f;     // of the needle's arc: least position of a needle holder that hands over near the swage
constexpr float kClear = 0.4f;          // [s] that the forceps backs out before anything else moves
constexpr float kTipUp = -2.2f;         // [rad] angle of the needle's circle at which its tip is up
constexpr float kStraight = 0.93f;      // of the strand's length
constexpr float kEdgeGrip = 0.003f;     // [m] of the rim between the forceps' jaws
constexpr float kEdgesLean = 0.6f;      // of the forceps at two edges
constexpr float kYieldsBack = 0.0007f;  // [m] by which the needle is pushed back before it enters a wall
constexpr float kEdgesGrip = 0.002f;    // [m] of the grasp point below two edges
constexpr float kTooShallow = 0.4f;     // of the wall, for a shallow bite
constexpr float kDeeper = 0.0005f;      // [m]
constexpr float kOutFor = 0.3f;         // [s] that a needle is out of the tissue before its bite counts as failed
constexpr float kSlit = 0.0005f;        // [m] torn by the needle on its way: it lies at an edge, or only in the surface
constexpr float kMuchDeeper = 0.0008f;  // [m] after a wall that gave way
constexpr float kTooHard = 1.5f;        // [N] on a needle that is driven, for kRidesUp: a wall that it passes takes less
constexpr float kRidesUp = 0.2f;        // [s]
constexpr int kMostMisses = 6;          // grasps at a tip that walls cover
constexpr int kAgain = 2;               // times that a bite is made again from the start
constexpr float kBeside = 0.002f;       // [m] from the place where it failed
constexpr float kDrawOut = 20;          // [s] to draw a thread out
constexpr float kScoopSpeed = 0.7f;     // of the needle's speed, with which it is lifted then
constexpr float kEntered = 0.4f;        // of the wall: deep enough to be turned
constexpr float kFlattenSpeed = 4;      // [rad/s]
constexpr float kTurnMore = 400;        // [rad/m] where a correction of the depth is one of that turn: 0.2 rad for kDeeper

}  // namespace

bool Scripted::pick_up(const Snapshot& seen) {
  enum { over, down, close };
  const Pose grip = driver_grip(seen.suture[suture_].needle.pose, first_place());
  if (stage_ != over || seen.tick > 0) rest_aside(seen, kForceps);
  switch (stage_) {
    case over:
      jaw(kNeedleHolder, 1);
      if (move(kNeedleHolder, raised(grip, 0.03f), skill_.speed)) go_down(down);
      return false;
    case down:
      if (move(kNeedleHolder, short_of(grip), careful())) go(close);
      return false;
    default:
      if (!jaw(kNeedleHolder, 0) || waited_ < 0.35f) return false;
      if (!holds_needle(seen, kNeedleHolder)) return miss(over), false;
      remember_grip(seen, kNeedleHolder);
      return true;
  }
}

int Scripted::passages(const Snapshot& seen, bool complete) const {
  int count = 0;
  for (size_t b = bites_before_; b < seen.active().bite.size(); ++b)
    count += complete ? seen.active().bite[b].complete : seen.active().bite[b].has_exit;
  return count;
}

bool Scripted::too_deep(const Snapshot& seen) const {
  if (bite().deepest <= 0 || seen.active().bite.size() <= bites_before_) return false;
  const BiteView& b = seen.active().bite.back();
  return b.depth > bite().deepest * skill_.wall || b.entry_inside || (b.has_exit && b.exit_inside);
}

bool Scripted::holds_well(const Snapshot& seen, size_t hand) const {
  return holds_needle(seen, hand) && (plan_.pull <= 0 || !catches_thread(picture_, seen, seen.tool[hand]));
}

bool Scripted::tears(const Snapshot& seen) const {
  const auto& bite = seen.active().bite;
  return std::any_of(bite.begin() + static_cast<std::ptrdiff_t>(std::min(bites_before_, bite.size())), bite.end(),
                     [](const BiteView& b) { return b.torn > kSlit; });
}

void Scripted::hold_or_rest(const Snapshot& seen) {
  if (seen.tool[kForceps].held != Held::tissue) rest_aside(seen, kForceps);
}

bool Scripted::hold_edge(const Snapshot& seen) {
  enum { over, down, close };
  rest_aside(seen, kNeedleHolder);
  BiteFrame f = frame(seen, place_);
  Pose grip;
  if (bite().walls > 1) {  // both edges between the jaws, above the needle's way
    // It leans away from the needle holder, which passes above it as the needle is driven.
    const Vec3 side = cross(f.along, f.out), holder = rotate(holding(kNeedleHolder, needle_at(f, 0)).q, {0, 0, 1});
    const Vec3 z = normalized(f.out + side * (dot(holder, side) > 0 ? -kEdgesLean : kEdgesLean));
    grip = {f.at - f.out * kEdgesGrip, from_axes(f.along, cross(z, f.along), z)};
  } else {  // where the needle enters
    grip = {f.at - f.along * (0.5f * bite().length) + f.up * (skill_.edge_distance - kEdgeGrip) - f.out * (0.5f * skill_.wall),
            from_axes(f.out, cross(f.up, f.out), f.up)};
  }
  switch (stage_) {
    case over:
      jaw(kForceps, 1);
      if (move(kForceps, raised(grip, 0.02f), skill_.speed)) go_down(down);
      else if (!patience(6)) gave_up_ = true;
      return false;
    case down:
      if (move(kForceps, short_of(grip), careful())) go(close);
      else if (!patience(4)) gave_up_ = true;
      return false;
    default:
      if (!jaw(kForceps, 0) || waited_ < 0.3f) return false;
      if (seen.tool[kForceps].held != Held::tissue) return miss(over), false;
      return true;
  }
}

void Scripted::turn_about_tip(float by) {
  const auto to_center = [&] { return frame_.out * portable::cos(psi_) - frame_.along * portable::sin(psi_); };
  const Vec3 before = to_center();
  psi_ += by, flattened_ += by;
  frame_.at += (to_center() - before) * shape().needle_radius;
}

// A needle whose circle lies less deep would not enter at all: it is turned more in the wall instead.
void Scripted::correct_depth(float shallower) {
  if (plan_.flatten > 0) turn_fix_ += kTurnMore * shallower;
  else next_fix_ = shallower;
}

bool Scripted::make_bite(const Snapshot& seen) {
  enum { hover, approach, drive, withdraw, let_go, over, down, close, release, retreat, bring };
  const float speed = skill_.speed, psi_bite = half_bite_angle();
  const Pose& needle = seen.active().needle.pose;
  if (stage_ == hover && waited_ <= dt_) {
    aim();
    tip_misses_ = 0;
    aim_up_ += kBeside * static_cast<float>(again_), depth_error_ -= kDeeper * static_cast<float>(again_);  // clear of the slit
  }
  switch (stage_) {
    case hover: {  // to a position beside the bite, clear of the organ
      doing_ = name_of_bite() + "approach";
      hold_or_rest(seen);
      BiteFrame f = frame(seen, place_);
      f.at += f.out * 0.022f + f.up * plan_.lift;
      if (move(kNeedleHolder, holding(kNeedleHolder, needle_at(f, -psi_bite - 0.7f)), speed)) go(approach);
      else if (!patience(6)) gave_up_ = true;
      return false;
    }
    case approach: {
      hold_or_rest(seen);
      scooped_ = 0, flattened_ = 0, hard_ = 0;
      frame_ = frame(seen, place_);
      if (bite().walls > 1 && seen.tool[kForceps].held == Held::tissue)  // midway between both edges, where it holds them
        frame_.at += frame_.along * (dot(seen.tool[kForceps].pose.p - frame_.at, frame_.along) + kYieldsBack);
      frame_.at += frame_.along * aim_along_ + frame_.up * aim_up_;
      if (aim_turn_ != 0) {
        const Quat turn = axis_angle(frame_.out, aim_turn_);
        frame_.along = rotate(turn, frame_.along), frame_.up = rotate(turn, frame_.up);
      }
      psi_ = -psi_bite - 0.45f;
      if (move(kNeedleHolder, holding(kNeedleHolder, needle_at(frame_, psi_)), careful())) {
        bites_before_ = seen.active().bite.size();
        points_before_ = seen.active().suture_point.size();
        go(drive);
      } else if (!patience(5)) {
        gave_up_ = true;
      }
      return false;
    }
    case drive: {
      doing_ = name_of_bite() + "drive the needle";
      hold_or_rest(seen);
      // Square to the wall until the tip is deep enough in it, then shallow.
      const float depth = seen.active().needle.in_tissue ? seen.active().bite.back().depth / skill_.wall : 0;
      if (flattened_ < plan_.flatten + turn_fix_ && depth > kEntered) {
        turn_about_tip(std::min(plan_.flatten + turn_fix_ - flattened_, kFlattenSpeed * dt_));
      } else {
        psi_ += skill_.drive_speed / shape().needle_radius * dt_;
      }
      if (plan_.scoop > 0 && depth > bite().deep) {
        const float up = std::min(plan_.scoop - scooped_, kScoopSpeed * skill_.drive_speed * dt_);
        frame_.at += frame_.out * up, scooped_ += up;
      }
      move(kNeedleHolder, holding(kNeedleHolder, needle_at(frame_, psi_)), 2 * speed);
      const int passed = passages(seen, false);
      if (too_deep(seen)) {
        correct_depth(kDeeper);
        go(withdraw);
        return false;
      }
      if (plan_.pull > 0 && tears(seen)) {
        next_fix_ = -kDeeper;
        go(withdraw);
        return false;
      }
      // A wall that rides up on the needle would be torn.
      hard_ = length(seen.tool[kNeedleHolder].force) > kTooHard ? hard_ + dt_ : 0;
      if (plan_.pull > 0 && hard_ > kRidesUp && passed < bite().walls) {
        next_fix_ = -kMuchDeeper;
        go(withdraw);
        return false;
      }
      // A shallow bite that holds too little is made again, deeper.
      const bool shallow = plan_.scoop > 0 || plan_.flatten > 0;
      if (shallow && passed > 0 && seen.active().bite.back().depth < kTooShallow * skill_.wall) {
        correct_depth(-kDeeper);
        go(withdraw);
      } else if (passed >= bite().walls && psi_ > psi_bite + plan_.beyond) {
        go(seen.tool[kForceps].held == Held::tissue ? let_go : over);
      } else if (psi_ > psi_bite + 1.1f) {
        // The tip is misplaced: it did not enter, is not deep enough, or is too deep to exit.
        // Through the first wall but not the second, which was pushed away by millimeters, as soft walls are.
        const bool gave_way = passed > 0 && passed < bite().walls;
        next_fix_ = gave_way ? -kMuchDeeper : passed > 0 || !seen.active().needle.in_tissue ? -0.0003f : 0.0003f;
        go(withdraw);
      }
      return false;
    }
    case withdraw: {  // back along the same arc, then the same bite again
      doing_ = name_of_bite() + "withdraw and retry";
      hold_or_rest(seen);
      psi_ = std::max(psi_ - 2 * skill_.drive_speed / shape().needle_radius * dt_, -psi_bite - 0.7f);
      BiteFrame f = frame_;
      if (!patience(1.5f)) f.at += f.out * std::min(0.01f, 0.01f * (waited_ - 1.5f));  // stuck: move away from the wall
      move(kNeedleHolder, holding(kNeedleHolder, needle_at(f, psi_)), 2 * speed);
      if (psi_ <= -psi_bite - 0.7f && !seen.active().needle.in_tissue) {
        ++retries_;
        depth_fix_ += std::exchange(next_fix_, 0.0f);
        if (++attempts_ > kAttempts) gave_up_ = true;
        if (holds_edge(place_) && seen.tool[kForceps].held != Held::tissue) return bite_again(seen);
        go(hover);
      } else if (!patience(8)) {
        gave_up_ = true;
      }
      return false;
    }
    case let_go:  // of the edge, and off it
      if (seen.tool[kForceps].held == Held::tissue || !jaw(kForceps, 1)) jaw(kForceps, 1), waited_ = 0;
      else if (move(kForceps, raised(hand_[kForceps].pose, 0.02f), skill_.speed) || waited_ > 0.15f) go(over);
      return false;
    case over: {
      doing_ = name_of_bite() + "grasp the tip";
      if (plan_.lumen && waited_ <= dt_) choose_tip_way(seen);
      jaw(kForceps, plan_.tip_open);
      // A tip that was missed is driven on: more of it is out then.
      const float psi = psi_bite + plan_.beyond + kDriveOn * static_cast<float>(std::min(tip_misses_, kDriveOnAtMost));
      if (tip_misses_ > 0 && psi_ < psi && holds_needle(seen, kNeedleHolder)) {
        psi_ = std::min(psi, psi_ + skill_.drive_speed / shape().needle_radius * dt_);
        move(kNeedleHolder, holding(kNeedleHolder, needle_at(frame_, psi_)), 2 * speed);
      }
      if (move(kForceps, raised(forceps_grip(needle), 0.025f), speed)) go_down(down);
      return false;
    }
    case down:
      if (move(kForceps, short_of(forceps_grip(needle)), careful())) go(close);
      return false;
    case close:
      if (!jaw(kForceps, 0) || waited_ < 0.3f) return false;
      if (!holds_well(seen, kForceps)) {
        if (!holds_needle(seen, kForceps)) ++tip_misses_;  // else it held thread, too
        miss(over);
        if (plan_.pull > 0 && misses_ > kMostMisses && holds_needle(seen, kNeedleHolder)) misses_ = 0, go(withdraw);
        return false;
      }
      misses_ = 0;
      remember_grip(seen, kForceps);
      go(release);
      return false;
    case release:
      if (jaw(kNeedleHolder, 1)) go(retreat);
      return false;
    case retreat:
      if (move(kNeedleHolder, raised(hand_[kNeedleHolder].pose, 0.01f), speed) || waited_ > 0.25f) go(bring);
      return false;
    default: {
      doing_ = name_of_bite() + "pull the needle through";
      if (!holds_needle(seen, kForceps)) return miss(over), false;  // it has slipped out
      rest_aside(seen, kNeedleHolder);
      psi_ = std::min(psi_ + 2 * skill_.drive_speed / shape().needle_radius * dt_, psi_bite + kPi + 0.5f);
      BiteFrame f = frame_;
      if (!patience(3))  // stuck: an outward pull frees the back end
        f.at += (f.out + (plan_.lift > 0 ? 0.4f : 0.0f) * f.up) * std::min(0.02f, 0.01f * (waited_ - 3));
      move(kForceps, holding(kForceps, needle_at(f, psi_)), 2 * speed);
      const bool out = !seen.active().needle.in_tissue, complete = passages(seen, true) >= bite().walls;
      if (out) pull_from_ = hand_[kForceps].pose;
      if (out && complete) {
        if (task_ + 1 == plan_.task.size() || plan_.task[task_ + 1].kind != TaskKind::pull_tail) again_ = 0;
        return true;
      }
      steady_ = out ? steady_ + dt_ : 0;
      if (steady_ > kOutFor) return bite_again(seen);
      if (!patience(8)) gave_up_ = true;
      return false;
    }
  }
}

bool Scripted::holds_edge(size_t place) const {
  return std::any_of(plan_.task.begin(), plan_.task.end(),
                     [&](const Task& t) { return t.kind == TaskKind::hold_edge && t.which == static_cast<int>(place); });
}

bool Scripted::bite_again(const Snapshot& seen) {
  // Thread cannot be drawn out of one bite alone.
  const bool threaded = seen.active().suture_point.size() > points_before_;
  if (++again_ > kAgain || (threaded && points_before_ > 0)) return gave_up_ = true, false;
  ++retries_;
  const int which = static_cast<int>(place_);
  std::vector<Task> task;
  if (threaded) task.push_back({TaskKind::draw_out});
  if (holds_needle(seen, kForceps)) task.push_back({TaskKind::hand_back});
  if (holds_edge(place_)) task.push_back({TaskKind::hold_edge, which});
  task.push_back({TaskKind::bite, which});
  if (plan_.task[task_].kind == TaskKind::pull_tail) task.push_back({TaskKind::pull_tail});
  plan_.task.insert(plan_.task.begin() + static_cast<std::ptrdiff_t>(task_) + 1, task.begin(), task.end());
  return true;
}

bool Scripted::draw_out(const Snapshot& seen) {
  rest_aside(seen, kNeedleHolder);
  if (seen.active().suture_point.size() <= points_before_) return true;
  if (!holds_needle(seen, kForceps) || !patience(kDrawOut)) return gave_up_ = true, false;
  enum { sweep, lift };
  if (stage_ == sweep && task_ > 0 && plan_.task[task_ - 1].kind == TaskKind::pull_tail) go(lift);
  if (stage_ == sweep) {  // on along its arc: it may still lie between two edges
    const float end = half_bite_angle() + kPi + 0.5f;
    psi_ = std::min(psi_ + 2 * skill_.drive_speed / shape().needle_radius * dt_, end);
    move(kForceps, holding(kForceps, needle_at(frame_, psi_)), skill_.speed);
    if (psi_ >= end && waited_ > 0.5f) go(lift);
    return false;
  }
  const float gently = std::clamp(1.5f - length(seen.tool[kForceps].force), 0.02f, 1.0f);
  move(kForceps, {pull_from_.p + frame_.out * 0.3f, hand_[kForceps].pose.q}, gently * 0.5f * skill_.speed);
  return false;
}

void Scripted::hold_strand_straight(const Snapshot& seen, BiteFrame& f, float psi) const {
  const size_t from = last_point_node(seen);
  const float want = kStraight * length_between(seen, from, seen.active().thread_order.size() - 1);
  const Vec3 hole = node_at(seen, from);
  for (int i = 0; i < 4; ++i) {
    const Vec3 end = transform(needle_at(f, psi), {shape().needle_radius, 0, 0});
    f.at += f.out * (want - distance(end, hole));
  }
}

bool Scripted::take_back(const Snapshot& seen, bool present) {
  enum { bring, over, down, close, give, clear };
  // To tie, the forceps takes the needle near its swage: the holder leaves it room. Drawn jaws are 3 mm wide, and wider open.
  const bool guided = plan_.pull <= 0;
  const float least = !present && guided ? kRoomToTie : 0;
  const size_t next = again_ > 0 ? place_ : std::min(place_ + 1, plan_.place.size() - 1), taken_for = present ? next : place_;
  switch (stage_) {
    case bring: {
      // It is taken from the needle holder's side: the holder waits there, or its path would cross the forceps.
      if (present) rest_aside(seen, kNeedleHolder);
      else
        move(kNeedleHolder, {stitch(seen) + Vec3{0.09f * plan_.driver_side, 0.09f, 0}, tying_pose(kNeedleHolder, {}).q},
             skill_.speed);
      // Before a bite the needle is moved beside its target; before a knot high above the stitch, with its tip up and out of
      // reach.
      BiteFrame f = present ? frame(seen, next) : BiteFrame{stitch(seen), {0, 1, 0}, {0, 0, -1}, {1, 0, 0}};
      f.at += f.out * (present ? 0.03f : 0.045f) + f.up * (present ? 1.7f * plan_.lift : 0.0f);
      const float psi = present ? -half_bite_angle() - 0.7f : kTipUp;
      if (plan_.pull > 0 && (plan_.lift == 0 || !present)) hold_strand_straight(seen, f, psi);
      if (move(kForceps, holding(kForceps, needle_at(f, psi)), skill_.speed)) go(over);
      else if (!patience(6)) gave_up_ = true;
      return false;
    }
    case over:
      jaw(kNeedleHolder, 1);
      if (move(kNeedleHolder, raised(driver_grip(seen.active().needle.pose, taken_for, least), 0.025f), skill_.speed))
        go_down(down);
      return false;
    case down:
      if (move(kNeedleHolder, short_of(driver_grip(seen.active().needle.pose, taken_for, least)), careful())) go(close);
      return false;
    case close:
      if (!jaw(kNeedleHolder, 0) || waited_ < 0.3f) return false;
      if (!holds_well(seen, kNeedleHolder)) return miss(over), false;
      remember_grip(seen, kNeedleHolder);
      go(give);
      return false;
    case give:
      if (jaw(kForceps, guided ? kJustOpen : 1.0f)) go(clear);
      return false;
    default:  // back out along its own shaft first: the tools are close to each other, and rigid
      return move(kForceps, raised(hand_[kForceps].pose, 0.01f), skill_.speed) || waited_ > (guided ? kClear : 0.2f);
  }
}

}  // namespace catgut
