// SPDX-License-Identifier: Apache-2.0
// surgeon/slit: see the header.
#include "surgeon/slit.h"

#include <algorithm>

namespace catgut {
namespace {

constexpr float kClear = 0.015f;            // [m] of an instrument on its way
constexpr float kSwab = 0.005f;             // [m] radius of the swab
constexpr float kPressed = 0.005f;          // [m] by which it is pressed in: some tenths of a newton
constexpr float kPress = 1, kPatience = 2;  // [s] of pressure, and of coagulation on one vessel
constexpr int kCuts = 2, kMostAttempts = 20;

}  // namespace

Slitting::Slitting(const PictureModel& picture, const SurgeonSkill& skill)
    : picture_(picture), skill_(skill), opening_(opening_shape(picture, 0)), random_(skill.seed) {
  u_ = normalized(Vec3{1, 0, 0} - opening_.axis * opening_.axis.x, any_perpendicular(opening_.axis));
  hand_.pose = {picture.focus + Vec3{0.06f, 0.08f, 0.05f}, {}};
}

std::string Slitting::doing() const {
  static constexpr const char* kName[] = {"go to the rim",
                                          "place the blades",
                                          "cut",
                                          "withdraw the scissors",
                                          "take the swab",
                                          "press the swab",
                                          "press the swab",
                                          "press the swab",
                                          "take the pen",
                                          "go to a vessel",
                                          "go to a vessel",
                                          "coagulate",
                                          "coagulate",
                                          "done"};
  return std::string(gave_up_ ? "gave up: " : "") + kName[stage_];
}

Pose Slitting::blades_at(float above) const {
  const Vec3 out = cuts_ == 0 ? u_ : -u_, z = opening_.axis;
  return {opening_.center + out * (opening_.radius - 0.5f * skill_.wall) + z * above, from_axes(out, cross(z, out), z)};
}

Pose Slitting::beside(const BleedingView& vessel, float above) const {
  const Vec3 off = vessel.at - opening_.center, out = normalized(off - opening_.axis * dot(off, opening_.axis), u_);
  const Vec3 z = normalized(out + opening_.axis * 0.25f), x = normalized(cross(opening_.axis, z), any_perpendicular(z));
  return {vessel.at + out * (0.5f * skill_.wall + above), from_axes(x, cross(z, x), z)};
}

bool Slitting::choose_vessel(const Snapshot& seen) {
  for (uint32_t i = 0; i < seen.wound.bleeding.size(); ++i)
    if (seen.wound.bleeding[i].flow > 0) return vessel_ = i, true;
  return false;
}

// Lays down what the right hand has, and takes the instrument of the tray that can do this.
void Slitting::take(const Snapshot& seen, uint32_t capability, Stage next) {
  if (seen.tool[0].instrument >= 0 && picture_.instrument[static_cast<size_t>(seen.tool[0].instrument)].can(capability))
    return go(next);
  if (waited_ > dt_) {
    gave_up_ = waited_ > 1;  // refused
    return;
  }
  for (size_t i = 0; i < picture_.instrument.size(); ++i)
    if (picture_.instrument[i].can(capability)) commands_.push({CommandKind::swap, 0, static_cast<uint16_t>(i)});
}

void Slitting::act(const Snapshot& seen) {
  const float slow = 0.35f * skill_.speed;
  const auto vessel = [&] { return seen.wound.bleeding[vessel_]; };
  switch (stage_) {
    case over_rim:
      move_jaw(hand_, 1, dt_);
      if (move_toward(hand_, blades_at(kClear), skill_.speed, dt_)) go(enter);
      return;
    case enter:
      if (move_toward(hand_, blades_at(-skill_.edge_distance), slow, dt_)) go(close);
      return;
    case close:
      if (move_jaw(hand_, 0, dt_) && waited_ > 0.4f) go(withdraw);
      return;
    case withdraw:
      if (!move_toward(hand_, blades_at(kClear), slow, dt_)) return;
      return go(++cuts_ < kCuts ? over_rim : take_swab);
    case take_swab:
      if (!choose_vessel(seen)) return go(finished);
      return take(seen, kAbsorb, to_stain);
    case to_stain:
      if (move_toward(hand_, beside(vessel(), kClear), skill_.speed, dt_)) go(press);
      return;
    case press:
      move_toward(hand_, beside(vessel(), kSwab - kPressed), slow, dt_);
      if (waited_ > kPress) go(leave_stain);
      return;
    case leave_stain:
      if (move_toward(hand_, beside(vessel(), 2 * kClear), skill_.speed, dt_)) go(take_pen);
      return;
    case take_pen:
      return take(seen, kCauterize, to_vessel);
    case to_vessel:
      if (waited_ <= dt_ && (!choose_vessel(seen) || retries_ > kMostAttempts)) return go(finished);
      if (move_toward(hand_, beside(vessel(), kClear), skill_.speed, dt_)) go(touch);
      return;
    case touch:
      if (!move_toward(hand_, beside(vessel(), 0), slow, dt_)) return;
      commands_.push({CommandKind::new_suture, 0, 0});
      return go(coagulate);
    case coagulate:
      move_toward(hand_, beside(vessel(), 0), slow, dt_);
      if (vessel().flow > 0 && waited_ < kPatience) return;
      retries_ += vessel().flow > 0;
      commands_.push({CommandKind::new_suture, 0, 0});
      return go(leave);
    case leave:
      if (move_toward(hand_, beside(vessel(), kClear), skill_.speed, dt_)) go(to_vessel);
      return;
    case finished:
      return;
  }
}

TickInput Slitting::operate(const Snapshot& seen, float dt) {
  const Pose before = hand_.pose;
  commands_.clear();
  dt_ = dt, waited_ += dt;
  if (!done()) act(seen);
  TickInput out;
  out.commands = commands_;
  tremble(hand_, skill_.tremor, random_, dt);
  out.hand[0] = as_input(hand_, before, dt, sequence_++);
  for (size_t k = 1; k < out.hand.size(); ++k) out.hand[k].connected = 0;
  return out;
}

}  // namespace catgut
