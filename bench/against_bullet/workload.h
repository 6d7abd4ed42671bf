// SPDX-License-Identifier: Apache-2.0
// bench/against_bullet: the workload of both sides: one of Catgut's own scenes, its particles, clusters, pins and
// thread, and a tool that presses the wall in and releases it once per second.
#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "sim/model.h"

namespace catgut {

struct Workload {
  std::string name;
  std::shared_ptr<const Model> model;         // preset paper: 8 substeps of 1/480 s
  std::vector<std::array<uint32_t, 2>> edge;  // of the wall's tetrahedra, once each
  std::vector<std::vector<uint32_t>> body;    // particles that edges connect: bowel ends, layers
  Vec3 pressed;                               // [m] point of the wall at which the tool presses
};

// scene: one of Catgut's; times: this multiple of its wall and its thread, with the same particle spacing.
Workload make_workload(const std::string& scene, int times);
Pose tool_pose(const Workload& work, float time);  // [s]

}  // namespace catgut
