// SPDX-License-Identifier: Apache-2.0
// render: the operating field in a window, with panels over it. The window itself belongs to a caller that reads its events;
// here it is a number of the X server's. Panels are Dear ImGui's: its context exists as long as the WindowRenderer does.
#pragma once
#include <cstdint>
#include <functional>
#include <memory>

#include "exchange/picture.h"
#include "exchange/snapshot.h"
#include "render/camera.h"
#include "render/image.h"
#include "render/renderer.h"

namespace catgut {

// Belongs to the thread that made it.
class WindowRenderer {
 public:
  virtual ~WindowRenderer() = default;

  // What is shown from now on; null: nothing but the panels.
  virtual void stage(const PictureModel* model, Quality quality) = 0;
  // From now on, and until the next stage(), the field has only `part` (0.25 .. 1) of the window's pixels each way; panels stay
  // sharp. Half the pixels take about a third of the time on a processor.
  virtual void set_resolution_scale(float part) = 0;
  virtual void resize(int width, int height) = 0;  // [pixels], when the window has changed
  // [pixels] of a line of the panels' text. Between frames; 16 at first.
  virtual void text_height(float pixels) = 0;

  struct Frame {
    const Snapshot* snapshot = nullptr;  // null: the field is not drawn
    Camera camera;
    bool suture_points = false;
    float dt = 1.0f / 60;          // [s] since the last frame, for the panels
    std::function<void()> panels;  // calls ImGui
    Image* copy = nullptr;         // not null: receives what the window shows
  };
  // False: the driver was behind, the frame was left out and the panels were not called (never with `copy`).
  virtual bool draw(const Frame& frame) = 0;
};

// window: of the X display that the environment names. font: path of a TrueType file for the panels; empty, or not there: a
// small built-in one. Throws std::runtime_error with one line to act on.
std::unique_ptr<WindowRenderer> make_window_renderer(uint64_t window, int width, int height, const std::string& font);

}  // namespace catgut
