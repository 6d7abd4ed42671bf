// SPDX-License-Identifier: Apache-2.0
// app/window: the simulator that people sit down at: a window, screens to choose, practice, pause and look back, and hands by
// mouse, keyboard and gamepad.
#pragma once
#include <functional>
#include <string>

#include "device/mouse.h"
#include "render/renderer.h"
#include "runtime/live.h"
#include "window/lesson_panel.h"

namespace catgut {

// What a user at the window sees and has in hand, after a picture in which hands were let in.
struct WindowLook {
  const Snapshot& seen;
  const ViewFrame& view;
  const Steering& steering;
  const MouseHand& mouse;
  const LiveStatus& status;
  const LessonRun& lesson;
};

struct PlayOptions {
  std::string scene;  // opens straight into it; empty: the start screen
  std::string view;   // or a recording, to look at
  LiveOptions live;
  Quality quality = Quality::low;
  bool quality_given = false;
  int width = 1280, height = 720;
  bool left_handed = false;
  bool teach = false;      // the lesson of the first stitch, in its scene
  std::string events;      // file to which everything that happens is written as it happens, a JSON object a line; "-"
  std::string screenshot;  // PNG of the window, then quit
  int after = 60;          // pictures before it
  std::string screen;  // that is in it: start, settings, practice, pause, developer, results, view; empty: whatever is there
  double at = 0;       // [s] of the work, or of the recording, that it shows
  std::string json;    // what was sutured, written when a scene is left; "-"
  double seconds = 0;  // [s] of wall time, then quit; 0: until a user quits
  // For a caller that looks on from within the program (a test that sits at the window): every such picture, false closes the
  // window; and every event.
  std::function<bool(const WindowLook&)> watch;
  std::function<void(const Event&)> on_event;
  int stall_ms = 0;  // for tests: the loop stands still so long, every two seconds
};

// Runs until the window is closed. Throws InputError, also when there is no display here.
int play(const PlayOptions& options);

}  // namespace catgut
