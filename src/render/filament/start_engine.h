// SPDX-License-Identifier: Apache-2.0
// render/filament: an engine on a platform of ours.
#pragma once
#include <backend/Platform.h>
#include <filament/Engine.h>

namespace catgut {

// Throws std::runtime_error if the driver refuses. Filament prints a greeting on standard output at its start, where results of
// the program go. The greeting is removed, and other messages go to standard error.
filament::Engine* start_engine(filament::backend::Platform& platform);
filament::Engine* start_engine_without_driver();  // one that accepts everything and renders nothing

}  // namespace catgut
