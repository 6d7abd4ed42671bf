// SPDX-License-Identifier: Apache-2.0
// tests/hands: the same stitch in the window itself, by events of the X server or of a virtual gamepad (at_the_window.h).
// Checks events, never pixels.
#ifdef CATGUT_TESTS_WINDOW
#include <gtest/gtest.h>

#include <cstdlib>

#include "at_the_window.h"
#include "procedure/procedure_file.h"
#include "window/hands.h"

namespace catgut {
namespace {

constexpr float kDt = 1.0f / 60;  // [s]

// Three attempts: hands that depend on frame timing are not deterministic. lesson_runs_test counts first tries.
void sew_and_tie(AtTheWindow& desk, std::string& stopped_at, int throws, bool cut = false) {
  for (int attempt = 0; attempt < 3; ++attempt) {
    Person me(desk);
    if (sew_and_tie_once(desk, me, throws, cut)) return stopped_at.clear();
    stopped_at = me.doing();
    std::fprintf(stderr, "again: %s\n", me.doing().c_str());
    desk.begin_again();
    if (!desk.restarted()) return;
  }
}

void expect_a_stitch(AtTheWindow& desk, const std::string& stopped_at) {
  EXPECT_TRUE(stopped_at.empty()) << stopped_at;
  EXPECT_GE(desk.count(EventKind::needle_grasped), 3u);
  EXPECT_GE(desk.count(EventKind::bite_completed), 2u);
  EXPECT_GE(desk.count(EventKind::particle_passed), 10u) << "thread was pulled through";
  EXPECT_GE(desk.count(EventKind::seam_closed), 1u);
  EXPECT_GE(desk.count(EventKind::loop_formed), 1u);
  EXPECT_GE(desk.count(EventKind::throw_started), 1u);
  EXPECT_GE(desk.count(EventKind::throw_locked), 1u);
}

// `play --stage`: the scripted surgeon has left the needle in the needle holder.
TEST(WindowHands, jaws_that_hold_something_stay_closed_when_a_later_stage_begins) {
  const SceneSpec scene = read_scene("skin");
  const auto model = build_model(scene);
  const PictureModel picture = picture_model(*model);
  Snapshot seen;
  publish(*model, *initial_state(*model), seen);
  seen.tool[0].held = Held::needle, seen.tool[0].jaw = 0;
  seen.tool[0].pose = seen.tool[0].hand = {{0.05f, 0.06f, 0.02f}, {}};
  WindowHands hands;
  const auto tick = hands.begin(scene, {});
  const ViewFrame view = view_frame({0, 0.3f, 0.3f}, {}, {0, 1, 0}, 30, 720);
  std::array<ToolInput, 2> out;
  for (int i = 0; i < 3; ++i) {
    out = tick({picture, seen, kDt, 1, false});
    hands.move({}, {}, view, seen, {}, kDt, 1);
  }
  ASSERT_TRUE(out[0].connected);
  EXPECT_EQ(out[0].jaw, 0);
  EXPECT_LT(distance(out[0].pose.p, seen.tool[0].pose.p), 0.001f);
}

// With the lesson open: follows its instructions to the end of the first bite, twice as fast as real time. The rest needs most
// of a minute: by_mouse_and_keyboard_to_the_end, and without a window stitch_test and lesson_test.
TEST_F(StitchAtTheWindow, by_mouse_and_keyboard) {
  XMouse desk(x_->display, 120, 2);
  if (!desk.ready()) GTEST_SKIP() << "no XTest here";
  Person me(desk);
  bool bitten = false;
  desk.sit([&] { bitten = me.take_needle() && me.bite() && me.hand_back() && me.bite() && me.pull_tail(0.08f); }, true);
  EXPECT_TRUE(bitten) << me.doing();
  EXPECT_GE(desk.count(EventKind::needle_grasped), 2u);
  EXPECT_EQ(desk.count(EventKind::bite_completed), 2u);
  EXPECT_GE(desk.count(EventKind::particle_passed), 10u) << "thread was pulled through";
  const std::vector<size_t>& went = desk.lesson_went();
  ASSERT_GE(went.size(), 5u);
  EXPECT_EQ(std::vector<size_t>(went.begin(), went.begin() + 5), (std::vector<size_t>{0, 1, 2, 3, 4})) << "stage by stage";
}

TEST_F(StitchAtTheWindow, by_mouse_and_keyboard_to_the_end) {
  if (!std::getenv("CATGUT_LONG")) GTEST_SKIP() << "set CATGUT_LONG=1";
  XMouse desk(x_->display, 480);
  if (!desk.ready()) GTEST_SKIP() << "no XTest here";
  std::string stopped_at = "nothing was done";
  desk.sit([&] { sew_and_tie(desk, stopped_at, 2, true); }, true);
  expect_a_stitch(desk, stopped_at);
  const std::vector<size_t>& went = desk.lesson_went();
  ASSERT_FALSE(went.empty());
  EXPECT_EQ(went.front(), 0u);
  EXPECT_EQ(went.back(), read_procedure("first_stitch").stage.size()) << "all of it is done";
  EXPECT_GE(went.size(), 6u) << "step by step; some are done in one movement";
}

// "Show me", then the learner's turn: the demonstration is undone, and the learner's actions are recognized.
TEST_F(StitchAtTheWindow, a_lesson_shows_a_step_and_sees_it_done) {
  XMouse desk(x_->display, 180);
  if (!desk.ready()) GTEST_SKIP() << "no XTest here";
  Person me(desk);
  bool shown = false, undone = false, taken = false;
  size_t before = 99, after = 0, grasped = 0;
  desk.sit(
      [&] {
        const Vec3 lay = desk.look().seen.active().needle.pose.p;
        before = desk.lesson_step();
        desk.until_reading();
        desk.press("s");
        shown = desk.until_showing(true) && desk.until_showing(false);
        grasped = desk.count(EventKind::needle_grasped);
        undone = desk.look().seen.tool[0].held == Held::nothing &&
                 distance(desk.look().seen.active().needle.pose.p, lay) < 0.001f && desk.lesson_step() == 0;
        taken = me.take_needle();
        for (int i = 0; i < 5; ++i) desk.act({});
        after = desk.lesson_step();
      },
      true);
  EXPECT_EQ(before, 0u);
  EXPECT_TRUE(shown);
  EXPECT_EQ(grasped, 0u) << "the surgeon took it: that is not the learner's event";
  EXPECT_TRUE(undone);
  EXPECT_TRUE(taken) << me.doing();
  EXPECT_EQ(after, 1u);
}

// Half a minute, so for the nightly tests. Every time: by_mouse_and_keyboard through the same window, a bite by a virtual
// gamepad below, and the whole stitch by gamepad without a window (stitch_test).
TEST_F(StitchAtTheWindow, by_gamepad) {
  if (!std::getenv("CATGUT_LONG")) GTEST_SKIP() << "set CATGUT_LONG=1";
  SdlPad desk(480);
  std::string stopped_at = "no virtual joysticks in this SDL";
  desk.sit([&] {
    if (desk.plug_in()) sew_and_tie(desk, stopped_at, 1);
  });
  expect_a_stitch(desk, stopped_at);
}

// The gamepad is unplugged while the needle is held. The hands stay, the needle is not dropped; after plugging it in again
// the bite is completed.
TEST_F(StitchAtTheWindow, a_gamepad_that_is_unplugged_loses_nothing) {
  SdlPad desk(180);
  Person me(desk);
  bool held = false, kept = false, finished = false;
  desk.sit([&] {
    held = desk.plug_in() && me.take_needle();
    if (!held) return;
    const size_t released = desk.count(EventKind::needle_released);
    const Vec3 at = desk.look().seen.tool[0].pose.p;
    const bool paused = desk.pull_out();
    for (int i = 0; i < 10; ++i) desk.act({});
    kept = paused && desk.look().seen.tool[0].held == Held::needle && desk.count(EventKind::needle_released) == released &&
           distance(desk.look().seen.tool[0].pose.p, at) < 0.01f;
    if (!desk.plug_in()) return;
    for (int i = 0; i < 5; ++i) desk.act({});
    kept = kept && desk.count(EventKind::needle_released) == released;
    finished = me.bite();
  });
  EXPECT_TRUE(held) << me.doing();
  EXPECT_TRUE(kept);
  EXPECT_TRUE(finished) << me.doing();
}

// D-pad up: the next instrument of the tray into the hand, and what was in it onto the tray; again, and they are back.
TEST_F(StitchAtTheWindow, a_hand_swaps_its_instrument_by_gamepad) {
  SdlPad desk(120, "three_hands");
  std::vector<std::string> had;
  const auto in_hand = [&] {
    const int i = desk.look().seen.tool[0].instrument;
    return i < 0 ? std::string("nothing") : desk.picture().instrument[static_cast<size_t>(i)].kind;
  };
  desk.sit([&] {
    if (!desk.plug_in()) return;
    had.push_back(in_hand());
    for (int swap = 0; swap < 2; ++swap) {
      desk.tap(SDL_CONTROLLER_BUTTON_DPAD_UP);
      for (int i = 0; i < 200 && in_hand() == had.back() && desk.act({}); ++i) continue;
      had.push_back(in_hand());
    }
  });
  EXPECT_EQ(had, (std::vector<std::string>{"needle_holder", "scissors", "needle_holder"}));
  EXPECT_EQ(desk.count(EventKind::instrument_taken), 2u);
}

}  // namespace
}  // namespace catgut
#endif
