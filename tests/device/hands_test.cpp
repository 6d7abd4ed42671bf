// SPDX-License-Identifier: Apache-2.0
// tests/device: motions match the view, assists move to the best grasp of the needle, and a mouse alone can make a bite.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "device/gamepad.h"
#include "device/mouse.h"
#include "device/tray.h"
#include "exchange/strand.h"
#include "exchange/tying.h"
#include "procedure/scene_file.h"
#include "runtime/live.h"
#include "sim/simulation.h"
#include "surgeon/plan.h"
#include "surgeon/sight.h"

namespace catgut {
namespace {

constexpr float kDt = 1.0f / 60;

struct WorkQueue {
  PictureModel picture;
  Snapshot seen;
  ViewFrame view = view_frame({0.02f, 0.2f, 0.25f}, {}, {0, 1, 0}, 30, 720);
  Steering steering;
  MouseHand mouse;
  std::array<ToolInput, 2> out;
  WorkQueue() {
    picture.field = 0.06f;
    picture.instrument.resize(2);
    picture.instrument[0].capabilities = kHoldNeedle | kHoldThread | kHoldTissue | kClamp | kCutThread;  // a needle holder
    picture.instrument[1].capabilities = kHoldNeedle | kHoldThread | kHoldTissue;                        // forceps
    seen.tool[0].instrument = 0, seen.tool[1].instrument = 1;
    seen.active().needle.pose.p = {0.3f, 0, 0};  // out of the assist's reach
    steering = start_steering(picture, false);
    turn({});
  }
  void turn(const MouseInput& input) {
    out = steer(steering, mouse_motion(mouse, steering, input, view, kDt), view, picture, seen, kDt, 0);
  }
};

// Pixels from the center of the image, right and down.
std::array<float, 2> on_screen(const ViewFrame& v, Vec3 p) {
  const Vec3 d = p - v.eye;
  const float scale = 1 / (v.pixel * dot(d, v.ahead));
  return {dot(d, v.right) * scale, -dot(d, v.up) * scale};
}

MouseInput moved(float right, float down) {
  MouseInput in;
  in.right = right, in.down = down;
  return in;
}

TEST(Mouse, the_tool_stays_under_the_pointer) {
  WorkQueue d;
  const auto from = on_screen(d.view, d.out[0].pose.p);
  const Vec3 start = d.out[0].pose.p, other = d.out[1].pose.p;
  d.turn(moved(30, -20));
  const auto to = on_screen(d.view, d.out[0].pose.p);
  EXPECT_NEAR(to[0] - from[0], 30, 0.01f);
  EXPECT_NEAR(to[1] - from[1], -20, 0.01f);
  EXPECT_NEAR(dot(d.out[0].pose.p - start, d.view.ahead), 0, 1e-6f);
  EXPECT_TRUE(d.out[1].pose.p == other);
  EXPECT_NEAR(length(d.out[0].velocity), distance(d.out[0].pose.p, start) / kDt, 1e-3f);
}

TEST(Mouse, wheel_and_shift_go_into_the_picture) {
  WorkQueue d;
  const Vec3 start = d.out[0].pose.p;
  MouseInput in;
  in.wheel = 3;
  d.turn(in);
  EXPECT_NEAR(distance(d.out[0].pose.p, start), 0.006f, 1e-6f);
  EXPECT_NEAR(distance(d.out[0].pose.p, d.view.eye), distance(start, d.view.eye) + 0.006f, 1e-5f);
  EXPECT_NEAR(on_screen(d.view, d.out[0].pose.p)[0], on_screen(d.view, start)[0], 0.05f) << "it stays under the pointer";
  in = moved(0, -50);  // the mouse away from the user
  in.depth = true;
  d.turn(in);
  EXPECT_GT(dot(d.out[0].pose.p - start, d.view.ahead), 0.008f);
}

TEST(Mouse, tab_changes_hands_and_speed_scales) {
  WorkQueue d;
  MouseInput in = moved(10, 0);
  in.hand_changes = 1;
  const Vec3 right = d.out[0].pose.p, left = d.out[1].pose.p;
  d.turn(in);
  EXPECT_TRUE(d.out[0].pose.p == right);
  const float normal = distance(d.out[1].pose.p, left);
  EXPECT_GT(normal, 0.001f);
  d.mouse.speed = kMouseSpeeds[0];
  const Vec3 at = d.out[1].pose.p;
  d.turn(moved(10, 0));
  EXPECT_NEAR(distance(d.out[1].pose.p, at), 0.3f * normal, 0.02f * normal);
  in = {};
  in.hand_changes = 2;  // there and back
  d.turn(in);
  EXPECT_EQ(d.mouse.active, 1u);
}

TEST(Mouse, the_jaw_is_a_ratchet_or_is_held) {
  WorkQueue d;
  MouseInput press;
  press.jaw_presses = 1;
  press.jaw_down = true;
  d.turn(press);
  EXPECT_EQ(d.out[0].jaw, 0);
  d.turn({});
  EXPECT_EQ(d.out[0].jaw, 0) << "it stays closed when the button is let go";
  d.turn(press);
  EXPECT_EQ(d.out[0].jaw, 1);
  d.turn({});
  d.mouse.hold_to_close = true;
  d.turn(press);
  EXPECT_EQ(d.out[0].jaw, 0);
  d.turn({});
  EXPECT_EQ(d.out[0].jaw, 1);
}

TEST(Mouse, keys_are_buttons_of_the_active_hand_while_they_are_down) {
  WorkQueue d;
  MouseInput in;
  in.cut = in.fresh = true;
  d.turn(in);
  EXPECT_EQ(d.out[0].buttons, kButtonCut | kButtonNewSuture);
  EXPECT_EQ(d.out[1].buttons, 0u);
  d.turn({});
  EXPECT_EQ(d.out[0].buttons, 0u);
}

TEST(Mouse, the_right_button_turns_a_held_needle_about_its_own_circle) {
  WorkQueue d;
  d.seen.active().needle.pose = {{0.01f, 0.02f, 0.03f}, axis_angle(normalized(Vec3{1, 2, 3}), 0.7f)};
  d.seen.tool[0].held = Held::needle;
  const Pose grip{{0.004f, 0.007f, 0}, axis_angle({1, 0, 0}, 0.4f)};
  d.seen.tool[0].pose = d.steering.hand[0].pose = d.seen.active().needle.pose * grip;
  d.turn({});
  MouseInput in = moved(100, 0);
  in.turn = true;
  d.turn(in);
  const Pose needle = d.out[0].pose * inverse(grip);
  EXPECT_LT(distance(needle.p, d.seen.active().needle.pose.p), 1e-6f) << "its center stays";
  const Vec3 turned = rotation_vector(conjugate(d.seen.active().needle.pose.q) * needle.q);
  EXPECT_NEAR(turned.z, 0.6f, 1e-4f) << "tip first";
  EXPECT_NEAR(std::hypot(turned.x, turned.y), 0, 1e-4f);
}

TEST(Mouse, without_a_needle_the_tool_turns_about_its_shaft_or_as_a_ball) {
  WorkQueue d;
  const Pose start = d.out[0].pose;
  MouseInput in = moved(50, 0);
  in.turn = true;
  d.turn(in);
  EXPECT_TRUE(d.out[0].pose.p == start.p);
  EXPECT_LT(distance(rotate(d.out[0].pose.q, {0, 0, 1}), rotate(start.q, {0, 0, 1})), 1e-5f);
  EXPECT_GT(distance(rotate(d.out[0].pose.q, {1, 0, 0}), rotate(start.q, {1, 0, 0})), 0.2f);
  in.free_turn = true;
  const Quat before = d.out[0].pose.q;
  d.turn(in);
  const Vec3 about = rotation_vector(d.out[0].pose.q * conjugate(before));
  EXPECT_NEAR(dot(about, d.view.up), 0.3f, 1e-4f);
}

TEST(Steer, left_handed_is_the_mirror_image) {
  WorkQueue d;
  const Steering left = start_steering(d.picture, true), right = start_steering(d.picture, false);
  for (size_t k = 0; k < 2; ++k) {
    EXPECT_EQ(left.hand[k].pose.p.x, -right.hand[k].pose.p.x);
    EXPECT_EQ(left.hand[k].pose.p.y, right.hand[k].pose.p.y);
  }
  EXPECT_GT(right.hand[0].pose.p.x, 0);
}

TEST(Steer, no_motion_takes_a_hand_out_of_reach) {
  WorkQueue d;
  for (int i = 0; i < 50; ++i) d.turn(moved(900, -700));
  EXPECT_LT(length(d.out[0].pose.p), 0.36f);
  EXPECT_TRUE(is_finite(d.out[0].pose.p));
}

TEST(Steer, after_a_jump_in_time_hands_go_on_from_the_tools) {
  WorkQueue d;
  d.turn(moved(80, 30));
  const Pose grip{{0.004f, 0.007f, 0}, axis_angle({1, 0, 0}, 0.4f)};
  d.seen.active().needle.pose = {{0.01f, 0.02f, 0.03f}, axis_angle(normalized(Vec3{1, 2, 3}), 0.7f)};
  d.seen.tool[0].held = Held::needle;
  d.seen.tool[0].jaw = 0;
  d.seen.tool[0].pose = d.seen.tool[0].hand = d.seen.active().needle.pose * grip;
  d.seen.tool[1].hand = {{-0.05f, 0.01f, 0}, {}};
  resume_steering(d.steering, d.seen);
  d.turn({});
  EXPECT_LT(distance(d.out[0].pose.p, d.seen.tool[0].hand.p), 1e-6f);
  EXPECT_EQ(d.out[0].jaw, 0) << "it still holds the needle";
  EXPECT_LT(distance(d.out[1].pose.p, d.seen.tool[1].hand.p), 1e-6f);
  MouseInput in = moved(50, 0);
  in.turn = true;
  d.turn(in);
  EXPECT_LT(distance((d.out[0].pose * inverse(grip)).p, d.seen.active().needle.pose.p), 1e-6f)
      << "and turns it about its own center";
}

TEST(Help, takes_an_open_jaw_to_the_good_place_and_lets_go_of_a_moving_hand) {
  WorkQueue d;
  d.seen.active().needle.pose = {d.out[0].pose.p + d.view.ahead * 0.04f, axis_angle({1, 0, 0}, -0.5f * kPi)};
  const float phi = 0.35f * d.picture.suture[0].needle_arc;
  const Vec3 place =
      transform(d.seen.active().needle.pose, Vec3{std::cos(phi), std::sin(phi), 0} * d.picture.suture[0].needle_radius);
  // Moves the pointer over the needle, 40 mm in front of it.
  const auto to = on_screen(d.view, place), from = on_screen(d.view, d.out[0].pose.p);
  d.turn(moved(to[0] - from[0], to[1] - from[1]));
  EXPECT_LT(distance(d.out[0].pose.p, place), 1e-5f);
  const Vec3 along = rotate(d.seen.active().needle.pose.q, {-std::sin(phi), std::cos(phi), 0});
  for (const Vec3 axis : {Vec3{1, 0, 0}, Vec3{0, 0, 1}})
    EXPECT_NEAR(dot(rotate(d.out[0].pose.q, axis), along), 0, 1e-3f) << "across the needle";
  EXPECT_GT(rotate(d.out[0].pose.q, {0, 0, 1}).y, 0.7f) << "from above, where the shaft was";
  MouseInput press;
  press.jaw_presses = 1;
  d.turn(press);
  EXPECT_EQ(d.out[0].jaw, 1) << "the tool is not there yet: closing now would miss";
  d.seen.tool[0].pose = d.out[0].pose;
  d.turn({});
  EXPECT_EQ(d.out[0].jaw, 0);
  d.seen.tool[0].held = Held::needle;
  const Pose grasped = d.out[0].pose;
  d.turn({});
  EXPECT_LT(distance(d.out[0].pose.p, grasped.p), 1e-6f) << "nothing jumps when it is grasped";
  d.seen.tool[0].held = Held::nothing;
  d.turn(press);
  d.turn(moved(200, 0));
  EXPECT_FALSE(d.steering.hand[0].snapped);
  d.steering.assist = false;
  d.turn(moved(-200, 0));
  EXPECT_FALSE(d.steering.hand[0].snapped) << "switched off";
}

// Thread from a stitch in the middle of the field to the needle, which the forceps holds; the tail lies in front.
void with_a_stitch(WorkQueue& d) {
  for (uint32_t i = 0; i < 41; ++i) {
    const float s = 0.002f * static_cast<float>(i);
    d.seen.active().thread_order.push_back(i);
    d.seen.particle.push_back(i <= 15 ? Vec3{0, 0, 0.03f - s} : Vec3{0.03f - s, 0.002f, 0});
  }
  d.seen.active().thread_tension.resize(40);
  d.seen.active().thread_cut.resize(40);
  d.seen.active().thread_rest = 0.08f;
  d.seen.active().suture_point.resize(1);
  d.seen.active().suture_point[0].anchored = 15;
  d.seen.active().needle.pose.p = d.seen.particle[40] - Vec3{d.picture.suture[0].needle_radius, 0, 0};
  d.seen.tool[1].held = Held::needle;
  d.seen.tool[1].pose = d.steering.hand[1].pose = {d.seen.active().needle.pose.p, axis_angle({0, 1, 0}, -0.5f * kPi)};
}

TEST(Help, one_gesture_moves_both_hands_unless_it_is_switched_off) {
  MouseInput in = moved(60, 0);
  in.both = true;
  for (const bool assist : {true, false}) {
    WorkQueue d;
    with_a_stitch(d);
    d.steering.assist = assist;
    const Vec3 driver = d.steering.hand[0].pose.p, forceps = d.steering.hand[1].pose.p;
    d.turn(in);
    EXPECT_EQ(distance(d.out[0].pose.p, driver) > 0.001f, assist);
    EXPECT_EQ(distance(d.out[1].pose.p, forceps) > 0.001f, assist);
    EXPECT_EQ(d.steering.both.winding.way, assist ? 1.0f : 0.0f);
    EXPECT_LT(d.out[0].jaw, assist ? 0.71f : 1.1f) << "a jaw wide open would shake the loop off";
  }
}

// Jaws behind the needle's tip stand opposite to its swage. A strand that crossed the needle's circle caught on them, became
// slack and slid off the tool: wound the other way, the second throw had no loop.
TEST(Help, a_strand_that_is_wound_stays_clear_of_the_jaws_at_the_tip) {
  for (const float way : {60.0f, -60.0f})
    for (const float side : {1.0f, -1.0f}) {
      WorkQueue d;
      with_a_stitch(d);
      Snapshot& seen = d.seen;
      for (float& t : seen.active().thread_tension) t = 0.05f;  // [N] just taut
      const Pose needle = seen.active().needle.pose;
      seen.tool[1].pose = d.steering.hand[1].pose = {on_needle(d.picture, needle, 0.93f), needle.q};
      d.steering.hand[0].pose.q = from_tool_axis(tying_axis(side));
      MouseInput in = moved(way, 0);
      in.both = true;
      float clear = 1, wound = 0;
      for (int i = 0; i < 1200 && wound < 2 * kPi; ++i) {
        d.turn(in);
        for (size_t k = 0; k < 2; ++k) seen.tool[k].pose = d.out[k].pose;
        seen.active().needle.pose = d.out[1].pose * inverse(d.steering.hand[1].grip);
        const Vec3 stitch = seen.particle[15], swage = needle_swage(d.picture, seen);
        for (size_t n = 16; n <= 40; ++n) seen.particle[n] = stitch + (swage - stitch) * (static_cast<float>(n - 15) / 25);
        wound = d.steering.both.winding.wound;
        if (wound < 0.2f) continue;
        const Vec3 jaws = d.out[1].pose.p, turns = d.out[0].pose.p + rotate(d.out[0].pose.q, {0, 0, kTieWindAt});
        const float at = std::clamp(dot(jaws - swage, turns - swage) / length2(turns - swage), 0.0f, 1.0f);
        clear = std::min(clear, distance(jaws, swage + (turns - swage) * at));
      }
      EXPECT_GE(wound, 2 * kPi);
      EXPECT_GT(clear, d.picture.suture[0].needle_radius) << "way " << way << ", side " << side;
    }
}

TEST(Help, a_needle_that_entered_the_tissue_while_tying_is_withdrawn) {
  WorkQueue d;
  with_a_stitch(d);
  MouseInput in = moved(10, 0);
  in.both = true;
  d.seen.active().needle.in_tissue = true;
  const Pose before = d.seen.active().needle.pose;
  d.turn(in);
  EXPECT_EQ(d.steering.both.doing, BothDo::nothing) << "nothing is tied: it is a bite";
  d.seen.active().knot.resize(1);
  for (int i = 0; i < 10; ++i) d.turn(in);
  EXPECT_EQ(d.steering.both.doing, BothDo::withdraw);
  const Pose needle = d.out[1].pose * inverse(d.steering.hand[1].grip);
  const float turned = 10 * 1.5f * kDt;  // [rad]
  EXPECT_LT(distance(on_needle(d.picture, needle, 1), on_needle(d.picture, before, 1 - turned / kPi)), 1e-4f)
      << "backward along its own curve";
}

// A running suture has a knot at its beginning, and more bites to come.
TEST(Help, a_bite_under_way_is_not_withdrawn_after_a_knot) {
  WorkQueue d;
  with_a_stitch(d);
  d.seen.active().knot.resize(1);
  MouseInput drive = moved(10, 0), both = moved(10, 0);
  drive.turn = both.both = true;
  drive.hand_changes = 1;  // to the forceps, which holds the needle
  d.turn(drive);
  d.seen.active().needle.in_tissue = true;
  for (int i = 0; i < 100; ++i) d.turn({});
  const Pose hand = d.out[1].pose;
  for (int i = 0; i < 10; ++i) d.turn(both);
  EXPECT_EQ(d.steering.both.doing, BothDo::nothing);
  EXPECT_LT(distance(d.out[1].pose.p, hand.p), 1e-6f);
}

TEST(Help, an_end_is_not_drawn_farther_than_it_is_long) {
  WorkQueue d;
  with_a_stitch(d);
  const float strand = 0.05f;  // from the stitch to the needle
  const Vec3 stitch = d.seen.particle[15];
  const auto swage_with = [&](Vec3 hand) { return d.seen.particle[40] + (hand - d.seen.tool[1].pose.p); };
  const Vec3 here = d.seen.tool[1].pose.p, far = here + Vec3{-0.2f, 0.1f, 0};
  EXPECT_TRUE(on_leash(d.picture, d.seen, 1, here) == here);
  EXPECT_NEAR(distance(swage_with(on_leash(d.picture, d.seen, 1, far)), stitch), strand + 0.01f, 1e-4f);
  d.seen.active().knot.resize(1);
  d.seen.active().knot[0].position = stitch;
  d.seen.active().knot[0].phase = KnotPhase::tightening;
  EXPECT_GT(distance(swage_with(on_leash(d.picture, d.seen, 1, far)), stitch), strand + 0.015f)
      << "an open throw comes down only as far as the hand moves, and its loop has thread to give";
  d.seen.active().knot[0].phase = KnotPhase::locked;
  EXPECT_NEAR(distance(swage_with(on_leash(d.picture, d.seen, 1, far)), stitch), strand + 0.002f, 1e-4f) << "nothing slides";
  EXPECT_TRUE(on_leash(d.picture, d.seen, 0, far) == far) << "an empty hand goes where it likes";
}

// At two frames per second a stroke of the mouse lasts half a second: the whole thread would be out before the next look.
TEST(Help, a_free_end_that_becomes_short_slows_the_hand_that_pulls_it) {
  const auto pulled = [](bool assist) {  // [m] in half a second
    WorkQueue d;
    with_a_stitch(d);
    d.steering.assist = assist;
    const Vec3 from = d.seen.tool[1].pose.p;
    MouseInput in = moved(-40, 0);
    in.hand_changes = 1;
    for (int i = 0; i < 30; ++i) {
      d.turn(in);
      in.hand_changes = 0;
      // Nothing holds the thread: it follows.
      const Vec3 moved_by = d.out[1].pose.p - d.seen.tool[1].pose.p;
      d.seen.tool[1].pose = d.out[1].pose;
      d.seen.active().needle.pose.p += moved_by;
      for (size_t n = 0; n <= 40; ++n) d.seen.particle[n] += moved_by;
    }
    return from.x - d.out[1].pose.p.x;  // along the strand
  };
  EXPECT_LT(pulled(true), 0.005f) << "3 cm are left";
  EXPECT_GT(pulled(false), 0.1f) << "switched off";
}

TEST(Help, the_jaws_find_the_tail_while_the_other_hand_has_the_needle) {
  WorkQueue d;
  with_a_stitch(d);
  TailGrip grip;
  ASSERT_TRUE(tail_grip(d.picture, d.seen, 0, grip));
  EXPECT_LT(grip.slot, 15u);
  const auto to = on_screen(d.view, grip.pose.p), from = on_screen(d.view, d.steering.hand[0].pose.p);
  d.turn(moved(to[0] - from[0], to[1] - from[1]));
  EXPECT_TRUE(d.steering.hand[0].snapped);
  EXPECT_EQ(d.steering.hand[0].at, HelpAt::tail);
}

TEST(Help, a_held_needle_comes_to_the_bite_and_is_driven_from_there) {
  WorkQueue d;
  d.seen.active().needle.pose = {{0.03f, 0.03f, 0}, axis_angle({1, 0, 0}, 0.3f)};
  d.seen.tool[0].held = Held::needle;
  d.seen.tool[0].pose = d.steering.hand[0].pose =
      d.seen.active().needle.pose * Pose{{0.004f, 0.007f, 0}, axis_angle({1, 0, 0}, 0.4f)};
  d.steering.guide = BiteGuide{{0, 0, 0}, {0, 1, 0}, {1, 0, 0}, 0.008f, 0.001f};
  d.turn({});
  EXPECT_FALSE(d.steering.hand[0].snapped) << "too far";
  const auto to = on_screen(d.view, entry_of(*d.steering.guide)), from = on_screen(d.view, d.steering.hand[0].pose.p);
  d.turn(moved(to[0] - from[0], to[1] - from[1]));
  ASSERT_TRUE(d.steering.hand[0].snapped);
  for (int i = 0; i < 240; ++i) {  // the tool and the needle in it follow their target
    d.seen.active().needle.pose = d.out[0].pose * inverse(d.steering.hand[0].grip);
    d.seen.tool[0].pose = d.out[0].pose;
    d.turn({});
  }
  const Vec3 before = on_needle(d.picture, d.seen.active().needle.pose, 1);
  EXPECT_LT(distance(before, entry_of(*d.steering.guide)), 0.006f);
  EXPECT_GT(before.y, 0) << "the tip is before the tissue";
  MouseInput in = moved(80, 0);
  in.turn = true;
  d.turn(in);
  for (int i = 0; i < 30; ++i) d.turn({});
  const Vec3 after = on_needle(d.picture, d.out[0].pose * inverse(d.steering.hand[0].grip), 1);
  EXPECT_LT(after.y, before.y);
  EXPECT_GT(after.x, before.x);
}

TEST(Help, the_needle_under_the_pointer_is_meant_whichever_suture_it_is_of) {
  WorkQueue d;
  d.seen.suture.resize(2), d.picture.suture.resize(2);
  d.picture.suture[1].needle_radius = 0.012f;
  d.seen.suture[0].needle.pose = {{-0.03f, 0, 0}, {}};
  d.seen.suture[1].needle.pose = {{0.03f, 0, 0}, {}};
  for (const int k : {1, 0, 1}) {
    const Pose grip = good_grip(d.picture, d.seen, 0, {0, 0, 1}, {}, k);
    const auto to = on_screen(d.view, grip.p), from = on_screen(d.view, d.steering.hand[0].pose.p);
    d.turn(moved(to[0] - from[0], to[1] - from[1]));
    ASSERT_TRUE(d.steering.hand[0].snapped) << k;
    const auto which = static_cast<size_t>(k);
    EXPECT_NEAR(distance(d.steering.hand[0].help.p, d.seen.suture[which].needle.pose.p), d.picture.suture[which].needle_radius,
                1e-5f);
  }
  // In the jaws: it is this needle that turns with the tool, though the other one was active.
  const NeedleView& held = d.seen.suture[1].needle;
  d.seen.tool[0].held = Held::needle, d.seen.tool[0].held_suture = 1;
  d.seen.tool[0].pose = d.steering.hand[0].help;
  d.turn({});
  const Pose same = d.steering.hand[0].pose * inverse(d.steering.hand[0].grip);
  EXPECT_LT(distance(same.p, held.pose.p), 1e-4f);
}

TEST(Help, the_second_hand_takes_the_other_place) {
  WorkQueue d;
  d.seen.active().needle.pose = {};
  d.seen.tool[0].held = Held::needle;
  d.seen.tool[0].held_at = 0.35f;
  const Pose tip = good_grip(d.picture, d.seen, 1, {0, 0, 1}, {});
  EXPECT_LT(tip.p.x, -0.9f * d.picture.suture[0].needle_radius);
  d.seen.tool[0].held_at = 0.93f;
  EXPECT_GT(good_grip(d.picture, d.seen, 1, {0, 0, 1}, {}).p.x, 0);
}

TEST(Gamepad, each_stick_moves_its_hand) {
  WorkQueue d;
  GamepadHand pad;
  GamepadInput in;
  in.right.x = 1;
  in.left.y = -1;
  in.left.x = 0.1f;  // a worn stick
  auto m = gamepad_motion(pad, d.steering, in, 0.1f);
  EXPECT_NEAR(m[0].right, 0.008f, 1e-6f);
  EXPECT_EQ(m[0].up, 0);
  EXPECT_NEAR(m[1].up, 0.008f, 1e-6f);
  EXPECT_EQ(m[1].right, 0);
  in.right.shoulder = true;
  m = gamepad_motion(pad, d.steering, in, 0.1f);
  EXPECT_NEAR(m[0].drive, 0.2f, 1e-6f);
  EXPECT_EQ(m[0].right, 0);
  pad.left_handed = true;
  m = gamepad_motion(pad, d.steering, in, 0.1f);
  EXPECT_NEAR(m[1].drive, 0.2f, 1e-6f);
}

TEST(Gamepad, triggers_close_the_jaws_and_leave_a_mouses_alone) {
  WorkQueue d;
  GamepadHand pad;
  GamepadInput in;
  d.steering.hand[0].closed = true;  // by the mouse
  gamepad_motion(pad, d.steering, in, kDt);
  EXPECT_TRUE(d.steering.hand[0].closed);
  in.left.trigger = 0.5f;
  gamepad_motion(pad, d.steering, in, kDt);
  d.turn({});
  EXPECT_NEAR(d.out[1].jaw, 0.5f, 1e-6f);
  in.left.trigger = 1;
  gamepad_motion(pad, d.steering, in, kDt);
  d.turn({});
  EXPECT_EQ(d.out[1].jaw, 0);
  in.left.trigger = 0;
  in.cut = true;
  gamepad_motion(pad, d.steering, in, kDt);
  d.turn({});
  EXPECT_EQ(d.out[1].jaw, 1);
  EXPECT_EQ(d.out[0].buttons, kButtonCut);
}

// A simulated user with only a mouse: every step below is pixels, notches and buttons.
class MousePerson {
 public:
  // ticks: of the simulation per frame; hands move as in runtime/live.
  explicit MousePerson(const std::string& scene, int ticks = 1)
      : ticks_(ticks),
        dt_(kDt * static_cast<float>(ticks)),
        model_(build_model(read_scene(scene))),
        state_(initial_state(*model_)),
        picture_(picture_model(*model_)) {
    steering_ = start_steering(picture_, false);
    const Vec3 target = picture_.focus + Vec3{0.02f, 0, 0};
    view_ = view_frame(target + Vec3{0.03f, 0.16f, 0.17f}, target, {0, 1, 0}, 30, 360);
    publish(*model_, *state_, seen_);
  }

  void tick(const MouseInput& input) {
    const auto hand = steer(steering_, mouse_motion(mouse_, steering_, input, view_, dt_), view_, picture_, seen_, dt_, 0);
    for (int i = 0; i < ticks_; ++i) {
      for (size_t k = 0; k < 2; ++k) in_.hand[k] = started_ ? hand_toward(in_.hand[k], hand[k], 0.6f, 12, kDt) : hand[k];
      started_ = true;
      step(*model_, *state_, in_, jobs_);
      publish(*model_, *state_, seen_);
      for (const Event& e : seen_.event) events_.push_back(e);
    }
  }
  void wait(int ticks) {
    for (int i = 0; i < ticks; ++i) tick({});
  }
  void click() {
    MouseInput press;
    press.jaw_presses = 1;
    tick(press);
  }
  void tab() {
    MouseInput press;
    press.hand_changes = 1;
    tick(press);
  }
  // Moves the pointer over a point of the scene; with `deep` the wheel moves the tool to its depth too.
  bool point_at(const std::function<Vec3()>& place, bool deep, int ticks) {
    for (int i = 0; i < ticks; ++i) {
      const auto from = on_screen(view_, steering_.hand[mouse_.active].pose.p), to = on_screen(view_, place());
      const Vec3 off = place() - steering_.hand[mouse_.active].pose.p;
      MouseInput in = moved(std::clamp(to[0] - from[0], -8.0f, 8.0f), std::clamp(to[1] - from[1], -8.0f, 8.0f));
      if (deep) in.wheel = std::clamp(dot(off, view_.ahead) / 0.002f, -1.0f, 1.0f);
      tick(in);
      if (std::hypot(to[0] - from[0], to[1] - from[1]) < 0.2f && (!deep || std::abs(dot(off, view_.ahead)) < 1e-4f))
        return true;
    }
    return false;
  }
  Pose commanded_needle() const {
    const SteeredHand& hand = steering_.hand[mouse_.active];
    return hand.pose * inverse(hand.grip);
  }
  // Turns (Control and the right button; Q and E) and moves until the held needle reaches its target.
  bool bring_needle(const Pose& wanted, int ticks) {
    for (int i = 0; i < ticks; ++i) {
      const Pose now = commanded_needle();
      const Vec3 about = rotation_vector(wanted.q * conjugate(now.q)), off = wanted.p - now.p;
      if (length(about) < 0.01f && length(off) < 2e-4f) return true;
      MouseInput in;
      if (i % 2 == 0) {
        in.turn = in.free_turn = true;
        in.right = std::clamp(dot(about, view_.up) / 0.006f, -8.0f, 8.0f);
        in.down = std::clamp(dot(about, view_.right) / 0.006f, -8.0f, 8.0f);
        in.roll = std::clamp(dot(about, view_.ahead) / (1.5f * dt_), -1.0f, 1.0f);
      } else {
        const float px = view_.pixel * dot(steering_.hand[mouse_.active].pose.p - view_.eye, view_.ahead);
        in.right = std::clamp(dot(off, view_.right) / px, -12.0f, 12.0f);
        in.down = std::clamp(-dot(off, view_.up) / px, -12.0f, 12.0f);
        in.wheel = std::clamp(dot(off, view_.ahead) / 0.002f, -2.0f, 2.0f);
      }
      tick(in);
    }
    return false;
  }
  bool drive(float pixels, int ticks, const std::function<bool()>& done) {
    MouseInput in = moved(pixels, 0);
    in.turn = true;
    for (int i = 0; i < ticks && !done(); ++i) tick(in);
    return done();
  }
  bool happened(EventKind kind) const {
    return std::any_of(events_.begin(), events_.end(), [&](const Event& e) { return e.kind == kind; });
  }
  Vec3 on_needle(float s) const {
    const float phi = s * picture_.suture[0].needle_arc;
    return transform(seen_.active().needle.pose, Vec3{std::cos(phi), std::sin(phi), 0} * picture_.suture[0].needle_radius);
  }

  const int ticks_;
  const float dt_;  // [s] between two pictures
  std::shared_ptr<const Model> model_;
  StatePtr state_;
  PictureModel picture_;
  Snapshot seen_;
  TickInput in_;
  bool started_ = false;
  Steering steering_;
  MouseHand mouse_;
  ViewFrame view_;
  Jobs jobs_{1};
  std::vector<Event> events_;
};

// ticks 1: a frame every tick; 6: ten frames per second, as on a machine without a graphics card.
class WholeBite : public testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Pictures, WholeBite, testing::Values(1, 6));

TEST_P(WholeBite, by_mouse_alone) {
  MousePerson me("purse_string", GetParam());
  me.wait(30);
  // The pointer over the needle; the assist does the rest.
  ASSERT_TRUE(me.point_at([&] { return me.on_needle(0.35f); }, false, 400));
  EXPECT_TRUE(me.steering_.hand[0].snapped);
  me.click();
  me.wait(30);
  ASSERT_EQ(me.seen_.tool[0].held, Held::needle);
  EXPECT_NEAR(me.seen_.tool[0].held_at, 0.35f, 0.05f);

  // The needle beside the planned bite, its circle level with the rim, as the scripted surgeon holds it.
  const Plan plan = make_plan("purse_string", me.picture_, SurgeonSkill{});
  const BitePlace& bite = plan.place[0];
  const Vec3 out = normalized(bite.out - bite.up * dot(bite.out, bite.up)), along = cross(out, bite.up);
  const float half = std::asin(0.5f * bite.length / me.picture_.suture[0].needle_radius);
  const auto needle_at = [&](float psi, float away, float lift) {
    const Vec3 x = out * std::cos(psi) - along * std::sin(psi);
    return Pose{bite.at + out * (me.picture_.suture[0].needle_radius - bite.depth + away) + bite.up * lift,
                from_axes(x, cross(bite.up, x), bite.up)};
  };
  ASSERT_TRUE(me.bring_needle(needle_at(-half - 0.7f, 0.02f, 0.012f), 1500));
  ASSERT_TRUE(me.bring_needle(needle_at(-half - 0.5f, -0.0003f, 0), 600));
  EXPECT_TRUE(me.drive(0.8f, 800, [&] { return !me.seen_.active().bite.empty() && me.seen_.active().bite.back().has_exit; }))
      << "the right button, the mouse to the right";
  EXPECT_TRUE(me.happened(EventKind::tip_entered));
  ASSERT_TRUE(me.happened(EventKind::tip_exited));
  me.drive(0.8f, 150, [] { return false; });

  // The other hand grasps the tip, the first one releases, and the needle is turned out of the tissue.
  me.tab();
  ASSERT_TRUE(me.point_at([&] { return me.on_needle(0.93f); }, false, 600));
  EXPECT_TRUE(me.steering_.hand[1].snapped);
  me.click();
  me.wait(40);
  ASSERT_EQ(me.seen_.tool[1].held, Held::needle);
  me.tab();
  me.click();
  me.point_at([&] { return me.picture_.focus + Vec3{0.06f, 0.06f, 0.04f}; }, true, 200);
  ASSERT_EQ(me.seen_.tool[0].held, Held::nothing);
  me.tab();
  EXPECT_TRUE(me.drive(1.2f, 1200, [&] { return !me.seen_.active().needle.in_tissue; }));
  EXPECT_TRUE(me.happened(EventKind::bite_completed));
}

// One key cycles through the tray; parked instruments and those of the other hand are skipped.
TEST(Tray, the_key_goes_round_what_lies_there) {
  Snapshot seen;
  seen.instrument.resize(4);
  for (size_t k = 0; k < 2; ++k) {
    seen.tool[k].instrument = static_cast<int>(k);
    seen.instrument[k].place = InstrumentPlace::hand;
  }
  Command c = next_from_tray(seen, 0);
  EXPECT_EQ(c.kind, CommandKind::swap);
  EXPECT_EQ(c.argument, 2);
  seen.instrument[2].place = InstrumentPlace::parked;
  EXPECT_EQ(next_from_tray(seen, 0).argument, 3);
  seen.tool[0].instrument = -1, seen.instrument[0].place = InstrumentPlace::tray;
  c = next_from_tray(seen, 0);
  EXPECT_EQ(c.kind, CommandKind::take);
  EXPECT_EQ(c.argument, 0);
  c = park_or_take_up(seen, 0);
  EXPECT_EQ(c.kind, CommandKind::unpark);
  EXPECT_EQ(c.argument, 2);
  // An assistant's clamp on tissue is as good as a parked one, and the nearest one is taken.
  seen.tool[2].instrument = 3, seen.tool[0].hand.p = seen.instrument[3].pose.p = {0.1f, 0, 0};
  seen.instrument[3].place = InstrumentPlace::hand;
  EXPECT_EQ(park_or_take_up(seen, 0).argument, 2) << "the assistant's holds nothing";
  seen.instrument[3].held = Held::tissue;
  EXPECT_EQ(park_or_take_up(seen, 0).argument, 3);
  EXPECT_EQ(park_or_take_up(seen, 1).kind, CommandKind::lay_down);
  seen.tool[1].held = Held::tissue;
  EXPECT_EQ(park_or_take_up(seen, 1).kind, CommandKind::park);
  seen.instrument[0].place = seen.instrument[3].place = InstrumentPlace::hand;
  EXPECT_EQ(next_from_tray(seen, 1).kind, CommandKind::none);
}

}  // namespace
}  // namespace catgut
