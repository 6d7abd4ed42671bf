// SPDX-License-Identifier: Apache-2.0
// assess: writes a Result; see result.h.
#include "assess/result.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "assess/metrics.h"

namespace catgut::assess {
namespace {
using Json = nlohmann::ordered_json;

Json place(Vec3 v) { return Json::array({v.x, v.y, v.z}); }

Json bite_json(const Bite& b) {
  return {{"tick", b.tick},
          {"entered", b.entered},
          {"suture", b.suture},
          {"load", b.load},
          {"number", b.number},
          {"wall", b.wall},
          {"entry_m", place(b.entry)},
          {"exit_m", place(b.exit)},
          {"where_m", place(b.where)},
          {"along_in_mm", b.along_in},
          {"along_out_mm", b.along_out},
          {"edge_in_mm", b.edge_in},
          {"edge_out_mm", b.edge_out},
          {"length_mm", b.length},
          {"spacing_mm", b.spacing},
          {"depth_mm", b.depth},
          {"depth_fraction", b.depth_fraction},
          {"layers", b.layers},
          {"entry_angle_deg", b.entry_angle},
          {"exit_angle_deg", b.exit_angle},
          {"edge_angle_deg", b.edge_angle},
          {"wander_mm", b.wander},
          {"seconds", b.seconds},
          {"grasp_at", b.grasp_at},
          {"grasp_angle_deg", b.grasp_angle},
          {"attempts", b.attempts},
          {"grasps", b.grasps},
          {"entry_inside", b.entry_inside},
          {"exit_inside", b.exit_inside}};
}

Json knot_json(const Knot& k) {
  Json throws = Json::array();
  for (const Throw& t : k.thrown)
    throws.push_back({{"tick", t.tick},
                      {"wraps", t.wraps},
                      {"hand", t.hand},
                      {"sliding", t.sliding},
                      {"tension_n", t.tension},
                      {"gap_mm", t.gap},
                      {"seconds", t.seconds}});
  return {{"tick", k.tick},     {"suture", k.suture},        {"load", k.load},
          {"number", k.number}, {"where_m", place(k.where)}, {"kind", knot_kind_name(k.kind)},
          {"throws", throws}};
}

Json metric_json(const Metric& m) {
  const MetricRow* row = find_metric(m.key);
  Json samples = Json::array();
  for (const Sample& s : m.sample)
    samples.push_back({{"value", s.value}, {"tick", s.tick}, {"where_m", place(s.where)}, {"of", s.of}});
  return {{"key", m.key},
          {"name", row ? row->name : ""},
          {"unit", row ? row->unit : ""},
          {"summary", row ? summary_name(row->summary) : ""},
          {"better", row ? better_name(row->better) : ""},
          {"value", m.value},
          {"samples", samples}};
}

Json score_json(const Score& s) {
  Json items = Json::array(), lost = Json::array();
  for (const ItemScore& i : s.item)
    items.push_back({{"item", i.item},
                     {"title", i.title},
                     {"metric", i.metric},
                     {"unit", i.unit},
                     {"stage", i.stage},
                     {"value", i.value},
                     {"points", i.points},
                     {"of", i.of},
                     {"observed", i.observed},
                     {"passed", i.passed},
                     {"validated", i.validated},
                     {"source", i.source}});
  for (const LostPoint& l : s.lost)
    lost.push_back({{"item", l.item},
                    {"why", l.why},
                    {"of", l.of},
                    {"value", l.value},
                    {"points", l.points},
                    {"tick", l.tick},
                    {"time_s", l.time_s},
                    {"where_m", place(l.where)},
                    {"critical", l.critical}});
  return {{"rubric", s.rubric},
          {"title", s.title},
          {"version", s.version},
          {"rubric_hash", fmt::format("{:016x}", s.rubric_hash)},
          {"points", s.points},
          {"of", s.of},
          {"percent", s.percent},
          {"pass_percent", s.pass},
          {"every_item", s.every_item},
          {"completed", s.completed},
          {"passed", s.passed},
          {"verdict", s.verdict},
          {"items", items},
          {"lost", lost}};
}

}  // namespace

const Metric* Result::find(std::string_view key) const {
  for (const Metric& m : metric)
    if (m.key == key) return &m;
  return nullptr;
}

double Result::value(std::string_view key) const {
  const Metric* m = find(key);
  return m ? m->value : kNotObserved;
}

std::string result_json(const Result& r) {
  Json j;
  j["assessment"] = Result::kVersion;
  j["catgut"] = r.catgut_version;
  j["scene"] = r.scene;
  j["title"] = r.title;
  j["technique"] = r.technique;
  j["surgeon"] = r.surgeon;
  j["seed"] = r.seed;
  j["ticks"] = r.ticks;
  j["first_tick"] = r.first_tick;
  j["tick_s"] = r.tick_s;
  j["time_s"] = r.time_s;
  j["state_hash"] = fmt::format("{:016x}", r.state_hash);
  j["truncated"] = r.truncated;
  j["filter"] = r.filter;
  for (const char* list : {"bites", "knots", "metrics", "scores"}) j[list] = Json::array();
  for (const Bite& b : r.bite) j["bites"].push_back(bite_json(b));
  for (const Knot& k : r.knot) j["knots"].push_back(knot_json(k));
  for (const Metric& m : r.metric) j["metrics"].push_back(metric_json(m));
  for (const Score& s : r.score) j["scores"].push_back(score_json(s));
  return j.dump(2) + "\n";
}

std::string result_csv(const Result& r) {
  std::string out = "key,value,unit,samples\n";
  for (const Metric& m : r.metric) {
    const MetricRow* row = find_metric(m.key);
    out += fmt::format("{},{},{},{}\n", m.key, std::isfinite(m.value) ? fmt::format("{}", m.value) : "", row ? row->unit : "",
                       m.sample.size());
  }
  return out;
}

}  // namespace catgut::assess
