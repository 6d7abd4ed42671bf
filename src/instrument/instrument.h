// SPDX-License-Identifier: Apache-2.0
// instrument: surgical instruments as data. A model states geometry, mass and capabilities of an instrument; the stages in
// suture query capabilities and limits, never a name. The table of models is instrument/table.cpp; docs/add_an_instrument.md
// shows how to add one, in the table or from your own program.
//
// Tool frame of every instrument, as in ToolInput: origin at the grasp point between the jaw tips, -z the pointing direction,
// +z along the shaft toward the hand, x the direction in which the jaws open. SI units.
#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "exchange/instrument.h"
#include "solver/rigid.h"

namespace catgut {

struct Jaw {
  float length = 0;      // [m] from the pivot to the tips; 0: the instrument has no jaws
  float closed = 0.35f;  // of ToolInput::jaw (0 shut, 1 open): below this the jaws grasp,
  float open = 0.5f;     // above this they release. Two thresholds, so that tremor does not release anything
};

struct InstrumentModel {
  std::string name;   // of the model: "needle_holder"
  std::string title;  // for display: "Needle holder"
  uint32_t capabilities = 0;
  RigidModel body;  // mass, inertia, and the capsules it collides with
  Jaw jaw;
  // [N] of pull at which the jaws slip.
  float needle_grip = 0, thread_grip = 0, tissue_grip = 0;
  bool can(uint32_t capability) const { return (capabilities & capability) == capability; }
};

// State of one instrument of a scene. Written by sim/hands (pose, hand) and suture/grasp (the rest).
struct InstrumentState {
  Held held = Held::nothing;
  uint32_t slot = 0;  // held thread particle, or tissue particle nearest to the jaws
  float at = 0;       // held needle: fraction of its arc, 0 swage .. 1 tip
  float jaw = 1;      // of the last tick
  InstrumentPlace place = InstrumentPlace::tray;
  uint8_t hand = kNoHand;  // that holds it
  uint32_t suture = 0;     // index of the held needle's or thread's suture
  bool latched = false;    // a clamp that was taken up on tissue: closed until the hand has closed its jaw input
  Vec3 parked_at;          // [m] grasp point when it was parked, where its cord draws with its whole force
};

// The jaw of an instrument in a hand, from the hand's input.
inline float follow_jaw(InstrumentState& tool, const InstrumentModel& kind, float input) {
  tool.latched = tool.latched && input > kind.jaw.closed;
  return tool.latched ? tool.jaw : input;
}

// All models of the table, in order.
const std::vector<InstrumentModel>& instrument_table();
// The model of that name, first in `own`, then in the table; null: unknown.
const InstrumentModel* find_instrument(const std::string& name, std::span<const InstrumentModel> own = {});

}  // namespace catgut
