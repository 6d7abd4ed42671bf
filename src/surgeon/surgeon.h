// SPDX-License-Identifier: Apache-2.0
// surgeon: a scripted pair of hands. To the simulation it is a device like any other: it reads the published Snapshot and
// returns ToolInputs; it has no access to the state. Motion plans react to the Snapshot.
#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "exchange/picture.h"
#include "exchange/snapshot.h"
#include "exchange/tool_input.h"

namespace catgut {

struct SurgeonSkill {
  int bites = 12;
  float edge_distance = 0.004f, bite_length = 0.007f;  // [m]
  float tail = 0.045f;                                 // [m] free end left
  float speed = 0.15f, drive_speed = 0.03f;            // [m/s]
  float tremor = 0.0001f, aim_error = 0.0003f;         // [m] standard deviations
  // Abilities; 0: without that error.
  float angle_error = 0;    // [rad] standard deviation of the needle's direction
  float pause = 0;          // [s] mean time of thought before a task
  float tension_error = 0;  // relative standard deviation of the force of a pull
  float grasp_error = 0;    // probability that a grasp misses
  float order_error = 0;    // probability of a throw in the wrong direction, or of two bites exchanged
  float wall = 0.0025f;     // [m] thickness of the wall, visible at a cut edge
  // [N] at a suture point, where a pull stops; human small bowel begins to tear at 3.2 N. 0: no pull stops or gives way, as
  // with preset paper, whose thread stretches and whose constraints draw the edges together with more.
  float most_load = 2.8f;
  uint64_t seed = 1;
};

class Surgeon {
 public:
  virtual ~Surgeon() = default;
  // Hands and commands for the next tick, from the state after the last one; the caller sets TickInput::tick. dt:
  // length of a tick [s].
  virtual TickInput operate(const Snapshot& seen, float dt) = 0;
  virtual bool done() const = 0;  // the plan is finished (or abandoned)
  virtual bool gave_up() const { return false; }
  virtual int retries() const { return 0; }  // bites, grasps, throws and cuts tried again so far
  virtual std::string doing() const = 0;     // "bite 3 of 12: drive the needle", for progress lines
};

// Demonstrates part of the work: tasks of the plan, by number and in this order, taking over the tools from the caller at their
// poses and with what they hold. Throws as make_surgeon, or where the plan has no such task.
std::unique_ptr<Surgeon> make_demonstrator(const std::string& plan, const PictureModel& picture, const SurgeonSkill& skill,
                                           const std::vector<size_t>& tasks);

// plan: a name of plan_names() (surgeon/plan.h), else std::invalid_argument.
std::unique_ptr<Surgeon> make_surgeon(const std::string& plan, const PictureModel& picture, const SurgeonSkill& skill);

}  // namespace catgut
