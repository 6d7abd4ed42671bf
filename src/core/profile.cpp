// SPDX-License-Identifier: Apache-2.0
// core/profile: the names of the stages, as the stage table prints them.
#include "core/profile.h"

namespace catgut {

const char* stage_name(Stage stage) {
  static constexpr const char* kName[] = {"predict",    "shape",        "volume",       "thread",         "attach",   "rigid",
                                          "broadphase", "self_contact", "tool_contact", "thread_contact", "velocity", "loop",
                                          "puncture",   "pull",         "closure",      "publish"};
  static_assert(sizeof(kName) / sizeof(kName[0]) == static_cast<size_t>(Stage::count_));
  return stage < Stage::count_ ? kName[static_cast<size_t>(stage)] : "unknown";
}

}  // namespace catgut
