// SPDX-License-Identifier: Apache-2.0
// surgeon: a scripted pair of hands. To the simulation it is just another device: it sees the published Snapshot and answers
// with ToolInputs, like a human; it cannot reach into the state. Motion plans react to what they see.
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
  float wall = 0.0025f;                                // [m] thickness of the wall, which shows at a cut edge
  uint64_t seed = 1;
};

class Surgeon {
 public:
  virtual ~Surgeon() = default;
  // Hands and commands for the next tick, seeing the state after the last one; TickInput::tick is left to the caller. dt:
  // length of a tick [s].
  virtual TickInput operate(const Snapshot& seen, float dt) = 0;
  virtual bool done() const = 0;  // the plan is finished (or given up)
  virtual bool gave_up() const { return false; }
  virtual std::string doing() const = 0;  // "bite 3 of 12: drive the needle", for progress lines
};

// Shows a part of the work: tasks of the plan, by number and in this order, taking over from a caller that had the tools. It
// begins where they are and with what they hold. Throws as make_surgeon, or where the plan has no such task.
std::unique_ptr<Surgeon> make_demonstrator(const std::string& technique, const PictureModel& picture, const SurgeonSkill& skill,
                                           const std::vector<size_t>& tasks);

// The techniques of paper 2.5: purse_string, connell, stay, lembert. Throws std::invalid_argument for a technique without a
// script.
std::unique_ptr<Surgeon> make_surgeon(const std::string& technique, const PictureModel& picture, const SurgeonSkill& skill);

}  // namespace catgut
