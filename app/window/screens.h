// SPDX-License-Identifier: Apache-2.0
// app/window: which screens there are, what can be chosen on them, and what a key chooses. Pure: plain data in and out; a
// caller that owns the window carries the choices out.
#pragma once
#include <cstddef>
#include <cstdint>
#include <string>

#include "window/input.h"

namespace catgut {

enum class Screen { start, settings, practice, pause, results, view };
const char* screen_name(Screen screen);

enum class Chosen {
  nothing,
  scene,  // which: of the list
  teach,
  show_me,    // the surgeon shows the step of the lesson
  recording,  // text: its path
  settings,
  leave_settings,
  resume,
  pause,
  single_step,
  take_back,
  restart,
  finish,
  slower,
  faster,
  start_screen,
  save_json,
  change,        // text: a parameter, as in --set
  play_or_hold,  // of a recording
  go_to,         // which: tick of the recording
  go_by,         // by: so many ticks
  speed,         // of: real time
  sewn,          // what a recording's hands have sutured
  leave_results,
  points,
  hints,
  help_at_needle,
  next_instrument,
  park,
  arms_off,  // no force to haptic arms, or again
  developer,
  picture,
  quit,
};

struct Choice {
  Chosen what = Chosen::nothing;
  size_t which = 0;
  std::string text{};
  int64_t by = 0;
  float of = 1;
};

// What a key's meaning depends on.
struct ScreenFacts {
  Screen screen = Screen::start;
  bool fault = false;           // the simulation has stopped
  size_t scenes = 0;            // that can be chosen
  bool from_recording = false;  // results are of one
  int64_t second = 60;          // ticks of the recording
};
Choice choice_of_key(const WindowInput& in, const ScreenFacts& facts);

}  // namespace catgut
