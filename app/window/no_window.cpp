// SPDX-License-Identifier: Apache-2.0
// app/window: what a build without pictures (CATGUT_RENDER=OFF) answers.
#include "core/check.h"
#include "window/window.h"

namespace catgut {

int play(const PlayOptions&) {
  throw InputError("window", "this build has no window",
                   "run without it: catgut run purse_string --surgeon scripted --headless");
}

}  // namespace catgut
