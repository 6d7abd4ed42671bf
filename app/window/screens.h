// SPDX-License-Identifier: Apache-2.0
// app/window: the screens, their choices, and the meaning of keys on them. Pure: plain data in and out; the
// owner of the window carries the choices out.
#pragma once
#include <cstddef>
#include <cstdint>
#include <string>

#include "window/input.h"

namespace catgut {

enum class Screen { start, settings, practice, pause, results, view, survey };
const char* screen_name(Screen screen);

enum class Chosen {
  nothing,
  scene,  // which: of the list
  teach,
  begin_stage,  // the new stage of a tutorial was read
  record,       // starts or stops it
  show_me,      // demonstration of the stage, or its end
  recording,    // text: its path
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
  moment,        // text: a recording, which: tick of the session to play
  survey,        // the questionnaire is opened
  keep_answers,  // and its answers are stored, or
  leave_survey,  // not
  points,
  hints,
  help_at_needle,
  next_instrument,  // which: as WindowInput::digit
  park,             // likewise
  arms_off,         // switches force of haptic devices off, or on
  developer,
  headset,  // connects to one, or leaves it
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

// Context of a key's meaning.
struct ScreenFacts {
  Screen screen = Screen::start;
  bool fault = false;           // the simulation has stopped
  bool reading = false;         // time stands still at a new stage
  size_t scenes = 0;            // number of scenes in the list
  bool from_recording = false;  // results are from a recording
  int64_t second = 60;          // ticks of the recording
};
Choice choice_of_key(const WindowInput& in, const ScreenFacts& facts);

}  // namespace catgut
