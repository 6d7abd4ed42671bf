// SPDX-License-Identifier: Apache-2.0
// sim/bleeding: blood from opened vessels, and heat that spreads from a pen's tip. Declared in sim/cutting. Jaws that hold
// tissue, and swabs that press on it, stop the vessels between or under them (physical/bleed).
#include <algorithm>

#include "sim/cutting.h"
#include "sim/model.h"
#include "sim/state.h"

namespace catgut {
namespace {

constexpr float kJawReach = 3e-3f;    // [m] round the middle of closed jaws
constexpr float kSwabReach = 5e-3f;   // [m] round the middle of a swab; its radius
constexpr float kSwabForce = 0.1f;    // [N] on a swab: the pressure of small arteries on 12 mm^2
constexpr float kSwabBeside = 1e-3f;  // [m] from the wall: it touches

void find_pressures(const Model& model, const State& state, std::vector<physical::Pressure>& out) {
  const physical::Model& m = model.physical->world;
  const physical::State& world = state.physical.world;
  out.clear();
  for (uint32_t i = 0; i < model.solver.instruments(); ++i) {
    const physical::Body& body = world.bodies.body[i];
    if (body.grip.what == physical::Gripped::tissue) {
      out.push_back({wall::rest_place(m.wall, body.grip.point[0].tissue), kJawReach, true, false});
    } else if (model.suture.instrument[i].can(kAbsorb) && state.suture.instrument[i].place == InstrumentPlace::hand) {
      wall::Point at = physical::nearest_foot(m, world, body.pose.p, kSwabReach + kSwabBeside).point;
      at.zeta = 0;
      const Vec3 on_wall = wall::place(wall::weights(m.wall, world.wall.topology, at), world.wall.motion);
      if (distance(on_wall, body.pose.p) < kSwabReach + 0.5f * m.wall.laminate.thickness + kSwabBeside) {
        const Vec3 rest = wall::rest_place(m.wall, at);
        // A swab that presses already continues to do so at half the force: hands tremble.
        const auto is_stopped = [&](const physical::Bleed& b) {
          return b.open > 0 && b.flow == 0 && length2(wall::rest_place(m.wall, b.at) - rest) < kSwabReach * kSwabReach;
        };
        const std::vector<physical::Bleed>& vessels = state.physical.cutting.excision.bleed;
        const float least = std::any_of(vessels.begin(), vessels.end(), is_stopped) ? 0.5f * kSwabForce : kSwabForce;
        out.push_back({rest, kSwabReach, length(body.force) >= least, true});
      }
    }
  }
}

}  // namespace

void bleed(const Model& model, State& state, CutScratch& k) {
  Cutting& c = state.physical.cutting;
  if (c.mode.empty()) return;
  const wall::Model& wall = model.physical->world.wall;
  physical::Excision& e = c.excision;
  physical::conduct(kExciseLaw.heat, wall, state.physical.world.wall.topology, e.path, model.dt, k.heat, e.heat);
  if (e.bleed.empty()) return;
  k.flow.clear();
  for (const physical::Bleed& b : e.bleed) k.flow.push_back(b.flow);
  find_pressures(model, state, k.pressure);
  physical::bleed_on(kExciseLaw.bleed, wall, k.pressure, model.dt, e.bleed);
  for (size_t i = 0; i < k.flow.size(); ++i) {
    const physical::Bleed& b = e.bleed[i];
    if ((k.flow[i] > 0) == (b.flow > 0)) continue;
    Event event;
    event.kind = b.flow > 0 ? EventKind::bleeding_started : EventKind::bleeding_stopped;
    event.who = kNoHand, event.which = static_cast<uint32_t>(i), event.value = b.flow > 0 ? b.flow : b.lost;
    event.where = wall::place(wall::weights(wall, state.physical.world.wall.topology, b.at), state.physical.world.wall.motion);
    state.event.add(event);
  }
}

}  // namespace catgut
