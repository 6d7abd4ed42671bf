// SPDX-License-Identifier: Apache-2.0
// tests/app: from SDL events to the input of hands and panels. Events are pushed into SDL's own queue, and the gamepad
// is one of SDL's virtual ones: no display is needed.
#ifdef CATGUT_TESTS_WINDOW
#include <SDL.h>
#include <gtest/gtest.h>
#include <imgui.h>

#include "window/input.h"
#include "window/words.h"

namespace catgut {
namespace {

class WindowEventsTest : public testing::Test {
 protected:
  void SetUp() override {
    SDL_SetHint(SDL_HINT_VIDEODRIVER, "dummy");
    if (SDL_Init(SDL_INIT_VIDEO | SDL_INIT_GAMECONTROLLER) != 0) GTEST_SKIP() << "SDL does not start here: " << SDL_GetError();
    ImGui::CreateContext();
    started_ = true;
  }
  void TearDown() override {
    events_.reset();
    if (started_) ImGui::DestroyContext();
    SDL_Quit();
  }
  static void key(SDL_Keycode code, SDL_Scancode scan, bool down) {
    SDL_Event e{};
    e.type = down ? SDL_KEYDOWN : SDL_KEYUP;
    e.key.keysym.sym = code;
    e.key.keysym.scancode = scan;
    SDL_PushEvent(&e);
  }
  static void button(uint8_t which, bool down) {
    SDL_Event e{};
    e.type = down ? SDL_MOUSEBUTTONDOWN : SDL_MOUSEBUTTONUP;
    e.button.button = which;
    SDL_PushEvent(&e);
  }
  static void motion(int x, int y) {
    SDL_Event e{};
    e.type = SDL_MOUSEMOTION;
    e.motion.xrel = x, e.motion.yrel = y;
    SDL_PushEvent(&e);
  }
  WindowInput read(bool working = true) { return events_->read(working, 0.1f); }

  bool started_ = false;
  std::unique_ptr<WindowEvents> events_ = std::make_unique<WindowEvents>();
};

TEST_F(WindowEventsTest, motions_add_up_and_buttons_are_kept) {
  motion(3, 4), motion(5, -1);
  button(SDL_BUTTON_RIGHT, true);
  WindowInput in = read();
  EXPECT_EQ(in.mouse.right, 8);
  EXPECT_EQ(in.mouse.down, 3);
  EXPECT_TRUE(in.mouse.turn);
  EXPECT_GT(in.moved_ns, 0u);
  in = read();
  EXPECT_EQ(in.mouse.right, 0);
  EXPECT_TRUE(in.mouse.turn) << "until it comes up";
  button(SDL_BUTTON_RIGHT, false), button(SDL_BUTTON_MIDDLE, true), motion(10, 0);
  in = read();
  EXPECT_FALSE(in.mouse.turn);
  EXPECT_EQ(in.mouse.right, 0) << "the middle button looks round";
  EXPECT_NE(in.orbit_right, 0);
}

TEST_F(WindowEventsTest, what_came_and_went_between_two_pictures_is_not_lost) {
  button(SDL_BUTTON_LEFT, true), button(SDL_BUTTON_LEFT, false);
  key(SDLK_c, SDL_SCANCODE_C, true), key(SDLK_c, SDL_SCANCODE_C, false);
  WindowInput in = read();
  EXPECT_EQ(in.mouse.jaw_presses, 1);
  EXPECT_FALSE(in.mouse.jaw_down);
  EXPECT_TRUE(in.mouse.cut);
  EXPECT_FALSE(read().mouse.cut);
  button(SDL_BUTTON_LEFT, true), button(SDL_BUTTON_LEFT, false);
  EXPECT_EQ(read(false).mouse.jaw_presses, 0) << "a click on a panel is no jaw";
  EXPECT_TRUE(ImGui::GetIO().MouseDown[0]);
  read(false);
  EXPECT_TRUE(ImGui::GetIO().MouseDown[0]) << "until the panels have seen it";
  events_->panels_drawn();
  read(false);
  EXPECT_FALSE(ImGui::GetIO().MouseDown[0]);
}

TEST_F(WindowEventsTest, keys) {
  key(SDLK_TAB, SDL_SCANCODE_TAB, true), key(SDLK_3, SDL_SCANCODE_3, true), key(SDLK_e, SDL_SCANCODE_E, true);
  WindowInput in = read();
  EXPECT_EQ(in.mouse.hand_changes, 1);
  EXPECT_EQ(in.speed, 2);
  EXPECT_EQ(in.digit, 3);
  EXPECT_EQ(in.mouse.roll, 1);
  EXPECT_FALSE(in.mouse.both);
  key(SDLK_w, SDL_SCANCODE_W, true);
  EXPECT_TRUE(read().mouse.both);
  EXPECT_TRUE(read().mouse.both) << "until it comes up";
  SDL_Event e{};
  e.type = SDL_WINDOWEVENT;
  e.window.event = SDL_WINDOWEVENT_FOCUS_LOST;
  SDL_PushEvent(&e);
  in = read();
  EXPECT_TRUE(in.left);
  EXPECT_FALSE(in.mouse.both);
  EXPECT_EQ(in.mouse.roll, 0) << "a key that comes up elsewhere is not held here for ever";
  key(SDLK_BACKSPACE, SDL_SCANCODE_BACKSPACE, true);
  EXPECT_EQ(read().key, Key::take_back);
}

TEST_F(WindowEventsTest, two_keys_between_two_slow_frames_are_both_reported) {
  key(SDLK_h, SDL_SCANCODE_H, true), key(SDLK_h, SDL_SCANCODE_H, false), key(SDLK_F2, SDL_SCANCODE_F2, true);
  EXPECT_EQ(read().key, Key::help_at_needle);
  EXPECT_EQ(read().key, Key::settings);
  EXPECT_EQ(read().key, Key::none);
}

TEST_F(WindowEventsTest, a_window_that_is_hidden_or_minimised_is_left) {
  for (const uint8_t what : {SDL_WINDOWEVENT_MINIMIZED, SDL_WINDOWEVENT_HIDDEN}) {
    button(SDL_BUTTON_LEFT, true);
    EXPECT_TRUE(read().mouse.jaw_down);
    SDL_Event e{};
    e.type = SDL_WINDOWEVENT;
    e.window.event = what;
    SDL_PushEvent(&e);
    const WindowInput in = read();
    EXPECT_TRUE(in.left);
    EXPECT_FALSE(in.mouse.jaw_down);
  }
}

TEST_F(WindowEventsTest, a_recording_is_looked_at_from_all_sides) {
  button(SDL_BUTTON_LEFT, true), motion(10, 0);
  WindowInput in = events_->read(false, 0.1f, true);
  EXPECT_NE(in.orbit_right, 0) << "dragged where no panel is";
  EXPECT_EQ(in.mouse.right, 0);
  button(SDL_BUTTON_LEFT, false), motion(10, 0);
  EXPECT_EQ(events_->read(false, 0.1f, true).orbit_right, 0) << "not dragged";
  ImGui::GetIO().WantCaptureMouse = true;
  button(SDL_BUTTON_LEFT, true), motion(10, 0);
  EXPECT_EQ(events_->read(false, 0.1f, true).orbit_right, 0) << "a panel has the mouse";
  key(SDLK_LEFT, SDL_SCANCODE_LEFT, true), key(SDLK_LEFT, SDL_SCANCODE_LEFT, true);
  EXPECT_EQ(read(false).arrow_presses, -2);
}

TEST_F(WindowEventsTest, a_gamepad_comes_works_and_goes) {
  // SDL's own layout for virtual pads: six axes and fifteen buttons in the order of SDL_GameControllerAxis and -Button.
  const int index =
      SDL_JoystickAttachVirtual(SDL_JOYSTICK_TYPE_GAMECONTROLLER, SDL_CONTROLLER_AXIS_MAX, SDL_CONTROLLER_BUTTON_MAX, 1);
  if (index < 0) GTEST_SKIP() << "no virtual joysticks in this SDL: " << SDL_GetError();
  read();
  WindowInput in = read();
  ASSERT_TRUE(in.has_pad);
  EXPECT_FALSE(events_->pad_name().empty());
  SDL_Joystick* stick = SDL_JoystickOpen(index);
  ASSERT_NE(stick, nullptr);
  SDL_JoystickSetVirtualAxis(stick, SDL_CONTROLLER_AXIS_LEFTX, 32767);
  SDL_JoystickSetVirtualAxis(stick, SDL_CONTROLLER_AXIS_RIGHTY, -32767);
  SDL_JoystickSetVirtualButton(stick, SDL_CONTROLLER_BUTTON_RIGHTSHOULDER, SDL_PRESSED);
  SDL_JoystickSetVirtualButton(stick, SDL_CONTROLLER_BUTTON_START, SDL_PRESSED);
  SDL_JoystickSetVirtualButton(stick, SDL_CONTROLLER_BUTTON_B, SDL_PRESSED);
  read();  // SDL updates a virtual stick when events are polled
  in = read();
  EXPECT_NEAR(in.pad.left.x, 1, 1e-3f);
  EXPECT_NEAR(in.pad.right.y, -1, 1e-3f);
  EXPECT_TRUE(in.pad.right.shoulder);
  EXPECT_TRUE(in.pad.both);
  EXPECT_FALSE(in.pad.left.shoulder);
  SDL_JoystickClose(stick);
  SDL_JoystickDetachVirtual(index);
  const bool gone = read().pad_gone;
  in = read();
  EXPECT_TRUE(gone || in.pad_gone) << "the session pauses";
  EXPECT_FALSE(in.has_pad);
  EXPECT_TRUE(events_->pad_name().empty());
}

TEST(Words, every_event_has_a_text_or_is_left_out_on_purpose) {
  size_t messages = 0;
  for (size_t k = 0; k < static_cast<size_t>(EventKind::count_); ++k) {
    Event e;
    e.kind = static_cast<EventKind>(k);
    bool bad = false;
    messages += !words_for(e, bad).empty();
    EXPECT_EQ(event_json(e).find('\n'), std::string::npos);
  }
  EXPECT_GE(messages, 25u);
  Event slipped;
  slipped.kind = EventKind::needle_released;
  bool bad = true;
  EXPECT_EQ(words_for(slipped, bad), "needle released by needle holder");
  EXPECT_FALSE(bad);
  slipped.value = 3.2f;
  EXPECT_EQ(words_for(slipped, bad), "needle slipped from needle holder at 3.2 N");
  EXPECT_TRUE(bad);
}

TEST(Words, an_exit_of_the_same_bite_is_shown_once) {
  const auto event = [](EventKind kind, uint32_t bite, uint16_t suture) {
    Event e;
    e.kind = kind, e.which = bite, e.suture = suture;
    return e;
  };
  const EventKind in = EventKind::tip_entered, out = EventKind::tip_exited;
  const std::vector<Event> events{event(in, 3, 0), event(out, 3, 0), event(out, 0, 1), event(out, 3, 0),
                                  event(in, 4, 0), event(out, 4, 0), event(in, 3, 0),  event(out, 3, 0)};
  std::vector<bool> repeated;
  for (size_t i = 0; i < events.size(); ++i) repeated.push_back(repeated_exit(events, i));
  EXPECT_EQ(repeated, (std::vector<bool>{false, false, false, true, false, false, false, false}));
}

}  // namespace
}  // namespace catgut
#endif
