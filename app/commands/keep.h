// SPDX-License-Identifier: Apache-2.0
// app: a measured session as a row of the store, and its recording beside the store. For `catgut store add` and the window.
#pragma once
#include <string>

#include "assess/result.h"
#include "assess/stitch_map.h"
#include "store/store.h"

namespace catgut {

// Metrics, score with reasons, stitches and thread tension. name: of the source, for messages.
Session session_of(const assess::Result& result, const StitchMap& map, const std::string& name);

// Pseudonym, task and second: unique enough for one person. Also a file name.
std::string session_uid(const std::string& trainee, const std::string& task);

// Copies a recording beside a store in a file, so that one folder is all there is to keep; the recording of a session in
// PostgreSQL stays where it is. Returns its path. Throws InputError.
std::string keep_recording(const Store& store, const std::string& path, const std::string& uid);

}  // namespace catgut
