// render/filament: an engine on a platform of ours.
#pragma once
#include <backend/Platform.h>
#include <filament/Engine.h>

namespace catgut {

// Throws std::runtime_error when the driver refuses. Filament greets on standard output while it starts, where a program's own
// results go: its lines go to standard error instead.
filament::Engine* start_engine(filament::backend::Platform& platform);

}  // namespace catgut
