// SPDX-License-Identifier: Apache-2.0
// surgeon/scripted: tasks and pulling thread; see scripted.h. Bites are in biting.cpp.
#include "surgeon/scripted.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include "surgeon/excision.h"
#include "surgeon/operation.h"
#include "surgeon/reach.h"
#include "surgeon/slit.h"

namespace catgut {
namespace {

constexpr float kCounterHold = 0.8f;  // [N]
constexpr float kTighten = 0.15f;     // of the free speed: the thread runs through two dozen holes, and tissue follows it late
constexpr float kSecure = 0.985f;     // fraction of a closure that counts as closed
constexpr float kMissBy = 0.008f;     // [m] along the shaft
constexpr float kForcepsAt = 0.93f;   // position on the needle's arc: behind the tip
// Ways of the forceps to a tip in a lumen: of the plan's lean, [rad] more than its angle.
constexpr struct TipWay {
  float lean, psi;
} kTipWay[] = {{1, 0}, {0.6f, 0}, {1.8f, 0}, {1, 0.5f}, {1, -0.5f}, {0.6f, 0.5f}, {0.6f, -0.5f}, {0.35f, 0}};
constexpr float kOtherLean = 0.2f;     // of the forceps' lean at a tip, less with every miss
constexpr float kGathering = 0.03f;    // [m/s] at most of hands that draw a purse-string
constexpr float kGatherPatience = 25;  // [s]
constexpr float kFeel = 0.2f;          // share of a new value per tick
constexpr float kLoose = 0.05f;        // [N] of thread that is let go
constexpr float kGathered = 1;         // [s] of full tension on both ends

}  // namespace

Scripted::Scripted(const std::string& plan, const PictureModel& picture, const SurgeonSkill& skill)
    : picture_(picture), skill_(skill), plan_(make_plan(plan, picture, skill)), random_(skill.seed), ability_(~skill.seed) {
  misorder();
  hand_[kNeedleHolder].pose = {picture.focus + Vec3{0.06f, 0.08f, 0.05f}, {}};
  hand_[kForceps].pose = {picture.focus + Vec3{-0.08f, 0.08f, 0.06f}, {}};
}

std::string Scripted::doing() const {
  if (gave_up_) return "gave up: " + doing_;
  return task_ >= plan_.task.size() ? "done" : doing_;
}

void Scripted::take_over_for(const std::vector<size_t>& tasks) {
  std::vector<Task> kept;
  for (const size_t t : tasks) {
    if (t >= plan_.task.size()) throw std::invalid_argument("the plan has no such task");
    kept.push_back(plan_.task[t]);
  }
  // The last completed bite.
  for (size_t t = 0; !tasks.empty() && t < tasks.front(); ++t)
    if (plan_.task[t].kind == TaskKind::bite) place_ = static_cast<size_t>(plan_.task[t].which);
  plan_.task = kept;
  takes_over_ = true;
}

void Scripted::take_over(const Snapshot& seen) {
  takes_over_ = false;
  for (size_t k = 0; k < 2; ++k) {
    hand_[k].pose = seen.tool[k].pose;
    hand_[k].jaw = seen.tool[k].jaw;
    if (holds_needle(seen, k)) remember_grip(seen, k);
  }
  suture_ = seen.active_suture;
  frame_ = frame(seen, place_);
  bites_before_ = seen.active().bite.size();
  pull_from_ = hand_[kForceps].pose;
}

TickInput Scripted::operate(const Snapshot& seen, float dt) {
  if (takes_over_) take_over(seen);
  const std::array<Pose, 2> before{hand_[0].pose, hand_[1].pose};
  const Pose assistant_before = assistant_[0].pose;
  commands_.clear();
  if (!done() && pause_left_ > 0) {
    pause_left_ -= dt;
  } else if (!done()) {
    waited_ += dt;
    dt_ = dt;
    if (act(plan_.task[task_], seen)) {
      ++task_;
      begin();
    }
  }
  TickInput out;
  out.commands = commands_;
  for (size_t k = 0; k < 2; ++k) {
    tremble(hand_[k], skill_.tremor, random_, dt);
    out.hand[k] = as_input(hand_[k], before[k], dt, sequence_);
  }
  // Assistant hands with an instrument in the scene wait open beyond the field.
  for (size_t k = 2; k < kMaxHands; ++k) {
    if (seen.tool[k].instrument < 0) continue;
    ScriptedHand& hand = assistant_[k - 2];
    if (sequence_ == 0) hand.pose = seen.tool[k].hand;
    if (k == 2 && assisting_ > 0) {
      out.hand[k] = as_input(hand, assistant_before, dt, sequence_);
      continue;
    }
    const Pose from = hand.pose;
    const Vec3 z = normalized(Vec3{k == 2 ? 0.4f : -0.4f, 0.6f, -0.7f}), x = normalized(cross({0, 1, 0}, z));
    const Vec3 at = picture_.focus + Vec3{k == 2 ? 0.25f : -0.25f, 0.35f, -0.5f} * picture_.field;
    move_toward(hand, {at, from_axes(x, cross(z, x), z)}, skill_.speed, dt);
    out.hand[k] = as_input(hand, from, dt, sequence_);
  }
  ++sequence_;
  return out;
}

void Scripted::begin() {
  stage_ = 0;
  waited_ = 0;
  misses_ = 0;
  attempts_ = 0;
  depth_fix_ = next_fix_ = turn_fix_ = 0;
  steady_ = 0;
  // Exponentially distributed, without the long tail.
  if (skill_.pause > 0) pause_left_ = skill_.pause * std::min(4.0f, -portable::log(std::max(1e-6f, 1 - ability_.uniform())));
  if (skill_.tension_error > 0) strength_ = portable::exp(skill_.tension_error * ability_.normal());
}

void Scripted::misorder() {
  if (skill_.order_error <= 0) return;
  for (size_t t = 1; t < plan_.task.size(); ++t) {
    Task &task = plan_.task[t], &before = plan_.task[t - 1];
    if (task.kind == TaskKind::throw_ && before.kind == TaskKind::throw_ && ability_.uniform() < skill_.order_error)
      task.way = before.way;
    if (plan_.lift == 0 || task.kind != TaskKind::bite || task.which == 0) continue;
    // The bite before it, if the two are not yet exchanged.
    for (size_t b = t; b-- > 0;)
      if (plan_.task[b].kind == TaskKind::bite) {
        if (plan_.task[b].which == task.which - 1 && ability_.uniform() < skill_.order_error)
          std::swap(plan_.task[b].which, task.which);
        break;
      }
  }
}

void Scripted::go_down(int stage) {
  miss_by_ = skill_.grasp_error > 0 && ability_.uniform() < skill_.grasp_error ? kMissBy : 0;
  go(stage);
}

void Scripted::go(int stage) {
  stage_ = stage;
  waited_ = 0;
}

void Scripted::miss(int back_to) {
  ++retries_;
  if (++misses_ > kAttempts) gave_up_ = true;
  go(back_to);
}

void Scripted::rest_aside(const Snapshot& seen, size_t hand) {
  const BiteFrame f = frame(seen, place_);
  const float side = side_of(hand, place_);
  const Vec3 lateral = plan_.forceps_side == plan_.driver_side ? f.along * (hand == kNeedleHolder ? -0.05f : 0.05f) : Vec3{};
  const Vec3 p = picture_.focus + f.out * 0.07f + f.up * (0.09f * side) + lateral;
  move(hand, {p, hand_[hand].pose.q}, skill_.speed);
  if (!holds_needle(seen, hand) || hand != kNeedleHolder) jaw(hand, 1);
}

BiteFrame Scripted::frame(const Snapshot& seen, size_t place) const {
  return bite_frame(picture_, seen, plan_.place[std::min(place, plan_.place.size() - 1)]);
}

size_t Scripted::first_place() const {
  const auto mine = [&](const BitePlace& p) { return p.suture == suture_; };
  const auto first = std::find_if(plan_.place.begin(), plan_.place.end(), mine);
  return static_cast<size_t>(first - plan_.place.begin());
}

Pose Scripted::needle_at(const BiteFrame& f, float psi) const {
  const Vec3 center = f.at + f.out * (shape().needle_radius - bite().depth + depth_error_ + depth_fix_);
  const Vec3 x = f.out * portable::cos(psi) - f.along * portable::sin(psi);
  // The tip is at the end of the arc: for arcs other than a half circle, rotate back by the difference.
  const Pose half{center, from_axes(x, cross(f.up, x), f.up)};
  return half * Pose{{}, axis_angle({0, 0, 1}, kPi - shape().needle_arc)};
}

Pose Scripted::grip_at(const Pose& needle, float s, float side, float lean, float psi) const {
  const float phi = s * shape().needle_arc;
  const Vec3 radial = rotate(needle.q, {portable::cos(phi), portable::sin(phi), 0});
  const Vec3 outward = rotate(needle.q, {portable::cos(psi), -portable::sin(psi), 0});
  const Vec3 z = normalized(rotate(needle.q, {0, 0, side}) + outward * lean);
  const Vec3 y = normalized(cross(z, radial), any_perpendicular(z)), x = cross(y, z);
  return {needle.p + radial * shape().needle_radius, from_axes(x, y, z)};
}

Pose Scripted::driver_grip(const Pose& needle, size_t place, float least) const {
  return grip_at(needle, std::max(plan_.driver_at, least), side_of(kNeedleHolder, place), plan_.lift > 0 ? 0.0f : 0.7f, 0.2f);
}

Pose Scripted::forceps_grip(const Pose& needle) const {
  if (plan_.lumen) return tip_grip(needle, tip_way_);
  // After a miss from another side: thread may be in the way.
  const float lean = plan_.pull > 0 ? plan_.tip_lean * (1 - kOtherLean * static_cast<float>(misses_ % 4)) : plan_.tip_lean;
  return grip_at(needle, kForcepsAt, side_of(kForceps, place_), plan_.lift > 0 ? 0.3f : lean, plan_.tip_psi);
}

Pose Scripted::tip_grip(const Pose& needle, size_t way) const {
  const TipWay& w = kTipWay[way % std::size(kTipWay)];
  return grip_at(needle, kForcepsAt, side_of(kForceps, place_), plan_.tip_lean * w.lean, plan_.tip_psi + w.psi);
}

// The first way to the tip on which no wall and no stitch is between the blades or in front of them; after a miss another one.
void Scripted::choose_tip_way(const Snapshot& seen) {
  const Pose& needle = seen.active().needle.pose;
  std::array<Vec3, std::size(kTipWay)> from;
  for (size_t i = 0; i < from.size(); ++i) from[i] = rotate(tip_grip(needle, i + static_cast<size_t>(misses_)).q, {0, 0, 1});
  tip_way_ = clear_shaft(picture_, seen, tip_grip(needle, 0).p, from) + static_cast<size_t>(misses_);
}

void Scripted::aim() {
  aim_along_ = skill_.aim_error * random_.normal();
  aim_up_ = skill_.aim_error * random_.normal();
  depth_error_ = 0.4f * skill_.aim_error * random_.normal();
  if (skill_.angle_error > 0) aim_turn_ = skill_.angle_error * ability_.normal();
}

bool Scripted::act(const Task& task, const Snapshot& seen) {
  switch (task.kind) {
    case TaskKind::pick_up:
      doing_ = "pick up the needle";
      suture_ = static_cast<size_t>(task.which);
      return pick_up(seen);
    case TaskKind::hold_edge:
      place_ = static_cast<size_t>(task.which);
      doing_ = name_of_bite() + "hold the edge";
      return hold_edge(seen);
    case TaskKind::bite:
      place_ = static_cast<size_t>(task.which);
      return make_bite(seen);
    case TaskKind::draw_out:
      doing_ = name_of_bite() + "draw the thread out";
      return draw_out(seen);
    case TaskKind::pull_tail:
    case TaskKind::pull_slack:
    case TaskKind::pull_together:
      doing_ = name_of_bite() + "pull the thread";
      if (!pull(task.kind, seen)) return false;
      if (plan_.pull > 0 && task.kind == TaskKind::pull_tail) {
        if (!is_sound(seen)) return bite_again(seen);
        if (is_caught(seen)) {
          doing_ = name_of_bite() + "the thread is caught";
          return gave_up_ = true, false;
        }
      }
      again_ = 0;
      return true;
    case TaskKind::hand_back:
      doing_ = name_of_bite() + "return the needle";
      return take_back(seen, true);
    case TaskKind::regrip:
      doing_ = "grasp the needle near the swage";
      return regrip(seen);
    case TaskKind::draw:
      doing_ = "tighten the suture";
      return draw(seen);
    case TaskKind::gather:
      doing_ = "draw both ends";
      return gather(seen);
    case TaskKind::throw_:
    case TaskKind::lock_strand:
      return plan_.pull > 0 ? tie_thread(task, seen) : tie(task, seen);
    case TaskKind::cut_long:
    case TaskKind::cut_tail:
    case TaskKind::cut_needle:
      doing_ = "cut the thread";
      return cut(task.kind, seen);
    case TaskKind::take_both:
      doing_ = "grasp both ends";
      return take_both(seen);
    case TaskKind::discard:
      doing_ = "discard the needle";
      return discard(seen);
    case TaskKind::fresh:
      doing_ = "load a new suture";
      return fresh(seen);
    case TaskKind::approximate:
      doing_ = "bring the bowel ends together";
      order_clamps(true);
      return waited_ > plan_.approximate / kClampSpeed;
    case TaskKind::remove:
      doing_ = "take the stitch out";
      return remove(seen);
    case TaskKind::leave:
      doing_ = "hands away";
      return leave(seen);
    case TaskKind::rest:
      doing_ = "hold";
      // Without pulling: a suture is measured at rest.
      if (needle_tension(seen) > 0.05f) move(kForceps, {stitch(seen), hand_[kForceps].pose.q}, 0.3f * skill_.speed);
      return waited_ > 1.5f;
  }
  return true;
}

std::string Scripted::name_of_bite() const {
  return "bite " + std::to_string(place_ + 1) + " of " + std::to_string(plan_.place.size()) + ": ";
}

bool Scripted::pull(TaskKind kind, const Snapshot& seen) {
  rest_aside(seen, kNeedleHolder);
  if (seen.active().suture_point.empty()) return true;
  const Vec3 way = plan_.lift > 0 ? normalized(frame_.out * 0.85f + frame_.up * 0.4f)
                                  : normalized(frame_.out + frame_.up * (0.35f * side_of(kForceps, place_)));
  const size_t n = seen.active().suture_point.size();
  float slack = 0;
  if (kind == TaskKind::pull_tail) {
    slack = length_between(seen, 0, first_point_node(seen)) - skill_.tail;
  } else if (kind == TaskKind::pull_slack) {
    // In the last span from one bite to the next, or from one bowel end to the other: length of thread minus distance. With
    // physical mechanics in all spans that this bite has made: a sweep passes several walls, or one of them twice.
    for (size_t k = n - 1; k-- > 0;) {
      if (plan_.pull > 0 && k + 1 < points_before_) break;
      const SuturePointView &a = seen.active().suture_point[k], &b = seen.active().suture_point[k + 1];
      if (a.bite == b.bite || (plan_.lift == 0 && plan_.pull <= 0 && a.wall == b.wall)) continue;
      slack += length_between(seen, node_of(seen, a.anchored), node_of(seen, b.anchored)) -
               1.1f * distance(a.position, b.position) - 0.001f;
      if (plan_.pull <= 0) break;
    }
  } else if (kind == TaskKind::pull_together) {
    slack = open_seam(seen);
  }
  // Thread that cannot be pulled further is left: the last pull takes up the slack. So is one that would tear its bites.
  float load = 0;  // [N]
  for (const SuturePointView& p : seen.active().suture_point) load = std::max({load, p.tension_needle, p.tension_free});
  overloaded_ = load > skill_.most_load * strength_ ? overloaded_ + dt_ : 0;
  if (slack <= 0 || (skill_.most_load > 0 && overloaded_ > plan_.jerk) ||
      distance(hand_[kForceps].pose.p, pull_from_.p) > 0.29f || !patience(12))
    return true;
  // Decelerate before the thread is taut, and when it pulls back: a jerk would tear tissue.
  const float gently = std::clamp(2.0f * strength_ - length(seen.tool[kForceps].force), 0.02f, 1.0f);
  move(kForceps, {pull_from_.p + way * 0.3f, hand_[kForceps].pose.q}, gently * std::min(skill_.speed, 0.015f + 5 * slack));
  return false;
}

// The thread did not follow the needle: slack of the tail may be drawn into a snarl before its first hole.
bool Scripted::is_caught(const Snapshot& seen) const {
  constexpr float kTooLong = 0.02f;  // [m] of the tail
  constexpr float kStrand = 0.04f;   // [m] the least with which a throw is wound
  const size_t last = seen.active().thread_order.size() - 1;
  return length_between(seen, 0, first_point_node(seen)) > skill_.tail + kTooLong &&
         length_between(seen, last_point_node(seen), last) < kStrand;
}

float Scripted::open_seam(const Snapshot& seen) {
  float open = 0;
  for (const SeamView& s : seen.active().seam)
    if (s.midpoint && s.progress < kSecure) open = std::max(open, (1 - s.progress) * s.start);
  return open;
}

// Both draw() and gather() begin with these stages.
bool Scripted::grasp_tail(const Snapshot& seen) {
  enum { over, down, close };
  const size_t first = first_point_node(seen);
  const BiteFrame f = frame(seen, first_place());
  // A position on the tail a short distance from the first bite, seen from outside; after a miss a different one.
  const float away = 0.019f + 0.005f * static_cast<float>(misses_ % 4);
  const Vec3 thread = node_at(seen, node_along(seen, first, std::min(away, 0.6f * length_between(seen, 0, first)), -1));
  const Vec3 z = plan_.lift > 0 ? normalized(f.out * 0.6f + f.up) : normalized(f.out + Vec3{0.6f, 0, 0.2f});
  const Vec3 x = normalized(f.along - z * dot(f.along, z), any_perpendicular(z));
  const Pose goal{thread, from_axes(x, cross(z, x), z)};
  if (stage_ == over) {
    jaw(kNeedleHolder, 1);
    if (move(kNeedleHolder, raised(goal, 0.03f), skill_.speed)) go(down);
    else if (!patience(8)) gave_up_ = true;
  } else if (stage_ == down) {
    if (move(kNeedleHolder, goal, careful())) go(close);
    else if (!patience(4)) gave_up_ = true;
  } else if (jaw(kNeedleHolder, 0) && waited_ > 0.3f) {
    if (seen.tool[kNeedleHolder].held == Held::thread) return true;
    miss(over);
  }
  return false;
}

bool Scripted::draw(const Snapshot& seen) {
  enum { over, down, close, tighten, lay, open };
  const BiteFrame f = frame(seen, first_place());
  switch (stage_) {
    case over:
    case down:
    case close:
      if (grasp_tail(seen)) go(tighten);
      return false;
    case tighten: {
      // Force feedback: the hand slows in proportion to the thread's tension.
      auto gently = [&](size_t hand) {
        return kTighten * skill_.speed * std::clamp(1.5f * strength_ - length(seen.tool[hand].force), 0.02f, 1.0f);
      };
      const bool closed = plan_.lift > 0 ? seen.closure >= kSecure : open_seam(seen) <= 0;
      if (closed) return go(plan_.lift > 0 ? open : lay), false;
      Vec3 left, right;
      if (plan_.lift > 0) {
        // The needle's end leaves the last bite, which lies before the first one along the rim; the tail leaves the first.
        left = normalized(f.out * 0.5f - f.along * 0.8f + f.up * 0.35f);
        right = normalized(f.out * 0.5f + f.along * 0.8f + f.up * 0.35f);
      } else {
        const Vec3 across =
            normalized(seen.active().suture_point.back().position - seen.active().suture_point.front().position, {1, 0, 0});
        left = normalized(across * 0.8f + f.out * 0.6f);
        right = normalized(across * -0.8f + f.out * 0.6f);
      }
      move(kForceps, {picture_.focus + left * 0.35f, hand_[kForceps].pose.q}, gently(kForceps));
      // The tail hand applies counter-traction: it moves out only as far as keeps its own side taut. When both sides are pulled
      // hard, the thread sticks in its holes and the tissue follows the hands instead, so the tail hand relaxes first.
      const size_t held = node_of(seen, seen.tool[kNeedleHolder].held_slot);
      const float tail = held < seen.active().thread_tension.size() ? seen.active().thread_tension[held] : 0;
      if (plan_.lift == 0 && !patience(5) && tail > kCounterHold)
        move(kNeedleHolder, {stitch(seen), hand_[kNeedleHolder].pose.q}, 0.3f * skill_.speed);
      else move(kNeedleHolder, {picture_.focus + right * 0.11f, hand_[kNeedleHolder].pose.q}, gently(kNeedleHolder));
      if (!patience(20)) gave_up_ = true;
      return false;
    }
    case lay:
      if (lay_tail(seen) || !patience(2.5f)) go(open);
      return false;
    default:
      if (plan_.lift > 0) return true;  // a purse-string stays in the hands
      jaw(kNeedleHolder, 1);
      return move(kNeedleHolder, raised(hand_[kNeedleHolder].pose, 0.02f), skill_.speed) || waited_ > 0.8f;
  }
}

bool Scripted::gather(const Snapshot& seen) {
  enum { over, down, close, tighten, slacken, open };
  if (stage_ < tighten) {
    if (grasp_tail(seen)) steady_ = 0, felt_ = {}, go(tighten);
    return false;
  }
  const BiteFrame f = frame(seen, first_place());
  // Each end is drawn on beyond the other one's hole, low, as strands cross in a throw.
  const SutureView& s = seen.active();
  const Vec3 tail_at = s.suture_point.front().position, end_at = s.suture_point.back().position;
  const Vec3 between = normalized(end_at - tail_at, -f.along), out = normalized(f.out * 0.6f + f.up * 0.3f);
  const size_t held = node_of(seen, seen.tool[kNeedleHolder].held_slot);
  const float now[2] = {held + 2 < s.thread_tension.size() ? s.thread_tension[held + 2] : 0, needle_tension(seen)};
  for (size_t k = 0; k < 2; ++k) felt_[k] += kFeel * (now[k] - felt_[k]);
  const float tail = felt_[kNeedleHolder], end = felt_[kForceps];
  // Evenly: neither hand leads.
  const auto pace = [&](float felt, float other) {
    const float want = std::min(plan_.pull * strength_, 1.2f * other + 0.1f);
    return kGathering * std::clamp(2 * (want - felt), -1.0f, 1.0f);
  };
  const auto draw = [&](size_t hand, Vec3 way, float speed) {
    const Vec3 p = hand_[hand].pose.p;
    move(hand, {p + (speed > 0 ? way : -way) * 0.05f, hand_[hand].pose.q}, std::abs(speed));
  };
  const Vec3 right = normalized(between * 0.8f + out), left = normalized(between * -0.8f + out);
  switch (stage_) {
    case tighten:
      draw(kNeedleHolder, right, pace(tail, end)), draw(kForceps, left, pace(end, tail));
      steady_ = std::min(tail, end) > 0.9f * plan_.pull * strength_ ? steady_ + dt_ : 0;
      if (steady_ > kGathered || !patience(kGatherPatience)) go(slacken);
      return false;
    case slacken:  // both ends at once
      if (tail > kLoose) draw(kNeedleHolder, right, -kGathering);
      if (end > kLoose) draw(kForceps, left, -kGathering);
      if (std::max(tail, end) < kLoose || !patience(5)) go(open);
      return false;
    default:
      doing_ = "let go of both ends";
      return jaw(kNeedleHolder, 1);
  }
}

std::unique_ptr<Surgeon> make_demonstrator(const std::string& plan, const PictureModel& picture, const SurgeonSkill& skill,
                                           const std::vector<size_t>& tasks) {
  auto surgeon = std::make_unique<Scripted>(plan, picture, skill);
  surgeon->take_over_for(tasks);
  return surgeon;
}

std::unique_ptr<Surgeon> make_surgeon(const std::string& plan, const PictureModel& picture, const SurgeonSkill& skill) {
  if (plan == "excision") return make_plan(plan, picture, skill), std::make_unique<Excising>(picture, skill);
  if (plan == "slit") return make_plan(plan, picture, skill), std::make_unique<Slitting>(picture, skill);
  if (plan == "altemeier") return make_plan(plan, picture, skill), std::make_unique<Operating>(picture, skill);
  return std::make_unique<Scripted>(plan, picture, skill);
}

}  // namespace catgut
