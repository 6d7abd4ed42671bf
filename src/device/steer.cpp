// device: see steer.h.
#include "device/steer.h"

#include <cmath>

namespace catgut {
namespace {

constexpr float kDriveAt = 0.35f, kTipAt = 0.93f;  // places on the needle's arc: two thirds from the tip, behind the tip
constexpr float kBeside = 0.3f;                    // of the arc: two jaws nearer than this would meet
constexpr float kCatch = 0.009f;     // [m] across the view: nearer than this to the good place, the help takes the tool
constexpr float kLetGo = 0.014f;     // and farther than this it lets go
constexpr float kCatchDeep = 0.12f;  // [m] along the view, where nobody can judge distances on a flat screen
constexpr float kThere = 0.0015f;    // [m] the tool is at the needle
constexpr float kPatience = 0.6f;    // [s] a closing jaw waits for that
constexpr float kReach = 0.35f;      // [m] from the field's centre: no hand gets lost

Vec3 shaft_of(const Pose& tool) { return rotate(tool.q, {0, 0, 1}); }

void turn_about(Pose& pose, Vec3 axis, float angle) {
  if (angle != 0) pose.q = normalized(axis_angle(axis, angle) * pose.q);
}

// The needle turns about its own circle and the tool with it, as one body.
void drive_needle(SteeredHand& hand, float angle) {
  const Pose needle = hand.pose * inverse(hand.grip);
  hand.pose = needle * Pose{{}, axis_angle({0, 0, 1}, angle)} * hand.grip;
}

void move(SteeredHand& hand, const HandMotion& m, const ViewFrame& view, const PictureModel& picture) {
  hand.pose.p += view.right * m.right + view.up * m.up;
  // Into the picture is along the line of sight: the tool stays under the pointer.
  hand.pose.p += normalized(hand.pose.p - view.eye, view.ahead) * m.ahead;
  turn_about(hand.pose, view.up, m.yaw);
  turn_about(hand.pose, view.right, m.pitch);
  turn_about(hand.pose, view.ahead, m.roll);
  if (m.drive != 0) {
    if (hand.holds) drive_needle(hand, m.drive);
    else turn_about(hand.pose, shaft_of(hand.pose), m.drive);
  }
  const Vec3 away = hand.pose.p - picture.focus;
  if (length(away) > kReach) hand.pose.p = picture.focus + normalized(away) * kReach;
}

// Whether the help has the tool now; on a flat screen nearness counts across the view far more than along it.
void help(Steering& steering, size_t who, const ViewFrame& view, const PictureModel& picture, const Snapshot& seen) {
  SteeredHand& hand = steering.hand[who];
  const bool open = !hand.closed && hand.opening > 0.5f;
  if (!steering.assist || seen.tool[who].held != Held::nothing || (!open && !hand.snapped)) {
    hand.snapped = false;
    return;
  }
  const Pose grip = good_grip(picture, seen, who, shaft_of(hand.pose), hand.pose.p);
  const Vec3 a = hand.pose.p - view.eye, b = grip.p - view.eye;
  const float deep_a = std::max(dot(a, view.ahead), 0.01f), deep_b = dot(b, view.ahead);
  // Both seen at the needle's depth.
  const Vec3 there = a * (deep_b / deep_a);
  const bool was = hand.snapped;
  hand.snapped = distance(there, b) < (was ? kLetGo : kCatch) && std::abs(deep_b - deep_a) < kCatchDeep;
  if (!hand.snapped) return;
  hand.help = grip;
  // The depth that the help found is the hand's from now on, or the tool would jump back when it is let go.
  hand.pose.p = view.eye + there;
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

Pose good_grip(const PictureModel& picture, const Snapshot& seen, size_t who, Vec3 shaft, Vec3 near) {
  const ToolView& other = seen.tool[1 - who];
  const Pose& needle = seen.needle.pose;
  const auto at = [&](float s) {
    const float phi = s * picture.needle_arc;
    return needle.p + rotate(needle.q, {std::cos(phi), std::sin(phi), 0}) * picture.needle_radius;
  };
  const auto free = [&](float s) { return other.held != Held::needle || std::abs(other.held_at - s) > kBeside; };
  bool tip = !free(kDriveAt);
  // Stuck in tissue with nobody holding it: whichever end the hand is at.
  if (seen.needle.in_tissue && free(kDriveAt) && free(kTipAt)) tip = distance(at(kTipAt), near) < distance(at(kDriveAt), near);
  const float s = tip ? kTipAt : kDriveAt;
  const Vec3 radial = rotate(needle.q, {std::cos(s * picture.needle_arc), std::sin(s * picture.needle_arc), 0});
  // The shaft leaves the needle's plane on the side that it is on already; at the tip it leans back, away from the tissue that
  // the needle comes out of.
  const float side = dot(rotate(needle.q, {0, 0, 1}), shaft) >= 0 ? 1.0f : -1.0f;
  const Vec3 lean = rotate(needle.q, {std::cos(2.6f), -std::sin(2.6f), 0});
  const Vec3 z = normalized(rotate(needle.q, {0, 0, side}) + lean * (tip ? 0.3f : 0.0f));
  const Vec3 y = normalized(cross(z, radial), any_perpendicular(z));
  return {needle.p + radial * picture.needle_radius, from_axes(cross(y, z), y, z)};
}

std::array<ToolInput, 2> steer(Steering& steering, const std::array<HandMotion, 2>& motion, const ViewFrame& view,
                               const PictureModel& picture, const Snapshot& seen, float dt, uint64_t time_ns) {
  std::array<ToolInput, 2> out;
  for (size_t k = 0; k < 2; ++k) {
    SteeredHand& hand = steering.hand[k];
    const bool holds = seen.tool[k].held == Held::needle;
    if (holds && !hand.holds) {
      if (hand.snapped) hand.pose = hand.help;  // it was grasped where the help had it
      hand.grip = inverse(seen.needle.pose) * seen.tool[k].pose;
    }
    hand.holds = holds;
    move(hand, motion[k], view, picture);
    help(steering, k, view, picture, seen);

    ToolInput in;
    in.pose = hand.snapped ? hand.help : hand.pose;
    in.jaw = hand.closed ? 0.0f : hand.opening;
    // A jaw that is told to close on the way to the needle closes when it is there.
    const bool coming = hand.snapped && hand.closed && distance(seen.tool[k].pose.p, hand.help.p) > kThere;
    hand.waited = coming ? hand.waited + dt : 0;
    if (coming && hand.waited < kPatience) in.jaw = 1;
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
