// SPDX-License-Identifier: Apache-2.0
// sim/cutting: commands and the pen's stage. See the header.
#include "sim/cutting.h"

#include <algorithm>
#include <cmath>

#include "sim/model.h"
#include "sim/state.h"

namespace catgut {
namespace {

constexpr physical::ExciseModel kLaw;

}  // namespace

Cutting start_cutting(const Model& model) {
  Cutting c;
  const std::vector<InstrumentModel>& kind = model.suture.instrument;
  if (std::none_of(kind.begin(), kind.end(), [](const InstrumentModel& k) { return k.can(kCauterize); })) return c;
  c.mode.assign(kind.size(), PenMode::off);
  c.pieces = wall::count_pieces(model.physical->start.wall);
  return c;
}

bool cutting_fits(const Model& model, const Cutting& c) {
  if (c.mode.empty()) return start_cutting(model).mode.empty();
  const physical::Excision& e = c.excision;
  const wall::Model& wall = model.physical->world.wall;
  const size_t faces = wall.lane_of_face.size();
  const auto good = [&](const wall::Point& p) {
    return p.face < faces && std::abs(p.xi) <= 2 && std::abs(p.eta) <= 2 && std::abs(p.zeta) <= 1;
  };
  const auto good_groove = [&](const physical::Groove& g) {
    return g.face < faces && g.link < wall::raster(wall.mesh.face[g.face][3] != wall::kNone).links;
  };
  if (c.mode.size() != model.suture.instrument.size() || e.passed.size() != e.burnt.size() ||
      (!e.passed.empty() && e.passed.size() != faces))
    return false;
  for (const PenMode mode : c.mode)
    if (mode > PenMode::coagulate) return false;
  if (e.passed.empty() && (!e.groove.empty() || !e.path.empty() || !e.bleed.empty() || e.touching)) return false;
  return e.groove.size() <= physical::kMaxGroove && e.path.size() <= physical::kMaxTipPath &&
         e.bleed.size() <= physical::kMaxBleed && (!e.touching || good(e.last)) &&
         std::all_of(e.path.begin(), e.path.end(), good) && std::all_of(e.groove.begin(), e.groove.end(), good_groove) &&
         std::all_of(e.bleed.begin(), e.bleed.end(), [&](const physical::Bleed& b) { return good(b.at); });
}

void switch_pens(const Model& model, State& state, TickInput& input) {
  Cutting& c = state.physical.cutting;
  if (c.mode.empty()) return;
  CommandList others;
  for (const Command& command : input.commands) {
    const PenMode wanted = command.kind == CommandKind::cut          ? PenMode::cut
                           : command.kind == CommandKind::new_suture ? PenMode::coagulate
                                                                     : PenMode::off;
    const bool known = wanted != PenMode::off && command.hand < kMaxHands && input.hand[command.hand].connected;
    const int held = known ? state.hand[command.hand].instrument : -1;
    if (held < 0 || !model.suture.instrument[static_cast<size_t>(held)].can(kCauterize)) {
      others.push(command);
      continue;
    }
    PenMode& mode = c.mode[static_cast<size_t>(held)];
    const PenMode next = mode == wanted ? PenMode::off : wanted;
    std::fill(c.mode.begin(), c.mode.end(), PenMode::off);
    mode = next;
  }
  input.commands = others;
  // A pen that was laid down, or whose hand is gone, is off.
  for (uint32_t i = 0; i < c.mode.size(); ++i) {
    const InstrumentState& tool = state.suture.instrument[i];
    if (tool.place != InstrumentPlace::hand || !input.hand[tool.hand].connected) c.mode[i] = PenMode::off;
  }
}

void use_pens(const Model& model, State& state, physical::Scratch& scratch, float h) {
  Cutting& c = state.physical.cutting;
  if (c.mode.empty()) return;
  physical::Pen pen;
  for (size_t i = 0; i < c.mode.size(); ++i) {
    if (c.mode[i] == PenMode::off) continue;
    pen.tip = state.physical.world.bodies.body[i].pose.p;
    pen.coagulate = c.mode[i] == PenMode::coagulate;
    pen.power = pen.coagulate ? kCoagulatePower : kCutPower;
  }
  if (use_pen(kLaw, model.physical->world, state.physical.world, scratch, c.excision, pen, h).divided)
    c.pieces = wall::count_pieces(state.physical.world.wall);
}

}  // namespace catgut
