// SPDX-License-Identifier: Apache-2.0
// device: see both_hands.h.
#include "device/both_hands.h"

#include <algorithm>
#include <cmath>

#include "exchange/strand.h"

namespace catgut {
namespace {

constexpr float kTautInTissue = 0.9f;           // where only friction holds the thread, and one jerk would pull it all through
constexpr float kLeastLoose = 0.4f;             // the needle is not pulled down into the wound with it
constexpr float kWindRate = 2.2f;               // [rad/s] maximum, or the strand becomes slack or cuts the corner
constexpr float kOver = 1.5f;                   // [rad] beyond whole turns: thread that crosses itself
constexpr float kSlack = 0.05f, kRise = 0.03f;  // [N], [m/s] below and at which the needle rises over a loop
constexpr float kWithdraw = 1.5f;               // [rad/s] of a needle that entered the tissue by mistake
constexpr float kDrivenIn = 0.5f;               // [s] from the gesture to the needle's entry
constexpr float kCarried = 2.2f;                // [rad] from the vertical to the radius of the needle's swage
constexpr float kOutward = 1.75f;               // [rad] maximum between that radius and the strand that leaves
constexpr float kGoesOn = 0.012f;               // [m]
constexpr float kSpeed = 0.15f, kLift = 0.1f, kCareful = 0.06f, kTurn = 4.0f;  // [m/s], [m/s], [rad/s]
constexpr float kLongestDraw = 0.05f;                                          // [s] of motion in one frame of drawing
constexpr float kDrawPerRad = 0.012f;                          // [m] per radian of the gesture by which the hands move apart
constexpr float kGiveInTissue = 0.010f, kGiveAtKnot = 0.002f;  // [m] that a hand may pull a taut strand, and
constexpr float kGiveToThrow = 0.040f;  // [m] one whose throw is not locked: its loop still has thread to give
constexpr float kLongTail = 0.080f, kShortTail = 0.030f, kSettle = 0.7f,
                kLeastPull = 0.006f;  // [m], [m], [s], [m/s]: see spare_tail
constexpr size_t kFirstStitch = 4;    // suture points: at most two bites
constexpr float kCounterHold = 0.8f;  // [N] above this the thread sticks in its holes

enum { lift, lay, beside, wind };  // stages of winding

// From which side a tool comes: +1 from the right.
float side_of(const Pose& tool) { return rotate(tool.q, {0, 0, 1}).x >= 0 ? 1.0f : -1.0f; }

size_t whole_pairs(const Snapshot& seen) {
  return seen.active().thread_tension.size() -
         static_cast<size_t>(std::count(seen.active().thread_cut.begin(), seen.active().thread_cut.end(), uint8_t{1}));
}

// The tool that holds the needle by `grip`, given the position of the needle's swage: its tip up and out of reach, the shaft on
// `side`. Jaws near the tip stand opposite to the swage, where a strand that leaves across the needle's circle would catch on
// them. So the tool rolls about its shaft while the needle moves round the other one, and the strand always leaves outward.
Pose carrying(const SuturePicture& suture, const Pose& grip, Vec3 swage_at, float side, float way = 0, float wound = 0) {
  const float u = rotate(grip.q, {0, 0, 1}).z * side >= 0 ? 1.0f : -1.0f, sense = side * way;
  const float roll = -kCarried * u + sense * std::max(0.0f, wound - (kPi - kCarried) * u * sense - kOutward);
  const Vec3 up{u, 0, 0}, x{0, portable::cos(roll), portable::sin(roll)};
  const Quat q = from_axes(x, cross(up, x), up);
  return Pose{swage_at - rotate(q, {suture.needle_radius, 0, 0}), q} * grip;
}

void go(BothHands& b, int stage) { b.stage = stage, b.held_for = 0; }

// The same sense as before, if any.
void begin(BothHands& b, const PictureModel& picture, const Snapshot& seen) {
  begin_winding(b.winding, picture, seen);
  b.winding.free = -1;
  b.wish = 0;
  go(b, lift);
}

void wind_on(BothHands& b, size_t winder, std::array<Pose, 2>& hand, const Pose& grip, const PictureModel& picture,
             const Snapshot& seen, float dt) {
  const size_t lying = 1 - winder;
  const float side = side_of(hand[lying]);
  Winding& w = b.winding;
  const AcrossTool across(tying_axis(side));
  const Vec3 axis_at = winding_axis(w, across);
  const Pose rest{axis_at - across.z * kTieWindAt, from_tool_axis(across.z)};
  if (w.free < 0) w.free = (seen.active().knot.empty() ? kTautInTissue : kTieTaut) * (w.reach - distance(w.start, axis_at));
  float room = 1;
  const auto swage_at = [&](float wound) { return winding_swage(w, across, wound, room); };
  const float tension = needle_tension(seen);
  const float behind = distance(needle_swage(picture, seen), swage_at(w.wound));
  if (b.stage >= beside) feel_winding(w, seen, across, behind, room, dt);
  const auto carry = [&](float speed) {
    return glide(hand[winder], carrying(picture.suture[seen.active_suture], grip, swage_at(w.wound), -side, w.way, w.wound),
                 speed, kTurn, dt);
  };
  b.held_for += dt;
  switch (b.stage) {
    case lift:
      glide(hand[lying], {rest.p - across.e2 * (w.way * 0.03f) + Vec3{0, 0.01f, 0}, rest.q}, kSpeed, kTurn, dt);
      if (carry(kLift) || b.held_for > 8) go(b, lay);
      return;
    case lay:
      carry(kLift);
      if (glide(hand[lying], {rest.p - across.e2 * (w.way * 0.012f), rest.q}, kSpeed, kTurn, dt)) go(b, beside);
      return;
    case beside:
      carry(kCareful);
      if ((glide(hand[lying], rest, kCareful, kTurn, dt) && tension > 0.02f) || b.held_for > 4) go(b, wind);
      return;
    default: {
      glide(hand[lying], rest, kCareful, kTurn, dt);
      // The needle waits while it lags behind.
      const float keep_up = std::clamp(1.5f - behind / 0.006f, 0.0f, 1.0f);
      // No further than the next loop: a continued spiral is not a loop.
      const float next = static_cast<float>(seen.tool[lying].loop_wraps + 1) * 2 * kPi;
      const float most_turn = std::max(next + kOver, w.wound), before = w.wound;
      const float turn = std::clamp(b.wish, -2 * kWindRate * dt, kWindRate * dt * keep_up);
      w.wound = std::clamp(w.wound + turn, kTieBefore, most_turn);
      const float turned = w.wound - before;
      b.wish = std::clamp(b.wish - turn, -1.5f * kPi, 1.5f * kPi);
      w.free = std::max(0.006f, w.free - kTieWound * turned);
      // Wound but not a loop yet: its ends are too far apart along the tool, and are moved together.
      if (w.wound > next + kOver - 0.1f) w.lean = std::max(-2 * kTieLean, w.lean - kTieLean * dt);
      carry(1.2f * kSpeed);
      // Wound back: the attempt is discarded, and the tool is laid to the strand again.
      if (before >= 0 && w.wound < 0) begin(b, picture, seen);
      return;
    }
  }
}

void draw_on(const BothHands& b, float amount, size_t needle, std::array<Pose, 2>& hand, const PictureModel& picture,
             const Snapshot& seen, float dt) {
  const size_t tail = 1 - needle;
  const Vec3 knot = stitch_place(picture, seen);
  Vec3 way[2];
  if (b.winding.way != 0) {  // a throw: the hands move low and evenly, each to the side that makes it lie flat
    const float x = b.winding.way * side_of(hand[tail]);
    way[tail] = normalized(Vec3{x, 0.35f, 0.1f});
    way[needle] = normalized(Vec3{-x, 0.35f, 0.1f});
  } else {  // no knot: along the stitch, each end from its own hole
    Vec3 across{1, 0, 0};
    if (!seen.active().suture_point.empty())
      across = normalized(seen.active().suture_point.back().position - seen.active().suture_point.front().position, across);
    way[needle] = normalized(across * 0.8f + Vec3{0, 0.6f, 0});
    way[tail] = normalized(across * -0.8f + Vec3{0, 0.6f, 0});
  }
  // The force that slows the hand is that of the last frame: at few frames per second a whole step at full speed would jerk the
  // tail out.
  const float most = 0.6f * kSpeed * std::min(dt, kLongestDraw), far = std::clamp(amount * kDrawPerRad, -most, most);
  const size_t held = node_of(seen, seen.tool[tail].held_slot);
  const float pull = held < seen.active().thread_tension.size() ? seen.active().thread_tension[held] : 0;
  for (const size_t k : {needle, tail}) {
    // The hand slows in proportion to the tension, and to what stops it; not to tissue that pushes the jaws out.
    const float load = std::max(k == tail ? pull : needle_tension(seen), -dot(seen.tool[k].force, way[k]));
    const float gently = amount > 0 ? std::clamp(1.5f - load, 0.03f, 1.0f) : 1.0f;
    hand[k].p = on_leash(picture, seen, k, hand[k].p + way[k] * (far * gently));
  }
  // Before a knot, the tail's hand only applies counter-traction: if both sides are pulled hard, the tissue follows instead.
  if (b.winding.way == 0 && pull > kCounterHold) hand[tail].p += normalized(knot - hand[tail].p) * (0.3f * kSpeed * dt);
}

}  // namespace

Vec3 on_leash(const PictureModel& picture, const Snapshot& seen, size_t who, Vec3 p) {
  const ToolView& tool = seen.tool[who];
  if (seen.active().suture_point.empty() || seen.active().thread_tension.empty()) return p;
  const size_t first = first_point_node(seen), last = last_point_node(seen);
  size_t held = seen.active().thread_order.size() - 1;
  Vec3 end = tool.pose.p;  // where the hand holds the thread
  if (tool.held == Held::needle && !seen.active().needle.in_tissue && seen.active().needle_on_thread)
    end = needle_swage(picture, seen);
  else if (tool.held == Held::thread) held = node_of(seen, tool.held_slot);
  else return p;
  if (held >= first && held <= last) return p;
  size_t from = held < first ? first : last;
  Vec3 anchor = node_at(seen, from);
  if (!seen.active().knot.empty()) {  // a knot holds it: the strands that leave the knot cannot slide
    const Vec3 knot = seen.active().knot.back().position;
    const size_t begin = held < first ? held : last, end_node = held < first ? first : held;
    for (size_t i = begin; i <= end_node; ++i)
      if (length2(node_at(seen, i) - knot) < length2(node_at(seen, from) - knot)) from = i;
    anchor = knot;
  }
  const float pair = seen.active().thread_rest / static_cast<float>(std::max<size_t>(1, whole_pairs(seen)));
  const Vec3 off = end + (p - tool.pose.p) - anchor;
  const float most = static_cast<float>(std::max(from, held) - std::min(from, held)) * pair +
                     (seen.active().knot.empty()                                 ? kGiveInTissue
                      : seen.active().knot.back().phase == KnotPhase::tightening ? kGiveToThrow
                                                                                 : kGiveAtKnot);
  const float far = length(off);
  return far > most ? p - off * ((far - most) / far) : p;
}

Vec3 spare_tail(const PictureModel& picture, const Snapshot& seen, size_t who, Vec3 from, Vec3 p, float dt) {
  const SutureView& s = seen.active();
  if (seen.tool[who].held != Held::needle || s.needle.in_tissue || !s.needle_on_thread || !s.knot.empty() ||
      s.suture_point.empty() || s.suture_point.size() > kFirstStitch || seen.tool[1 - who].held == Held::thread)
    return p;
  const Vec3 swage = needle_swage(picture, seen), anchor = node_at(seen, last_point_node(seen));
  const bool taut =
      distance(swage, anchor) > kTautInTissue * length_between(seen, last_point_node(seen), s.thread_order.size() - 1);
  const float tail = length_between(seen, 0, first_point_node(seen));
  if (tail > kLongTail) return p;
  const float most = std::max(kLeastPull, (tail - kShortTail) / kSettle) * dt;
  const Vec3 away = normalized(swage - anchor);
  const float far = dot(p - from, away);
  return taut && far > most ? p - away * (far - most) : p;
}

bool glide(Pose& pose, const Pose& goal, float speed, float turn, float dt) {
  const Vec3 way = goal.p - pose.p, about = rotation_vector(goal.q * conjugate(pose.q));
  const float far = length(way), angle = length(about);
  const float part = std::min({1.0f, far > 0 ? speed * dt / far : 1.0f, angle > 0 ? turn * dt / angle : 1.0f});
  pose.p += way * part;
  pose.q = nlerp(pose.q, goal.q, part);
  return far * (1 - part) < 0.0005f && angle * (1 - part) < 0.03f;
}

BothDo both_hands(BothHands& b, float amount, std::array<Pose, 2>& hand, const Pose& grip, const PictureModel& picture,
                  const Snapshot& seen, float dt) {
  const size_t needle = seen.tool[0].held == Held::needle ? 0 : 1, other = 1 - needle;
  const bool ties = !seen.active().knot.empty() || b.winding.way != 0;
  const bool strayed = seen.active().needle.in_tissue && b.not_driven > kDrivenIn;
  if (seen.tool[needle].held == Held::needle && strayed && ties && amount != 0) {
    const Pose back{{}, axis_angle({0, 0, 1}, -std::min(std::abs(amount), kWithdraw * dt))};
    hand[needle] = hand[needle] * inverse(grip) * back * grip;
    return b.doing = BothDo::withdraw;
  }
  const bool holds =
      seen.tool[needle].held == Held::needle && !seen.active().needle.in_tissue && !seen.active().suture_point.empty();
  b.follows = false;
  if (!holds || (seen.tool[other].held != Held::nothing && seen.tool[other].held != Held::thread))
    return b.doing = BothDo::nothing;
  if (seen.tool[other].held == Held::thread) {
    b.doing = BothDo::draw;
    draw_on(b, amount, needle, hand, picture, seen, dt);
    return b.doing;
  }
  // Resumed where it was left, unless the tool has moved elsewhere meanwhile.
  const bool goes_on = b.doing == BothDo::wind && distance(hand[other].p, b.lain) < kGoesOn;
  if (!goes_on) {
    b.doing = BothDo::wind;
    b.winding.way = 0;
    begin(b, picture, seen);
    b.lain = hand[other].p;
  }
  // The first motion selects the sense; until then the hands are ready for either.
  if (b.winding.way == 0) {
    if (amount == 0) return b.doing;
    b.winding.way = amount > 0 ? 1.0f : -1.0f;
  }
  b.wish += amount * b.winding.way;
  wind_on(b, needle, hand, grip, picture, seen, dt);
  b.lain = hand[other].p;
  return b.doing;
}

void go_along(BothHands& b, size_t who, std::array<Pose, 2>& hand, const Pose& grip, const PictureModel& picture,
              const Snapshot& seen, float dt) {
  const size_t needle = 1 - who;
  const float strand = length_between(seen, node_of(seen, seen.tool[who].loop_last), seen.active().thread_order.size() - 1);
  if (!b.follows) b.winding.free = kTieLoose * strand;
  b.follows = true;
  const Pose& tool = seen.tool[who].pose;
  const float tension = needle_tension(seen), side = side_of(tool);
  // Slack again, it rises again: a needle that stays low enters the tissue on the way to the tail.
  if (tension > kTieTooTaut) b.winding.free = std::max(kLeastLoose * strand, feel_strand(b.winding.free, tension, dt));
  else if (tension < kSlack) b.winding.free = std::min(kTieLoose * strand, b.winding.free + kRise * dt);
  const Vec3 turns = tool.p + rotate(tool.q, {0, 0, kTieWindAt});
  const Vec3 above = strand_above(b.winding, AcrossTool(tying_axis(side)), turns);
  glide(hand[needle], carrying(picture.suture[seen.active_suture], grip, above, -side), 2 * kSpeed, kTurn, dt);
}

bool tail_grip(const PictureModel& picture, const Snapshot& seen, size_t who, TailGrip& out, std::span<const Vec3> tried) {
  return best_tail_grip(picture, seen, who, side_of(seen.tool[who].pose), kTailByHand, tried, out) && out.tail >= 0.004f;
}

}  // namespace catgut
