// SPDX-License-Identifier: Apache-2.0
// app/window: the window's events as plain data: for the hands, for the camera, for the panels, for the screens. The
// only file beside window.cpp that uses SDL.
#pragma once
#include <SDL.h>

#include <cstdint>
#include <deque>
#include <string>
#include <utility>

#include "device/gamepad.h"
#include "device/mouse.h"

namespace catgut {

// Keys that are reported once per press.
enum class Key {
  none,
  escape,
  enter,
  pause,
  single_step,
  take_back,
  restart,
  slower,
  faster,
  points,
  hints,
  help_at_needle,
  next_instrument,  // from the tray into the active hand; from a gamepad, see kFromPad
  park,             // parks the hand's clamp, lays down its instrument, or takes a parked one
  arms_off,
  finish,
  digit,
  picture,
  settings,
  developer,
  save,
  space,
  step_back,
  show_me,
  teach,
  record
};

// WindowInput::digit of a gamepad's button: which shoulder buttons were pressed with it.
constexpr int kFromPad = 1, kLeftShoulder = 2, kRightShoulder = 4;

struct WindowInput {
  MouseInput mouse;
  GamepadInput pad;
  bool has_pad = false;
  float orbit_right = 0, orbit_up = 0, closer = 0;  // of the camera, see turn_orbit
  bool camera_home = false;
  int clamps = 0;                // F4 held: the assistant brings the clamped ends together, +1; F6: draws them apart, -1
  PenMode pedal = PenMode::off;  // that is held down: F7 cut, F8 coagulate; a footswitch sends these keys
  int speed = -1;                // of kMouseSpeeds, when a speed key was pressed
  Key key = Key::none;           // one per call: two presses between two frames are reported in sequence
  int digit = 0;
  int arrow_presses = 0;  // right minus left, repeats included
  bool any = false;       // a key, a button, a motion
  bool quit = false, resized = false;
  bool left = false;      // the window lost the focus, or was hidden
  bool pad_gone = false;  // the used gamepad was unplugged
  uint64_t moved_ns = 0;  // on the clock of runtime/live: time of the newest motion
};

class WindowEvents {
 public:
  WindowEvents() = default;
  ~WindowEvents();
  WindowEvents(const WindowEvents&) = delete;
  WindowEvents& operator=(const WindowEvents&) = delete;

  // Everything since the last call. working: the mouse controls the hands, else the panels (ImGui's context is fed), and
  // with look_round the camera, where no panel is below it.
  WindowInput read(bool working, float dt, bool look_round = false);
  void panels_drawn() { clicked_ = false; }  // clicks were processed
  const std::string& pad_name() const { return pad_name_; }

 private:
  void key(const SDL_KeyboardEvent& e, WindowInput& in);
  static bool edit_text(const SDL_KeyboardEvent& e);
  void read_pad(GamepadInput& pad) const;
  int shoulders() const;

  std::deque<std::pair<Key, int>> keys_;  // with the digit, not reported yet
  SDL_GameController* pad_ = nullptr;
  std::string pad_name_;
  bool clicked_ = false;  // the left button was pressed since the panels were last drawn
  bool left_ = false, right_ = false, middle_ = false, space_ = false, cut_ = false, fresh_ = false;
  bool roll_left_ = false, roll_right_ = false, both_ = false, cut_pedal_ = false, coagulate_pedal_ = false;
  bool together_ = false, apart_ = false;
  int arrow_x_ = 0, arrow_y_ = 0, zoom_ = 0;
};

}  // namespace catgut
