// SPDX-License-Identifier: Apache-2.0
// render/filament: an engine on a platform of ours.
#pragma once
#include <backend/Platform.h>
#include <filament/Engine.h>

namespace catgut {

// Throws std::runtime_error when the driver refuses. Filament greets on standard output while it starts, where a program's own
// results go: its greetings are left out, and whatever else it says goes to standard error.
filament::Engine* start_engine(filament::backend::Platform& platform);
filament::Engine* start_engine_without_driver();  // one that takes everything and draws nothing

}  // namespace catgut
