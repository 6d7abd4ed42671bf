// app/window: the panels over the picture, drawn with Dear ImGui. They show what they are given and say what was chosen;
// nothing happens here.
#pragma once
#include <deque>
#include <string>
#include <vector>

#include "device/mouse.h"
#include "render/renderer.h"
#include "runtime/live.h"
#include "window/words.h"

namespace catgut {

struct SceneChoice {
  std::string name, title;
};

enum class Guidance { full, hints, none };

// What a person has set; the start and pause screens change it.
struct Settings {
  Quality quality = Quality::draft;
  bool left_handed = false;
  bool hold_to_close = false;
  bool assist = true;
  bool suture_points = false;
  bool hints = true;
  // What is shown of how it should be: the ghost of the needle's way and what is said of the bite; how things are done; or
  // nothing.
  Guidance guidance = Guidance::full;
};

struct LogLine {
  double time_s = 0;  // [s] simulated
  std::string text;
  bool bad = false;
};

// What is drawn over the field while somebody works.
struct WorkView {
  const SceneSpec* scene = nullptr;
  const LiveStatus* status = nullptr;
  const Snapshot* seen = nullptr;
  const Steering* steering = nullptr;
  const MouseHand* mouse = nullptr;
  const std::deque<LogLine>* log = nullptr;
  std::string pad;  // name of the gamepad; empty: none
  double pictures_per_s = 0;
};

enum class Chosen { nothing, scene, teach, resume, single_step, take_back, restart, finish, start_screen, quit };
struct Choice {
  Chosen what = Chosen::nothing;
  size_t scene = 0;  // of the list
};

Choice start_panel(const std::vector<SceneChoice>& scenes, Settings& settings, const std::string& message);
void work_panel(const WorkView& view, const Settings& settings);
Choice pause_panel(const WorkView& view, Settings& settings);
Choice result_panel(const SceneSpec& scene, const Practice& practice, const std::vector<std::string>& recorded,
                    const std::string& fault);
void style_panels(float scale);  // once, and when the window has changed

}  // namespace catgut
