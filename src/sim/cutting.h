// SPDX-License-Identifier: Apache-2.0
// sim/cutting: the stage of physical mechanics in which an active electrosurgical pen divides the wall. Reads commands and the
// poses of instruments; writes the wall's topology (physical/excise) and the picture of a wall that a pen has touched.
// docs/wall.md.
//
// The tip is the origin of the tool frame. Depth follows from power and time. One pen is active at a time: there is one tip.
// Commands of a hand that holds an instrument which cauterizes: `cut` switches cutting on and off, `new_suture` coagulation.
// So the buttons of every device work, and a recording repeats them.
#pragma once
#include <memory>
#include <vector>

#include "exchange/picture.h"
#include "exchange/snapshot.h"
#include "exchange/tool_input.h"
#include "physical/excise.h"
#include "physical/reflect.h"

namespace catgut {

struct Model;
struct State;

enum class PenMode : uint8_t { off, cut, coagulate };
constexpr float kCutPower = 40, kCoagulatePower = 30;  // [W] within the settings of general surgery (chosen)

struct Cutting {
  std::vector<PenMode> mode;  // per instrument; empty: the scene has no electrosurgical pen
  physical::Excision excision;
  uint32_t pieces = 0;      // of the wall
  uint64_t picture_of = 0;  // what `picture` shows
  std::shared_ptr<const PictureModel> picture;
};
// A scene without a pen has none of it.
constexpr void reflect(auto& a, Like<Cutting> auto& c) {
  if (c.mode.empty()) a.cache(c.mode), a.cache(c.excision), a.cache(c.pieces);
  else a(c.mode), a(c.excision), a(c.pieces);
  a.cache(c.picture_of), a.cache(c.picture);
}

// --- building, saving --------------------------------------------------------------------------------------------------
Cutting start_cutting(const Model& model);
// Whether a loaded state has sizes and indices that a step can work with.
bool cutting_fits(const Model& model, const Cutting& cutting);

// --- stages of a tick ----------------------------------------------------------------------------------------------------
// Once: switches pens, and removes their commands from the list.
void switch_pens(const Model& model, State& state, TickInput& input);
// In every step of h seconds, before physical::step.
void use_pens(const Model& model, State& state, physical::Scratch& scratch, float h);

// --- sim/cut_picture -----------------------------------------------------------------------------------------------------
// Once per tick and after a load: a new picture if the shape of the drawn wall has changed.
void renew_cut_picture(const Model& model, State& state);
// Adds copies of columns, rotations and the picture to a snapshot of the tissue as built.
void publish_cut(const Model& model, const State& state, Snapshot& snapshot);

}  // namespace catgut
