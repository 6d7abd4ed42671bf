// SPDX-License-Identifier: Apache-2.0
// app/window: where a session is kept without being asked for: a recording, and its results beside it.
#pragma once
#include <string>

#include "runtime/live.h"
#include "window/settings.h"

namespace catgut {

// The folder of the settings; not set: $XDG_DATA_HOME/catgut/sessions, or ~/.local/share/...; empty: the user has no home.
std::string data_folder(const Settings& settings);
// FOLDER/SCENE_2026-11-23_1432.cgrec, a name that is free; makes the folder. Throws InputError where nothing can be written.
std::string session_file(const std::string& folder, const std::string& scene);
// After the session: NAME.json and NAME.csv beside its first recording. A session in which nothing happened is removed.
// Throws InputError.
void keep_session(const std::string& file, const LiveResult& result, const std::string& json);

}  // namespace catgut
