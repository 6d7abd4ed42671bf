// SPDX-License-Identifier: Apache-2.0
// app/window: the interactive simulator: a window, screens, practice, pause and review, and hands by
// mouse, keyboard and gamepad.
#pragma once
#include <functional>
#include <span>
#include <string>

#include "device/mouse.h"
#include "render/renderer.h"
#include "runtime/live.h"
#include "window/layout.h"
#include "xr/wearer.h"

namespace catgut {

// State of an interactive session, after a frame with connected hands.
struct WindowLook {
  const Snapshot& seen;
  const ViewFrame& view;
  const Steering& steering;
  const MouseHand& mouse;
  const LiveStatus& status;
  const std::vector<PlacedPanel>& panels;   // as drawn last
  const xr::WearerLook* headset = nullptr;  // the frame that was submitted before this one; null: none
  std::span<const PlacedPanel> board{};     // panels of a headset's board, as drawn last
};

struct PlayOptions {
  std::string scene;  // opens directly; empty: the start screen
  std::string view;   // or a recording, for the viewer
  LiveOptions live;
  Quality quality = Quality::low;
  bool quality_given = false;
  int width = 1280, height = 720;
  bool left_handed = false;
  std::string procedure;   // its stages are shown; empty: none
  std::string stage;       // the first one; empty: the first of the file
  bool exam = false;       // no feedback before the results, whatever the settings
  bool tutorial = false;   // time stands still at every new stage; demonstrations
  std::string events;      // file that receives events immediately, one JSON object per line; "-"
  std::string screenshot;  // PNG of the window, then quit
  int after = 60;          // frames before it
  std::string
      screen;  // the screen shown: start, settings, practice, pause, developer, results, survey, view; empty: the current one
  double at = 0;               // [s] of the session, or of the recording
  std::string json;            // results, written when a scene is closed; "-"
  std::string csv;             // the same as a table
  bool sound = false;          // the pen's tone, as the settings want
  bool keep_sessions = false;  // records every session into the data folder, as the settings want
  bool kiosk = false;          // whole screen, cannot be left; back to the start screen after a time without input
  double idle_s = 180;         // [s] that time
  double seconds = 0;          // [s] of wall time, then quit; 0: until the user quits
  // For an observer within the program (a test that simulates a user): every such frame, false closes the
  // window; and every event.
  std::function<bool(const WindowLook&)> watch;
  std::function<void(const Event&)> on_event;
  std::function<bool(const char* screen)> on_frame;       // after every drawn frame, on any screen; false closes the window
  std::function<void(const xr::WearerLook&)> watch_eyes;  // after every frame of a headset, on any screen
  std::string trainee;                                    // pseudonym: sessions are stored; empty: the setting
  std::string store;                                      // where; empty: the default
  std::string feedback;                                   // silent, stitch or live; empty: the setting
  std::string survey;                                     // asked after a session; empty: the setting
  bool headset = false;                                   // draws for a headset too, and takes its wearer's hands
  std::string room = "room";                              // whose table height and registration apply
  bool register_arms = false;                             // registers haptic arms to the headset's space
  bool eye_pictures = false;                              // for an observer: copies of both eyes' images (slow)
  int stall_ms = 0;                                       // for tests: blocks the loop for this time, every two seconds
};

// For an observer in on_frame: the buttons on the results that play the moment of a lost point, as drawn last.
std::span<const PanelRect> drawn_moments();

// Runs until the window is closed. Throws InputError, also without a display.
int play(const PlayOptions& options);

}  // namespace catgut
