// device: see both_hands.h.
#include "device/both_hands.h"

#include <algorithm>
#include <cmath>

#include "exchange/strand.h"

namespace catgut {
namespace {

constexpr float kWindAt = 0.024f;       // [m] behind the tool's tip, where thread is wound round it
constexpr float kWindRadius = 0.0028f;  // [m] of a wrap's middle line
constexpr float kBefore = -0.25f;       // [rad] where the strand stands before it is wound
constexpr float kWound = 0.0022f;       // [m] of thread that a radian takes
constexpr float kApart = 0.010f;        // [m] along the tool, by which the strand's two ends stand apart
constexpr float kLeadBack = 0.004f;     // [m] toward the hand: a slack strand would slide off the tip
constexpr float kLean = 0.3f;           // of the strand that leaves, along the tool
constexpr float kTaut = 0.975f;         // of the strand's length, between tool and needle: just not taut
constexpr float kTautInTissue = 0.9f;   // where nothing but friction holds the thread, and one jerk draws it all through
constexpr float kNeedleBelow = 0.007f;  // [m] that the needle hangs below its swage
constexpr float kLeastFree = 0.032f;    // [m] of strand that must be left to go round
constexpr float kNear = 0.035f;         // [m] round a stitch: tissue that hands go over
constexpr float kTooTaut = 0.3f;        // [N]
constexpr float kLoose = 0.7f;          // of the strand between the turns and the needle, on the way to the tail
constexpr float kLeastLoose = 0.4f;     // the needle is not drawn down into the wound with it
constexpr float kWindRate = 2.2f;       // [rad/s] no faster, or the strand goes slack or cuts the corner
constexpr float kOver = 1.5f;           // [rad] beyond whole turns: thread that crosses itself
constexpr float kGoesOn = 0.012f;       // [m]
constexpr float kSpeed = 0.15f, kLift = 0.1f, kCareful = 0.06f, kTurn = 4.0f;  // [m/s], [m/s], [rad/s]
constexpr float kDrawPerRad = 0.012f;                          // [m] that a radian of the gesture draws the hands apart
constexpr float kGiveInTissue = 0.010f, kGiveAtKnot = 0.002f;  // [m] that a hand may draw at a taut strand
constexpr float kCounterHold = 0.8f;                           // [N] drawn harder the thread sticks in its holes
constexpr float kShaft = 0.0035f;                              // [m] a shaft's radius and the tissue's
constexpr float kClear = 0.006f;                               // [m] between jaws that take the tail and the other strand

enum { lift, lay, beside, wind };  // stages of winding

// A tool along z, the open side of its jaws up.
Quat from_tool_axis(Vec3 z) {
  const Vec3 x = normalized(Vec3{0, 1, 0} - z * z.y);
  return from_axes(x, cross(z, x), z);
}

// From which side a tool comes: +1 from the right.
float side_of(const Pose& tool) { return rotate(tool.q, {0, 0, 1}).x >= 0 ? 1.0f : -1.0f; }

Vec3 stitch(const PictureModel& picture, const Snapshot& seen) {
  if (!seen.knot.empty()) return seen.knot.back().position;
  if (seen.suture_point.empty()) return picture.focus;
  return 0.5f * (seen.suture_point.front().position + seen.suture_point.back().position);
}

float highest_near(const PictureModel& picture, const Snapshot& seen, Vec3 p) {
  float y = p.y - kNear;
  for (size_t i = 0; i < picture.particle_rest.size() && i < seen.particle.size(); ++i) {
    const Vec3 d = seen.particle[i] - p;
    if (d.x * d.x + d.z * d.z < kNear * kNear) y = std::max(y, seen.particle[i].y);
  }
  return y;
}

size_t whole_pairs(const Snapshot& seen) {
  return seen.thread_tension.size() -
         static_cast<size_t>(std::count(seen.thread_cut.begin(), seen.thread_cut.end(), uint8_t{1}));
}

Vec3 swage(const PictureModel& picture, const Snapshot& seen) {
  return transform(seen.needle.pose, {picture.needle_radius, 0, 0});
}

// The tool that holds the needle by `grip`, when the needle's swage is at a place: its tip up and out of the way, the shaft on
// `side`.
Pose carrying(const PictureModel& picture, const Pose& grip, Vec3 swage_at, float side) {
  const float u = rotate(grip.q, {0, 0, 1}).z * side >= 0 ? 1.0f : -1.0f;
  const Vec3 up{u, 0, 0}, along{0, 0, -u}, x = Vec3{0, std::cos(-2.2f), 0} - along * std::sin(-2.2f);
  const Quat q = from_axes(x, cross(up, x), up);
  return Pose{swage_at - rotate(q, {picture.needle_radius, 0, 0}), q} * grip;
}

// How much strand is left between two hands is felt: a little is given while it is taut and taken while it is slack.
float feel(float strand, float tension, float dt) {
  return strand + dt * (tension < 0.02f ? 0.012f : tension > 0.1f ? -std::min(0.06f, 0.1f * tension) : 0.0f);
}

// The tool that the strand is laid round, and what is reckoned along and across it: e1 away from the tissue, e2 to its side.
struct Lying {
  Vec3 z, e1, e2;
  explicit Lying(float side)
      : z(normalized(Vec3{side, 0.3f, 0.15f})), e1(normalized(Vec3{0, 1, 0} - z * z.y)), e2(cross(z, e1)) {}
};

void begin_winding(BothHands& b, const PictureModel& picture, const Snapshot& seen) {
  // The strand rises from the last suture point, or from the knot that is already on it.
  const bool from_point = !seen.suture_point.empty() && seen.knot.empty();
  b.start = from_point ? seen.suture_point.back().position : stitch(picture, seen);
  const float spent = seen.suture_point.empty() ? 0 : distance(seen.suture_point.back().position, b.start);
  b.reach = std::max(0.03f, length_between(seen, last_point_node(seen), seen.thread_order.size() - 1) - spent);
  // So high that the needle, going round below on a taut strand, keeps clear of the tissue, as far as a short strand allows.
  const float crest = highest_near(picture, seen, b.start);
  b.ground = crest + kNeedleBelow;
  b.height = std::clamp(0.5f * (b.reach + crest - b.start.y + kNeedleBelow), 0.025f, std::max(0.025f, b.reach - kLeastFree));
  b.stage = lift;
  b.held_for = 0;
  b.wound = kBefore;
  b.lean = kLean;
  b.wish = 0;
  b.free = -1;
}

void go(BothHands& b, int stage) { b.stage = stage, b.held_for = 0; }

void wind_on(BothHands& b, size_t winder, std::array<Pose, 2>& hand, const Pose& grip, const PictureModel& picture,
             const Snapshot& seen, float dt) {
  const size_t lying = 1 - winder;
  const float side = side_of(hand[lying]);
  const Lying l(side);
  // The strand comes up on the hand's side of the turn and leaves on the tip's: the two never meet.
  const Vec3 axis_at = b.start + l.e1 * b.height - l.e2 * (b.way * kWindRadius) - l.z * kApart;
  const Pose rest{axis_at - l.z * kWindAt, from_tool_axis(l.z)};
  if (b.free < 0) b.free = (seen.knot.empty() ? kTautInTissue : kTaut) * (b.reach - distance(b.start, axis_at));
  // The swage when the strand leaves the tool after turning by w about it. A strand that is short for the height goes slack
  // below, where there is no room for it, and is drawn taut again behind.
  float room = 1;
  const auto swage_at = [&](float w) {
    const float turned = b.way * w;
    const Vec3 leave = axis_at + kWindRadius * (l.e2 * (b.way * std::cos(w)) + l.e1 * std::sin(w));
    const Vec3 to = l.e1 * std::cos(turned) - l.e2 * std::sin(turned);
    room = to.y < 0 ? std::max(0.012f, (leave.y - b.ground) / -to.y) : 1;
    return leave + to * std::min(b.free, room) -
           l.z * (room < b.free ? -kLeadBack : std::clamp(b.lean * b.free, -kApart, kApart));
  };
  const float tension = needle_tension(seen);
  const float behind = distance(swage(picture, seen), swage_at(b.wound));
  // Before the first throw nothing but friction holds the thread in its holes: no more is asked for than there is.
  const float there_is = b.reach - distance(b.start, axis_at) - kWound * std::max(0.0f, b.wound) + 0.002f;
  const float most = seen.knot.empty() ? std::max(0.006f, there_is) : b.reach;
  if (b.stage >= beside && ((behind < 0.005f && room > b.free) || tension > kTooTaut))
    b.free = std::clamp(feel(b.free, tension, dt), 0.006f, most);
  const auto carry = [&](float speed) {
    return glide(hand[winder], carrying(picture, grip, swage_at(b.wound), -side), speed, kTurn, dt);
  };
  b.held_for += dt;
  switch (b.stage) {
    case lift:
      glide(hand[lying], {rest.p - l.e2 * (b.way * 0.03f) + Vec3{0, 0.01f, 0}, rest.q}, kSpeed, kTurn, dt);
      if (carry(kLift) || b.held_for > 8) go(b, lay);
      return;
    case lay:
      carry(kLift);
      if (glide(hand[lying], {rest.p - l.e2 * (b.way * 0.012f), rest.q}, kSpeed, kTurn, dt)) go(b, beside);
      return;
    case beside:
      carry(kCareful);
      if ((glide(hand[lying], rest, kCareful, kTurn, dt) && tension > 0.02f) || b.held_for > 4) go(b, wind);
      return;
    default: {
      glide(hand[lying], rest, kCareful, kTurn, dt);
      // The needle is not hurried on while it lags behind.
      const float keep_up = std::clamp(1.5f - behind / 0.006f, 0.0f, 1.0f);
      // Not farther than the next loop: a spiral that goes on is none.
      const float next = static_cast<float>(seen.tool[lying].loop_wraps + 1) * 2 * kPi;
      const float most_turn = std::max(next + kOver, b.wound), before = b.wound;
      const float turn = std::clamp(b.wish, -2 * kWindRate * dt, kWindRate * dt * keep_up);
      b.wound = std::clamp(b.wound + turn, kBefore, most_turn);
      const float turned = b.wound - before;
      b.wish = std::clamp(b.wish - turn, -1.5f * kPi, 1.5f * kPi);
      b.free = std::max(0.006f, b.free - kWound * turned);
      // Wound and no loop yet: its ends lie too far apart along the tool, and are led together.
      if (b.wound > next + kOver - 0.1f) b.lean = std::max(-2 * kLean, b.lean - kLean * dt);
      carry(1.2f * kSpeed);
      return;
    }
  }
}

void draw_on(const BothHands& b, float amount, size_t needle, std::array<Pose, 2>& hand, const PictureModel& picture,
             const Snapshot& seen, float dt) {
  const size_t tail = 1 - needle;
  const Vec3 knot = stitch(picture, seen);
  Vec3 way[2];
  if (b.way != 0) {  // a throw: the hands go low and even, each to the side that makes it lie flat
    const float x = b.way * side_of(hand[tail]);
    way[tail] = normalized(Vec3{x, 0.35f, 0.1f});
    way[needle] = normalized(Vec3{-x, 0.35f, 0.1f});
  } else {  // nothing is tied: along the stitch, each end from its own hole
    Vec3 across{1, 0, 0};
    if (!seen.suture_point.empty())
      across = normalized(seen.suture_point.back().position - seen.suture_point.front().position, across);
    way[needle] = normalized(across * 0.8f + Vec3{0, 0.6f, 0});
    way[tail] = normalized(across * -0.8f + Vec3{0, 0.6f, 0});
  }
  const float most = 0.6f * kSpeed * dt, far = std::clamp(amount * kDrawPerRad, -most, most);
  for (const size_t k : {needle, tail}) {
    // The harder it pulls back, the slower the hand.
    const float gently = amount > 0 ? std::clamp(1.5f - length(seen.tool[k].force), 0.03f, 1.0f) : 1.0f;
    hand[k].p = on_leash(picture, seen, k, hand[k].p + way[k] * (far * gently));
  }
  // Before a knot the tail's hand only gives a counter-hold: where both sides are drawn hard the tissue follows instead.
  const size_t held = node_of(seen, seen.tool[tail].held_slot);
  const float pull = held < seen.thread_tension.size() ? seen.thread_tension[held] : 0;
  if (b.way == 0 && pull > kCounterHold) hand[tail].p += normalized(knot - hand[tail].p) * (0.3f * kSpeed * dt);
}

}  // namespace

Vec3 on_leash(const PictureModel& picture, const Snapshot& seen, size_t who, Vec3 p) {
  const ToolView& tool = seen.tool[who];
  if (seen.suture_point.empty() || seen.thread_tension.empty()) return p;
  const size_t first = first_point_node(seen), last = last_point_node(seen);
  size_t held = seen.thread_order.size() - 1;
  Vec3 end = tool.pose.p;  // what the hand holds the thread by
  if (tool.held == Held::needle && !seen.needle.in_tissue && seen.needle_on_thread) end = swage(picture, seen);
  else if (tool.held == Held::thread) held = node_of(seen, tool.held_slot);
  else return p;
  if (held >= first && held <= last) return p;
  size_t from = held < first ? first : last;
  Vec3 anchor = node_at(seen, from);
  if (!seen.knot.empty()) {  // a knot holds it: there is what leaves the knot, and nothing slides
    const Vec3 knot = seen.knot.back().position;
    const size_t begin = held < first ? held : last, end_node = held < first ? first : held;
    for (size_t i = begin; i <= end_node; ++i)
      if (length2(node_at(seen, i) - knot) < length2(node_at(seen, from) - knot)) from = i;
    anchor = knot;
  }
  const float pair = seen.thread_rest / static_cast<float>(std::max<size_t>(1, whole_pairs(seen)));
  const Vec3 off = end + (p - tool.pose.p) - anchor;
  const float most = static_cast<float>(std::max(from, held) - std::min(from, held)) * pair +
                     (seen.knot.empty() ? kGiveInTissue : kGiveAtKnot);
  const float far = length(off);
  return far > most ? p - off * ((far - most) / far) : p;
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
  const bool holds = seen.tool[needle].held == Held::needle && !seen.needle.in_tissue && !seen.suture_point.empty();
  b.follows = false;
  if (!holds || (seen.tool[other].held != Held::nothing && seen.tool[other].held != Held::thread))
    return b.doing = BothDo::nothing;
  if (seen.tool[other].held == Held::thread) {
    b.doing = BothDo::draw;
    draw_on(b, amount, needle, hand, picture, seen, dt);
    return b.doing;
  }
  // Taken up again where it was left, unless the tool has gone elsewhere meanwhile.
  const bool goes_on = b.doing == BothDo::wind && distance(hand[other].p, b.lain) < kGoesOn;
  if (!goes_on) {
    b.doing = BothDo::wind;
    b.way = 0;
    begin_winding(b, picture, seen);
    b.lain = hand[other].p;
  }
  // The first motion chooses the way round; until then the hands stand ready for either.
  if (b.way == 0) {
    if (amount == 0) return b.doing;
    b.way = amount > 0 ? 1.0f : -1.0f;
  }
  b.wish += amount * b.way;
  wind_on(b, needle, hand, grip, picture, seen, dt);
  b.lain = hand[other].p;
  return b.doing;
}

void go_along(BothHands& b, size_t who, std::array<Pose, 2>& hand, const Pose& grip, const PictureModel& picture,
              const Snapshot& seen, float dt) {
  const size_t needle = 1 - who;
  const float strand = length_between(seen, node_of(seen, seen.tool[who].loop_last), seen.thread_order.size() - 1);
  if (!b.follows) b.free = kLoose * strand;
  b.follows = true;
  const Pose& tool = seen.tool[who].pose;
  const float tension = needle_tension(seen), side = side_of(tool);
  if (tension > kTooTaut) b.free = std::max(kLeastLoose * strand, feel(b.free, tension, dt));
  const Lying l(side);
  const Vec3 turns = tool.p + rotate(tool.q, {0, 0, kWindAt});
  Vec3 above = turns + normalized(l.e1 - 0.4f * l.z) * b.free;
  above.y = std::max(above.y, std::min(b.ground, turns.y + b.free));
  glide(hand[needle], carrying(picture, grip, above, -side), 2 * kSpeed, kTurn, dt);
}

bool tail_grip(const PictureModel& picture, const Snapshot& seen, size_t who, TailGrip& out) {
  if (seen.suture_point.empty() || seen.thread_order.size() < 3) return false;
  const Vec3 knot = stitch(picture, seen);
  const size_t point = first_point_node(seen), root = node_along(seen, point, distance(node_at(seen, point), knot), -1);
  const float tail = length_between(seen, 0, root), side = side_of(seen.tool[who].pose);
  if (root == 0 || tail < 0.004f) return false;
  // What lies between tissue and turns is all there is: the jaws come no further.
  const bool loop = seen.tool[who].loop_wraps > 0;
  const float leash = loop ? 0.9f * (length_between(seen, last_point_node(seen), node_of(seen, seen.tool[who].loop_first)) -
                                     distance(node_at(seen, last_point_node(seen)), knot))
                           : 1.0f;
  const Vec3 ways[] = {{side, 0.3f, 0.15f}, {0.8f * side, 0.5f, 0.6f}, {0.5f * side, 0.4f, 1}, {0.7f * side, 1, 0.1f}};
  float best = -1e9f;
  for (size_t i = node_along(seen, root, std::min(loop ? 0.010f : 0.016f, 0.5f * tail), -1); i-- > 1;) {
    if (length_between(seen, 0, i) < 0.2f * tail || (i < seen.thread_cut.size() && seen.thread_cut[i])) break;
    const Vec3 tip = node_at(seen, i);
    for (const Vec3& direction : ways) {
      const Vec3 z = normalized(direction);
      // The needle's strand as it will run when the jaws are there: from the knot to the turns behind them.
      const Vec3 run = tip + z * kWindAt - knot;
      const float s = std::clamp(dot(tip - knot, run) / std::max(length2(run), 1e-12f), 0.0f, 1.0f);
      float good = loop ? std::min(distance(tip, knot + run * s), kClear) / kClear : 1;
      if (length(run) > leash) good -= 1 + 100 * (length(run) - leash);
      for (size_t k = 0; k < picture.particle_rest.size(); ++k) {  // tissue in the way of the shaft
        const Vec3 d = seen.particle[k] - tip;
        const float along = dot(d, z);
        if (along > 0.003f && along < 0.06f && length2(d - z * along) < kShaft * kShaft) good -= 0.1f;
      }
      // Near the knot little else lies about; nobody reaches down between two bowel ends.
      good -= 12 * distance(tip, knot) + 30 * std::max(0.0f, knot.y - 0.006f - tip.y);
      if (good > best) best = good, out = {seen.thread_order[i], {tip, from_tool_axis(z)}};
    }
  }
  return best > -1e8f;
}

}  // namespace catgut
