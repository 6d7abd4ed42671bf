// SPDX-License-Identifier: Apache-2.0
// app/window: what a person has set, and the small TOML file that keeps it from one day to the next.
#pragma once
#include <string>

#include "render/renderer.h"

namespace catgut {

// How much the program says while a user sews.
enum class Guidance {
  learn,     // the way that the needle should go, suture points and keys are shown
  practice,  // events appear as messages
  exam,      // nothing is reported or helped until the end
};

struct Settings {
  Quality quality = Quality::low;
  Guidance guidance = Guidance::practice;
  bool left_handed = false;    // the needle driver is the left hand's
  bool hold_to_close = false;  // the jaw closes only while the button is down
  bool assist = true;          // an open jaw finds the needle
  bool suture_points = false;
  bool hints = true;      // the list of keys
  float mouse_speed = 1;  // 0.2 .. 4, of tool to mouse
  float text_size = 1;    // 0.7 .. 2, of what fits the window
  bool operator==(const Settings&) const = default;
};
const char* quality_name(Quality quality);     // "low", "medium", "high"
const char* guidance_name(Guidance guidance);  // "learn", "practice", "exam"

// Throws InputError (file:line, what, what next) for text that is no TOML, unknown keys and values out of range.
Settings parse_settings(const std::string& text, const std::string& name);
std::string settings_text(const Settings& settings);  // parse_settings gives the same back

struct LoadedSettings {
  Settings settings;   // defaults where the file could not be read
  std::string fault;   // one line, naming the file; empty: none, also where there is no file yet
  bool first = false;  // there is no file yet
};
LoadedSettings load_settings(const std::string& path);

// The file is there whole, or as it was: written beside and renamed. A file that was not understood is kept as FILE.bad. Throws
// InputError where it cannot be written.
void save_settings(const Settings& settings, const std::string& path);

std::string settings_path();  // $XDG_CONFIG_HOME/catgut/settings.toml, or ~/.config/...; empty: this user has no home

}  // namespace catgut
