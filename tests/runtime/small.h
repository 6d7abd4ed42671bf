// SPDX-License-Identifier: Apache-2.0
// tests/runtime: a scene that is built and settled quickly: a little tissue, a short thread, no technique.
#pragma once
#include "procedure/scene_file.h"

namespace catgut {

inline SceneSpec small_scene() {
  return parse_scene(R"(title = "small"
settle = 0.05
[[body]]
particles = 300
[thread]
particles = 30
[solver]
substeps = 2
[technique]
name = "none"
)",
                     "small");
}

}  // namespace catgut
