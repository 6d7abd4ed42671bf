// SPDX-License-Identifier: Apache-2.0
// runtime: collects a run's results; see metrics_collector.h for their definitions.
#include "runtime/metrics_collector.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "exchange/strand.h"
#include "runtime/cut_measures.h"

namespace catgut {

Percentiles percentiles_of(std::vector<float> values) {
  if (values.empty()) return {};
  std::sort(values.begin(), values.end());
  const auto at = [&](double part) {
    const size_t rank = static_cast<size_t>(std::ceil(part * static_cast<double>(values.size())));
    return static_cast<double>(values[std::clamp<size_t>(rank, 1, values.size()) - 1]);
  };
  return {at(0.5), at(0.99), at(0.999), static_cast<double>(values.back())};
}

bool RunResult::expectations_hold() const {
  return std::all_of(expect.begin(), expect.end(), [](const ExpectationResult& e) { return e.ok; });
}

namespace {

// Of a result whose thing is not there, such as a gap where no stitch crosses: it meets no expectation.
constexpr double kNotMeasured = std::numeric_limits<double>::quiet_NaN();

// |free end - needle end| / sum of the thread outside the first and the last suture point, along the thread. 0 without both.
double tail_asymmetry(const Snapshot& seen, size_t which) {
  if (which >= seen.suture.size()) return 0;
  const SutureView& suture = seen.suture[which];
  if (suture.suture_point.empty() || suture.thread_order.size() < 2) return 0;
  const auto begin = suture.thread_order.begin(), end = suture.thread_order.end();
  std::ptrdiff_t first = end - begin, last = 0;
  for (const SuturePointView& p : suture.suture_point) {
    const auto at = std::find(begin, end, p.anchored) - begin;
    first = std::min(first, at), last = std::max(last, at);
  }
  const auto length = [&](std::ptrdiff_t from, std::ptrdiff_t to) {
    double sum = 0;
    for (; from < to && from + 1 < end - begin; ++from)
      sum += distance(seen.particle[begin[from]], seen.particle[begin[from + 1]]);
    return sum;
  };
  const double tail = length(0, first), needle_side = length(last, end - begin - 1);
  return tail + needle_side > 0 ? std::abs(tail - needle_side) / (tail + needle_side) : 0;
}

// Of an edge, a polygon through the outer particles of a rim.
Vec3 nearest_on_edge(const Snapshot& seen, const std::vector<uint32_t>& rim, Vec3 p) {
  Vec3 best = seen.particle[rim[0]];
  for (size_t i = 0; i < rim.size(); ++i) {
    const Vec3 a = seen.particle[rim[i]], way = seen.particle[rim[(i + 1) % rim.size()]] - a;
    const Vec3 q = a + way * std::clamp(dot(p - a, way) / std::max(1e-12f, length2(way)), 0.0f, 1.0f);
    if (distance(q, p) < distance(best, p)) best = q;
  }
  return best;
}

}  // namespace

MetricsCollector::MetricsCollector(const SceneSpec& scene, const PictureModel& picture)
    : scene_(scene), suture_(picture.suture), rim_(picture.rim), tail_asymmetry_(picture.suture.size(), -1) {}

void MetricsCollector::open() { opening_wanted_ = true; }

void MetricsCollector::tick(const Snapshot& seen) {
  if (opening_wanted_) opening_at_start_ = seen.opening_area;
  opening_wanted_ = false;
  least_opening_ = std::min(least_opening_, seen.opening_area);
  bool passing = false;
  for (const Event& e : seen.event) {
    count(counts_, e);
    passing = passing || e.kind == EventKind::particle_passed;
    if (e.kind != EventKind::throw_started || e.suture >= tail_asymmetry_.size()) continue;
    double& of_suture = tail_asymmetry_[e.suture];
    if (of_suture < 0) of_suture = tail_asymmetry(seen, e.suture);
  }
  const float error = thread_length_error(seen);
  if (!std::isfinite(error)) valid_ = false;
  float& worst = passing ? length_error_passing_ : length_error_;
  worst = std::max(worst, error);
  order_errors_ = std::max(order_errors_, count_order_errors(seen));
  for (const SutureView& suture : seen.suture)
    for (const float tension : suture.thread_tension) thread_force_ = std::max(thread_force_, tension);
  if (const double now = edge_inversion(seen); now > most_inversion_) most_inversion_ = now;
  const bool held = std::any_of(seen.tool.begin(), seen.tool.end(), [](const ToolView& t) { return t.held != Held::nothing; });
  if (held_ && !held) let_go_s_ = seen.time_s, let_go_gap_ = wound_gap(seen), let_go_opening_ = seen.opening_area;
  held_ = held;
}

namespace {

// A single stitch has two holes in either wall. With more of them, and one crossing in between, the thread is a loop that
// crosses again where its ends are tied.
bool is_loop(const std::vector<SuturePointView>& point, size_t crossings) { return crossings == 1 && point.size() > 4; }

}  // namespace

// Where the active suture crosses from one wall to the other, the largest: from the first edge's point that is nearest to the
// crossing to the other edge.
double MetricsCollector::wound_gap(const Snapshot& seen) const {
  const std::vector<SuturePointView>& point = seen.active().suture_point;
  if (rim_.size() != 2 || point.empty() || point.front().wall == point.back().wall) return kNotMeasured;
  const auto gap = [&](Vec3 p) {
    const Vec3 a = nearest_on_edge(seen, rim_[0], p);
    return distance(a, nearest_on_edge(seen, rim_[1], a));
  };
  float most = 0;
  size_t crossings = 0;
  for (size_t k = 0; k + 1 < point.size(); ++k)
    if (point[k].wall != point[k + 1].wall)
      most = std::max(most, gap(0.5f * (point[k].position + point[k + 1].position))), ++crossings;
  if (crossings > 1) return most;
  const float ends = gap(0.5f * (point.front().position + point.back().position));
  return is_loop(point, crossings) ? std::max(most, ends) : ends;
}

// How far the edges lie inward of the line from the last hole in one wall to the first one in the other, the least of all
// crossings and both edges. Outward is away from the middle of both openings.
double MetricsCollector::edge_inversion(const Snapshot& seen) const {
  const std::vector<SuturePointView>& point = seen.active().suture_point;
  if (rim_.size() != 2) return kNotMeasured;
  Vec3 middle;
  for (const std::vector<uint32_t>& rim : rim_)
    for (const uint32_t i : rim) middle += seen.particle[i] / (2 * static_cast<float>(rim.size()));
  float least = std::numeric_limits<float>::max();
  const auto look = [&](Vec3 a, Vec3 b) {
    const Vec3 at = 0.5f * (a + b), across = normalized(b - a, {1, 0, 0});
    const Vec3 out = normalized(at - middle - across * dot(at - middle, across), {0, 1, 0});
    for (const std::vector<uint32_t>& rim : rim_) least = std::min(least, dot(at - nearest_on_edge(seen, rim, at), out));
  };
  size_t crossings = 0;
  for (size_t k = 0; k + 1 < point.size(); ++k)
    if (point[k].wall != point[k + 1].wall) look(point[k].position, point[k + 1].position), ++crossings;
  if (is_loop(point, crossings)) look(point.back().position, point.front().position);
  return least < std::numeric_limits<float>::max() ? least : kNotMeasured;
}

// Depth of the bites, as part of the wall's thickness, and those that reach the inner face.
void MetricsCollector::measure_depth(const Snapshot& last, std::map<std::string, double>& v) const {
  double least = 0, most = 0, through = 0;
  bool any = false;
  for (const SutureView& suture : last.suture)
    for (const BiteView& b : suture.bite) {
      if (!b.complete || b.wall >= scene_.body.size()) continue;
      const double part = b.entry_inside != b.exit_inside ? 1 : static_cast<double>(b.depth / scene_.body[b.wall].wall);
      least = any ? std::min(least, part) : part, most = std::max(most, part), any = true;
      through += b.entry_inside || b.exit_inside;
    }
  v["bite_depth_least"] = least;
  v["bite_depth_most"] = most;
  v["full_thickness_bites"] = through;
}

void MetricsCollector::measure_seam(const Snapshot& last, std::map<std::string, double>& v) const {
  double gap = 0, all = 0, start = 0;
  bool any = false;
  size_t pairs = 0;
  for (const SutureView& suture : last.suture)
    for (const SeamView& s : suture.seam) {
      const double d = distance(s.a, s.b);
      ++pairs;
      all = std::max(all, d);
      if (!s.midpoint) continue;
      gap = std::max(gap, d);
      start = any ? std::min(start, static_cast<double>(s.start)) : static_cast<double>(s.start);
      any = true;
    }
  v["pairs"] = static_cast<double>(pairs);
  v["seam_gap"] = any ? gap : kNotMeasured;
  v["seam_gap_all"] = pairs > 0 ? all : kNotMeasured;
  v["seam_gap_start"] = any ? start : kNotMeasured;
}

void MetricsCollector::time(const StageTimes& times, double tick_ms) {
  solver_ms_.push_back(static_cast<float>(times.solver_ms()));
  tick_ms_.push_back(static_cast<float>(tick_ms));
  for (size_t s = 0; s < kStages; ++s) stage_ms_[s].push_back(static_cast<float>(times.ms[s]));
  contacts_ = std::max(contacts_, times.contacts);
  spent_ms_ += tick_ms;
  if (tick_ms > 1000.0 / scene_.solver.tick_rate) ++overrun_ticks_;
  if (tick_ms > longest_ms_) longest_ms_ = tick_ms, longest_ = times, longest_tick_ = tick_ms_.size();
}

float MetricsCollector::thread_length_error(const Snapshot& seen) const {
  float worst = 0;
  for (size_t k = 0; k < seen.suture.size(); ++k) {
    const SutureView& suture = seen.suture[k];
    const std::vector<uint32_t>& order = suture.thread_order;
    if (order.size() < 2) continue;
    double length = 0;
    bool whole = true;
    for (size_t i = 1; i < order.size(); ++i) {
      const uint32_t a = order[i - 1], b = order[i];
      if (i - 1 < suture.thread_cut.size() && suture.thread_cut[i - 1]) {
        whole = false;
        continue;
      }
      if (a < seen.particle.size() && b < seen.particle.size()) length += distance(seen.particle[a], seen.particle[b]);
    }
    // Uncut, the thread is compared with the scene; cut, its pieces with their reported lengths.
    const double rest = whole ? static_cast<double>(order.size() - 1) * suture_[k].thread_spacing : suture.thread_rest;
    const float error = rest > 0 ? static_cast<float>(std::abs(length - rest) / rest) : 0;
    worst = std::isfinite(error) ? std::max(worst, error) : error;
    if (!std::isfinite(error)) break;
  }
  return worst;
}

uint32_t MetricsCollector::count_order_errors(const Snapshot& seen) {
  uint32_t wrong = 0;
  for (size_t k = 0; k < seen.suture.size(); ++k) {
    seen_slot_.assign(suture_[k].thread_count, 0);  // within its capacity after the first
    for (const uint32_t slot : seen.suture[k].thread_order) {
      const uint32_t i = slot - suture_[k].thread_first;  // wraps to a large number below the first
      if (i >= suture_[k].thread_count || seen_slot_[i]) ++wrong;
      else seen_slot_[i] = 1;
    }
    wrong += static_cast<uint32_t>(std::count(seen_slot_.begin(), seen_slot_.end(), uint8_t{0}));
  }
  return wrong;
}

void MetricsCollector::finish(const Snapshot& last, RunResult& result) const {
  for (size_t k = 0; k < counts_.events.size(); ++k) {
    const char* name = event_name(static_cast<EventKind>(k));
    if (counts_.events[k]) result.events[name] = counts_.events[k];
    result.value[name] = static_cast<double>(counts_.events[k]);
  }
  result.value.erase(event_name(EventKind::suture_point));  // the result suture_points has this count
  std::map<std::string, double>& v = result.value;
  size_t bites = 0, off = 0;
  for (const SutureView& suture : last.suture) {
    for (const BiteView& b : suture.bite) bites += b.complete;
    off += !suture.needle_on_thread;
  }
  v["bites"] = static_cast<double>(bites);
  v["suture_points"] = static_cast<double>(suture_point_count(last));
  v["knots"] = counts_.knots;
  v["throws"] = counts_.throws;
  v["last_knot_throws"] = counts_.last_knot_throws;
  v["sutures"] = static_cast<double>(last.settled.size() + counts_.tied());
  measure_seam(last, v);
  measure_depth(last, v);
  v["edge_inversion"] = edge_inversion(last);
  v["edge_inversion_most"] = most_inversion_;
  v["wound_gap"] = wound_gap(last);
  v["wound_gap_change"] = held_ ? kNotMeasured : wound_gap(last) - let_go_gap_;
  v["hands_off"] = held_ ? 0 : last.time_s - let_go_s_;
  v["thread_force"] = thread_force_;
  v["needle_detached"] = static_cast<double>(off);
  double& held = v["held_ends"] = 0;
  for (const ToolView& tool : last.tool) held = std::max(held, static_cast<double>(tool.held_strands));
  double& uneven = v["tail_asymmetry"] = kNotMeasured;
  for (const double of_suture : tail_asymmetry_)
    if (of_suture >= 0) uneven = uneven >= of_suture ? uneven : of_suture;
  for (size_t k = 1; k < counts_.faults.size(); ++k) {
    const std::string name = fault_name(static_cast<Fault>(k));
    if (counts_.faults[k]) result.faults[name] = counts_.faults[k];
    v["fault_" + name] = static_cast<double>(counts_.faults[k]);
  }
  v["particles"] = static_cast<double>(result.particles);
  const double start = opening_at_start_;
  v["opening_ratio"] = start > 0 ? static_cast<double>(last.opening_area) / start : 1;
  v["opening_ratio_least"] = start > 0 ? static_cast<double>(least_opening_) / start : 1;
  v["opening_ratio_change"] = start > 0 && !held_ ? static_cast<double>(last.opening_area - let_go_opening_) / start : 0;
  v["closure"] = last.closure;
  v["thread_length_error"] = length_error_;
  v["thread_length_error_passing"] = length_error_passing_;
  v["order_errors"] = order_errors_;
  v["state_valid"] = valid_ ? 1 : 0;
  const CutMeasures cut = measure_cut(scene_, last);
  v["pieces"] = cut.pieces;
  v["cut_deviation"] = cut.deviation;
  v["ring_gap"] = cut.ring_gap;
  v["stitch_gap"] = cut.stitch_gap;
  v["stitch_tension"] = cut.stitch_tension;
  if (scene_.mechanics.kind == "physical") result.stitch = measure_stitches(last);
  v["throws_held"] = throws_held(result.stitch), v["stitches_finished"] = stitches_finished(result.stitch);
  v["edge_eversion"] = cut.eversion;
  v["specimen_way"] = cut.way;
  v["drawn_mass"] = cut.mass;
  double &lost = v["blood_loss"] = 0, &bleeding = v["bleeding"] = 0;
  for (const BleedingView& b : last.wound.bleeding) lost += static_cast<double>(b.lost), bleeding += b.flow > 0 ? 1 : 0;
  v["thermal_spread"] = static_cast<double>(last.wound.thermal_spread);
  v["burnt_area"] = static_cast<double>(last.wound.damaged);
  v["simulated_s"] = result.simulated_s;
  v["ticks"] = static_cast<double>(result.ticks);
  v.try_emplace("surgeon_retries", 0);
  v.try_emplace("surgeon_done", 0);
  v.try_emplace("contacts_dropped", 0);
  v.try_emplace("stitch_slip", kNotMeasured), v.try_emplace("stitch_bears", kNotMeasured);

  result.solver_ms = percentiles_of(solver_ms_);
  result.tick_ms = percentiles_of(tick_ms_);
  result.longest = longest_;
  result.longest_tick = longest_tick_;
  result.overrun_ticks = overrun_ticks_;
  for (size_t s = 0; s < kStages; ++s) result.stage_ms[s] = percentiles_of(stage_ms_[s]);
  result.contacts = contacts_;
  result.real_time_factor = spent_ms_ > 0 ? result.simulated_s * 1000 / spent_ms_ : 0;
  for (const Expectation& want : scene_.expect) {
    const auto found = v.find(want.name);
    const double got = found == v.end() ? std::nan("") : found->second;
    result.expect.push_back({want, got, got >= want.min && got <= want.max});
  }
}

}  // namespace catgut
