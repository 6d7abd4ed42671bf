// SPDX-License-Identifier: Apache-2.0
// runtime: see measures.h.
#include "runtime/measures.h"

#include <algorithm>
#include <cmath>

#include "sim/model.h"
#include "sim/scene.h"
#include "sim/state.h"

namespace catgut {

namespace {

// Multipliers of the last substep; lambda / h^2 is a force.
void measure_guided(const Model& model, const State& state, Measures& out) {
  const SolverModel& m = model.solver;
  const SolverState& s = state.solver;
  out.clusters = m.shape.clusters;
  out.contacts = state.scratch.contacts;
  const float inv_h2 = 1 / (m.h * m.h);
  auto& [thread, tool, attachment, channel, seam] = out.force;
  thread = {"thread"};
  for (const Strand& strand : s.strand) {
    thread.count += static_cast<uint32_t>(strand.tension.size());
    for (float t : strand.tension) thread.peak_n = std::max(thread.peak_n, std::abs(t));
  }
  const auto all = [&](ForceMeasure& row, const char* name, const auto& list, auto force) {
    row = {name, 0, static_cast<uint32_t>(list.size())};
    for (const auto& entry : list) row.peak_n = std::max(row.peak_n, force(entry) * inv_h2);
  };
  all(tool, "tool and needle", s.weld, [](const Weld& w) { return length(w.lambda); });
  all(attachment, "attachment", s.attach, [](const Attachment& a) { return length(a.lambda); });
  all(channel, "needle track", s.channel,
      [](const NeedleTrackConstraint& c) { return std::max(length(c.lambda), std::abs(c.drag_lambda)); });
  all(seam, "seam", s.pin, [](const Tether& p) { return std::abs(p.lambda); });
}

// Impulses of the last step of the wall; an impulse over the step is a force.
void measure_physical(const Model& model, const State& state, Measures& out) {
  const physical::Model& m = model.physical->world;
  const physical::State& s = state.physical.world;
  out.columns = wall::columns(s.wall);
  out.contacts = static_cast<uint32_t>(s.contact.size() + s.lip.size() + s.bodies.memory.size());
  for (const physical::Sleep::Strand& k : s.sleep.strand) out.awake += k.asleep ? 0 : k.last - k.first + 1;
  auto& [thread, hole, surface, lip, body] = out.force;
  thread = {"thread", 0, static_cast<uint32_t>(s.thread.segments())};
  for (size_t i = 0; i < s.thread.segments(); ++i)
    if (!s.thread.broken[i]) thread.peak_n = std::max(thread.peak_n, std::abs(s.thread.tension[i]));
  const auto all = [&](ForceMeasure& row, const char* name, const auto& list, float step, auto impulse) {
    row = {name, 0, static_cast<uint32_t>(list.size())};
    for (const auto& entry : list) row.peak_n = std::max(row.peak_n, impulse(entry) / step);
  };
  all(hole, "bite", s.hole, 1, [](const physical::Hole& h) { return length(h.load); });
  all(surface, "thread on wall", s.contact, m.thread.substep * m.thread.substep,  // as in thread::Crossing
      [](const thread::SoftContact& c) { return std::abs(c.normal_impulse); });
  all(lip, "wall on wall", s.lip, m.wall.step, [](const wall::Contact& c) { return length(c.impulse); });
  all(body, "instrument, needle", s.bodies.memory, m.wall.step, [](const physical::RowMemory& r) { return length(r.impulse); });
}

}  // namespace

void measure(const Model& model, const State& state, Measures& out) {
  const auto times = out.stage_ms;
  out = {};
  out.stage_ms = times;
  out.particles = model.solver.count;
  out.thread_particles = model.solver.count - model.solver.tissue;
  out.without_room = dropped_contacts(state);
  out.physical = model.physical != nullptr;
  if (out.physical) measure_physical(model, state, out);
  else measure_guided(model, state, out);
}

const std::array<LiveParameter, kLiveParameters>& live_parameters() {
  static const std::array<LiveParameter, kLiveParameters> kList{{
      {"solver.shape_stiffness", 0.05f, 1, [](const SceneSpec& s) { return s.solver.shape_stiffness; }},
      {"solver.damping", 0, 40, [](const SceneSpec& s) { return s.solver.damping; }},
      {"solver.thread_damping", 0, 60, [](const SceneSpec& s) { return s.solver.thread_damping; }},
      {"solver.friction_tissue", 0, 1, [](const SceneSpec& s) { return s.solver.friction_tissue; }},
      {"solver.friction_thread", 0, 1, [](const SceneSpec& s) { return s.solver.friction_thread; }},
      {"mechanics.pass_tension", 0.001f, 0.5f, [](const SceneSpec& s) { return s.mechanics.pass_tension; }},
      {"mechanics.capstan_friction", 0, 0.5f, [](const SceneSpec& s) { return s.mechanics.capstan_friction; }},
      {"mechanics.release_distance", 0.0005f, 0.008f, [](const SceneSpec& s) { return s.mechanics.release_distance; }},
      {"technique.closure_compliance", 0.000002f, 0.002f, [](const SceneSpec& s) { return s.technique.closure_compliance; }},
  }};
  return kList;
}

}  // namespace catgut
