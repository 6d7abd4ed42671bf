// SPDX-License-Identifier: Apache-2.0
// tests/xr: place, hands, vibration and resolution as plain functions, without a runtime.
#ifdef CATGUT_TESTS_HEADSET
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <random>

#include "device/steer.h"
#include "procedure/scene_file.h"
#include "render/camera.h"
#include "sim/simulation.h"
#include "xr/boards.h"
#include "xr/fade.h"
#include "xr/register.h"
#include "xr/resolution.h"
#include "xr/space_hands.h"
#include "xr/vibration.h"

namespace catgut::xr {
namespace {

constexpr float kDt = 1.0f / 90;

Pose head_at(Vec3 p, float yaw, float pitch) {
  return {p, normalized(axis_angle({0, 1, 0}, yaw) * axis_angle({1, 0, 0}, pitch))};
}

struct Still {
  Snapshot seen;
  PictureModel picture;
  Still() {
    const auto model = build_model(read_scene("stay"));
    const auto state = initial_state(*model);
    publish(*model, *state, seen);
    picture = picture_model(*model);
  }
};

TEST(Place, a_recenter_puts_the_field_ahead_of_the_wearer_wherever_they_look) {
  for (const float yaw : {-2.5f, -0.4f, 0.0f, 1.0f, 3.0f}) {
    Place place;
    place.focus = {0.1f, 0.2f, -0.3f};
    const Pose head = head_at({1, 1.6f, -2}, yaw, -0.5f);
    recenter(place, head);
    const Pose eye = place.to_world(head);
    const Vec3 way = place.focus - eye.p;
    EXPECT_NEAR(way.x, 0, 1e-5f);
    EXPECT_NEAR(-way.z, kAhead, 1e-5f) << "the wearer looks along the world's -z";
    EXPECT_NEAR(-way.y, kBelow, 1e-5f);
    EXPECT_NEAR(distance(place.to_room(place.to_world(Vec3{0.3f, -1, 2})), Vec3{0.3f, -1, 2}), 0, 1e-5f);
  }
}

TEST(Place, a_loupe_magnifies_about_the_field) {
  Place place;
  recenter(place, head_at({0, 1.6f, 0}, 0.3f, -0.4f));
  const Vec3 there = place.at;
  const Vec3 a = place.to_room(place.focus + Vec3{0.01f, 0, 0});
  ASSERT_TRUE(change_loupe(place, 1));
  ASSERT_TRUE(change_loupe(place, 1));
  EXPECT_EQ(place.loupe, 2);
  const Vec3 b = place.to_room(place.focus + Vec3{0.01f, 0, 0});
  EXPECT_NEAR(distance(place.to_room(place.focus), there), 0, 1e-6f) << "the field stays where it is";
  EXPECT_NEAR(distance(b, there), 2 * distance(a, there), 1e-6f);
  for (int i = 0; i < 10; ++i) change_loupe(place, 1);
  EXPECT_EQ(place.loupe, 4);
  EXPECT_FALSE(change_loupe(place, 1));
}

TEST(Place, the_table_stays_within_reach) {
  Place place;
  const Pose head = head_at({0, 1.7f, 0}, 0, 0);
  recenter(place, head);
  for (int i = 0; i < 1000; ++i) move_table(place, 0.01f, head);
  EXPECT_NEAR(place.at.y - head.p.y, kHighest, 1e-5f);
  recenter(place, head_at({0, 1.2f, 0}, 1, 0));  // seated
  EXPECT_NEAR(place.at.y - 1.2f, kHighest, 1e-5f) << "the height is kept";
}

// The two settings of the table are independent of each other and of where the wearer looks.
TEST(Place, the_reach_moves_the_field_ahead_of_the_wearer_and_is_kept) {
  Place place;
  place.focus = {0.1f, 0.2f, -0.3f};
  const Pose head = head_at({1, 1.6f, -2}, 2.5f, -0.5f);
  recenter(place, head);
  ASSERT_TRUE(move_reach(place, 0.1f));
  const Vec3 way = place.focus - place.to_world(head.p);
  EXPECT_NEAR(way.x, 0, 1e-5f);
  EXPECT_NEAR(-way.z, kAhead + 0.1f, 1e-5f);
  EXPECT_NEAR(-way.y, kBelow, 1e-5f);
  for (int i = 0; i < 100; ++i) move_reach(place, 0.01f);
  EXPECT_FALSE(move_reach(place, 0.01f));
  recenter(place, head_at({0, 1.2f, 0}, -1, 0));
  EXPECT_NEAR(std::hypot(place.at.x, place.at.z), kFarthest, 1e-5f) << "kept";
}

// The wearer's place changes only in a black frame, and never by a jump of brightness that a frame's time does not explain.
TEST(Comfort, a_fade_hides_every_change_of_place) {
  for (const float dt : {1.0f / 120, 1.0f / 45, 0.25f}) {
    Fade fade;
    int changes = 0, asked = 0;
    float before = fade.brightness, time = 0;
    for (int i = 0; i < 400; ++i) {
      if (fade.brightness == 1 && asked < 3) fade.out(), ++asked;
      if (fade.step(dt)) {
        ++changes;
        EXPECT_EQ(fade.brightness, 0);
      }
      EXPECT_LE(std::abs(fade.brightness - before), dt / std::min(kFadeOut, kFadeIn) + 1e-5f);
      before = fade.brightness, time += fade.brightness < 1 ? dt : 0;
    }
    EXPECT_EQ(asked, 3);
    EXPECT_EQ(changes, 3);
    EXPECT_EQ(fade.brightness, 1);
    if (dt < 0.1f) { EXPECT_NEAR(time, 3 * (kFadeOut + kFadeIn) + kFadeIn, 8 * dt); }
  }
}

// A result is carried around: the point in the hand stays in the hand, and the field stays level.
TEST(Place, a_carried_field_follows_the_hand) {
  Place place;
  place.focus = {0.01f, 0.02f, -0.03f};
  place.loupe = 2;
  recenter(place, head_at({0.3f, 1.6f, -1}, 0.4f, -0.5f));
  const Pose from{place.at + Vec3{0.05f, 0.02f, 0.1f}, axis_angle({1, 0, 0}, 0.2f)};
  const Pose to{from.p + Vec3{-0.1f, 0.03f, 0.2f}, normalized(axis_angle({0, 1, 0}, 0.7f) * from.q)};
  const Vec3 held = place.to_world(from.p), other = held + Vec3{0, 0.01f, 0};
  const float before = place.yaw;
  carry(place, from, to);
  EXPECT_LT(distance(place.to_world(to.p), held), 1e-5f);
  EXPECT_LT(distance(place.to_room(other) - to.p, {0, 0.02f, 0}), 1e-5f) << "up stays up";
  EXPECT_NEAR(before - place.yaw, 0.7f, 1e-4f);
}

// Text of 0.7 degrees a line is read without leaning forward; at the lowest table it stays above half a degree. No panel comes
// between the eyes and the field.
TEST(Boards, are_legible_and_never_over_the_field) {
  for (const float loupe : kLoupe)
    for (const float height : {-kBelow, kLowest, kHighest}) {
      Place place;
      place.focus = {0.1f, 0.05f, 0};
      place.height = height, place.loupe = loupe;
      const Pose head = head_at({0.2f, 1.5f, 0.3f}, 1.1f, -0.6f);
      recenter(place, head);
      EXPECT_LT(distance(eyes_at(place), head.p), 1e-4f);
      const float least = height == -kBelow ? 0.7f : 0.5f;
      const Board beside = board_at(place, place, true), above = board_at(place, place, false);
      const Board caption = caption_at(place, place, {250, 560, 1030, 710});
      if (loupe == 1)
        std::fprintf(
            stderr, "eyes %.2f m above the table: text %.2f, %.2f and %.2f degrees; %.0f and %.0f degrees from the field\n",
            static_cast<double>(-height), static_cast<double>(text_degrees(beside, place, place)),
            static_cast<double>(text_degrees(above, place, place)), static_cast<double>(text_degrees(caption, place, place)),
            static_cast<double>(degrees_from_field(beside, place, place)),
            static_cast<double>(degrees_from_field(caption, place, place)));
      for (const Board& b : {beside, above, caption}) EXPECT_GT(text_degrees(b, place, place), least) << height;
      EXPECT_GT(degrees_from_field(beside, place, place), 10) << height;
      EXPECT_GT(degrees_from_field(caption, place, place), 8) << height;
      EXPECT_LT(degrees_from_field(caption, place, place), 25) << "near the work";
    }
}

// Twice around the field, and back: the board shows its front, stands beyond the field, and moves in few steps.
TEST(Boards, of_results_stand_on_the_far_side_of_a_wearer_who_walks) {
  Place stand;
  stand.focus = {0.1f, 0.05f, 0};
  recenter(stand, head_at({0.2f, 1.5f, 0.3f}, 1.1f, -0.6f));
  int turn = 0, steps = 0;
  for (int i = -700; i <= 1400; ++i) {
    const float angle = 0.009f * static_cast<float>(std::abs(i));
    const Vec3 head = stand.at + Vec3{0.5f * std::sin(angle - stand.yaw), 0.4f, 0.5f * std::cos(angle - stand.yaw)};
    const int before = turn;
    const Board b = board_at(walked_stand(stand, turn, head), stand, false);
    steps += turn != before;
    const Vec3 eye = stand.to_world(head), to = b.pose.p - eye, field = stand.focus - eye;
    ASSERT_GT(dot(rotate(b.pose.q, {0, 0, 1}), normalized(-to)), 0.3f) << "its front, from " << angle;
    ASSERT_GT(std::hypot(to.x, to.z), std::hypot(field.x, field.z)) << "beyond the field, from " << angle;
  }
  EXPECT_LE(steps, 14) << "three turns of four quarters each, at most one more at each end";
}

TEST(SpaceHands, a_pinch_lies_between_the_finger_tips_and_closes_the_jaws) {
  // Right hand ahead of the wearer, palm to the left: thumb below the index finger.
  const auto fingers = [](float apart) {
    const Vec3 middle{0.2f, 1.2f, -0.4f};
    return Fingers{middle - Vec3{0, apart / 2, 0}, middle + Vec3{0, apart / 2, 0}, middle + Vec3{0, -0.03f, 0.07f},
                   middle + Vec3{0, 0.03f, 0.07f}};
  };
  HandState hand;
  pinch(fingers(0.055f), hand);
  EXPECT_TRUE(hand.tracked && hand.articulated);
  EXPECT_NEAR(hand.trigger, 0, 1e-5f);
  EXPECT_LT(distance(hand.grip.p, {0.2f, 1.2f, -0.4f}), 1e-6f);
  EXPECT_LT(distance(rotate(hand.grip.q, {0, 0, -1}), {0, 0, -1}), 1e-5f) << "from the knuckles ahead";
  EXPECT_LT(distance(rotate(hand.grip.q, {1, 0, 0}), {0, 1, 0}), 1e-5f) << "from thumb to index finger";
  const Pose open = hand.grip;
  pinch(fingers(0.0335f), hand);
  EXPECT_NEAR(hand.trigger, 0.5f, 1e-5f);
  pinch(fingers(0), hand);
  EXPECT_EQ(hand.trigger, 1);
  EXPECT_LT(length(rotation_vector(hand.grip.q * conjugate(open.q))), 1e-4f) << "closing does not turn the instrument";
}

TEST(Gaze, meets_the_first_tissue_in_the_direction_of_the_head) {
  const Still still;
  const Vec3 particle = still.seen.particle[0];
  Vec3 top = particle;  // the highest point of the tissue: nothing hides it from above
  for (size_t i = 0; i < still.picture.particle_rest.size(); ++i)
    if (still.seen.particle[i].y > top.y) top = still.seen.particle[i];
  const Pose head{top + Vec3{0, 0.4f, 0}, axis_angle({1, 0, 0}, -kPi / 2)};
  EXPECT_LT(distance(gaze_point(head, still.picture, still.seen), top), 0.003f);
  const Pose away{head.p, axis_angle({1, 0, 0}, kPi / 2)};
  EXPECT_NEAR(gaze_point(away, still.picture, still.seen).y - head.p.y, distance(head.p, still.picture.focus), 1e-4f)
      << "no tissue there: the distance of the field";
}

TEST(SpaceHands, the_instrument_lies_in_the_hand_at_any_magnification) {
  const Still still;
  for (const float loupe : {1.0f, 3.0f}) {
    Place place;
    place.focus = still.picture.focus;
    place.loupe = loupe;
    recenter(place, head_at({0, 1.6f, 0}, 0.7f, -0.3f));
    const Pose tool{still.picture.focus + Vec3{0.02f, 0.03f, 0.01f}, axis_angle(normalized(Vec3{1, 2, 3}), 0.8f)};
    SpaceHands hands;
    std::array<HandState, 2> state;
    state[1].tracked = true;
    state[1].grip = place.to_room(grip_of_tool(tool, false, loupe));
    state[1].trigger = 0.25f;
    SpaceHandOptions options;
    options.steady = false;
    const auto out = move(hands, state, place, options, still.seen, true, kDt, 5);
    ASSERT_TRUE(out[0].connected) << "the right hand has the needle holder";
    EXPECT_FALSE(out[1].connected) << "the left hand was never seen";
    EXPECT_LT(distance(out[0].pose.p, tool.p), 1e-5f);
    EXPECT_LT(length(rotation_vector(out[0].pose.q * conjugate(tool.q))), 1e-3f);
    EXPECT_NEAR(out[0].jaw, 0.75f, 1e-6f);
    options.left_handed = true;
    hands = {};
    const auto other = move(hands, state, place, options, still.seen, true, kDt, 5);
    EXPECT_TRUE(other[1].connected);
    EXPECT_FALSE(other[0].connected);
  }
}

TEST(SpaceHands, the_clutch_moves_the_hand_and_not_the_instrument) {
  const Still still;
  Place place;
  place.focus = still.picture.focus;
  recenter(place, head_at({0, 1.6f, 0}, 0, 0));
  SpaceHands hands;
  SpaceHandOptions options;
  options.steady = false;
  options.motion_scale = 0.5f;
  std::array<HandState, 2> state;
  HandState& right = state[1];
  right.tracked = true;
  right.grip = {place.at, {}};
  const Vec3 start = move(hands, state, place, options, still.seen, true, kDt, 0)[0].pose.p;
  right.grip.p += {0.04f, 0, 0};
  EXPECT_NEAR(move(hands, state, place, options, still.seen, true, kDt, 0)[0].pose.p.x - start.x, 0.02f, 1e-5f) << "half";
  right.clutch = true;
  right.grip.p -= {0.04f, 0, 0};
  const Vec3 held = move(hands, state, place, options, still.seen, true, kDt, 0)[0].pose.p;
  EXPECT_NEAR(held.x - start.x, 0.02f, 1e-5f) << "it stays";
  right.clutch = false;
  move(hands, state, place, options, still.seen, true, kDt, 0);
  right.grip.p += {0.04f, 0, 0};
  EXPECT_NEAR(move(hands, state, place, options, still.seen, true, kDt, 0)[0].pose.p.x - start.x, 0.04f, 1e-5f) << "further";
}

// The hand leaves the cameras' view with the needle in the jaws and comes back 10 cm away with the trigger released.
TEST(SpaceHands, a_hand_that_returns_drops_nothing_and_does_not_jump) {
  Still still;
  Place place;
  place.focus = still.picture.focus;
  recenter(place, head_at({0, 1.6f, 0}, 0, 0));
  SpaceHands hands;
  SpaceHandOptions options;
  std::array<HandState, 2> state;
  HandState& right = state[1];
  right.tracked = true;
  right.trigger = 1;
  right.grip = {place.at, {}};
  const Pose held = move(hands, state, place, options, still.seen, true, kDt, 0)[0].pose;
  still.seen.tool[0].held = Held::needle;
  right.tracked = false;
  for (int i = 0; i < 10; ++i) {
    const ToolInput in = move(hands, state, place, options, still.seen, true, kDt, 0)[0];
    EXPECT_TRUE(in.connected);
    EXPECT_EQ(in.pose, held);
    EXPECT_EQ(in.jaw, 0);
  }
  right.tracked = true;
  right.trigger = 0;
  right.grip.p += {0.1f, 0, 0};
  ToolInput back = move(hands, state, place, options, still.seen, true, kDt, 0)[0];
  EXPECT_LT(distance(back.pose.p, held.p), 1e-5f);
  EXPECT_EQ(back.jaw, 0) << "the trigger was released while nobody saw it";
  right.trigger = 1;
  move(hands, state, place, options, still.seen, true, kDt, 0);
  right.trigger = 0;
  EXPECT_EQ(move(hands, state, place, options, still.seen, true, kDt, 0)[0].jaw, 1) << "now it is meant";
  // Out of the session's focus: as untracked.
  right.grip.p += {0.1f, 0, 0};
  const Pose before = hands.hand[0].sent.pose;
  EXPECT_EQ(move(hands, state, place, options, still.seen, false, kDt, 0)[0].pose, before);
}

// A still hand with a tremor of 0.5 mm at 9 Hz, and one that moves at 0.3 m/s.
TEST(SpaceHands, the_filter_removes_tremor_and_does_not_delay_motion) {
  Steady filter;
  float most = 0;
  for (int i = 0; i < 360; ++i) {
    const float t = kDt * static_cast<float>(i);
    const float p = filter.filter({{0.0005f * std::sin(2 * kPi * 9 * t), 0, 0}, {}}, kDt).p.x;
    if (i > 90) most = std::max(most, std::abs(p));
  }
  EXPECT_LT(most, 0.00025f) << "less than half of it is left";
  filter = {};
  float lag = 0;
  for (int i = 0; i < 180; ++i) {
    const float x = 0.3f * kDt * static_cast<float>(i);
    lag = x - filter.filter({{x, 0, 0}, {}}, kDt).p.x;
  }
  EXPECT_LT(lag / 0.3f, 0.015f) << "[s] behind a moving hand";
}

TEST(Vibration, marks_puncture_contact_throw_and_a_strand_that_is_about_to_slip) {
  Still still;
  VibrationState state;
  const auto pulses = [&](std::vector<Event> events) { return vibration(state, events, still.seen, still.picture, kDt); };
  EXPECT_EQ(pulses({})[0].amplitude, 0);
  still.seen.tool[0].held = Held::needle;
  Event e;
  e.kind = EventKind::tip_entered;
  EXPECT_STREQ(pulses({e})[0].why, "puncture");
  EXPECT_EQ(pulses({e})[1].amplitude, 0) << "the other hand feels nothing";
  still.seen.tool[1].force = {0, 0.3f, 0};
  EXPECT_STREQ(pulses({})[1].why, "contact");
  EXPECT_EQ(pulses({})[1].amplitude, 0) << "once per contact";
  still.seen.tool[1].force = {};
  pulses({});
  still.seen.tool[1].force = {0, 0.3f, 0};
  EXPECT_STREQ(pulses({})[1].why, "contact");
  e.kind = EventKind::throw_locked;
  EXPECT_STREQ(pulses({e})[0].why, "throw");
  SutureView& suture = still.seen.suture[0];
  ASSERT_FALSE(suture.thread_tension.empty());
  suture.thread_tension.back() = 100;
  int count = 0;
  for (int i = 0; i < 90; ++i) count += pulses({})[0].amplitude > 0;
  EXPECT_GE(count, 5);
  EXPECT_LE(count, 10) << "a train of pulses, not a hum";
  suture.thread_tension.back() = 0.01f;
  EXPECT_EQ(pulses({})[0].amplitude, 0);
}

// Five touches with half a millimeter of error: the field is found again, and the residual states that error.
TEST(Register, finds_the_arms_from_five_touches_and_states_the_residual) {
  Place truth;
  truth.focus = {0, 0.02f, 0.01f};
  truth.at = {0.4f, 0.95f, -1.2f};
  truth.yaw = 2.1f;
  truth.loupe = 1.5f;
  std::mt19937 random(7);
  std::normal_distribution<float> error(0, 0.0005f);
  std::vector<Vec3> room, world;
  for (const Vec3 p : {Vec3{0, 0, 0}, {0.06f, 0, 0}, {-0.06f, 0.01f, 0}, {0, 0.03f, 0.06f}, {0, 0, -0.06f}}) {
    world.push_back(truth.focus + p);
    room.push_back(truth.to_room(world.back()) + Vec3{error(random), error(random), error(random)});
  }
  Place start;
  start.focus = truth.focus;
  const ArmFit fit = fit_arms(room, world, start);
  ASSERT_TRUE(fit.valid);
  EXPECT_TRUE(is_plausible(fit));
  EXPECT_NEAR(fit.place.yaw, truth.yaw, 0.02f);
  EXPECT_NEAR(fit.place.loupe, truth.loupe, 0.03f);
  EXPECT_LT(distance(fit.place.at, truth.at), 0.001f);
  EXPECT_GT(fit.rms, 0.0003f);
  EXPECT_LT(fit.rms, 0.0015f);
  // One point was touched 3 cm beside the stylus.
  room[2] += {0, 0, 0.03f};
  EXPECT_FALSE(is_plausible(fit_arms(room, world, start)));
  EXPECT_FALSE(fit_arms(std::span(room).first(2), std::span(world).first(2), start).valid)
      << "two points leave the rotation free";
  const std::vector<Vec3> same(4, room[0]);
  EXPECT_FALSE(fit_arms(same, std::vector<Vec3>(4, world[0]), start).valid);
}

TEST(Register, is_kept_per_room) {
  const std::filesystem::path folder = std::filesystem::path(testing::TempDir()) / "catgut_rooms";
  const std::string file = (folder / "rooms.toml").string();
  std::filesystem::remove_all(folder);
  EXPECT_EQ(load_room(file, "a").height, -kBelow);
  RoomSettings a, b;
  a.height = -0.3f;
  a.reach = 0.5f;
  a.arms = Place{};
  a.arms->at = {1, 2, 3};
  a.arms->yaw = 0.25f;
  a.arms_rms = 0.0012f;
  b.loupe = 2;
  save_room(file, "a", a);
  save_room(file, "b", b);
  const RoomSettings again = load_room(file, "a");
  EXPECT_NEAR(again.height, -0.3f, 1e-5f);
  ASSERT_TRUE(again.arms.has_value());
  EXPECT_LT(distance(again.arms->at, {1, 2, 3}), 1e-4f);
  EXPECT_NEAR(again.arms->yaw, 0.25f, 1e-4f);
  EXPECT_NEAR(again.arms_rms, 0.0012f, 1e-5f);
  EXPECT_FALSE(load_room(file, "b").arms.has_value());
  EXPECT_EQ(load_room(file, "b").loupe, 2);
  EXPECT_NEAR(again.reach, 0.5f, 1e-5f);
  std::ofstream(file) << "no [toml";
  EXPECT_ANY_THROW(load_room(file, "a"));
  std::filesystem::remove_all(folder);
}

TEST(Late, is_a_picture_after_its_display_time_or_after_a_gap) {
  constexpr double kPeriod = 1.0 / 90;
  EXPECT_FALSE(is_late(1.009, 1.010, kPeriod, kPeriod));
  EXPECT_TRUE(is_late(1.011, 1.010, kPeriod, kPeriod));
  EXPECT_TRUE(is_late(1.009, 1.010, 2 * kPeriod, kPeriod)) << "one period was left out";
}

TEST(Resolution, falls_with_late_frames_and_recovers) {
  Resolution r;
  for (int i = 0; i < 30; ++i) r.note(0.012f, 0.011f);
  EXPECT_EQ(r.part, 0.5f);
  for (int i = 0; i < 90 * 20; ++i) r.note(0.003f, 0.011f);
  EXPECT_EQ(r.part, 1.0f);
}

}  // namespace
}  // namespace catgut::xr
#endif
