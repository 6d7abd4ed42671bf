// SPDX-License-Identifier: Apache-2.0
// device: see steer.h.
#include "device/steer.h"

#include <cmath>
#include <span>

#include "device/wall_spot.h"
#include "exchange/strand.h"

namespace catgut {
namespace {

constexpr float kDriveAt = 0.35f, kTipAt = 0.93f;  // positions on the needle's arc: a third from the swage, behind the tip
constexpr float kBeside = 0.3f;                    // of the arc: closer jaws would collide
constexpr float kCatch = 0.009f;     // [m] in the view plane: within this distance of the best grasp, the assist moves the tool
constexpr float kLetGo = 0.014f;     // and beyond this it releases it
constexpr float kCatchDeep = 0.16f;  // [m] along the view axis, where distances are hard to judge on a flat screen
constexpr float kThere = 0.0015f;    // [m] the tool is at the needle
constexpr float kPatience = 0.6f;    // [s] that a closing jaw waits for that
constexpr float kBiteCatch = 0.012f, kBiteLetGo = 0.02f;  // [m] in the view plane, from the needle to the position of a bite
constexpr float kBefore = 0.45f;                          // [rad] of the needle's tip before the tissue
constexpr float kBesideTissue = 0.022f;                   // [m] where it arrives first
constexpr float kHelpSpeed = 0.2f, kHelpTurn = 5.0f;      // [m/s], [rad/s] of a tool that moves a needle there
constexpr float kAboveTail = 0.012f;                      // [m]
constexpr float kBlocked = 0.3f;                          // [s] that jaws are stopped before they go elsewhere on the tail
constexpr float kLoopSpeed = 0.1f;                        // [m/s] of a tool that carries a loop
constexpr float kKeepsLoop = 0.7f;                        // opening of a jaw that releases without shaking off a loop
constexpr float kOverRim = 0.025f;                        // [m] from where jaws and blades come down on a rim
constexpr float kSwab = 0.0045f;                          // [m] radius of its gauze, less what it presses
constexpr float kPressed = 0.001f, kLifted = 0.05f;       // [m] that the wheel moves a tip into the tissue, or off it
constexpr float kReach = 0.35f;                           // [m] from the field's center: limit of the hands

Vec3 shaft_of(const Pose& tool) { return rotate(tool.q, {0, 0, 1}); }

void turn_about(Pose& pose, Vec3 axis, float angle) {
  if (angle != 0) pose.q = normalized(axis_angle(axis, angle) * pose.q);
}

// The needle turns about its own circle and the tool with it, as one body.
void drive_needle(SteeredHand& hand, float angle) {
  const Pose needle = hand.pose * inverse(hand.grip);
  hand.pose = needle * Pose{{}, axis_angle({0, 0, 1}, angle)} * hand.grip;
}

// force: [N] on the hand, zero if it is not rendered.
void move(SteeredHand& hand, const HandMotion& m, const ViewFrame& view, const PictureModel& picture, Vec3 force) {
  // Motion along the view axis: the tool stays under the pointer.
  Vec3 way = view.right * m.right + view.up * m.up + normalized(hand.pose.p - view.eye, view.ahead) * m.ahead;
  // Without force feedback a hand would tear what it pulls: it slows against a force.
  if (dot(way, force) < 0) way = way * std::clamp(1.5f - length(force), 0.05f, 1.0f);
  hand.pose.p += way;
  turn_about(hand.pose, view.up, m.yaw);
  turn_about(hand.pose, view.right, m.pitch);
  turn_about(hand.pose, view.ahead, m.roll);
  if (m.drive != 0) {
    const bool at_bite = hand.snapped && hand.at == HelpAt::bite;
    if (at_bite) hand.driven = hand.hovered ? std::max(0.0f, hand.driven + m.drive) : 0;
    else if (hand.holds) drive_needle(hand, m.drive);
    else turn_about(hand.pose, shaft_of(hand.pose), m.drive);
  }
  const Vec3 away = hand.pose.p - picture.focus;
  if (length(away) > kReach) hand.pose.p = picture.focus + normalized(away) * kReach;
}

// On a flat screen, distance in the view plane counts far more than along it. there: the hand in the view plane, at the
// target's depth.
bool near_on_screen(const ViewFrame& view, Vec3 hand, Vec3 place, float reach, Vec3& there) {
  const Vec3 a = hand - view.eye, b = place - view.eye;
  const float deep_a = std::max(dot(a, view.ahead), 0.01f), deep_b = dot(b, view.ahead);
  there = view.eye + a * (deep_b / deep_a);
  return distance(there, place) < reach && std::abs(deep_b - deep_a) < kCatchDeep;
}

// A held needle near the planned bite is raised there, its tip in front of the tissue: first beside it, then at it.
void help_to_bite(Steering& steering, size_t who, const ViewFrame& view, const PictureModel& picture, const Snapshot& seen) {
  SteeredHand& hand = steering.hand[who];
  const bool was = hand.snapped && hand.at == HelpAt::bite;
  // A needle is driven with a tool that locks it: a needle holder, not forceps.
  const int tool = seen.tool[who].instrument;
  const bool drives = tool >= 0 && picture.instrument[static_cast<size_t>(tool)].can(kHoldNeedle | kClamp) &&
                      seen.tool[1 - who].held != Held::needle;
  const uint32_t suture = seen.tool[who].held_suture;
  const bool in_tissue = seen.suture[suture].needle.in_tissue;
  if (!steering.guide || steering.guide->suture != suture || !drives || (in_tissue && !was)) {
    hand.snapped = false;
    return;
  }
  if (in_tissue) {  // from here on the hand drives it
    hand.snapped = false;
    hand.pose = hand.sent.pose;
    return;
  }
  if (!was) hand.driven = 0;
  if (hand.driven <= 0) hand.bite = *steering.guide;
  const BiteGuide& g = hand.bite;
  const Pose needle = hand.pose * inverse(hand.grip);
  const Vec3 tip = on_needle(picture, needle, 1, suture), middle = on_needle(picture, needle, 0.5f, suture);
  Vec3 there, other;
  const float reach = was ? kBiteLetGo : kBiteCatch;
  // The reference point for the pointer: the needle's tip, or the tool.
  hand.snapped = hand.driven > 0 || near_on_screen(view, tip, entry_of(g), reach, there) ||
                 near_on_screen(view, hand.pose.p, entry_of(g), reach, other) ||
                 near_on_screen(view, middle, g.at, reach, other);
  if (!hand.snapped) return;
  if (!was) hand.hovered = false;
  hand.at = HelpAt::bite;
  const float psi = -half_bite(picture, g) - kBefore;
  const Pose beside = needle_on(picture, g, psi - 0.25f, kBesideTissue) * hand.grip;
  if (!hand.hovered) {
    const Pose& at = hand.sent.pose;
    hand.hovered = distance(at.p, beside.p) < 0.003f && length(rotation_vector(at.q * conjugate(beside.q))) < 0.1f;
  }
  hand.help = hand.hovered ? needle_on(picture, g, psi + hand.driven) * hand.grip : beside;
}

// Instruments that work on the wall. Jaws and blades come from above the rim. was: it was there in the last tick; open: the
// jaws are; ahead: [m] of the wheel. Snapped only where tissue is under the pointer.
void help_to_wall(SteeredHand& hand, uint32_t can, bool was, bool open, float ahead, const ViewFrame& view,
                  const PictureModel& picture, const Snapshot& seen) {
  const bool tip = can & (kCauterize | kAbsorb), blades = !tip && can & kCutTissue;
  const bool jaws = can & kHoldTissue && (can & (kHoldNeedle | kClamp)) != (kHoldNeedle | kClamp);
  if (!tip && !(blades && (was || open)) && !(jaws && (was || open))) return;
  const auto spot =
      jaws ? rim_beside(view, hand.pose.p, was ? kLetGo : kCatch, picture, seen) : wall_under(view, hand.pose.p, picture, seen);
  if (!spot || (!was && std::abs(dot(spot->at - hand.pose.p, view.ahead)) > kCatchDeep)) return;
  Vec3 there;
  near_on_screen(view, hand.pose.p, spot->at, 1, there);
  hand.pose.p = there;
  hand.snapped = true, hand.at = tip ? HelpAt::face : HelpAt::rim;
  if (!was) hand.hovered = false, hand.lift = 0;
  if (tip) {
    hand.lift = std::clamp(hand.lift - ahead, -kPressed, kLifted);
    hand.help = tip_on(*spot, hand.lift + (can & kAbsorb ? kSwab : 0));
    return;
  }
  hand.help = jaws ? jaws_at(*spot) : blades_at(*spot);
  if (hand.hovered) return;
  // Down along its own shaft: no blade passes through tissue on its way.
  Pose above = hand.help;
  const Vec3 z = shaft_of(above);
  const auto rim = blades ? rim_beside(view, hand.pose.p, 1, picture, seen) : std::nullopt;
  above.p += z * (kOverRim + (rim ? std::max(0.0f, dot(rim->at - above.p, z)) : 0));
  const Pose& at = hand.sent.pose;
  hand.hovered = distance(at.p, above.p) < 0.003f && length(rotation_vector(at.q * conjugate(above.q))) < 0.1f;
  if (!hand.hovered) hand.help = above;
}

// At needle, tail or bite.
void help_to_suture(Steering& steering, size_t who, const ViewFrame& view, const PictureModel& picture, const Snapshot& seen,
                    float dt) {
  SteeredHand& hand = steering.hand[who];
  if (!hand.snapped || hand.at != HelpAt::tail || seen.tool[who].held != Held::nothing) hand.misses = 0, hand.blocked = 0;
  if (steering.assist && seen.tool[who].held == Held::needle) return help_to_bite(steering, who, view, picture, seen);
  const bool open = !hand.closed && hand.opening > 0.5f;
  const int instrument = seen.tool[who].instrument;
  if (!steering.assist || instrument < 0 || seen.tool[who].held != Held::nothing || (!open && !hand.snapped)) {
    hand.snapped = false;
    return;
  }
  const InstrumentPicture& tool = picture.instrument[static_cast<size_t>(instrument)];
  if (hand.snapped && hand.at == HelpAt::bite) hand.snapped = false;
  const bool was = hand.snapped;
  const auto reach = [&](HelpAt at) { return was && hand.at == at ? kLetGo : kCatch; };
  // The target is the tail while the other hand has the needle; a tool with thread round it has no other target.
  const bool loop = seen.tool[who].loop_wraps > 0, other_has = seen.tool[1 - who].held == Held::needle;
  Vec3 there, best;
  float nearest = 1;
  hand.snapped = false;
  TailGrip tail;
  // Jaws that tissue stops on their way down do not press on: they go to the next best position.
  const bool at_tail = was && hand.at == HelpAt::tail;
  const bool stopped = at_tail && hand.hovered && distance(hand.sent.pose.p, hand.help.p) < kThere &&
                       distance(seen.tool[who].pose.p, hand.help.p) > kThere;
  hand.blocked = stopped ? hand.blocked + dt : 0;
  const bool elsewhere = hand.blocked > kBlocked && hand.misses < hand.missed.size();
  if (elsewhere) hand.missed[hand.misses++] = hand.help.p, hand.blocked = 0;
  const std::span<const Vec3> tried{hand.missed.data(), hand.misses};
  if (other_has && tool.can(kHoldThread) && !seen.active().needle.in_tissue && tail_grip(picture, seen, who, tail, tried)) {
    // Hysteresis: it stays with its particle even if another one is slightly better.
    if (elsewhere) hand.hovered = false, hand.pose.p = tail.pose.p;
    else if (at_tail) tail.slot = hand.tail_slot, tail.pose.p = seen.particle[tail.slot];
    if (near_on_screen(view, hand.pose.p, tail.pose.p, reach(HelpAt::tail), there)) {
      // Along the shaft, from above: objects beside the tail are not pushed aside.
      const Pose above{tail.pose.p + rotate(tail.pose.q, {0, 0, kAboveTail}), tail.pose.q};
      if (!was || hand.at != HelpAt::tail) hand.hovered = false;
      hand.hovered = hand.hovered || distance(hand.sent.pose.p, above.p) < 0.003f;
      hand.snapped = true, hand.at = HelpAt::tail, hand.tail_slot = tail.slot;
      hand.help = hand.hovered ? tail.pose : above;
      best = there, nearest = distance(there, tail.pose.p);
    }
  }
  // Any needle may be taken; the nearest on the screen is meant.
  for (size_t k = 0; k < seen.suture.size() && !loop && tool.can(kHoldNeedle); ++k) {
    const Pose grip = good_grip(picture, seen, who, shaft_of(hand.pose), hand.pose.p, static_cast<int>(k));
    if (!near_on_screen(view, hand.pose.p, grip.p, reach(HelpAt::needle), there) || distance(there, grip.p) >= nearest)
      continue;
    nearest = distance(there, grip.p);
    hand.snapped = true, hand.at = HelpAt::needle, hand.help = grip, best = there;
  }
  // The hand keeps the depth of the assist, or the tool would jump back on release.
  if (hand.snapped) hand.pose.p = best;
}

// Whether the assist moves the tool now. ahead: [m] of this hand's motion along the view axis.
void help(Steering& steering, size_t who, float ahead, const ViewFrame& view, const PictureModel& picture, const Snapshot& seen,
          float dt) {
  SteeredHand& hand = steering.hand[who];
  const bool at_wall = hand.snapped && hand.at >= HelpAt::rim;
  if (at_wall) hand.snapped = false;
  help_to_suture(steering, who, view, picture, seen, dt);
  const ToolView& tool = seen.tool[who];
  if (steering.assist && !hand.snapped && tool.instrument >= 0 && tool.held == Held::nothing)
    help_to_wall(hand, picture.instrument[static_cast<size_t>(tool.instrument)].capabilities, at_wall,
                 !hand.closed && hand.opening > 0.5f, ahead, view, picture, seen);
  if (!at_wall || (hand.snapped && hand.at >= HelpAt::rim)) return;
  // It leaves the wall as it was held there, or with what it has grasped.
  hand.pose.q = hand.sent.pose.q;
  if (tool.held == Held::tissue) hand.pose.p = hand.sent.pose.p;
}

// Two-handed actions, and the hand that follows the other.
void both(Steering& steering, const std::array<HandMotion, 2>& motion, const PictureModel& picture, const Snapshot& seen,
          float dt) {
  if (!steering.assist) return;
  std::array<Pose, 2> pose{steering.hand[0].pose, steering.hand[1].pose};
  const size_t needle = seen.tool[0].held == Held::needle ? 0 : 1;
  const SteeredHand& holder = steering.hand[needle];
  const Pose& grip = holder.grip;
  const bool at_bite = holder.snapped && holder.at == HelpAt::bite && holder.driven > 0;
  if (!seen.active().needle.in_tissue)
    steering.both.not_driven = at_bite || motion[needle].drive != 0 ? 0 : steering.both.not_driven + dt;
  if (motion[0].together || motion[1].together) {
    const BothDo done = both_hands(steering.both, motion[0].both + motion[1].both, pose, grip, picture, seen, dt);
    if (done != BothDo::nothing) steering.hand[0].snapped = steering.hand[1].snapped = false;
  } else if (seen.tool[needle].held == Held::needle && seen.tool[1 - needle].loop_wraps > 0) {
    go_along(steering.both, 1 - needle, pose, grip, picture, seen, dt);
  } else {
    steering.both.follows = false;
  }
  for (size_t k = 0; k < 2; ++k) steering.hand[k].pose = pose[k];
}

}  // namespace

ViewFrame view_frame(Vec3 eye, Vec3 target, Vec3 up, float fov_deg, float height_px) {
  ViewFrame v;
  v.eye = eye;
  v.ahead = normalized(target - eye, {0, 0, -1});
  v.right = normalized(cross(v.ahead, up), any_perpendicular(v.ahead));
  v.up = cross(v.right, v.ahead);
  v.pixel = 2 * std::tan(0.5f * fov_deg * kPi / 180) / std::max(height_px, 1.0f);
  return v;
}

Steering start_steering(const PictureModel& picture, bool left_handed) {
  Steering s;
  for (size_t k = 0; k < 2; ++k) {
    const float side = (k == 0) != left_handed ? 1.0f : -1.0f;
    // The shafts come from the surgeon's side, from above and from their own side; the jaws open across.
    const Vec3 z = normalized(Vec3{0.5f * side, 0.7f, 0.6f}), x = normalized(cross({0, 1, 0}, z));
    s.hand[k].pose = {picture.focus + Vec3{0.6f * side, 0.45f, 0.3f} * picture.field, from_axes(x, cross(z, x), z)};
  }
  return s;
}

void resume_steering(Steering& steering, const Snapshot& seen) {
  steering.both = {};
  if (seen.active().needle.in_tissue) steering.both.not_driven = 0;  // perhaps a bite
  for (size_t k = 0; k < 2; ++k) {
    SteeredHand& hand = steering.hand[k];
    hand.pose = seen.tool[k].hand;
    hand.closed = seen.tool[k].jaw < 0.4f;
    hand.opening = 1;
    hand.holds = hand.snapped = false;
    hand.waited = 0;
    hand.sent.connected = 0;
  }
}

Pose good_grip(const PictureModel& picture, const Snapshot& seen, size_t who, Vec3 shaft, Vec3 near, int suture) {
  const size_t which = suture < 0 ? seen.active_suture : static_cast<size_t>(suture);
  const SuturePicture& shape = picture.suture[which];
  const NeedleView& view = seen.suture[which].needle;
  const ToolView& other = seen.tool[1 - who];
  const Pose& needle = view.pose;
  const auto at = [&](float s) {
    const float phi = s * shape.needle_arc;
    return needle.p + rotate(needle.q, {std::cos(phi), std::sin(phi), 0}) * shape.needle_radius;
  };
  const auto free = [&](float s) {
    return other.held != Held::needle || other.held_suture != which || std::abs(other.held_at - s) > kBeside;
  };
  bool tip = !free(kDriveAt);
  // Stuck in tissue and not held: the end nearer to the hand.
  if (view.in_tissue && free(kDriveAt) && free(kTipAt)) tip = distance(at(kTipAt), near) < distance(at(kDriveAt), near);
  const float s = tip ? kTipAt : kDriveAt;
  const Vec3 radial = rotate(needle.q, {std::cos(s * shape.needle_arc), std::sin(s * shape.needle_arc), 0});
  // The shaft leaves the needle's plane on its present side; at the tip it tilts back, away from the tissue that the needle
  // exits.
  const float side = dot(rotate(needle.q, {0, 0, 1}), shaft) >= 0 ? 1.0f : -1.0f;
  const Vec3 lean = rotate(needle.q, {std::cos(2.6f), -std::sin(2.6f), 0});
  const Vec3 z = normalized(rotate(needle.q, {0, 0, side}) + lean * (tip ? 0.3f : 0.0f));
  const Vec3 y = normalized(cross(z, radial), any_perpendicular(z));
  return {needle.p + radial * shape.needle_radius, from_axes(cross(y, z), y, z)};
}

std::array<ToolInput, 2> steer(Steering& steering, const std::array<HandMotion, 2>& motion, const ViewFrame& view,
                               const PictureModel& picture, const Snapshot& seen, float dt, uint64_t time_ns) {
  std::array<ToolInput, 2> out;
  for (size_t k = 0; k < 2; ++k) {
    SteeredHand& hand = steering.hand[k];
    const bool holds = seen.tool[k].held == Held::needle;
    const NeedleView& needle = seen.suture[holds ? seen.tool[k].held_suture : seen.active_suture].needle;
    if (holds && !hand.holds) {
      if (hand.snapped) hand.pose = hand.help;  // it was grasped at the assisted pose
      hand.grip = inverse(needle.pose) * seen.tool[k].pose;
      hand.snapped = false;
    }
    hand.holds = holds;
    // Two tools that hold it displace each other slightly: use the grip of this one only.
    if (holds && !needle.in_tissue && seen.tool[1 - k].held != Held::needle)
      hand.grip = inverse(needle.pose) * seen.tool[k].pose;
  }
  both(steering, motion, picture, seen, dt);
  for (size_t k = 0; k < 2; ++k) {
    SteeredHand& hand = steering.hand[k];
    const bool together = motion[k].together && steering.assist && steering.both.doing != BothDo::nothing;
    if (!together) {
      const bool pulls = steering.assist && seen.tool[k].held != Held::nothing;
      const Vec3 from = hand.pose.p;
      move(hand, motion[k], view, picture, pulls ? seen.tool[k].force : Vec3{});
      if (pulls) hand.pose.p = on_leash(picture, seen, k, spare_tail(picture, seen, k, from, hand.pose.p, dt));
      help(steering, k, motion[k].ahead, view, picture, seen, dt);
    }

    ToolInput in;
    in.pose = hand.snapped ? hand.help : hand.pose;
    const bool loop = steering.assist && seen.tool[k].loop_wraps > 0;
    if (hand.sent.connected && steering.sequence > 0) {
      // Slow for a needle on its way to a bite, at the wall, and for a tool with a loop.
      Pose from = hand.sent.pose;
      if (hand.snapped && hand.at >= HelpAt::bite) {
        glide(from, in.pose, kHelpSpeed, kHelpTurn, dt);
        in.pose = from;
      } else if (loop && !together) {
        const float calm = std::clamp(1.5f - needle_tension(seen), 0.05f, 1.0f);
        glide(from, in.pose, kLoopSpeed * calm, kHelpTurn, dt);
        in.pose = from;
      }
    }
    in.jaw = hand.closed ? 0.0f : hand.opening;
    // A jaw closed on the way to the needle closes on arrival.
    const bool at_jaw = hand.snapped && hand.at != HelpAt::bite;
    const bool coming = at_jaw && hand.closed &&
                        (distance(seen.tool[k].pose.p, hand.help.p) > kThere ||
                         ((hand.at == HelpAt::tail || hand.at == HelpAt::rim) && !hand.hovered));
    const bool sent_there = distance(in.pose.p, hand.help.p) < kThere;
    hand.waited = coming ? hand.waited + (sent_there ? dt : 0) : 0;
    if (coming && hand.waited < kPatience) in.jaw = 1;
    const bool winds = together && steering.both.doing == BothDo::wind && !hand.holds;
    if (loop || winds) in.jaw = std::min(in.jaw, kKeepsLoop);
    in.buttons = hand.buttons;
    hand.buttons = 0;
    in.time_ns = time_ns;
    in.sequence = steering.sequence;
    if (hand.sent.connected && dt > 0 && steering.sequence > 0) {
      in.velocity = (in.pose.p - hand.sent.pose.p) / dt;
      in.angular_velocity = rotation_vector(in.pose.q * conjugate(hand.sent.pose.q)) / dt;
    }
    hand.sent = out[k] = in;
  }
  ++steering.sequence;
  return out;
}

}  // namespace catgut
