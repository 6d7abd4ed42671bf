// SPDX-License-Identifier: Apache-2.0
// surgeon/tying: instrument ties; see scripted.h.
#include <cmath>

#include "surgeon/scripted.h"

namespace catgut {
namespace {

constexpr float kLeastFreeForOwn = 0.038f;  // the same where the strand is then led along the needle holder to its jaws
constexpr float kWindOwnAt = 0.022f;        // [m] behind the tip, where such a strand is wound
constexpr float kOwnSide = 1.0f;            // part of the direction in which a tail is laid apart, against one to the front
constexpr float kTautTail = 1.5f;           // [N] on the hand that lays it down
constexpr float kTailAside = 0.030f;        // [m] from the stitch, where the tail is laid down
constexpr float kTieCrossing = 0.3f;        // fraction of the path of crossed hands, forward and backward
constexpr float kThrowComesDown = 3;        // [s] in which a throw reaches the tissue; most take less than one
constexpr uint8_t kAssistant = 2;
constexpr float kClampsBack = 1.2f;  // of the time that the clamps took in: they stop by themselves where the scene had them
constexpr float kTyingAt = 0.12f;    // position on the needle's arc: behind the swage
// The same with physical mechanics. The forceps lies along the needle, whose swage stands out beyond the tips: a strand that is
// wound then turns in front of the jaws, and never between them and the needle.
constexpr float kTyingAlong = 0.16f;
constexpr Vec3 kFromFront{0, 0.28f, 0.96f};       // the same of the assistant's forceps: lower than the strand that is wound
constexpr float kReleases = 0.5f, kAjar = 0.36f;  // of jaws within a throw, which wide open would break it
constexpr float kBetweenJaws = 0.4e-3f;           // [m] of a crossing from the middle of the jaws that close on it
constexpr float kGathers = 6;                     // [s] in which a rim follows both strands

// What is seen, turned.
Snapshot turned(const Snapshot& seen, Quat by) {
  const auto turn = [&](Pose& pose) { pose = {rotate(by, pose.p), by * pose.q}; };
  Snapshot out = seen;
  for (Vec3& p : out.particle) p = rotate(by, p);
  for (ToolView& tool : out.tool) turn(tool.pose);
  for (SutureView& suture : out.suture) {
    turn(suture.needle.pose);
    for (SuturePointView& p : suture.suture_point) p.position = rotate(by, p.position);
  }
  return out;
}

}  // namespace

Pose Scripted::tying_pose(size_t hand, Vec3 at) {
  return {at, from_tool_axis(tying_axis(hand == kNeedleHolder ? 1.0f : -1.0f))};
}

bool Scripted::regrip(const Snapshot& seen) {
  enum { first = 0, over = 10, down, close, give };
  if (stage_ < over) {
    if (!holds_needle(seen, kNeedleHolder) || stage_ > first) {
      if (!take_back(seen, false)) return false;
    }
    go(over);
    return false;
  }
  const float phi = (plan_.pull > 0 ? kTyingAlong : kTyingAt) * shape().needle_arc;
  const Pose& needle = seen.active().needle.pose;
  const Vec3 place = transform(needle, shape().needle_radius * Vec3{portable::cos(phi), portable::sin(phi), 0});
  Pose grip = tying_pose(kForceps, place);
  if (plan_.pull > 0) {
    const Vec3 z = rotate(needle.q, {-portable::sin(phi), portable::cos(phi), 0}), x = rotate(needle.q, {0, 0, 1});
    grip.q = from_axes(x, cross(z, x), z);
  }
  switch (stage_) {
    case over:
      jaw(kForceps, plan_.pull > 0 ? 1.0f : kJustOpen);
      if (move(kForceps, raised(grip, 0.025f), skill_.speed)) go(down);
      else if (!patience(6)) gave_up_ = true;
      return false;
    case down:
      if (move(kForceps, grip, careful())) go(close);
      else if (!patience(4)) gave_up_ = true;
      return false;
    case close:
      if (!jaw(kForceps, 0) || waited_ < 0.3f) return false;
      if (!holds_well(seen, kForceps)) return miss(over), false;
      remember_grip(seen, kForceps);
      go(give);
      return false;
    default:
      // Physical jaws hold until they are half open: a hand that leaves earlier pulls at the other one with 8 N.
      if (!jaw(kNeedleHolder, 1) && plan_.pull > 0) return waited_ = 0, false;
      return move(kNeedleHolder, raised(hand_[kNeedleHolder].pose, 0.02f), skill_.speed) || waited_ > 0.6f;
  }
}

bool Scripted::carry_swage(const Snapshot& seen, Vec3 goal, float speed) {
  return move(kForceps, {goal + (seen.tool[kForceps].pose.p - swage(seen)), tying_pose(kForceps, {}).q}, speed);
}

bool Scripted::lay_tail(const Snapshot& seen) {
  const float tail = length_between(seen, first_point_node(seen), node_of(seen, seen.tool[kNeedleHolder].held_slot));
  Vec3 from = stitch(seen), way{-0.2f, 0.2f, 1.0f};
  if (picture_.body.size() > 1 && !seen.active().suture_point.empty()) {
    const Vec3 exit = seen.active().suture_point.front().position;
    way += kOwnSide * normalized(exit - from);
    if (seen.active().knot.empty()) from = exit;
  }
  const Vec3 place = from + std::min(kTailAside, 0.8f * tail) * normalized(way);
  // The tail of a locked throw gives nothing: where it is taut, it is laid down there.
  const float pull = length(seen.tool[kNeedleHolder].force);
  const bool gentle = skill_.most_load > 0;
  if (gentle && pull > 2 * kTautTail && !seen.active().knot.empty()) return true;
  const float speed = gentle ? skill_.speed * std::clamp(1.5f - pull, 0.1f, 1.0f) : skill_.speed;
  return move(kNeedleHolder, {place, hand_[kNeedleHolder].pose.q}, speed);
}

void Scripted::choose_grasp(const Snapshot& seen) {
  TailGrip grip;
  if (best_tail_grip(picture_, seen, kNeedleHolder, 1, kTailByScript, {&tried_, misses_ > 0 ? 1u : 0u}, grip))
    take_slot_ = grip.slot, take_turn_ = grip.pose.q;
  tried_ = node_at(seen, node_of(seen, take_slot_));
}

bool Scripted::tie(const Task& task, const Snapshot& seen) {
  enum { lift, lay, beside, wind, over, down, close, tighten, lay_down, open, unwind };
  const bool own_strand = task.kind == TaskKind::lock_strand;
  doing_ = std::string(own_strand ? "lock the thread: " : "throw: ") + std::to_string(task.which) + " wrap" +
           (task.which > 1 ? "s" : "");
  const ToolView& driver = seen.tool[kNeedleHolder];
  const float side = static_cast<float>(task.way);
  const size_t last = seen.active().thread_order.size() - 1;
  if (stage_ == lift && waited_ <= dt_) {
    begin_winding(winding_, picture_, seen, own_strand ? kLeastFreeForOwn : kTieLeastFree, own_strand);
    throws_before_ = locked_throws(seen);
  }
  winding_.way = side;
  const AcrossTool across(rotate(tying_pose(kNeedleHolder, {}).q, {0, 0, 1}));
  const Vec3 axis_at = winding_axis(winding_, across);
  const float wind_at = own_strand ? kWindOwnAt : kTieWindAt;
  const Pose lying = tying_pose(kNeedleHolder, axis_at - across.z * wind_at);
  float room = 1;
  auto swage_at = [&](float w) { return winding_swage(winding_, across, w, room); };
  const float tension = needle_tension(seen);
  if (stage_ == lift && waited_ <= dt_) winding_.free = kTieTaut * (winding_.reach - distance(winding_.start, axis_at));
  const float behind = stage_ <= wind ? distance(swage(seen), swage_at(winding_.wound)) : 0;
  if (stage_ == beside || stage_ == wind) feel_winding(winding_, seen, across, behind, room, dt_);
  switch (stage_) {
    case lift:
      jaw(kNeedleHolder, kHalfOpen);
      move(kNeedleHolder, {lying.p - across.e2 * (side * 0.03f) + Vec3{0, 0.01f, 0}, lying.q}, skill_.speed);
      if (carry_swage(seen, swage_at(winding_.wound), skill_.speed)) go(lay);
      else if (!patience(8)) go(lay);
      return false;
    case lay:
      carry_swage(seen, swage_at(winding_.wound), skill_.speed);
      if (move(kNeedleHolder, {lying.p - across.e2 * (side * 0.012f), lying.q}, skill_.speed)) go(beside);
      else if (!patience(6)) gave_up_ = true;
      return false;
    case beside:
      carry_swage(seen, swage_at(winding_.wound), careful());
      if ((move(kNeedleHolder, lying, careful()) && tension > 0.02f) || !patience(4)) go(wind);
      return false;
    case wind: {
      const float want = static_cast<float>(task.which) * 2 * kPi + 0.6f;
      // The needle waits while it lags behind: otherwise the strand would be slack, or cut the corner.
      const float turn = 2.2f * dt_ * std::clamp(1.5f - behind / 0.006f, 0.0f, 1.0f);
      // Wound but not a loop yet: its ends are too far apart along the needle holder, and are moved together.
      if (winding_.wound + turn < want + 0.9f)
        winding_.wound += turn, winding_.free = std::max(0.006f, winding_.free - kTieWound * turn);
      else winding_.lean = std::max(-2 * kTieLean, winding_.lean - kTieLean * dt_);
      carry_swage(seen, swage_at(winding_.wound), 1.2f * skill_.speed);
      move(kNeedleHolder, lying, careful());
      if (driver.loop_wraps >= static_cast<uint32_t>(task.which)) go(over);
      else if (!patience(9)) go(unwind);
      return false;
    }
    case over:
    case down:
    case close: {
      if (driver.loop_wraps == 0 && stage_ != close) return miss(lift), false;
      if (own_strand) return take_strand(seen, lying, close, tighten, lift);
      const size_t first = first_point_node(seen);
      if (stage_ == over && waited_ <= dt_) choose_grasp(seen);
      const Pose goal{node_at(seen, node_of(seen, take_slot_)), take_turn_};
      // The forceps follows above, with its strand slack; both hands slow down when it becomes taut.
      if (stage_ == over && waited_ <= dt_)
        winding_.free = kTieLoose * length_between(seen, node_of(seen, driver.loop_last), last);
      if (tension > kTieTooTaut) winding_.free = std::max(0.002f, feel_strand(winding_.free, tension, dt_));
      const Vec3 turns = hand_[kNeedleHolder].pose.p + rotate(hand_[kNeedleHolder].pose.q, {0, 0, kTieWindAt});
      carry_swage(seen, strand_above(winding_, across, turns), 2 * skill_.speed);
      const float calm = std::clamp(1.5f - tension, 0.05f, 1.0f);
      if (stage_ == over) {
        jaw(kNeedleHolder, kHalfOpen);
        if (move(kNeedleHolder, raised(goal, 0.012f), 0.6f * skill_.speed * calm)) go(down);
        else if (!patience(6)) miss(unwind);
      } else if (stage_ == down) {
        if (move(kNeedleHolder, goal, careful() * calm)) go(close);
        else if (!patience(4)) miss(over);
      } else if (driver.held == Held::nothing && !move(kNeedleHolder, goal, careful() * calm)) {  // it has moved: follow it
        jaw(kNeedleHolder, kHalfOpen);
        if (!patience(4)) miss(over);
      } else if (jaw(kNeedleHolder, 0) && waited_ > 0.35f) {
        if (driver.held == Held::thread && node_of(seen, driver.held_slot) < first) {
          pull_from_ = hand_[kNeedleHolder].pose;
          go(tighten);
        } else {
          miss(over);
        }
      }
      return false;
    }
    case tighten: {
      const bool locked = locked_throws(seen) > throws_before_;
      // The strands are pulled apart, low and evenly.
      auto gently = [&](size_t hand) {
        return 0.6f * skill_.speed * std::clamp(1.5f * strength_ - length(seen.tool[hand].force), 0.03f, 1.0f);
      };
      // Where the hands cross, the needle holder, which has the tail, passes in front.
      const float front = side < 0 ? kTieCrossing : 0;
      // A throw that does not come down in time hangs on a tail that lies under an edge: the tail is raised out of there.
      const float rise = patience(kThrowComesDown) ? 0.35f : 2.0f;
      const Vec3 right = normalized(Vec3{side, rise, 0.1f + front}), left = normalized(Vec3{-side, 0.35f, 0.1f - front});
      const bool gentle = skill_.most_load > 0;
      if (locked && gentle && length(driver.force) > kTautTail) {  // a locked throw gives no more thread: the hand gives way
        move(kNeedleHolder, {stitch(seen), hand_[kNeedleHolder].pose.q}, 0.5f * skill_.speed);
      } else if (!locked || !gentle) {
        move(kNeedleHolder, {pull_from_.p + right * 0.08f, hand_[kNeedleHolder].pose.q}, gently(kNeedleHolder));
        carry_swage(seen, winding_.start + (own_strand ? Vec3{0, 1, 0} : left) * (0.9f * winding_.reach), gently(kForceps));
      }
      if (locked && (waited_ > 0.5f || driver.held != Held::thread)) go(driver.held == Held::thread ? lay_down : open);
      else if (driver.held != Held::thread) miss(lift);
      else if (!patience(8)) miss(unwind);
      return false;
    }
    case lay_down:
      if (own_strand || lay_tail(seen) || !patience(2.5f)) go(open);
      return false;
    case open:
      jaw(kNeedleHolder, kHalfOpen);
      return move(kNeedleHolder, raised(hand_[kNeedleHolder].pose, 0.02f), skill_.speed) || waited_ > 0.8f;
    default:  // unwind: shake the loop off and start again
      // Not before the jaws are open, and not against a taut strand: it would pull the tail out of the tissue.
      if (!jaw(kNeedleHolder, 1)) return false;
      winding_.wound = std::max(kTieBefore, winding_.wound - 4 * dt_);
      carry_swage(seen, swage_at(winding_.wound), skill_.speed);
      if ((move(kNeedleHolder, raised(lying, 0.03f), skill_.speed * std::clamp(1 - 2 * tension, 0.0f, 1.0f)) && waited_ > 1) ||
          !patience(5))
        miss(lift);
      return false;
  }
}

bool Scripted::tie_thread(const Task& task, const Snapshot& seen) {
  enum { start, work };
  // ThreadTie sees its stitch along x, from the viewer's side.
  const Quat from_knot = axis_angle({0, 1, 0}, plan_.knot_turn), to_knot = conjugate(from_knot);
  const auto turn_hands = [&](Quat by) {
    for (ScriptedHand& hand : hand_) hand.pose = {rotate(by, hand.pose.p), by * hand.pose.q};
  };
  const bool turns = plan_.knot_turn != 0;
  const Snapshot copy = turns ? turned(seen, to_knot) : Snapshot{};
  const Snapshot& at_knot = turns ? copy : seen;
  if (turns) turn_hands(to_knot);
  if (stage_ == start) {
    const bool first = !thread_tie_;
    if (first)
      thread_tie_.emplace(picture_, hand_, ThreadTieSettings{skill_.speed, plan_.pull, plan_.flat, plan_.lumen, plan_.aside});
    thread_tie_->begin(at_knot, task.which, task.way, first, task.release || task.assistant != 0);
    clamped_ = task.assistant > 0 ? kGathers : (kClampsBack * plan_.approximate - plan_.stay) / kClampSpeed;
    go(work);
  }
  const bool over = thread_tie_->operate(at_knot, dt_);
  if (turns) turn_hands(from_knot);
  doing_ = "throw: " + thread_tie_->doing();
  if (thread_tie_->keeping()) {
    doing_ = task.assistant > 0   ? "throw: hold both strands while the assistant takes them"
             : task.assistant < 0 ? "throw: hold both strands while the assistant lets go"
                                  : "throw: hold both strands while the clamps go back";
    if (task.assistant == 0) order_clamps(false);
    clamped_ -= dt_;
    if (clamped_ < 0 && (task.assistant == 0 || (task.assistant > 0 ? take_crossing(seen) : leave_crossing(seen))))
      thread_tie_->let_go();
  }
  if (over && thread_tie_->failed()) gave_up_ = true;
  return over;
}

bool Scripted::take_crossing(const Snapshot& seen) {
  enum { wait, over, down, close };
  ScriptedHand& hand = assistant_[0];
  const ToolView& tool = seen.tool[kAssistant];
  const Quat turn = axis_angle({0, 1, 0}, plan_.knot_turn);
  const Pose goal{knot_center(seen, stitch(seen)), turn * from_axes(cross({1, 0, 0}, kFromFront), {1, 0, 0}, kFromFront)};
  const Vec3 off = goal.p - tool.pose.p;  // by sight of the jaws, which tissue and thread push aside
  switch (assisting_) {
    case wait:
      assisting_ = over;
      return false;
    case over:
      if (move_jaw(hand, kHalfOpen, dt_) && move_toward(hand, raised(goal, 0.025f), skill_.speed, dt_)) assisting_ = down;
      return false;
    case down:
      move_toward(hand, {hand.pose.p + off, goal.q}, careful(), dt_);
      if (length(off) < kBetweenJaws) assisting_ = close, steady_ = 0;
      return false;
    default:
      steady_ += dt_;
      if (!move_jaw(hand, 0, dt_)) return false;
      if (tool.held == Held::thread && tool.held_strands > 1) return true;
      if (steady_ > 0.5f) assisting_ = over;
      return false;
  }
}

bool Scripted::leave_crossing(const Snapshot& seen) {
  ScriptedHand& hand = assistant_[0];
  if (assisting_ == 0) return true;
  if (seen.tool[kAssistant].held != Held::nothing) return move_jaw(hand, kReleases, dt_), false;
  hand.jaw = kAjar;
  const Vec3 away = hand.pose.p - knot_center(seen, stitch(seen));
  move_toward(hand, raised(hand.pose, 0.02f), skill_.speed, dt_);
  if (length(away) > 0.03f) assisting_ = 0;
  return false;
}

void Scripted::order_clamps(bool advance) {
  const CommandKind kind = advance ? CommandKind::advance_clamp : CommandKind::retract_clamp;
  for (uint16_t body = 0; body < 2; ++body) commands_.push({kind, kAssistant, body});
}

bool Scripted::take_strand(const Snapshot& seen, const Pose& lying, int close, int tighten, int again) {
  const Vec3 z = rotate(lying.q, {0, 0, 1});
  const ToolView& driver = seen.tool[kNeedleHolder];
  // In line with the turns, along the needle holder and between its jaws; pulled until taut.
  const float left = length_between(seen, node_of(seen, driver.loop_last), seen.active().thread_order.size() - 1);
  if (stage_ != close && waited_ <= dt_) winding_.free = 0.9f * left;
  const float tension = needle_tension(seen);
  const Vec3 ahead = lying.p - z * std::max(0.004f, winding_.free - kWindOwnAt);
  const bool there = distance(swage(seen), ahead) < 0.002f;
  if (there || tension > kTieTooTaut) winding_.free = feel_strand(winding_.free, tension, dt_);
  if (stage_ != close) {
    jaw(kNeedleHolder, kHalfOpen);
    move(kNeedleHolder, lying, careful());
    carry_swage(seen, ahead, 0.5f * skill_.speed);
    if ((there && tension > 0.03f && waited_ > 0.5f) || !patience(5)) go(close);
    return false;
  }
  if (jaw(kNeedleHolder, 0) && waited_ > 0.35f) {
    if (driver.held == Held::thread && node_of(seen, driver.held_slot) > last_point_node(seen)) {
      pull_from_ = hand_[kNeedleHolder].pose;
      go(tighten);
    } else {
      miss(again);
    }
  }
  return false;
}

}  // namespace catgut
