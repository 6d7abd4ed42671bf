// SPDX-License-Identifier: Apache-2.0
// app/window: the panels over the image, drawn with Dear ImGui. They show their arguments and return the user's choice;
// they change nothing themselves.
#pragma once
#include <array>
#include <deque>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "device/mouse.h"
#include "procedure/procedure.h"
#include "runtime/live.h"
#include "runtime/playback.h"
#include "window/charts.h"
#include "window/keeping.h"
#include "window/layout.h"
#include "window/screens.h"
#include "window/settings.h"
#include "window/words.h"

namespace catgut {

struct SceneChoice {
  std::string name, title, technique, body;
};

struct StartView {
  const std::vector<SceneChoice>* scenes = nullptr;
  const std::vector<std::string>* recordings = nullptr;  // paths, newest first
  std::string message;                                   // error, one line
  std::string pad;                                       // name of the gamepad; empty: none
  bool watch_only = false;                               // the command line has selected the surgeon
  bool headset_offered = false, headset_on = false;      // a runtime is installed; a session was asked for
  std::string headset;                                   // its last report
  bool can_keep = false;                                 // sessions of a trainee can be stored
};

struct LogLine {
  double time_s = 0;  // [s] simulated
  std::string text;
  bool bad = false;
};

// Contents of the panels over the field during a session.
struct WorkView {
  const SceneSpec* scene = nullptr;
  const LiveStatus* status = nullptr;
  const Snapshot* seen = nullptr;
  const PictureModel* picture = nullptr;
  const Steering* steering = nullptr;
  const MouseHand* mouse = nullptr;
  const std::deque<LogLine>* log = nullptr;
  const std::vector<assess::Cue>* cues = nullptr;       // of this moment; null or empty: none
  const std::deque<assess::Remark>* remarks = nullptr;  // on the last stitches
  size_t speed = 1;                                     // of kMouseSpeeds
  std::string pad;                                      // name of the gamepad; empty: none
  bool watching = false;                                // the scripted surgeon works
  bool inside = false;                                  // the developers' panel uses the lower part of the window
  double pictures_per_s = 0;
  std::string headset;  // its state, one line; empty: none
};

struct ResultView {
  const SceneSpec* scene = nullptr;
  const LiveResult* result = nullptr;
  std::vector<LogLine> log;              // all events, as text
  const Procedure* procedure = nullptr;  // of the session; null: none
  std::string saved;                     // name of the JSON file, or why there is none
  bool from_recording = false;           // from a recording, not from a session
  float known = 1;                       // scanned fraction of the recording: the results cover that part
  KeptSession kept{};                    // what the store has
  bool can_answer = false;               // a questionnaire is to be asked
};

std::vector<LogLine> event_log(const StitchMap& map);
std::string recording_of(const LiveResult& result, uint64_t tick);  // file that shows this tick as it counts; empty: none

struct PlayedView {
  const SceneSpec* scene = nullptr;
  const PlaybackStatus* status = nullptr;
  const LiveResult* result = nullptr;  // of the scanned part
  const Snapshot* seen = nullptr;
  std::string file, version, cut;            // cut: position and cause of a truncated recording
  std::optional<std::array<float, 2>> gaze;  // [pixels] the point that a headset's wearer looked at; none: not known
};

// Each may change the settings; `watch`: the scripted surgeon works.
Choice start_panel(const StartView& view, Settings& settings, bool& watch);
Choice settings_panel(Settings& settings, const std::string& file, const std::string& folder, const std::string& message,
                      bool working);
void draw_panels(std::span<const PlacedPanel> panels);
TextSize panel_text_size();  // of the present font and style
Choice pause_panel(const WorkView& view);
// can_touch: the mouse is a pointer and sliders can be moved.
Choice developer_panel(const WorkView& view, bool can_touch);
Choice result_panel(const ResultView& view, BiteColor& by);
// Changes the answers in the form.
Choice survey_panel(SurveyForm& form, const std::string& message);
Choice view_panel(const PlayedView& view, const Settings& settings);

}  // namespace catgut
