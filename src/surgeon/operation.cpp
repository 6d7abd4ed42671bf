// SPDX-License-Identifier: Apache-2.0
// surgeon/operation: see the header.
#include "surgeon/operation.h"

#include <algorithm>

#include "exchange/strand.h"

namespace catgut {
namespace {

constexpr size_t kRight = 0, kLeft = 1, kAssistant = 2;
constexpr size_t kHandedOver = 2;    // the clamp that the assistant takes: opposite the begin of the cut
constexpr float kPenSpeed = 0.005f;  // [m/s] along the line: half of what 40 W cut through 2 mm
constexpr float kAbove = 0.03f;      // [m] over the rim, on the way to it and back
constexpr float kBite = 0.002f;      // [m] of the jaws, from the rim
constexpr float kLean = 0.3f;        // of a clamp's shaft, outward
constexpr float kGrasped = 0.4f;     // [s] of closed jaws
constexpr float kLeftOf = 0.03f;     // [m] of the opening's center: a needle farther to the left is carried to the right first
constexpr int kMostMisses = 8;
constexpr int kMostTakenOut = 4;               // stitches, of the whole operation
constexpr float kPulls = 4;                    // [s] the colon's clamp, at the end
constexpr Vec3 kAside{-0.20f, 0.10f, -0.20f};  // [m] from the focus: where the assistant keeps the specimen

}  // namespace

Operating::Operating(const PictureModel& picture, const SurgeonSkill& skill)
    : picture_(picture), skill_(skill), opening_(opening_shape(picture, 0)), random_(skill.seed) {
  stitches_ = std::clamp<size_t>(static_cast<size_t>(skill.bites), 1, picture.suture.size());
  u_ = normalized(Vec3{1, 0, 0} - opening_.axis * opening_.axis.x, any_perpendicular(opening_.axis));
  v_ = cross(opening_.axis, u_);
  for (size_t i = 0; i < picture.instrument.size(); ++i)
    if (picture.instrument[i].can(kClamp | kHoldTissue) && !picture.instrument[i].can(kHoldNeedle))
      clamp_.push_back(static_cast<uint16_t>(i));
  hand_[kRight].pose = {picture.focus + Vec3{0.08f, 0.08f, 0.05f}, {}};
  hand_[kLeft].pose = {picture.focus + Vec3{-0.10f, 0.10f, 0.06f}, {}};
  hand_[kAssistant].pose = {picture.focus + Vec3{-0.10f, 0.12f, -0.08f}, {}};
}

int Operating::retries() const {
  return retries_ + retries_of_parts_ + (excising_ ? excising_->retries() : 0) + (sewing_ ? sewing_->retries() : 0);
}

std::string Operating::doing() const {
  const std::string clamp = "clamp " + std::to_string(std::min(clamped_ + 1, clamp_.size())) + ": ";
  std::string doing;
  switch (stage_) {
    case take_clamp:
      doing = clamp + "take it";
      break;
    case over_rim:
    case on_rim:
      doing = clamp + "go to the rim";
      break;
    case close_clamp:
    case park_clamp:
      doing = clamp + "close it on the rim";
      break;
    case off_rim:
      doing = "withdraw the hand";
      break;
    case to_assistant:
    case assistant_takes:
      doing = "the assistant takes a clamp";
      break;
    case take_pen:
      doing = "take the pen";
      break;
    case cut:
      return excising_->doing();
    case carry:
      doing = "the assistant carries the specimen away";
      break;
    case take_holder:
      doing = "take the needle holder";
      break;
    case sew:
    case remove:
      return "stitch " + std::to_string(stitched_ + 1) + ": " + sewing_->doing();
    case carry_needle:
      doing = "stitch " + std::to_string(stitched_ + 1) + ": carry the needle to the right";
      break;
    case pull:
      doing = "the colon retracts";
      break;
    case finished:
      return "done";
  }
  return gave_up_ ? "gave up: " + doing : doing;
}

float Operating::angle_of(size_t clamp) const {
  return 2 * kPi * static_cast<float>(clamp) / static_cast<float>(std::max<size_t>(clamp_.size(), 1));
}

Pose Operating::clamp_at(float angle, float raised) const {
  const Vec3 out = radial(angle), z = normalized(opening_.axis + out * kLean), x = normalized(out - z * dot(out, z));
  const Vec3 rim = opening_.center + out * (opening_.radius - 0.5f * skill_.wall);
  return {rim - opening_.axis * kBite + z * raised, from_axes(x, cross(z, x), z)};
}

// The right hand lays down what it has, and takes the instrument of the tray that can do this.
void Operating::swap_for(const Snapshot& seen, uint32_t capability, Stage next) {
  const int now = seen.tool[kRight].instrument;
  if (now >= 0 && picture_.instrument[static_cast<size_t>(now)].can(capability)) return go(next);
  if (waited_ > dt_) {
    gave_up_ = waited_ > 1;  // refused
    return;
  }
  for (size_t i = 0; i < picture_.instrument.size(); ++i)
    if (picture_.instrument[i].can(capability) && seen.instrument[i].place == InstrumentPlace::tray) {
      commands_.push({now >= 0 ? CommandKind::swap : CommandKind::take, kRight, static_cast<uint16_t>(i)});
      return;
    }
}

Snapshot Operating::turned(const Snapshot& seen, float by) const {
  Snapshot s = seen;
  const Quat q = axis_angle(opening_.axis, by);
  const auto place = [&](Vec3& p) { p = opening_.center + rotate(q, p - opening_.center); };
  const auto pose = [&](Pose& p) { place(p.p), p.q = q * p.q; };
  for (Vec3& p : s.particle) place(p);
  for (Quat& r : s.rotation) r = q * r * conjugate(q);
  for (ToolView& t : s.tool) pose(t.pose), pose(t.hand), t.force = rotate(q, t.force), t.torque = rotate(q, t.torque);
  for (InstrumentView& i : s.instrument) pose(i.pose);
  for (SutureView& u : s.suture) {
    pose(u.needle.pose);
    for (SuturePointView& p : u.suture_point) place(p.position);
    for (KnotView& k : u.knot) place(k.position), k.way = rotate(q, k.way);
    for (BiteView& b : u.bite) place(b.entry), place(b.exit);
  }
  return s;
}

void Operating::turn_back(TickInput& input, float by) const {
  const Quat q = axis_angle(opening_.axis, -by);
  for (size_t k = 0; k < 2; ++k) {
    ToolInput& h = input.hand[k];
    h.pose = {opening_.center + rotate(q, h.pose.p - opening_.center), q * h.pose.q};
    h.velocity = rotate(q, h.velocity), h.angular_velocity = rotate(q, h.angular_velocity);
  }
}

// Hands that another plan leads in this tick.
void Operating::join(const TickInput& part, std::initializer_list<size_t> hands) {
  part_ = part;
  for (const Command& c : part.commands) commands_.push(c);
  for (const size_t k : hands) led_[k] = 1, hand_[k].pose = part.hand[k].pose, hand_[k].jaw = part.hand[k].jaw;
}

// The suture in the forceps if it has been pulled through, else the first that is whole and in no tissue.
void Operating::choose_suture(const Snapshot& seen) {
  suture_ = seen.tool[kLeft].held_suture;
  if (pulled_through(seen)) return;
  const auto whole = [](const SutureView& s) {
    return s.needle_on_thread && s.suture_point.empty() && std::count(s.thread_cut.begin(), s.thread_cut.end(), 1) == 0;
  };
  suture_ = static_cast<size_t>(std::find_if(seen.suture.begin(), seen.suture.end(), whole) - seen.suture.begin());
}

// The places of all stitches are at one angle of a field that is turned: the tissue at rest turns too.
void Operating::begin_stitch(const Snapshot& seen, TaskKind from) {
  turn_ = -2 * kPi * static_cast<float>(place_of_stitch(stitched_)) / static_cast<float>(stitches_);
  PictureModel picture = picture_;
  const Quat q = axis_angle(opening_.axis, turn_);
  for (Vec3& p : picture.particle_rest) p = opening_.center + rotate(q, p - opening_.center);
  const std::vector<Task> task = make_plan("altemeier", picture, skill_).task;
  const size_t tasks = task.size() / picture_.suture.size();
  // The thread follows its needle. From the left it would lie under the forceps.
  const Vec3 needle = rotate(q, seen.suture[suture_].needle.pose.p - opening_.center);
  carries_ = from == TaskKind::pick_up && dot(needle, u_) < -kLeftOf;
  std::vector<size_t> mine;
  for (size_t t = suture_ * tasks; t < (suture_ + 1) * tasks && !(carries_ && mine.size() == 1); ++t)
    if (!mine.empty() || task[t].kind == from) mine.push_back(t);
  sewing_.emplace("altemeier", picture, skill_);
  sewing_->take_over_for(mine);
}

void Operating::next_stitch(const Snapshot& seen) {
  choose_suture(seen);
  if (suture_ == seen.suture.size()) return void(gave_up_ = true);  // none is left
  begin_stitch(seen, pulled_through(seen) ? TaskKind::throw_ : TaskKind::pick_up);
  go(sew);
}

// True when what `sewing_` has to do is done.
bool Operating::sew_on(const Snapshot& seen) {
  TickInput part = sewing_->operate(turn_ == 0 ? seen : turned(seen, turn_), dt_);
  if (turn_ != 0) turn_back(part, turn_);
  join(part, {kRight, kLeft});
  if (sewing_->done()) retries_of_parts_ += sewing_->retries();
  return sewing_->done();
}

// Each stitch as far from those before it as it can be: opposite first, then halving the gaps.
size_t Operating::place_of_stitch(size_t stitch) const {
  const size_t n = stitches_;
  std::vector<size_t> taken{0};
  while (taken.size() <= stitch) {
    size_t best = 0, far = 0;
    for (size_t i = 0; i < n; ++i) {
      size_t least = n;
      for (const size_t t : taken) least = std::min({least, (i + n - t) % n, (t + n - i) % n});
      if (least > far) far = least, best = i;
    }
    taken.push_back(best);
  }
  return taken[stitch];
}

// The forceps holds the needle of this stitch, outside the tissue.
bool Operating::in_forceps(const Snapshot& seen) const {
  const ToolView& forceps = seen.tool[kLeft];
  return forceps.held == Held::needle && forceps.held_suture == suture_ && !seen.suture[suture_].needle.in_tissue;
}

// And its thread runs through both walls.
bool Operating::pulled_through(const Snapshot& seen) const {
  return in_forceps(seen) && seen.suture[suture_].suture_point.size() >= 4;
}

void Operating::look(const Snapshot& seen) {
  for (size_t k = 0; k < hand_.size(); ++k) hand_[k].pose = seen.tool[k].hand, hand_[k].jaw = seen.tool[k].jaw;
  const auto holds = [&](uint16_t i) { return seen.instrument[i].held == Held::tissue; };
  clamped_ = static_cast<size_t>(std::count_if(clamp_.begin(), clamp_.end(), holds));
  stitched_ = static_cast<size_t>(std::count_if(seen.suture.begin(), seen.suture.end(), is_cut_off));
  if (stitched_ >= stitches_) go(pull);
  else if (seen.topology.pieces > picture_.body.size()) go(take_holder);
  else if (clamped_ == clamp_.size()) go(seen.tool[kAssistant].instrument < 0 ? off_rim : take_pen);
}

void Operating::act(const Snapshot& seen) {
  const float slow = 0.35f * skill_.speed;
  ScriptedHand &right = hand_[kRight], &assistant = hand_[kAssistant];
  switch (stage_) {
    case take_clamp:
      if (clamped_ >= clamp_.size()) return go(to_assistant);
      move_jaw(right, 1, dt_);
      if (seen.tool[kRight].instrument == static_cast<int>(clamp_[clamped_])) return go(over_rim);
      if (waited_ <= dt_) commands_.push({CommandKind::take, kRight, clamp_[clamped_]});
      else gave_up_ = waited_ > 1;
      return;
    case over_rim:
      move_jaw(right, 1, dt_);
      if (move_toward(right, clamp_at(angle_of(clamped_), kAbove), skill_.speed, dt_)) go(on_rim);
      return;
    case on_rim:
      if (move_toward(right, clamp_at(angle_of(clamped_), 0), slow, dt_)) go(close_clamp);
      return;
    case close_clamp:
      if (!move_jaw(right, 0, dt_) || waited_ < kGrasped) return;
      if (seen.tool[kRight].held == Held::tissue) {
        commands_.push({CommandKind::park, kRight, clamp_[clamped_]});
        return go(park_clamp);
      }
      ++retries_;
      if (++misses_ > kMostMisses) gave_up_ = true;
      return go(over_rim);
    case park_clamp:
      if (seen.tool[kRight].instrument < 0) ++clamped_, go(off_rim);
      else gave_up_ = waited_ > 1;
      return;
    case off_rim: {
      const Vec3 out = radial(angle_of(clamped_ - 1));
      const Pose away{opening_.center + out * 0.07f + opening_.axis * 0.09f, right.pose.q};
      if (move_toward(right, away, skill_.speed, dt_)) go(take_clamp);
      return;
    }
    case to_assistant: {
      assistant.jaw = 0;
      const Pose& clamp = seen.instrument[clamp_[std::min(kHandedOver, clamp_.size() - 1)]].pose;
      if (move_toward(assistant, clamp, skill_.speed, dt_)) {
        commands_.push({CommandKind::unpark, kAssistant, clamp_[std::min(kHandedOver, clamp_.size() - 1)]});
        go(assistant_takes);
      }
      return;
    }
    case assistant_takes:
      if (seen.tool[kAssistant].instrument >= 0) go(take_pen);
      else gave_up_ = waited_ > 1;
      return;
    case take_pen: {
      swap_for(seen, kCauterize, cut);
      if (stage_ != cut) return;
      SurgeonSkill skill = skill_;
      skill.drive_speed = kPenSpeed;
      excising_.emplace(picture_, skill);
      excising_->take_over(right, assistant, kAssistant);
      return;
    }
    case cut:
      join(excising_->operate(seen, dt_), {kRight, kAssistant});
      gave_up_ = excising_->gave_up();
      if (excising_->done() && !gave_up_) go(carry);
      return;
    case carry:
      move_toward(right, {picture_.focus + Vec3{0.10f, 0.08f, 0.05f}, right.pose.q}, skill_.speed, dt_);
      if (move_toward(assistant, {picture_.focus + kAside, assistant.pose.q}, 0.5f * skill_.speed, dt_)) go(take_holder);
      return;
    case take_holder:
      swap_for(seen, kHoldNeedle, sew);
      if (stage_ == sew) next_stitch(seen);
      return;
    case sew:
      if (!sew_on(seen)) return;
      if (sewing_->gave_up()) {  // a stitch that fails is taken out, and made again
        if (!in_forceps(seen) || ++taken_out_ > kMostTakenOut) return void(gave_up_ = true);
        ++retries_;
        sewing_->take_over_to_remove();
        return go(remove);
      }
      if (carries_) return way_ = 0, go(carry_needle);
      if (++stitched_ < stitches_) return next_stitch(seen);
      sewing_.reset();
      return go(pull);
    case remove:
      if (!sew_on(seen)) return;
      if (sewing_->gave_up()) return void(gave_up_ = true);
      return next_stitch(seen);
    case carry_needle: {  // round in front of the field, and from the right to the bite
      constexpr std::array<Vec3, 3> kWay{Vec3{-0.07f, 0.05f, 0.09f}, {0.03f, 0.06f, 0.12f}, {0.14f, 0.06f, 0.07f}};
      const Vec3 to = u_ * kWay[way_].x + opening_.axis * kWay[way_].y - v_ * kWay[way_].z;
      const Pose goal{opening_.center + rotate(axis_angle(opening_.axis, -turn_), to), right.pose.q};
      if (!move_toward(right, goal, skill_.speed, dt_)) return;
      if (++way_ < kWay.size()) return;
      begin_stitch(seen, TaskKind::hold_edge);
      return go(sew);
    }
    case pull:
      commands_.push({CommandKind::pull_clamp, kAssistant, static_cast<uint16_t>(picture_.body.size() - 1)});
      if (waited_ > kPulls) go(finished);
      return;
    case finished:
      return;
  }
}

TickInput Operating::operate(const Snapshot& seen, float dt) {
  if (sequence_ == 0) look(seen);
  std::array<Pose, 3> before;
  for (size_t k = 0; k < 3; ++k) before[k] = hand_[k].pose;
  commands_.clear();
  led_ = {};
  dt_ = dt, waited_ += dt;
  if (!done()) act(seen);
  TickInput out;
  out.commands = commands_;
  for (size_t k = 0; k < 3; ++k) {
    if (led_[k]) {
      out.hand[k] = part_.hand[k];
      continue;
    }
    tremble(hand_[k], skill_.tremor, random_, dt);
    out.hand[k] = as_input(hand_[k], before[k], dt, sequence_);
  }
  ++sequence_;
  return out;
}

}  // namespace catgut
