// SPDX-License-Identifier: Apache-2.0
// runtime: see session_log.h.
#include "runtime/session_log.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "runtime/report.h"

namespace catgut {

void SessionLog::start(const SceneSpec& scene, const PictureModel& picture) {
  tick_s_ = 1 / static_cast<double>(scene.solver.tick_rate);
  settle_s_ = static_cast<double>(scene.settle);
  picture_ = picture;
  map_ = start_map(picture, tick_s_);
}

void SessionLog::tick(const Snapshot& seen) {
  ++ticks_;
  if (seen.time_s < settle_s_ + 0.5 * tick_s_) return;
  update(metrics_, seen, static_cast<float>(tick_s_));
  note(map_, picture_, seen);
}

LiveResult SessionLog::result() const {
  LiveResult out;
  out.metrics = metrics_;
  out.map = map_;
  out.ticks = ticks_;
  return out;
}

std::string with_session(const std::string& json, const SceneSpec& scene, const LiveResult& result) {
  nlohmann::ordered_json all = nlohmann::ordered_json::parse(json);
  nlohmann::ordered_json session = nlohmann::ordered_json::parse(session_json(scene, result));
  for (const char* of_run : {"catgut", "scene", "title", "recorded", "fault", "state_hash"}) session.erase(of_run);
  all["session"] = session;
  return all.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

std::string session_csv(const LiveResult& r) {
  const SessionMetrics& m = r.metrics;
  std::string out = "kind,number,time_s,name,value,unit\n";
  const auto row = [&](const char* kind, size_t number, double time_s, const std::string& name, double value,
                       const char* unit) {
    out += fmt::format("{},{},{:.3f},{},{:.6g},{}\n", kind, number, time_s, name, value, unit);
  };
  const auto total = [&](const std::string& name, double value, const char* unit) {
    row("result", 0, m.time_s, name, value, unit);
  };
  total("time", m.time_s, "s");
  total("bites", m.bites, "");
  total("bites_withdrawn", m.bites_withdrawn, "");
  total("undos", m.undos, "");
  total("knots", m.knots, "");
  total("throws", m.throws, "");
  total("cuts", m.cuts, "");
  total("needle_slips", m.needle_slips, "");
  total("thread_slips", m.thread_slips, "");
  total("tissue_slips", m.tissue_slips, "");
  total("overloads", m.overloads, "");
  total("peak_tension", static_cast<double>(m.peak_tension), "N");
  static constexpr const char* kHand[kMaxHands] = {"right", "left", "assistant_right", "assistant_left"};
  for (size_t k = 0; k < kMaxHands; ++k) {
    if (k > 1 && m.path[k] == 0) continue;  // an assistant who did nothing
    total(fmt::format("path_{}", kHand[k]), static_cast<double>(m.path[k]), "m");
    total(fmt::format("peak_force_{}", kHand[k]), static_cast<double>(m.peak_force[k]), "N");
  }
  if (m.opening_start > 0) total("opening_ratio", static_cast<double>(m.opening / m.opening_start), "");
  for (size_t f = 1; f < m.faults.size(); ++f)
    if (m.faults[f] > 0) row("fault", 0, m.time_s, fault_name(static_cast<Fault>(f)), m.faults[f], "");
  if (m.overloads > 0) row("fault", 0, m.time_s, "overload", m.overloads, "");
  for (size_t i = 0; i < r.map.bite.size(); ++i) {
    const StitchBite& b = r.map.bite[i];
    const double t = static_cast<double>(b.tick) * r.map.tick_s;
    const auto stitch = [&](const char* name, float meters) {
      if (meters >= 0) row("stitch", i + 1, t, name, 1000 * static_cast<double>(meters), "mm");
    };
    row("stitch", i + 1, t, "wall", b.wall + 1, "");
    stitch("length", b.length), stitch("depth", b.depth), stitch("spacing", b.spacing);
    stitch("entry_edge", b.entry_edge), stitch("exit_edge", b.exit_edge);
    if (b.entry_angle >= 0)
      row("stitch", i + 1, t, "entry_angle", static_cast<double>(b.entry_angle) * 180 / double{kPi}, "degrees");
  }
  for (size_t i = 0; i < r.map.tension.size(); ++i) {
    const TensionSample& s = r.map.tension[i];
    const double t = static_cast<double>(s.tick) * r.map.tick_s;
    row("tension", i + 1, t, "peak", static_cast<double>(s.peak), "N");
    row("tension", i + 1, t, "needle", static_cast<double>(s.needle), "N");
  }
  for (size_t i = 0; i < r.map.event.size(); ++i) {
    const Event& e = r.map.event[i];
    row("event", i + 1, static_cast<double>(e.tick) * r.map.tick_s, event_name(e.kind), static_cast<double>(e.value), "");
  }
  return out;
}

}  // namespace catgut
