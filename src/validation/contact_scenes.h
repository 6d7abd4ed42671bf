// SPDX-License-Identifier: Apache-2.0
// validation: a tube of bowel, open at one end, with a tool in a hand, a free needle and a thread across it. Random events.
#pragma once
#include <functional>
#include <memory>
#include <vector>

#include "core/random.h"
#include "physical/physical.h"
#include "validation/knot_scenes.h"

namespace catgut::validation {

struct ContactBench {
  physical::Model model;
  physical::State state, rest;
  std::unique_ptr<physical::Scratch> scratch;
  Jobs jobs{1};
  std::vector<physical::HandTarget> target;  // tool, needle
  std::vector<thread::Pull> pull;
  std::function<void()> watch;  // called after each step
  Random random;
  uint64_t seed = 0;
  int events = 0;
  // Of the last event, per tool, needle and thread: overlap [m]; crossings of the wall's middle, at every fourth step.
  float deepest[3] = {};
  int passed[3] = {};
  int folded = 0;                    // spheres on faces that are folded upon themselves
  float fastest = 0, strongest = 0;  // [m/s] of a body, [N] on a body, over all events
  explicit ContactBench(uint64_t s);
  // 80 ms: the tool pushes and perhaps drags, the needle falls or is thrown, the thread's ends are pulled.
  void event(float max_force, float max_speed);

 private:
  Vec3 direction();
  // The tool at this pose touches neither the needle nor the thread, as it is and as it was at rest.
  bool clear(const Pose& tool, float opening) const;
  void step();
  void look();
  std::vector<Vec3> center;  // [m] per face
  std::vector<float> radius;
};

}  // namespace catgut::validation
