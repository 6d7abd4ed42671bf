// SPDX-License-Identifier: Apache-2.0
// validation: see tool_ties.h.
#include "validation/tool_ties.h"

#include <algorithm>
#include <cmath>

#include "thread/observe.h"
#include "thread/topology.h"
#include "validation/knot_scenes.h"

namespace catgut::validation {
namespace {

using thread::Hold;
using thread::Settings;
using thread::Surroundings;
using thread::ToolCapsule;

// x along the pull, y up from the tissue, z toward the viewer; the bite is at the origin. The needle holder comes from the side
// of the long strand, the forceps from the side of the tail: they face each other, so that the forceps never sweeps through the
// strand between wound and holder. The tissue is a rod along z that the thread lies around, as on a bench for knots. The sides
// alternate from throw to throw.
constexpr float kTick = 1e-3f;       // [s]
constexpr float kStrandAt = 20e-3f;  // [m] of the shaft, from the tip: above the wound
constexpr float kWindAt = 10e-3f;    // [m] of the shaft: plane of the winding hand, nearer the tip than the strand
constexpr float kGrip = 1.5e-3f;     // [m] and lies this far behind the tips of the needle holder
constexpr float kOpen = 0.10f;       // [rad] each jaw, to take the tail
constexpr float kClosed = -0.015f;   // [rad] on a thread, which lies between the two rods of each jaw
constexpr float kNearest = 11e-3f;   // [m] of the winding hand from the shaft
constexpr float kWinding = 0.10f;    // [N] tension of the strand while it is wound: felt, and held by the hand
constexpr float kDrawing = 0.04f;    // [N] while the turns slide off the jaws
constexpr float kTissue = 2e-3f;     // [m] radius of what the thread lies around, and its depth
constexpr float kLying = 0.02f;      // [N] that keeps the free tail where it was laid (wet tissue)

Vec3 shaft_from(float side) { return {side * 0.9063f, 0.4226f, 0}; }
// Unit, across the shaft; 0: toward the viewer, pi/2: above.
Vec3 around(float side, float angle) {
  const Vec3 shaft = shaft_from(side), up{-shaft.y * side, shaft.x * side, 0};
  return Vec3{0, 0, 1} * std::cos(angle) + up * std::sin(angle);
}
// Length of strand between wound and hand that a throw needs: to the tail, round the jaws, to the hand.
float strand_for(int wraps) { return 42e-3f + 15e-3f * static_cast<float>(wraps); }
// The shaft's height above the wound while the strand is wound: the hand must pass between it and the tail.
float height_for(int wraps) { return 0.5f * strand_for(wraps) + 9e-3f; }
// Tip of the needle holder meanwhile: beyond the wound.
Vec3 work_place(float side, int wraps) { return around(side, 0.5f * kPi) * height_for(wraps) - shaft_from(side) * kStrandAt; }

// A needle holder as src/render draws it (instruments.cpp): each jaw is two rods that diverge toward the box joint, so that
// their outline is the drawn one (3.2 x 1.8 mm at the tip, 8.8 x 5 mm at the joint); then the joint and two shanks. The jaws
// open in the plane across the pull (z).
constexpr size_t kHolderParts = 9;
void place_holder(Vec3 tip, Vec3 shaft, float opening, std::span<ToolCapsule> part) {
  constexpr float mm = 1e-3f;
  const Vec3 across{0, 0, 1}, up = cross(shaft, across);
  auto at = [&](float x, float y, float z, float angle) {  // the origin of the drawn tool lies 2.5 mm behind the tip
    const float arm = z - 26, c = std::cos(angle), s = std::sin(angle);
    const float turned_x = c * x - s * arm, turned_z = 26 + s * x + c * arm;
    return tip + across * (mm * turned_x) + up * (mm * y) + shaft * (mm * (turned_z + 2.5f));
  };
  size_t k = 0;
  auto add = [&](Vec3 a, Vec3 b, float radius) { part[k].to_a = a, part[k].to_b = b, part[k++].radius = radius * mm; };
  for (const float x : {1.0f, -1.0f})
    for (const float y : {1.0f, -1.0f})
      add(at(1.05f * x, 0.4f * y, -1.9f, x * opening), at(3.7f * x, 1.9f * y, 21, x * opening), 0.55f);
  add(at(0, 0, 7, 0), at(0, 0, 22, 0), 1);
  for (const float x : {1.4f, -1.4f}) add(at(x, 0, 22, 0), at(x, 0, 34, 0), 3);
  for (const float x : {1.0f, -1.0f}) add(at(1.9f * x, 0, 30, 0), at(5.2f * x, 0, 100, 0), 2.1f);
}

class Tying {
 public:
  Tying(const Settings& settings, const Tie& tie, const TieSettings& how, const TieWatcher& watcher)
      : settings_(settings), how_(how), watcher_(watcher), random_(how.seed) {
    // Tail from its end to the bite, the bite, the long strand.
    const float l = how.segment;
    const float bend = kTissue + 0.5f * settings.material.diameter + 0.05e-3f;
    const Vec3 left{-bend, -kTissue, 0}, right{bend, -kTissue, 0};
    tail_ = how.tail;
    const Vec3 tail_direction = normalized(laid_tail(1) - left), long_direction = normalized(Vec3{0.35f, 0.3f, 1});
    std::vector<Vec3> fine;
    auto line = [&](Vec3 from, Vec3 to) {
      for (int i = 0; i < 1000; ++i) fine.push_back(lerp(from, to, static_cast<float>(i) / 1000));
    };
    line(left + tail_direction * how.tail, left);
    for (int i = 0; i < 200; ++i)
      fine.push_back({-bend * std::cos(kPi * i / 200), -kTissue - bend * std::sin(kPi * i / 200), 0});
    int wraps = 1;
    for (const TiedThrow& t : tie) wraps = std::max(wraps, t.wraps);
    line(right, right + long_direction * (strand_for(wraps) + 25e-3f + 6e-3f * static_cast<float>(tie.size())));
    const std::vector<Vec3> path = resample(fine, l);
    knot_.state = thread::make_state(path);
    knot_.bite_a = static_cast<uint32_t>(std::lround(how.tail / l));
    knot_.bite_b = knot_.bite_a + static_cast<uint32_t>(std::lround(bend * kPi / l));
    stepper_ = std::make_unique<thread::Stepper>(path.size());
    const uint32_t middle = (knot_.bite_a + knot_.bite_b) / 2;
    const uint32_t nodes[] = {middle, middle + 1, 3, knot_.bite_b + static_cast<uint32_t>(std::lround(strand_for(wraps) / l)),
                              static_cast<uint32_t>(path.size()) - 1};
    for (size_t k = 0; k < 5; ++k) {
      hold_[k].node = std::min(nodes[k], static_cast<uint32_t>(path.size()) - 1);
      hold_[k].from = hold_[k].to = knot_.state.position(hold_[k].node);
      hold_[k].stiffness = 2000;
      hold_[k].limit = k < 2 ? 0.0f : 2 * how.pull;
    }
    hold_[4].stiffness = 20;
    lay_down();
    strand_ = how.segment * static_cast<float>(hold_[3].node - knot_.bite_b);
    shaft_ = shaft_from(1);
    tip_ = work_place(1, 1) + shaft_ * 60e-3f;
    hand_ = hold_[3].to;
    forceps_angle_ = kPi - 0.15f;
    tool_[kHolderParts].radius = 1.0e-3f;
    ToolCapsule& tissue = tool_[kHolderParts + 1];
    tissue.to_a = {0, -kTissue, -0.1f}, tissue.to_b = {0, -kTissue, 0.1f};
    tissue.radius = kTissue, tissue.friction = 0.3f;
    place_tools();
    for (ToolCapsule& t : tool_) t.a = t.to_a, t.b = t.to_b;
  }

  // side: +1 the long strand is on the right. sense: +1 over the top from the viewer's side.
  void make_throw(float side, float sense, int wraps) {
    ++throws_;
    for (int i = 0; i < 3 && !throw_once(side, sense, wraps); ++i) ++knot_.rewound;
  }

  TiedKnot finish() {
    std::vector<Vec3> curve;
    for (size_t i = 0; i < knot_.state.nodes(); ++i) curve.push_back(knot_.state.position(i));
    const float tail_side = curve.front().x < 0 ? -1 : 1;
    const std::vector<Vec3> closed = thread::close_curve(curve, {tail_side, 0, 0.1f}, {-tail_side, 0, -0.1f});
    knot_.determinant = thread::knot_determinant(closed);
    knot_.writhe = thread::mean_writhe(closed);
    knot_.seconds = 1e-3 * static_cast<double>(ticks_);
    knot_.tension = tension_;
    return std::move(knot_);
  }

 private:
  // False: no throw came of it, as is seen before it is pulled. The tail lies where it was then.
  bool throw_once(float side, float sense, int wraps) {
    take_strand(strand_for(wraps));
    side_ = side;
    const Vec3 shaft = shaft_from(side), work = work_place(side, wraps) + tremor();
    const float start = sense > 0 ? 0 : kPi, turn = 2 * kPi * static_cast<float>(wraps) * sense;
    // The needle holder comes from the other hand; at this moment it is far from the thread.
    shaft_ = shaft;
    tip_ = work + shaft * 60e-3f;
    place_tools();
    for (size_t k = 0; k < kHolderParts; ++k) tool_[k].a = tool_[k].to_a, tool_[k].b = tool_[k].to_b;
    // The strand is held out in front of the shaft (behind it, for the other sense), nearly taut.
    wind_at_ = kWindAt + tremor().x;
    const float drop = kStrandAt - wind_at_, taut = 0.98f * strand_for(wraps), height = height_for(wraps);
    radius_ = std::sqrt(taut * taut - height * height - drop * drop);
    angle_ = start;
    const float forceps = side > 0 ? kPi - 0.15f : 0.15f;
    const Vec3 out = work + shaft * wind_at_ + around(side, start) * radius_;
    move("to work", tip_, out, 0, 0.5f * (forceps_angle_ + forceps));
    move("to work", work, hand_, 0, forceps);
    const float before = turns();
    wind("wind", start + turn);
    wind_again(before, wraps, sense);
    fetch();
    draw(work, sense);
    // Low and level, each end to its own side, before either is pulled.
    move("cross", {side * 0.6f * tail_, 8e-3f, 0}, Vec3{-side * 24e-3f, 12e-3f, 0} + tremor());
    move("cross", {side * 0.75f * tail_, 2e-3f, 0}, {-side * 36e-3f, 2e-3f, 0});
    if (thread::observe(settings_, knot_.state).throws < throws_) {
      move("lay", laid_tail(side) - shaft_ * kGrip, hand_ + Vec3{0, 10e-3f, 0});
      leave_tail();
      return false;
    }
    pull(side);
    strand_ = distance(knot_.state.position(hold_[3].node), knot_.state.position(knot_.bite_b));  // taut
    tail_ = distance(knot_.state.position(0), knot_.state.position(knot_.bite_a));
    tension_ = 0.5f * (length(hold_[2].force) + length(hold_[3].force));
    move("lay", laid_tail(-side) - shaft_ * kGrip, hand_ + Vec3{side * 4e-3f, 2e-3f, 0});
    leave_tail();
    return true;
  }
  void leave_tail() {
    lay_down();
    open("let go", kOpen);
    move("let go", tip_ + shaft_ * 60e-3f, hand_);
    opening_ = 0;
  }

  Vec3 tremor() {
    if (how_.seed == 0) return {};
    return Vec3{random_.uniform() - 0.5f, random_.uniform() - 0.5f, random_.uniform() - 0.5f} * 2e-3f;
  }
  // Where the tail's end lies: low, nearly straight, on the side away from the long strand.
  Vec3 laid_tail(float side) const { return {side * -0.9f * tail_, 4e-3f, 0}; }
  // The hand takes the long strand where enough is left for the windings, and no more.
  void take_strand(float want) {
    const int shift = static_cast<int>(std::lround((want - strand_) / how_.segment)),
              last = static_cast<int>(knot_.state.nodes()) - 1;
    hold_[3].node = static_cast<uint32_t>(std::min(last, static_cast<int>(hold_[3].node) + shift));
    hand_ = hold_[3].from = hold_[3].to = knot_.state.position(hold_[3].node);
  }
  void lay_down() {
    gripped_ = false;
    hold_[2].limit = kLying, hold_[2].stiffness = 50;
    tail_at_ = knot_.state.position(hold_[2].node);
  }

  Vec3 forceps() const { return {std::cos(forceps_angle_), std::sin(forceps_angle_), 0}; }
  void place_tools() {
    place_holder(tip_, shaft_, opening_, tool_);
    tool_[kHolderParts].to_a = hand_ + forceps() * kForcepsReach, tool_[kHolderParts].to_b = hand_ + forceps() * 80e-3f;
  }

  void tick(const std::string& phase) {
    for (ToolCapsule& t : tool_) t.a = t.to_a, t.b = t.to_b;
    // Turning and yielding together must not make the hand faster than it is.
    const float way = distance(hold_[3].to, hand_);
    if (way > how_.speed * kTick) hand_ = lerp(hold_[3].to, hand_, how_.speed * kTick / way);
    place_tools();
    hold_[2].from = hold_[2].to, hold_[3].from = hold_[3].to;
    hold_[2].to = gripped_ ? tip_ + shaft_ * kGrip : tail_at_;
    hold_[3].to = hand_;
    // The rest of the strand lies in the palm.
    hold_[4].from = hold_[4].to;
    hold_[4].to = hand_ + forceps() * (how_.segment * static_cast<float>(hold_[4].node - hold_[3].node));
    Surroundings around;
    around.holds = hold_, around.tools = tool_;
    stepper_->step(settings_, knot_.state, around);
    ++ticks_;
    felt_ += 0.2f * (strand_pull() - felt_);
    tail_felt_ += 0.2f * ((gripped_ ? length(hold_[2].force) : 0.0f) - tail_felt_);
    for (const Hold* h : {&hold_[3], gripped_ ? &hold_[2] : &hold_[3]})
      knot_.fastest = std::max(knot_.fastest, distance(h->from, h->to) / kTick);
    for (size_t k = 0; k < knot_.state.key.size(); ++k)
      if (knot_.state.crossing[k].normal_impulse > 0 && thread::partner_of(knot_.state.key[k]) < thread::kTool)
        knot_.nearest = std::min(knot_.nearest, 1 + knot_.state.crossing[k].gap / settings_.material.diameter);
    if (watcher_) watcher_(knot_.state, tool_, 1e-3 * static_cast<double>(ticks_), phase);
  }

  // Of the strand from the wound, on the hand. Fingers that push the strand back after it has slipped feel no pull.
  float strand_pull() const {
    const Vec3 along = knot_.state.position(hold_[3].node) - knot_.state.position(hold_[3].node - 4);
    return std::max(0.0f, dot(hold_[3].force, normalized(along)));
  }

  // Both hands to their places in the time that the farther one needs.
  void move(const std::string& phase, Vec3 tip, Vec3 hand, float speed = 0, float forceps = -1) {
    const Vec3 tip_from = tip_, hand_from = hand_;
    const float forceps_from = forceps_angle_;
    if (speed == 0) speed = how_.speed;
    const float far =
        std::max({distance(tip_, tip), distance(hand_, hand), forceps >= 0 ? 20e-3f * std::abs(forceps - forceps_from) : 0.0f});
    const int ticks = std::max(1, static_cast<int>(std::ceil(1000 * 1.5f * far / speed)));
    for (int i = 1; i <= ticks; ++i) {
      const float s = static_cast<float>(i) / static_cast<float>(ticks), e = s * s * (3 - 2 * s);
      tip_ = lerp(tip_from, tip, e), hand_ = lerp(hand_from, hand, e);
      if (forceps >= 0) forceps_angle_ = forceps_from + e * (forceps - forceps_from);
      tick(phase);
    }
  }

  void open(const std::string& phase, float opening) {
    const float from = opening_;
    for (int i = 1; i <= 120; ++i) {
      opening_ = from + (opening - from) * static_cast<float>(i) / 120;
      tick(phase);
    }
  }

  // The winding hand keeps the strand at the wanted tension by its distance from the shaft.
  void feel(float tension) {
    radius_ += kTick * std::clamp(0.5f * (tension - felt_), -how_.speed, how_.speed);
    radius_ = std::max(radius_, kNearest);
    // Too short a strand slips through the fingers.
    if (felt_ > 4 * kWinding && hold_[3].node + 1 < knot_.state.nodes()) {
      ++hold_[3].node;
      felt_ = kWinding;
    }
  }
  // Under the shaft the hand passes on the tip's side of the strand that comes up from the wound.
  void place_hand() {
    const float at = wind_at_ - 3e-3f * std::max(0.0f, -std::sin(angle_));
    hand_ = tip_ + shaft_ * at + around(side_, angle_) * radius_;
  }

  void wind(const std::string& phase, float to) {
    const float from = angle_, direction = to > from ? 1.0f : -1.0f;
    float speed = 0;
    for (int guard = 0; std::abs(to - angle_) > 1e-3f && guard < 60000; ++guard) {
      feel(kWinding);
      // Slower near the end, and while the strand is slack or tight.
      const float left = std::abs(to - angle_) * radius_, off = std::abs(felt_ - kWinding) / kWinding;
      const float want = std::min(how_.speed, 0.02f + 10 * left) * std::clamp(1.6f - 0.6f * off, 0.25f, 1.0f);
      speed += std::clamp(want - speed, -10 * kTick, 5 * kTick);
      angle_ += direction * std::min(speed * kTick, left) / radius_;
      place_hand();
      tick(phase);
    }
  }

  // Turns of the strand about the shaft, from the wound to the hand; counted as the hand winds: over the top is positive.
  float turns() const {
    const Vec3 x = around(side_, 0), y = around(side_, 0.5f * kPi);
    float sum = 0, last = 0;
    for (uint32_t i = knot_.bite_b; i <= hold_[3].node; ++i) {
      const Vec3 p = knot_.state.position(i) - tip_;
      const float angle = std::atan2(dot(p, y), dot(p, x));
      if (i > knot_.bite_b) sum += std::remainder(angle - last, 2 * kPi);
      last = angle;
    }
    return sum / (2 * kPi);
  }

  // The hand sees what lies round the jaws: a slack turn may have slid off the tip while it was wound.
  void wind_again(float before, int wraps, float sense) {
    for (int i = 0; i < 2 && sense * (turns() - before) < static_cast<float>(wraps) - 0.5f; ++i, ++knot_.rewound)
      wind("wind again", angle_ + 2 * kPi * sense);
  }

  // The jaws open, go forward to the tail and close on it; the winding hand goes with them and keeps the turns on the jaws.
  void fetch() {
    open("open", kOpen);
    const Vec3 off = tremor() * 0.3f;
    float speed = 0;
    for (int guard = 0; guard < 20000; ++guard) {
      const Vec3 goal = knot_.state.position(hold_[2].node) - shaft_ * kGrip + off, way = goal - tip_;
      const float left = length(way);
      if (left < 0.4e-3f) break;
      // No faster than the hand takes in the strand, which the way to the wound slackens: a slack turn slides off the jaws.
      const float want = std::min(how_.speed, 0.01f + 12 * left) * std::clamp(2 * felt_ / kWinding, 0.15f, 1.0f);
      speed += std::clamp(want - speed, -20 * kTick, 5 * kTick);
      tip_ += way * (std::min(speed * kTick, left) / left);
      feel(kWinding);
      place_hand();
      tick("fetch");
    }
    // They keep to the tail while they close: it swings. The strand stays taut: a slack turn slides off past the tail's end.
    for (int i = 1; i <= 120; ++i) {
      opening_ = kOpen + (kClosed - kOpen) * static_cast<float>(i) / 120;
      const Vec3 way = knot_.state.position(hold_[2].node) - shaft_ * kGrip - tip_;
      tip_ += way * std::min(0.02f, 0.5f * how_.speed * kTick / std::max(1e-6f, length(way)));
      feel(kWinding);
      place_hand();
      tick("close");
    }
    gripped_ = distance(knot_.state.position(hold_[2].node), tip_ + shaft_ * kGrip) < 2e-3f;
    knot_.missed += !gripped_;
    hold_[2].limit = 2 * how_.pull, hold_[2].stiffness = 2000;
    hold_[2].to = tip_ + shaft_ * kGrip;
  }

  // Both hands go apart, neither pulling harder than the other, until each feels the wanted tension, and keep it for a moment.
  // A strand that is tight while the other is slack becomes a post, and the throw two half hitches round it.
  void pull(float side) {
    for (int i = 0, steady = 0; i < 6000 && steady < 150; ++i) {
      const auto pace = [&](float felt, float other) {
        const float want = std::min(how_.pull, other + 0.1f);
        return kTick * std::clamp(0.2f * (want - felt), -0.05f, std::min(0.1f, how_.speed));
      };
      tip_.x += side * pace(tail_felt_, felt_), hand_.x -= side * pace(felt_, tail_felt_);
      tick("pull");
      steady = std::min(tail_felt_, felt_) > 0.9f * how_.pull ? steady + 1 : 0;
    }
  }

  // The needle holder goes back with the tail. The other hand keeps the strand and continues over the top, past the tip: the
  // turns slide off the jaws and along the tail. A short tail stops the needle holder, but not the hand: turns that stay on the
  // jaws would be lost where the hands cross.
  void draw(Vec3 work, float sense) {
    const Vec3 from = tip_, to = work + shaft_ * 34e-3f + tremor();
    const Vec3 middle = tip_ + shaft_ * wind_at_, past = middle - shaft_ * 14e-3f + Vec3{0, 8e-3f, 0};
    const float angle_from = angle_, turn = sense * 0.5f * kPi;
    const float far = distance(from, to);
    float done = 0, speed = 0, passed = 0, passing = 0;
    for (int guard = 0; std::min(done, passed) < far && guard < 20000; ++guard) {
      // No farther than the tail lets it: a tight tail would open the throws below.
      if (tail_felt_ > 2 * kWinding && done > 0.5f * far && passed >= far) break;
      const auto pace = [&](float way) { return std::min(how_.speed, 0.02f + 10 * std::max(0.0f, far - way)); };
      speed += std::clamp(pace(done) * std::clamp(1.5f - tail_felt_ / kDrawing, 0.1f, 1.0f) - speed, -20 * kTick, 5 * kTick);
      passing += std::clamp(pace(passed) - passing, -20 * kTick, 5 * kTick);
      done += speed * kTick, passed += passing * kTick;
      const float e = std::min(1.0f, passed / far);
      tip_ = lerp(from, to, std::min(1.0f, done / far));
      angle_ = angle_from + turn * e;
      feel(kDrawing);
      hand_ = lerp(middle, past, e) + around(side_, angle_) * radius_;
      tick("draw through");
    }
  }

  const Settings& settings_;
  const TieSettings how_;
  const TieWatcher& watcher_;
  Random random_;
  TiedKnot knot_;
  std::unique_ptr<thread::Stepper> stepper_;
  Hold hold_[5];                        // two nodes of the bite, tail, long strand, its end
  ToolCapsule tool_[kHolderParts + 2];  // needle holder, forceps, tissue
  Vec3 tip_, shaft_, hand_, tail_at_;   // of the needle holder; where the forceps holds the strand; where the tail was laid
  float opening_ = 0;                   // [rad] of each jaw
  float forceps_angle_ = 0;             // [rad] in the plane of pull and height
  float side_ = 1, angle_ = 0, radius_ = 0, wind_at_ = kWindAt;  // of the winding hand about the shaft
  float felt_ = 0, tail_felt_ = 0;                               // [N] tension of strand and tail, smoothed over 5 ms
  float tension_ = 0, strand_ = 0, tail_ = 0;                    // the free lengths of both strands [m]
  bool gripped_ = false;
  uint32_t throws_ = 0;  // made and begun
  long ticks_ = 0;
};

}  // namespace

TiedKnot tie_with_tools(const Settings& settings, const Tie& tie, const TieSettings& how, const TieWatcher& each_tick) {
  Tying tying(settings, tie, how, each_tick);
  float side = 1, sense = 1;
  for (size_t k = 0; k < tie.size(); ++k) {
    // Winding in the same sense from the other side mirrors the throw: that is the square knot.
    if (k > 0 && !tie[k].alternating) sense = -sense;
    tying.make_throw(side, sense, tie[k].wraps);
    side = -side;
  }
  return tying.finish();
}

}  // namespace catgut::validation
