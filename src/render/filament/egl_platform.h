// SPDX-License-Identifier: Apache-2.0
// render/filament/egl_platform: a GL context for Filament: without a window or an X server, or for a window of one.
#pragma once
#include <cstdint>
#include <memory>

#include <backend/Platform.h>

namespace catgut {

// Throws std::runtime_error if no EGL driver provides an OpenGL 4.1 core context here.
std::unique_ptr<filament::backend::Platform> make_egl_platform();

// For the X11 window `window` of the display named by the environment, on a separate connection: the window's creator reads its
// events on another thread. The swap chain is created from the window's number. Throws std::runtime_error.
std::unique_ptr<filament::backend::Platform> make_egl_platform(uint64_t window);

// Two contexts that share textures: the platform's own, and another one of the same display and configuration that a headset's
// runtime uses on the caller's thread. Without a window. Throws std::runtime_error.
struct EglPair {
  std::unique_ptr<filament::backend::Platform> platform;
  void *display = nullptr, *config = nullptr, *context = nullptr,
       *surface = nullptr;  // of the runtime; the caller destroys them
};
EglPair make_egl_pair();

}  // namespace catgut
