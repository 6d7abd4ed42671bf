// SPDX-License-Identifier: Apache-2.0
// validation: see tool_ties.h.
#include "validation/tool_ties.h"

#include <algorithm>
#include <cmath>

#include "thread/topology.h"
#include "validation/knot_scenes.h"

namespace catgut::validation {
namespace {

using thread::Hold;
using thread::Settings;
using thread::Surroundings;
using thread::ToolCapsule;

// x along the pull, y up from the tissue, z toward the viewer. The needle holder comes from the side of the long strand and
// lies along the pull, tilted; the forceps lie parallel to it, so that the shafts never cross. The sides alternate from throw
// to throw.
constexpr float kCircle = 13e-3f;  // radius of the winding hand's path
constexpr float kBehind =
    6e-3f;  // the hand winds this far behind the tip: between the tip and where the strand leaves the wound
constexpr float kInFront = 1.6e-3f;  // a strand is held this far in front of the tip
Vec3 shaft_from(float side) { return {side * 0.85f, 0.527f, 0}; }
// Position of the needle holder's tip while the strand is wound round it: beyond the wound, which lies under the shaft.
Vec3 work_place(float side) { return {side * -16e-3f, 18e-3f, 0}; }

struct Hands {
  Vec3 holder, forceps;  // tips
};

class Tying {
 public:
  Tying(const Settings& settings, const Tie& tie, const TieSettings& how, const TieWatcher& watcher)
      : settings_(settings), how_(how), watcher_(watcher), random_(how.seed) {
    // Tail from its end to the bite, the bite, the long strand.
    const float l = how.segment;
    const Vec3 left{-1.5e-3f, 0, 0}, right{1.5e-3f, 0, 0};
    tail_ = how.tail;
    const Vec3 tail_way = normalized(laid_tail(1) - left);
    forceps_shaft_ = holder_shaft_ = shaft_from(1);
    const Vec3 long_way = normalized(work_hand(1, 0) - right);
    std::vector<Vec3> fine;
    auto line = [&](Vec3 from, Vec3 to) {
      for (int i = 0; i < 1000; ++i) fine.push_back(lerp(from, to, static_cast<float>(i) / 1000));
    };
    line(left + tail_way * how.tail, left);
    for (int i = 0; i < 200; ++i) fine.push_back({-1.5e-3f * std::cos(kPi * i / 200), -1.5e-3f * std::sin(kPi * i / 200), 0});
    int wraps = 1;
    for (const TiedThrow& t : tie) wraps = std::max(wraps, t.wraps);
    const float longest = how.long_strand + 8e-3f * static_cast<float>(wraps - 1) + 6e-3f * static_cast<float>(tie.size() - 1);
    line(right, right + long_way * longest);
    const std::vector<Vec3> path = resample(fine, l);
    knot_.state = thread::make_state(path);
    knot_.bite_a = static_cast<uint32_t>(std::lround(how.tail / l));
    knot_.bite_b = knot_.bite_a + static_cast<uint32_t>(std::lround(1.5e-3f * kPi / l));
    stepper_ = std::make_unique<thread::Stepper>(path.size());
    const uint32_t nodes[] = {knot_.bite_a, knot_.bite_b, 0,
                              knot_.bite_b + static_cast<uint32_t>(std::lround(how.long_strand / l))};
    for (size_t k = 0; k < 4; ++k) {
      hold_[k].node = nodes[k];
      hold_[k].from = hold_[k].to = knot_.state.position(nodes[k]);
      hold_[k].stiffness = k < 2 ? 500.0f : 2000.0f;
      hold_[k].limit = k < 2 ? 0.0f : how.pull;
    }
    tail_at_ = hold_[2].to;
    strand_ = how.long_strand;
    hands_.holder = work_place(1) + holder_shaft_ * 50e-3f;
    const float radius[] = {0.9e-3f, 1.75e-3f, 1.0e-3f};
    for (size_t k = 0; k < 3; ++k) tool_[k].radius = radius[k];
    hands_.forceps = hold_[3].to;
    place_tools();
    for (ToolCapsule& t : tool_) t.a = t.to_a, t.b = t.to_b;
  }

  // The hand takes the long strand where exactly enough is left for these windings: slack falls off the jaws. `now` [m]:
  // length between the wound and the node that the hand holds.
  void take_strand(float now, int wraps) {
    const float want = how_.long_strand + 8e-3f * static_cast<float>(wraps - 1);
    const int shift = static_cast<int>(std::lround((want - now) / how_.segment)),
              last = static_cast<int>(knot_.state.nodes()) - 1;
    hold_[3].node = static_cast<uint32_t>(std::min(last, static_cast<int>(hold_[3].node) + shift));
    hands_.forceps = hold_[3].from = hold_[3].to = knot_.state.position(hold_[3].node);
  }

  // side: +1 the long strand is on the right. sense: +1 over the top from the viewer's side.
  void make_throw(float side, float sense, int wraps) {
    take_strand(strand_, wraps);
    const Vec3 shaft = shaft_from(side), work = work_place(side);
    const float start = sense > 0 ? 0 : kPi, turns = 2 * kPi * static_cast<float>(wraps) * sense;
    // The needle holder comes from the other hand; at this moment it is far from the thread.
    holder_shaft_ = shaft;
    hands_.holder = work + shaft * 50e-3f;
    place_tools();
    for (ToolCapsule* t : {&tool_[0], &tool_[1]}) t->a = t->to_a, t->b = t->to_b;
    turn_forceps_ = shaft;
    move("to work", work + shaft * 40e-3f, work_hand(side, start) + tremor(), laid_tail(side) + tremor());
    move("to work", work + tremor(), hands_.forceps);
    circle("wind", side, start, start + turns);
    // The jaws go forward to the tail; the wound strand stays where it is and slides along the shaft.
    move("fetch", tail_at_ + shaft * kInFront, hands_.forceps);
    gripped_ = true;
    move("draw through", work + shaft * 28e-3f + tremor(), hands_.forceps);
    // The winding hand continues over the top to the other side: that completes the throw.
    circle("cross", side, start + turns, start + turns + sense * kPi / 2);
    move("cross", {side * 30e-3f, 12e-3f, 0}, Vec3{-side * 24e-3f, 16e-3f, 0} + tremor());
    move("pull", {side * 40e-3f, 3e-3f, 0}, {-side * 40e-3f, 3e-3f, 0});
    move("pull", {side * 60e-3f, 2e-3f, 0}, {-side * 65e-3f, 2e-3f, 0}, {}, 0.1f);
    rest("pull", 0.1);
    strand_ = distance(knot_.state.position(hold_[3].node), knot_.state.position(knot_.bite_b));  // taut
    tail_ = distance(knot_.state.position(0), knot_.state.position(knot_.bite_a));
    tension_ = 0.5f * (length(hold_[2].force) + length(hold_[3].force));
    // Where a hand's grip slipped, the hand is now at the strand.
    for (size_t k : {size_t{2}, size_t{3}}) hold_[k].from = hold_[k].to = knot_.state.position(hold_[k].node);
    hands_ = {hold_[2].to + shaft * kInFront, hold_[3].to};
    place_tools();
    for (ToolCapsule& t : tool_) t.a = t.to_a, t.b = t.to_b;
    move("ease", hands_.holder + Vec3{-side * 4e-3f, 0, 0}, hands_.forceps + Vec3{side * 4e-3f, 2e-3f, 0});
    gripped_ = false;
    tail_at_ = hold_[2].to;
    move("let go", hands_.holder + shaft * 30e-3f, hands_.forceps);
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
  Vec3 tremor() {
    if (how_.seed == 0) return {};
    return Vec3{random_.uniform() - 0.5f, random_.uniform() - 0.5f, random_.uniform() - 0.5f} * 2e-3f;
  }
  // The tail is laid nearly straight: sagging thread would obstruct the winding hand.
  Vec3 laid_tail(float side) const { return {side * -0.88f * tail_, 8e-3f, 0}; }
  // The winding hand at an angle about the needle holder's shaft; 0: toward the viewer, pi/2: above.
  static Vec3 work_hand(float side, float angle) {
    return work_place(side) + shaft_from(side) * kBehind + Vec3{0, std::sin(angle), std::cos(angle)} * kCircle;
  }

  void place_tools() {
    const Vec3 jaw = hands_.holder, joint = jaw + holder_shaft_ * 15e-3f;
    tool_[0].to_a = jaw, tool_[0].to_b = joint;
    tool_[1].to_a = joint, tool_[1].to_b = joint + holder_shaft_ * 80e-3f;
    tool_[2].to_a = hands_.forceps + forceps_shaft_ * kInFront, tool_[2].to_b = tool_[2].to_a + forceps_shaft_ * 80e-3f;
  }

  void tick(const std::string& phase) {
    for (ToolCapsule& t : tool_) t.a = t.to_a, t.b = t.to_b;
    place_tools();
    hold_[2].from = hold_[2].to, hold_[3].from = hold_[3].to;
    hold_[2].to = gripped_ ? hands_.holder - holder_shaft_ * kInFront : tail_at_;
    hold_[3].to = hands_.forceps;
    Surroundings around;
    around.holds = hold_, around.tools = tool_;
    stepper_->step(settings_, knot_.state, around);
    ++ticks_;
    for (size_t k = 0; k < knot_.state.key.size(); ++k)
      if (knot_.state.crossing[k].normal_impulse > 0 && thread::partner_of(knot_.state.key[k]) < thread::kTool)
        knot_.nearest = std::min(knot_.nearest, 1 + knot_.state.crossing[k].gap / settings_.material.diameter);
    if (watcher_) watcher_(knot_.state, tool_, 1e-3 * static_cast<double>(ticks_), phase);
  }

  void rest(const std::string& phase, double seconds) {
    for (int i = 0; i < static_cast<int>(1000 * seconds); ++i) tick(phase);
  }

  // Moves both hands in the time that the longer path needs; the free tail is laid to `tail` if given.
  void move(const std::string& phase, Vec3 holder, Vec3 forceps, Vec3 tail = {}, float speed = 0) {
    const Hands from = hands_;
    const Vec3 tail_from = tail_at_, shaft_was = forceps_shaft_;
    if (speed == 0) speed = how_.speed;
    const bool lay = !gripped_ && length2(tail) > 0;
    const float far =
        std::max({distance(from.holder, holder), distance(from.forceps, forceps), lay ? distance(tail_from, tail) : 0.0f});
    const int ticks = std::max(1, static_cast<int>(std::ceil(1000 * 1.5f * far / speed)));
    for (int i = 1; i <= ticks; ++i) {
      const float s = static_cast<float>(i) / static_cast<float>(ticks), e = s * s * (3 - 2 * s);
      hands_.holder = lerp(from.holder, holder, e), hands_.forceps = lerp(from.forceps, forceps, e);
      if (lay) tail_at_ = lerp(tail_from, tail, e);
      if (length2(turn_forceps_) > 0) forceps_shaft_ = normalized(lerp(shaft_was, turn_forceps_, e), {0, 1, 0});
      tick(phase);
    }
    turn_forceps_ = {};
  }

  // The winding hand about the needle holder from one angle to another.
  void circle(const std::string& phase, float side, float from, float to) {
    const Vec3 off = hands_.forceps - work_hand(side, from);
    const float far = std::abs(to - from) * kCircle;
    const int ticks = std::max(1, static_cast<int>(std::ceil(1000 * 1.5f * far / how_.speed)));
    for (int i = 1; i <= ticks; ++i) {
      const float s = static_cast<float>(i) / static_cast<float>(ticks), e = s * s * (3 - 2 * s);
      hands_.forceps = work_hand(side, from + (to - from) * e) + off;
      tick(phase);
    }
  }

  const Settings& settings_;
  const TieSettings how_;
  const TieWatcher& watcher_;
  Random random_;
  TiedKnot knot_;
  std::unique_ptr<thread::Stepper> stepper_;
  Hold hold_[4];         // bite, bite, tail, long end
  ToolCapsule tool_[3];  // jaws and shaft of the needle holder, forceps
  Hands hands_;
  Vec3 tail_at_, holder_shaft_, forceps_shaft_, turn_forceps_;
  float tension_ = 0, strand_ = 0, tail_ = 0;  // the free lengths of both strands [m]
  bool gripped_ = false;
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
