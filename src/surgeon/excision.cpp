// SPDX-License-Identifier: Apache-2.0
// surgeon/excision: see the header.
#include "surgeon/excision.h"

#include <algorithm>
#include <cmath>

namespace catgut {
namespace {

constexpr size_t kPen = 0, kHolder = 1;
constexpr float kClear = 0.008f;      // [m] of the tip from the surface before it touches
constexpr float kTraction = 0.0005f;  // [m] by which the rim is raised while it is cut
constexpr float kOverlap = 0.12f;     // [rad] beyond a full turn: the line closes on its start
constexpr float kSteer = 0.6f;        // [rad] before the end of the first round, in which the pen returns to where it began
constexpr float kNearLine = 0.004f;   // [m] from the line: a cut edge there is this cut's
constexpr float kCarried = 0.0035f;   // [m] from the line to the tissue that carries it: farther than an element
constexpr int kMostRounds = 3, kMostMisses = 8, kMostAttempts = 40;
constexpr float kPatience = 2;  // [s] of coagulation on one vessel

}  // namespace

Excising::Excising(const PictureModel& picture, const SurgeonSkill& skill)
    : picture_(picture), skill_(skill), opening_(opening_shape(picture, 0)), random_(skill.seed) {
  // The left hand is at angle pi, the pen begins at 0.
  u_ = normalized(Vec3{1, 0, 0} - opening_.axis * opening_.axis.x, any_perpendicular(opening_.axis));
  v_ = cross(opening_.axis, u_);
  for (uint32_t i = 0; i < picture.particle_rest.size(); i += 2) {  // even: on the outer side
    if (i >= picture.wall.size() || picture.wall[i] != 0) continue;
    const float depth = dot(opening_.center - picture.particle_rest[i], opening_.axis) - skill.edge_distance;
    if (depth > kCarried && depth < 3 * kCarried) below_.push_back(i);
  }
  hand_[kPen].pose = {picture.focus + Vec3{0.06f, 0.08f, 0.05f}, {}};
  hand_[kHolder].pose = {picture.focus + Vec3{-0.08f, 0.08f, 0.06f}, {}};
}

void Excising::take_over(const ScriptedHand& pen, const ScriptedHand& holder, size_t hand) {
  hand_ = {pen, holder};
  holder_ = hand, took_over_ = true, held_at_ = holder.pose;
  go(tighten);
}

std::string Excising::doing() const {
  static constexpr const char* kName[] = {"grasp the rim",
                                          "grasp the rim",
                                          "grasp the rim",
                                          "grasp the rim",
                                          "go to the line",
                                          "go to the line",
                                          "cut round the bowel",
                                          "switch the pen off",
                                          "lift the specimen",
                                          "lay the specimen aside",
                                          "go to a bleeding vessel",
                                          "coagulate",
                                          "coagulate",
                                          "hold",
                                          "done"};
  const std::string doing = kName[stage_];
  return gave_up_ ? "gave up: " + doing + (!freed_ && stage_ >= off ? ", it is still attached" : "") : doing;
}

Excising::OnLine Excising::on_line(const Snapshot& seen, float angle) const {
  const Vec3 out = radial(angle), rest = opening_.center + out * opening_.radius - opening_.axis * skill_.edge_distance;
  constexpr size_t kNear = 6;
  std::array<std::pair<float, uint32_t>, kNear> near;
  near.fill({1e9f, 0});
  for (const uint32_t i : below_) {
    std::pair<float, uint32_t> p{length2(picture_.particle_rest[i] - rest), i};
    for (auto& n : near)
      if (p.first < n.first) std::swap(p, n);
  }
  OnLine line{};
  float weight = 0;
  for (const auto& [d2, i] : near) {
    if (d2 > 1) continue;
    const float w = 1 / (d2 * d2 + 1e-14f);
    const Quat q = seen.rotation[i];
    line.at += (seen.particle[i] + rotate(q, rest - picture_.particle_rest[i])) * w;
    line.out += rotate(q, out) * w, line.up += rotate(q, opening_.axis) * w;
    weight += w;
  }
  if (weight > 0) line.at = line.at / weight;
  else line.at = rest;
  line.out = normalized(line.out, out), line.up = normalized(line.up, opening_.axis);
  return line;
}

float Excising::stray() {
  const auto bearing = [](float angle) {
    const float turns = angle / (2 * kPi), part = turns - std::floor(turns);
    return std::min(kBearings - 1, static_cast<size_t>(part * static_cast<float>(kBearings)));
  };
  if (rounds_ > 1) return strayed_[bearing(angle_)];
  // A hand that draws a line strays from it slowly.
  const float keep = portable::exp(-0.5f * dt_);
  aim_ = aim_ * keep + skill_.aim_error * std::sqrt(1 - keep * keep) * random_.normal();
  const float to_end = std::clamp((2 * kPi - angle_) / kSteer, 0.0f, 1.0f), there = aim_ * to_end + strayed_[0] * (1 - to_end);
  if (angle_ < 2 * kPi) strayed_[bearing(angle_)] = there;
  return there;
}

float Excising::closed_at(const Snapshot& seen) const {
  if (!seen.topology.picture) return 0;
  std::array<uint8_t, kBearings> open{};
  const VisibleMesh& mesh = seen.topology.picture->body.front();
  for (size_t v = 0; v < mesh.position.size(); ++v) {
    const Vec3 from = mesh.position[v] - opening_.center;
    if (mesh.layer[v] != TissueLayer::cut_edge || std::abs(dot(from, opening_.axis) + skill_.edge_distance) > kNearLine)
      continue;
    const float turns = portable::atan2(dot(from, v_), dot(from, u_)) / (2 * kPi), part = turns - std::floor(turns);
    open[std::min(kBearings - 1, static_cast<size_t>(part * static_cast<float>(kBearings)))] = 1;
  }
  const auto closed = std::find(open.begin(), open.end(), uint8_t{0});
  return closed == open.end() ? 0 : 2 * kPi * static_cast<float>(closed - open.begin()) / static_cast<float>(kBearings);
}

Pose Excising::pen_at(const OnLine& line, float above) const {
  // Nearly square to the wall, the shaft a little toward the rim.
  const Vec3 z = normalized(line.out + line.up * 0.25f), x = normalized(cross(line.up, z), any_perpendicular(z));
  return {line.at + line.out * above, from_axes(x, cross(z, x), z)};
}

// From the side, on the outer face beside the vessel.
Pose Excising::pen_on(const BleedingView& vessel, float above) const {
  const Vec3 from = vessel.at - opening_.center, out = normalized(from - opening_.axis * dot(from, opening_.axis), u_);
  return pen_at({vessel.at + out * (0.5f * skill_.wall), out, opening_.axis}, above);
}

bool Excising::choose_vessel(const Snapshot& seen) {
  for (uint32_t i = 0; i < seen.wound.bleeding.size(); ++i)
    if (seen.wound.bleeding[i].flow > 0) return vessel_ = i, true;
  return false;
}

Pose Excising::grasp_at(float raised) const {
  if (took_over_) return {held_at_.p + opening_.axis * raised, held_at_.q};
  const Vec3 out = radial(kPi), z = opening_.axis, x = out;
  const Vec3 rim = opening_.center + out * (opening_.radius - 0.5f * skill_.wall);
  return {rim + z * (raised - 0.0015f), from_axes(x, cross(z, x), z)};
}

void Excising::act(const Snapshot& seen) {
  ScriptedHand &pen = hand_[kPen], &holder = hand_[kHolder];
  const float slow = 0.35f * skill_.speed;
  freed_ = freed(seen);
  switch (stage_) {
    case over_rim:
      move_jaw(holder, 1, dt_);
      move_toward(pen, {picture_.focus + u_ * 0.06f + opening_.axis * 0.04f, pen_at(on_line(seen, 0), 0).q}, skill_.speed, dt_);
      if (move_toward(holder, grasp_at(0.03f), skill_.speed, dt_)) go(down);
      return;
    case down:
      if (move_toward(holder, grasp_at(0), slow, dt_)) go(close);
      return;
    case close:
      if (!move_jaw(holder, 0, dt_) || waited_ < 0.5f) return;
      if (seen.tool[holder_].held == Held::tissue) return go(tighten);
      ++retries_;
      if (++misses_ > kMostMisses) gave_up_ = true;
      return go(over_rim);
    case tighten:
      if (move_toward(holder, grasp_at(kTraction), 0.1f * skill_.speed, dt_)) go(to_line);
      return;
    case to_line:
      if (move_toward(pen, pen_at(on_line(seen, angle_), kClear), skill_.speed, dt_)) go(touch);
      return;
    case touch:
      if (!move_toward(pen, pen_at(on_line(seen, angle_), 0), slow, dt_)) return;
      switch_pen();
      ++rounds_;
      return go(round);
    case round: {
      angle_ += skill_.drive_speed / opening_.radius * dt_;
      OnLine line = on_line(seen, angle_);
      line.at += line.up * stray();
      move_toward(pen, pen_at(line, 0), 2 * skill_.drive_speed + 0.02f, dt_);
      // Later rounds end where the last bridge is gone.
      if (angle_ >= began_ + 2 * kPi + kOverlap || (rounds_ > 1 && freed_)) switch_pen(), go(off);
      return;
    }
    case off:
      if (!move_toward(pen, pen_at(on_line(seen, angle_), 0.02f), skill_.speed, dt_)) return;
      if (freed(seen)) return go(lift);
      ++retries_;
      if (rounds_ >= kMostRounds) gave_up_ = true;
      angle_ = began_ = closed_at(seen) - kOverlap;
      return go(to_line);
    case lift:
      if (move_toward(holder, grasp_at(0.035f), slow, dt_)) go(aside);
      return;
    case aside: {
      Pose goal = grasp_at(0.035f);
      goal.p -= u_ * 0.04f;
      if (move_toward(holder, goal, skill_.speed, dt_)) go(to_vessel);
      return;
    }
    case to_vessel:
      if (waited_ <= dt_ && (!choose_vessel(seen) || attempts_++ > kMostAttempts)) return go(hold);
      if (!move_toward(pen, pen_on(seen.wound.bleeding[vessel_], pen_is_near_ ? 0 : kClear), pen_is_near_ ? slow : skill_.speed,
                       dt_))
        return;
      if (!pen_is_near_) {
        pen_is_near_ = true;
        return;
      }
      commands_.push({CommandKind::new_suture, 0, 0});
      return go(coagulate);
    case coagulate:
      move_toward(pen, pen_on(seen.wound.bleeding[vessel_], 0), slow, dt_);
      if (seen.wound.bleeding[vessel_].flow > 0 && waited_ < kPatience) return;
      commands_.push({CommandKind::new_suture, 0, 0});
      return go(leave);
    case leave:
      pen_is_near_ = false;
      if (move_toward(pen, pen_on(seen.wound.bleeding[vessel_], 0.02f), skill_.speed, dt_)) go(to_vessel);
      return;
    case hold:
      if (waited_ > 1) go(finished);
      return;
    case finished:
      return;
  }
}

TickInput Excising::operate(const Snapshot& seen, float dt) {
  const std::array<Pose, 2> before{hand_[0].pose, hand_[1].pose};
  commands_.clear();
  dt_ = dt, waited_ += dt;
  if (!done()) act(seen);
  TickInput out;
  out.commands = commands_;
  for (size_t k = 0; k < 2; ++k) {
    tremble(hand_[k], skill_.tremor, random_, dt);
    out.hand[k == kHolder ? holder_ : k] = as_input(hand_[k], before[k], dt, sequence_);
  }
  ++sequence_;
  return out;
}

}  // namespace catgut
