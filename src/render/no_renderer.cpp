// SPDX-License-Identifier: Apache-2.0
// render: stubs of a build without rendering (CATGUT_RENDER=OFF). Physics, recordings and their tests need no graphics.
#include <stdexcept>

#include "render/eyes.h"
#include "render/frame_cost.h"
#include "render/renderer.h"
#include "render/window.h"

#ifndef CATGUT_WITH_FILAMENT
namespace catgut {

std::unique_ptr<Renderer> make_renderer(const PictureModel&, int, int, Quality) {
  throw std::runtime_error(
      "this build makes no pictures; install libfilament-dev libfilament-tools libegl-dev libepoxy-dev and configure with "
      "-DCATGUT_RENDER=ON");
}

bool renderer_available() { return false; }

std::unique_ptr<WindowRenderer> make_window_renderer(uint64_t, int, int, const std::string&) {
  throw std::runtime_error("this build has no window; configure it with -DCATGUT_RENDER=ON");
}

std::unique_ptr<EyeRenderer> make_eye_renderer(GlBinding, const std::string&) {
  throw std::runtime_error("this build makes no pictures");
}

std::unique_ptr<FrameCost> make_frame_cost(const PictureModel&, int, int, Quality, int) {
  throw std::runtime_error("this build makes no pictures");
}

}  // namespace catgut
#endif
