// SPDX-License-Identifier: Apache-2.0
// render: the operating field in a window, with panels over it. The caller owns the window and reads its events;
// here it is an X11 window number. Panels use Dear ImGui: its context exists as long as the WindowRenderer does.
#pragma once
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>

#include "exchange/picture.h"
#include "exchange/snapshot.h"
#include "render/camera.h"
#include "render/image.h"
#include "render/renderer.h"

namespace catgut {

// Belongs to the thread that created it.
class WindowRenderer {
 public:
  virtual ~WindowRenderer() = default;

  // Sets the displayed scene; null: only the panels.
  virtual void stage(const PictureModel* model, Quality quality) = 0;
  // From now on, and until the next stage(), the field has only `part` (0.25 .. 1) of the window's resolution in each
  // direction; panels stay sharp. Half the resolution takes about a third of the time on a processor.
  virtual void set_resolution_scale(float part) = 0;
  virtual void resize(int width, int height) = 0;  // [pixels], when the window has changed
  // [pixels] line height of the panels' text. Call between frames; initially 16.
  virtual void text_height(float pixels) = 0;

  struct Frame {
    const Snapshot* snapshot = nullptr;  // null: the field is not drawn
    Camera camera;
    bool suture_points = false;
    std::optional<Inset> inset;
    float dt = 1.0f / 60;          // [s] since the last frame, for the panels
    std::function<void()> panels;  // calls ImGui
    Image* copy = nullptr;         // not null: receives a copy of the window's image
  };
  // False: the driver was behind, the frame was skipped and the panels were not called (never with `copy`).
  virtual bool draw(const Frame& frame) = 0;
};

// window: of the X display named by the environment. font: path of a TrueType file for the panels; empty or missing: a
// small built-in one. Throws std::runtime_error with one line.
std::unique_ptr<WindowRenderer> make_window_renderer(uint64_t window, int width, int height, const std::string& font);

}  // namespace catgut
