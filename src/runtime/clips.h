// SPDX-License-Identifier: Apache-2.0
// runtime: short clips of moments of a recording, as JPEG pictures, for reports: what was to be seen when a point was lost.
// Replays the recording once; uses the renderer.
#pragma once
#include <string>
#include <vector>

#include "runtime/session.h"

namespace catgut {

struct ClipOptions {
  int width = 400, height = 260, quality = 70;            // [pixels], of JPEG 1..100
  std::vector<double> at{-1.6, -0.8, -0.3, 0, 0.3, 0.8};  // [s] pictures, before and after the moment
};

// One clip per moment [s on the simulation's clock], each with its JPEG files in the order of time; empty beyond the recording.
// Throws InputError, also where this machine cannot render.
std::vector<std::vector<std::string>> make_clips(const Recording& recording, const std::string& name,
                                                 const std::vector<double>& moments, const ClipOptions& options,
                                                 const SessionHooks& hooks = {});

}  // namespace catgut
