// SPDX-License-Identifier: Apache-2.0
// app/window: a user's settings, and the small TOML file that stores them.
#pragma once
#include <string>

#include "render/renderer.h"

namespace catgut {

// Amount of guidance during a session.
enum class Guidance {
  learn,     // shows the needle's target path, suture points and keys
  practice,  // events appear as messages
  exam,      // no messages and no help until the end
};

// Feedback on the quality of the work during a session. An exam is always silent.
enum class FeedbackLevel {
  silent,  // nothing before the results
  stitch,  // remarks after every stitch and throw
  live,    // and the numbers of the moment with their bands
};

struct Settings {
  Quality quality = Quality::low;
  Guidance guidance = Guidance::practice;
  FeedbackLevel feedback = FeedbackLevel::stitch;
  bool left_handed = false;    // the needle holder is in the left hand
  bool hold_to_close = false;  // the jaw closes only while the button is pressed
  bool assist = true;          // an open jaw snaps to the needle
  bool suture_points = false;
  bool hints = true;                      // the list of keys
  bool sound = true;                      // tone of an active pen
  bool inset = true;                      // magnifies the needle's tip where the resolution has been lowered
  float mouse_speed = 1;                  // 0.2 .. 4, of tool to mouse
  bool steady_hands = true;               // headset: removes the tremor of the wearer's hands
  float hand_scale = 1;                   // headset: 0.2 .. 1, of tool to hand
  float text_size = 1;                    // 0.7 .. 2, limited by the window
  bool record = true;                     // every session, into the data folder
  std::string data_folder;                // empty: of the user, see window/data_folder.h
  std::string language;                   // of languages/; empty: of the environment
  float force_right = 1, force_left = 1;  // 0.2 .. 2, gain of the haptic force in each hand; the device's limits hold after it
  std::string trainee;                    // pseudonym under which sessions are stored; empty: they are not
  std::string survey;                     // questionnaire that is asked after a session, a name or a path; empty: none
  bool operator==(const Settings&) const = default;
};
bool is_pseudonym(const std::string& text);      // letters, digits, dot, dash, underscore; 1 to 64
const char* quality_name(Quality quality);       // "low", "medium", "high"
const char* guidance_name(Guidance guidance);    // "learn", "practice", "exam"
const char* feedback_name(FeedbackLevel level);  // "silent", "stitch", "live"

// Throws InputError (file:line, error, remedy) for invalid TOML, unknown keys and values out of range.
Settings parse_settings(const std::string& text, const std::string& name);
std::string settings_text(const Settings& settings);  // parse_settings gives the same back

struct LoadedSettings {
  Settings settings;   // defaults if the file could not be read
  std::string fault;   // one line, naming the file; empty: none, also if there is no file yet
  bool first = false;  // there is no file yet
};
LoadedSettings load_settings(const std::string& path);

// The file is complete, or unchanged: written beside and renamed. An invalid file is kept as FILE.bad. Throws
// InputError where it cannot be written.
void save_settings(const Settings& settings, const std::string& path);

std::string settings_path();  // $XDG_CONFIG_HOME/catgut/settings.toml, or ~/.config/...; empty: the user has no home directory

}  // namespace catgut
