// SPDX-License-Identifier: Apache-2.0
// render: images of the operating field. Reads the PictureModel once and a Snapshot per image; writes only
// pixels. No code outside this room includes a header of the graphics library.
#pragma once
#include <algorithm>
#include <memory>
#include <optional>
#include <string>

#include "exchange/picture.h"
#include "exchange/snapshot.h"
#include "render/camera.h"
#include "render/image.h"

namespace catgut {

// Selection for a machine: render/quality.h.
enum class Quality {
  low,     // one sample per pixel, 1024 shadow map: for previews and for machines without a graphics card
  medium,  // four samples, 2048 shadow map
  high     // and a 4096 shadow map, ambient occlusion, bloom about highlights
};

// A second, square view of the same field over a corner of the picture, always at whole resolution.
struct Inset {
  Camera camera;
  int x = 0, y = 0, side = 0;  // [pixels] of its upper left corner, and its size
};

constexpr float kInsetHalf = 0.007f;  // [m] half of what the magnifier at the needle's tip shows
inline int inset_side(int width, int height) {
  return std::clamp(static_cast<int>(0.28f * static_cast<float>(std::min(width * 9 / 16, height))), 96, 240);
}

struct Overlay {
  std::string caption;         // along the bottom, none when empty
  bool suture_points = false;  // small balls at the entries (yellow) and exits (cyan)
  std::optional<Inset> inset = std::nullopt;
};

// Belongs to the thread that created it; two renderers may coexist.
class Renderer {
 public:
  virtual ~Renderer() = default;
  virtual Image render(const Snapshot& snapshot, const Camera& camera, const Overlay& overlay = {}) = 0;
  // The same without the pixels; returns when rendering is complete. For measurements.
  virtual void draw(const Snapshot& snapshot, const Camera& camera, const Overlay& overlay = {}) = 0;
  // Pictures are rendered at `part` (0.25 .. 1) of the resolution in each direction, and enlarged.
  virtual void set_resolution_scale(float part) = 0;
};

// Throws std::runtime_error with one line: no EGL driver on this machine, or a build without rendering.
std::unique_ptr<Renderer> make_renderer(const PictureModel& model, int width, int height, Quality quality);

bool renderer_available();  // whether make_renderer works here: built in, with a driver

}  // namespace catgut
