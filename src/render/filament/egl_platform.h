// render/filament/egl_platform: a GL context without a window or an X server, for Filament.
#pragma once
#include <memory>

#include <backend/Platform.h>

namespace catgut {

// Throws std::runtime_error when no EGL driver gives an OpenGL 4.1 core context here.
std::unique_ptr<filament::backend::Platform> make_egl_platform();

}  // namespace catgut
