// SPDX-License-Identifier: Apache-2.0
// runtime: writes results; see report.h. Non-finite numbers become null, as JSON requires.
#include "runtime/report.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

namespace catgut {
namespace {
using Json = nlohmann::ordered_json;

Json percentiles_json(const Percentiles& s) { return {{"median", s.median}, {"p99", s.p99}, {"p999", s.p999}, {"max", s.max}}; }

// Counts are written without a fraction: 12, not 12.0.
Json number_json(double v) {
  if (std::isfinite(v) && v == std::floor(v) && std::abs(v) < 1e15) return static_cast<int64_t>(v);
  return v;
}

Json want_json(const Expectation& e) {
  if (e.min == e.max) return number_json(e.min);
  Json want = Json::object();
  const Expectation open;
  if (e.min != open.min) want["min"] = number_json(e.min);
  if (e.max != open.max) want["max"] = number_json(e.max);
  return want;
}

std::string want_text(const Expectation& e) {
  const Expectation open;
  if (e.min == e.max) return fmt::format("{}", e.min);
  if (e.min != open.min && e.max != open.max) return fmt::format("{} to {}", e.min, e.max);
  return e.min != open.min ? fmt::format("at least {}", e.min) : fmt::format("at most {}", e.max);
}

double value(const RunResult& r, const char* name) {
  const auto found = r.value.find(name);
  return found == r.value.end() ? 0 : found->second;
}

Json json_of(const RunResult& r) {
  Json j;
  j["catgut"] = catgut_version();
  j["scene"] = r.scene;
  j["title"] = r.title;
  j["preset"] = r.preset;
  j["surgeon"] = r.surgeon;
  j["threads"] = r.threads;
  j["particles"] = r.particles;
  j["ticks"] = r.ticks;
  j["simulated_s"] = r.simulated_s;
  j["real_time_factor"] = r.real_time_factor;
  j["solver_ms"] = percentiles_json(r.solver_ms);
  j["tick_ms"] = percentiles_json(r.tick_ms);
  j["overrun_ticks"] = r.overrun_ticks;
  j["longest_tick"] = {{"tick", r.longest_tick}, {"ms", r.tick_ms.max}, {"stages", Json::object()}};
  for (size_t s = 0; s < kStages; ++s) j["longest_tick"]["stages"][stage_name(static_cast<Stage>(s))] = r.longest.ms[s];
  j["stages"] = Json::object();
  for (size_t s = 0; s < kStages; ++s) j["stages"][stage_name(static_cast<Stage>(s))] = percentiles_json(r.stage_ms[s]);
  j["contacts"] = r.contacts;
  for (const char* name : {"bites",
                           "sutures",
                           "knots",
                           "throws",
                           "last_knot_throws",
                           "suture_points",
                           "opening_ratio",
                           "closure",
                           "pairs",
                           "seam_gap",
                           "seam_gap_all",
                           "seam_gap_start",
                           "needle_detached",
                           "held_ends",
                           "tail_asymmetry",
                           "thread_length_error",
                           "thread_length_error_passing",
                           "order_errors",
                           "state_valid",
                           "surgeon_retries",
                           "surgeon_done",
                           "contacts_dropped"})
    j[name] = number_json(value(r, name));
  j["events"] = r.events.empty() ? Json::object() : Json(r.events);
  j["faults"] = r.faults.empty() ? Json::object() : Json(r.faults);
  j["stitches"] = Json::array();
  for (const StitchMeasures& s : r.stitch)
    j["stitches"].push_back({{"suture", s.suture},
                             {"finished", s.finished},
                             {"suture_points", s.points},
                             {"throws", s.throws()},
                             {"right", s.right},
                             {"left", s.left},
                             {"alternating", s.alternating},
                             {"tension_n", s.tension},
                             {"first_to_last_m", s.first_to_last}});
  j["expect"] = Json::object();
  for (const ExpectationResult& e : r.expect)
    j["expect"][e.want.name] = {{"want", want_json(e.want)}, {"got", number_json(e.got)}, {"ok", e.ok}};
  j["interrupted"] = r.interrupted;
  j["ended"] = r.ended;
  j["state_hash"] = fmt::format("{:016x}", r.state_hash);
  return j;
}

// Names come from files and may have any bytes: invalid UTF-8 is replaced, not an error.
std::string text(const Json& j) { return j.dump(2, ' ', false, Json::error_handler_t::replace) + "\n"; }

}  // namespace

std::string run_json(const RunResult& result) { return text(json_of(result)); }

std::string with_procedure(const std::string& json, const Procedure& procedure, const ProcedureRun& run) {
  static constexpr const char* kState[] = {"waiting", "active", "done", "met", "skipped"};
  Json j = Json::parse(json), p;
  p["name"] = procedure.name;
  p["title"] = procedure.title;
  p["finished"] = finished(run, procedure);
  p["faultless"] = faultless(run, procedure);
  p["stages"] = Json::array();
  for (size_t k = 0; k < run.record.size(); ++k) {
    const StageRecord& r = run.record[k];
    const bool over = r.state != StageState::waiting && r.state != StageState::active;
    Json stage{{"name", procedure.stage[k].name}, {"state", kState[static_cast<size_t>(r.state)]}, {"errors", r.errors}};
    stage["time_s"] = over ? Json(static_cast<double>(r.to - r.from) * run.tick_s) : Json();
    stage["demonstrated"] = r.assisted;
    p["stages"].push_back(stage);
  }
  p["errors"] = Json::array();
  for (const ErrorNote& n : run.error)
    p["errors"].push_back({{"time_s", static_cast<double>(n.tick) * run.tick_s},
                           {"stage", procedure.stage[n.stage].name},
                           {"error", n.error < procedure.error.size() ? procedure.error[n.error].name : "skipped"},
                           {"text", error_text(procedure, n)}});
  p["feedback"] = Json::array();
  for (const Feedback& f : feedback(run, procedure))
    p["feedback"].push_back({{"stage", procedure.stage[f.stage].name}, {"well", f.well}, {"text", f.text}});
  j["procedure"] = p;
  return text(j);
}

std::string replay_json(const ReplayResult& result, const Recording& recording) {
  Json j = json_of(result.run);
  j["recorded_by"] = recording.header.catgut_version;
  j["recorded_ticks"] = recording.tick.size();
  j["truncated"] = recording.truncated;
  j["differs_at"] = result.differs_at ? Json(*result.differs_at) : Json();
  return text(j);
}

namespace {

double mm(float meters) { return std::round(1e6 * static_cast<double>(meters)) / 1e3; }
double newtons(float force) { return std::round(1e4 * static_cast<double>(force)) / 1e4; }
Json mm_or_null(float meters) { return meters < 0 ? Json() : Json(mm(meters)); }
Json point_mm(Vec3 p) { return {mm(p.x), mm(p.y), mm(p.z)}; }

Json bite_json(const StitchBite& b, double tick_s) {
  return {{"time_s", static_cast<double>(b.tick) * tick_s},
          {"suture", b.suture},
          {"bite", b.bite},
          {"wall", b.wall},
          {"entry_mm", point_mm(b.entry)},
          {"exit_mm", point_mm(b.exit)},
          {"along_mm", {mm(b.entry_along), mm(b.exit_along)}},
          {"edge_mm", {mm_or_null(b.entry_edge), mm_or_null(b.exit_edge)}},
          {"spacing_mm", mm_or_null(b.spacing)},
          {"length_mm", mm(b.length)},
          {"depth_mm", mm(b.depth)},
          {"entry_angle_deg", b.entry_angle < 0 ? Json() : Json(std::round(10 * b.entry_angle * 180 / kPi) / 10)},
          {"inside", {b.entry_inside, b.exit_inside}}};
}

}  // namespace

std::string session_json(const SceneSpec& scene, const LiveResult& r) {
  const SessionMetrics& p = r.metrics;
  Json j;
  j["catgut"] = catgut_version();
  j["scene"] = scene.name;
  j["title"] = scene.title;
  j["technique"] = scene.technique.name;
  j["time_s"] = p.time_s;
  j["bites"] = p.bites;
  j["bites_withdrawn"] = p.bites_withdrawn;
  j["undos"] = p.undos;
  j["knots"] = p.knots;
  j["throws"] = p.throws;
  j["cuts"] = p.cuts;
  j["sutures_baked"] = p.sutures_baked;
  j["needle_slips"] = p.needle_slips;
  j["thread_slips"] = p.thread_slips;
  j["tissue_slips"] = p.tissue_slips;
  j["overloads"] = p.overloads;
  j["peak_tension_n"] = newtons(p.peak_tension);
  for (size_t k = 0; k < kMaxHands; ++k) {
    if (k > 1 && p.path[k] == 0) continue;  // an assistant who did nothing
    j["path_m"].push_back(p.path[k]);
    j["peak_force_n"].push_back(newtons(p.peak_force[k]));
    j["peak_force_rendered_n"].push_back(p.peak_rendered[k] < 0 ? Json() : Json(newtons(p.peak_rendered[k])));
  }
  j["opening_ratio"] = p.opening_start > 0 ? Json(p.opening / p.opening_start) : Json();
  j["faults"] = Json::object();
  for (size_t f = 1; f < p.faults.size(); ++f)
    if (p.faults[f]) j["faults"][fault_name(static_cast<Fault>(f))] = p.faults[f];
  if (p.overloads > 0) j["faults"]["overload"] = p.overloads;
  j["edges"] = Json::array();
  for (const StitchEdge& e : r.map.edge) {
    Json points = Json::array();
    for (Vec3 q : e.point) points.push_back(point_mm(q));
    j["edges"].push_back({{"length_mm", mm(e.length())}, {"at_rest_mm", points}});
  }
  j["stitches"] = Json::array();
  for (const StitchBite& b : r.map.bite) j["stitches"].push_back(bite_json(b, r.map.tick_s));
  j["tension"] = {{"time_s", Json::array()}, {"peak_n", Json::array()}, {"needle_n", Json::array()}};
  for (const TensionSample& t : r.map.tension) {
    j["tension"]["time_s"].push_back(std::round(1e3 * static_cast<double>(t.tick) * r.map.tick_s) / 1e3);
    j["tension"]["peak_n"].push_back(newtons(t.peak));
    j["tension"]["needle_n"].push_back(newtons(t.needle));
  }
  j["events"] = Json::array();
  for (const Event& e : r.map.event) {
    j["events"].push_back({{"tick", e.tick},
                           {"time_s", std::round(1e3 * static_cast<double>(e.tick) * r.map.tick_s) / 1e3},
                           {"event", event_name(e.kind)},
                           {"who", e.who},
                           {"which", e.which},
                           {"value", e.value},
                           {"where_mm", point_mm(e.where)}});
    if (e.fault != Fault::none) j["events"].back()["fault"] = fault_name(e.fault);
    if (e.reason != LoopReason::none) j["events"].back()["reason"] = loop_reason_name(e.reason);
  }
  j["recorded"] = r.recorded;
  j["fault"] = r.fault;
  j["state_hash"] = fmt::format("{:016x}", r.state_hash);
  return text(j);
}

std::string run_summary(const RunResult& r, bool judged) {
  std::string out =
      fmt::format("{}: {:.1f} s simulated in {} ticks, real-time factor {:.1f}, {} particles, {} thread{}\n", r.scene,
                  r.simulated_s, r.ticks, r.real_time_factor, r.particles, r.threads, r.threads == 1 ? "" : "s");
  out += fmt::format("  solver per tick {:.3f} ms (median), {:.3f} ms (99th percentile), {:.3f} ms (maximum)\n",
                     r.solver_ms.median, r.solver_ms.p99, r.solver_ms.max);
  if (r.overrun_ticks > 0) {
    // Time per stage in the longest ones.
    out += fmt::format("  {} ticks exceeded the real-time budget; longest: tick {}, {:.1f} ms:", r.overrun_ticks,
                       r.longest_tick, r.tick_ms.max);
    for (size_t s = 0; s < kStages; ++s)
      if (r.longest.ms[s] > 0.05 * r.tick_ms.max)
        out += fmt::format(" {} {:.1f}", stage_name(static_cast<Stage>(s)), r.longest.ms[s]);
    out += "\n";
  }
  out += fmt::format("  {} bites, {} suture points", value(r, "bites"), value(r, "suture_points"));
  if (value(r, "throws") > 0) out += fmt::format(", {} knots, {} throws", value(r, "knots"), value(r, "throws"));
  if (value(r, "pairs") > 0)
    out += fmt::format(", {} pairs, maximum gap {:.1f} mm", value(r, "pairs"), 1e3 * value(r, "seam_gap_all"));
  else out += fmt::format(", opening {:.1f} %", 100 * value(r, "opening_ratio"));
  out += "\n";
  for (const StitchMeasures& s : r.stitch)
    out += fmt::format("  suture {}: {} suture points, {} throw{} seen in its thread ({} right, {} left), {:.2f} N{}\n",
                       s.suture + 1, s.points, s.throws(), s.throws() == 1 ? "" : "s", s.right, s.left, s.tension,
                       s.finished ? "" : ", not cut off");
  for (const auto& [name, count] : r.faults) out += fmt::format("  fault: {} ({} x)\n", name, count);
  if (const double dropped = value(r, "contacts_dropped"); dropped > 0)
    out += fmt::format("  warning: {:.0f} contacts found no room; what touched there could pass through\n", dropped);
  const double retries = value(r, "surgeon_retries");
  out += fmt::format("  end: {}{}; state {:016x}\n", r.ended,
                     retries > 0 ? fmt::format(", {} {}", retries, retries == 1 ? "retry" : "retries") : "", r.state_hash);
  for (const ExpectationResult& e : r.expect)
    out += fmt::format("  {} {} = {}, expected {}\n",
                       e.ok     ? "ok     "
                       : judged ? "FAILED "
                                : "differs",
                       e.want.name, std::isnan(e.got) ? "not measured" : fmt::format("{:.6g}", e.got), want_text(e.want));
  return out;
}

std::string stage_table(const RunResult& r) {
  std::string out = fmt::format("{:<16}{:>12}{:>12}{:>12}{:>12}\n", "stage", "median ms", "p99 ms", "p99.9 ms", "max ms");
  const auto row = [&](const char* name, const Percentiles& s) {
    out += fmt::format("{:<16}{:>12.4f}{:>12.4f}{:>12.4f}{:>12.4f}\n", name, s.median, s.p99, s.p999, s.max);
  };
  for (size_t s = 0; s < kStages; ++s) row(stage_name(static_cast<Stage>(s)), r.stage_ms[s]);
  row("solver", r.solver_ms);
  row("whole tick", r.tick_ms);
  if (r.ticks > 0)
    out += fmt::format("{} of {} ticks ({:.3f} %) exceeded the real-time budget of {:.3f} ms\n", r.overrun_ticks, r.ticks,
                       100.0 * static_cast<double>(r.overrun_ticks) / static_cast<double>(r.ticks),
                       1000 * r.simulated_s / static_cast<double>(r.ticks));
  return out;
}

}  // namespace catgut
