// SPDX-License-Identifier: Apache-2.0
// render: pictures of the operating field. Reads the PictureModel once and a Snapshot per picture; writes pixels and nothing
// else. Nothing outside this room includes a header of the graphics library.
#pragma once
#include <memory>
#include <string>

#include "exchange/picture.h"
#include "exchange/snapshot.h"
#include "render/camera.h"
#include "render/image.h"

namespace catgut {

// Which one a machine bears: render/quality.h.
enum class Quality {
  low,     // one sample a pixel, 1024 shadow map: for previews and for machines without a graphics card
  medium,  // four samples, 2048 shadow map
  high     // and a 4096 shadow map, ambient occlusion, a glow about highlights
};

struct Overlay {
  std::string caption;         // along the bottom, none when empty
  bool suture_points = false;  // small balls at the entries (yellow) and exits (cyan)
};

// Belongs to the thread that made it; two renderers may live side by side.
class Renderer {
 public:
  virtual ~Renderer() = default;
  virtual Image render(const Snapshot& snapshot, const Camera& camera, const Overlay& overlay = {}) = 0;
  // The same without the picture; comes back when it has been drawn. For measuring.
  virtual void draw(const Snapshot& snapshot, const Camera& camera) = 0;
};

// Throws std::runtime_error with one line to act on: no EGL driver on this machine, or a build without pictures.
std::unique_ptr<Renderer> make_renderer(const PictureModel& model, int width, int height, Quality quality);

bool renderer_available();  // whether make_renderer can work here: built in, and a driver answers

}  // namespace catgut
