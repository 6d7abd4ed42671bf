// SPDX-License-Identifier: Apache-2.0
// runtime: see measures.h.
#include "runtime/measures.h"

#include <algorithm>
#include <cmath>

#include "sim/model.h"
#include "sim/scene.h"
#include "sim/state.h"

namespace catgut {

const char* force_name(ForceKind kind) {
  static constexpr const char* kName[] = {"thread", "tool and needle", "attachment", "needle track", "seam"};
  static_assert(sizeof(kName) / sizeof(kName[0]) == static_cast<size_t>(ForceKind::count_));
  return kind < ForceKind::count_ ? kName[static_cast<size_t>(kind)] : "unknown";
}

void measure(const Model& model, const State& state, Measures& out) {
  const SolverModel& m = model.solver;
  const SolverState& s = state.solver;
  out.particles = m.count;
  out.thread_particles = m.count - m.tissue;
  out.clusters = m.shape.clusters;
  out.contacts = state.scratch.contacts;
  out.peak_n.fill(0);
  const float inv_h2 = 1 / (m.h * m.h);
  const auto row = [&](ForceKind kind, size_t count) -> float& {
    out.constraints[static_cast<size_t>(kind)] = static_cast<uint32_t>(count);
    return out.peak_n[static_cast<size_t>(kind)];
  };
  size_t pairs = 0;
  for (const Strand& strand : s.strand) pairs += strand.tension.size();
  float& thread = row(ForceKind::thread, pairs);
  for (const Strand& strand : s.strand)
    for (float t : strand.tension) thread = std::max(thread, std::abs(t));
  float& tool = row(ForceKind::tool, s.weld.size());
  for (const Weld& w : s.weld) tool = std::max(tool, length(w.lambda) * inv_h2);
  float& attachment = row(ForceKind::attachment, s.attach.size());
  for (const Attachment& a : s.attach) attachment = std::max(attachment, length(a.lambda) * inv_h2);
  float& channel = row(ForceKind::channel, s.channel.size());
  for (const NeedleTrackConstraint& c : s.channel)
    channel = std::max({channel, length(c.lambda) * inv_h2, std::abs(c.drag_lambda) * inv_h2});
  float& seam = row(ForceKind::seam, s.pin.size());
  for (const Tether& p : s.pin) seam = std::max(seam, std::abs(p.lambda) * inv_h2);
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
