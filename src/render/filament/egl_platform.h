// SPDX-License-Identifier: Apache-2.0
// render/filament/egl_platform: a GL context for Filament: without a window or an X server, or for a window of one.
#pragma once
#include <cstdint>
#include <memory>

#include <backend/Platform.h>

namespace catgut {

// Throws std::runtime_error when no EGL driver gives an OpenGL 4.1 core context here.
std::unique_ptr<filament::backend::Platform> make_egl_platform();

// For the X11 window `window` of the display that the environment names, on a connection of its own: a caller that made the
// window reads its events on another thread. A swap chain is made of the window's number. Throws std::runtime_error.
std::unique_ptr<filament::backend::Platform> make_egl_platform(uint64_t window);

}  // namespace catgut
