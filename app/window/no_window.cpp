// SPDX-License-Identifier: Apache-2.0
// app/window: stubs of a build without rendering (CATGUT_RENDER=OFF).
#include "core/check.h"
#include "window/keeping.h"
#include "window/window.h"

namespace catgut {

void check_keeping(const std::string&, const std::string&) {}  // play refuses anyway

int play(const PlayOptions&) {
  throw InputError("window", "this build has no window",
                   "run without it: catgut run purse_string --surgeon scripted --headless");
}

}  // namespace catgut
