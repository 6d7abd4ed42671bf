// SPDX-License-Identifier: Apache-2.0
// render/filament: an engine on a platform of ours.
#pragma once
#include <backend/Platform.h>
#include <filament/Engine.h>

namespace catgut {

// Throws std::runtime_error if the driver refuses. Filament prints a greeting on standard output at its start, where results of
// the program go. The greeting is removed, and other messages go to standard error.
filament::Engine* start_engine(filament::backend::Platform& platform);
// On Filament's own platform for X11 (GLX), sharing the textures of the GLXContext `shared`.
filament::Engine* start_engine_on_glx(void* shared);
filament::Engine* start_engine_without_driver();  // one that accepts everything and renders nothing

}  // namespace catgut
