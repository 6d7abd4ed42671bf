// SPDX-License-Identifier: Apache-2.0
// report: sessions as JSON and xAPI; see session_file.h. Files come from outside: every value is read with its type checked.
#include "report/session_file.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <string_view>

#include "core/check.h"

namespace catgut {
namespace {
using Json = nlohmann::ordered_json;

constexpr size_t kMostBytes = 256u << 20;

Json parse(const std::string& text, const std::string& where) {
  if (text.size() > kMostBytes) throw InputError(where, "is larger than 256 MB", "check the file");
  Json j = Json::parse(text, nullptr, false);
  if (j.is_discarded())
    throw InputError(where, "is not valid JSON", "write it with catgut assess --json or catgut store export");
  if (!j.is_object()) throw InputError(where, "is not a JSON object", "check the file");
  return j;
}

// Null and missing: `otherwise`. Another type is an error.
double number(const Json& j, const char* key, double otherwise, const std::string& where) {
  const auto found = j.find(key);
  if (found == j.end() || found->is_null()) return otherwise;
  if (!found->is_number()) throw InputError(where, fmt::format("{} is not a number", key), "check the file");
  return found->get<double>();
}
std::string text(const Json& j, const char* key, const std::string& where) {
  const auto found = j.find(key);
  if (found == j.end() || found->is_null()) return "";
  if (!found->is_string()) throw InputError(where, fmt::format("{} is not a text", key), "check the file");
  return found->get<std::string>();
}
bool flag(const Json& j, const char* key) {
  const auto found = j.find(key);
  return found != j.end() && found->is_boolean() && found->get<bool>();
}
// The objects of a list; a missing list is empty.
std::vector<Json> list(const Json& j, const char* key, const std::string& where) {
  const auto found = j.find(key);
  if (found == j.end() || found->is_null()) return {};
  if (!found->is_array()) throw InputError(where, fmt::format("{} is not a list", key), "check the file");
  for (const Json& one : *found)
    if (!one.is_object()) throw InputError(where, fmt::format("{} holds something else than objects", key), "check the file");
  return std::vector<Json>(found->begin(), found->end());
}

Json number_or_null(double v) { return std::isfinite(v) ? Json(v) : Json(); }
std::string dump(const Json& j) { return j.dump(-1, ' ', false, Json::error_handler_t::replace); }

void add_metric(Session& s, Metric m) {
  if (!std::isfinite(m.value)) return;
  for (Metric& known : s.metric)
    if (known.name == m.name) {
      known = std::move(m);
      return;
    }
  s.metric.push_back(std::move(m));
}

Json details_of(const Session& s) {
  Json j = s.details.empty() ? Json::object() : Json::parse(s.details, nullptr, false);
  return j.is_object() ? j : Json::object();
}

// The result of `catgut assess`.
void read_assessment(const Json& j, const std::string& where, Session& s) {
  if (s.task.empty()) s.task = text(j, "scene", where);
  s.program = text(j, "catgut", where);
  s.duration_s = number(j, "time_s", s.duration_s, where);
  for (const Json& m : list(j, "metrics", where)) {
    const std::string unit = text(m, "unit", where);
    add_metric(s, {text(m, "key", where), number(m, "value", kUnknown, where), unit.empty() ? "1" : unit, kUnknown, kUnknown});
  }
  for (const Json& score : list(j, "scores", where)) {  // the first rubric counts; others are kept in details
    s.score = number(score, "points", kUnknown, where);
    s.score_max = number(score, "of", kUnknown, where);
    s.passed = flag(score, "passed");
    s.rubric = text(score, "title", where) + ", version " + text(score, "version", where);
    s.lost.clear();
    for (const Json& l : list(score, "lost", where))
      s.lost.push_back({text(l, "item", where), text(l, "why", where), text(l, "of", where), number(l, "points", 0, where),
                        number(l, "time_s", kUnknown, where), flag(l, "critical")});
    break;
  }
  Json details = details_of(s);
  const double tick = number(j, "tick_s", 1.0 / 60, where), first = number(j, "first_tick", 0, where);
  details["bites"] = Json::array();
  for (const Json& b : list(j, "bites", where))
    details["bites"].push_back({{"wall", number(b, "wall", 0, where)},
                                {"time_s", (number(b, "tick", 0, where) - first) * tick},
                                {"along_mm",
                                 {number_or_null(number(b, "along_in_mm", kUnknown, where)),
                                  number_or_null(number(b, "along_out_mm", kUnknown, where))}},
                                {"edge_mm",
                                 {number_or_null(number(b, "edge_in_mm", kUnknown, where)),
                                  number_or_null(number(b, "edge_out_mm", kUnknown, where))}},
                                {"spacing_mm", number_or_null(number(b, "spacing_mm", kUnknown, where))},
                                {"depth_fraction", number_or_null(number(b, "depth_fraction", kUnknown, where))}});
  if (const auto scores = j.find("scores"); scores != j.end()) details["scores"] = *scores;
  if (const auto knots = j.find("knots"); knots != j.end()) details["knots"] = *knots;
  s.details = dump(details);
}

// What an interactive session writes (runtime/report, session_json).
void read_interactive(const Json& j, const std::string& where, Session& s) {
  if (s.task.empty()) s.task = text(j, "scene", where);
  if (s.program.empty()) s.program = text(j, "catgut", where);
  if (s.duration_s == 0) s.duration_s = number(j, "time_s", 0, where);
  for (const char* count : {"bites", "bites_withdrawn", "undos", "knots", "throws", "cuts", "needle_slips"})
    if (const double value = number(j, count, kUnknown, where); std::isfinite(value)) {
      bool known = false;
      for (const Metric& m : s.metric) known = known || m.name == count;
      if (!known) add_metric(s, {count, value, "1", kUnknown, kUnknown});
    }
  for (const Json& e : list(j, "events", where)) {
    std::string more = text(e, "fault", where);
    if (more.empty()) more = text(e, "reason", where);
    s.event.push_back({number(e, "time_s", 0, where), text(e, "event", where), more});
  }
  Json details = details_of(s);
  details["lines"] = Json::array();
  for (const Json& e : list(j, "edges", where)) details["lines"].push_back({{"length_mm", number(e, "length_mm", 0, where)}});
  if (!details.contains("bites")) {
    details["bites"] = Json::array();
    for (Json& b : list(j, "stitches", where)) details["bites"].push_back(std::move(b));
  }
  if (const auto tension = j.find("tension"); tension != j.end() && tension->is_object()) details["tension"] = *tension;
  s.details = dump(details);
}

void read_export(const Json& j, const std::string& where, Session& s) {
  s.uid = text(j, "uid", where);
  if (s.trainee.empty()) s.trainee = text(j, "trainee", where);
  s.task = text(j, "task", where);
  s.started = text(j, "started", where);
  s.duration_s = number(j, "duration_s", 0, where);
  s.score = number(j, "score", kUnknown, where);
  s.score_max = number(j, "score_max", kUnknown, where);
  s.passed = j.contains("passed") && j["passed"].is_boolean() ? j["passed"].get<bool>() : -1;
  s.rubric = text(j, "rubric", where);
  s.program = text(j, "program", where);
  s.station = text(j, "station", where);
  s.recording = text(j, "recording", where);
  for (const auto& [key, to] : {std::pair{"settings", &s.settings}, {"details", &s.details}})
    if (const auto found = j.find(key); found != j.end() && found->is_object()) *to = dump(*found);
  for (const Json& m : list(j, "metrics", where))
    add_metric(s, {text(m, "name", where), number(m, "value", kUnknown, where), text(m, "unit", where),
                   number(m, "low", kUnknown, where), number(m, "high", kUnknown, where)});
  for (const Json& e : list(j, "events", where))
    s.event.push_back({number(e, "at_s", 0, where), text(e, "kind", where), text(e, "text", where)});
  for (const Json& l : list(j, "lost", where))
    s.lost.push_back({text(l, "item", where), text(l, "reason", where), text(l, "place", where), number(l, "points", 0, where),
                      number(l, "at_s", kUnknown, where), flag(l, "critical")});
}

void read_any(const Json& j, const std::string& where, Session& s) {
  if (j.contains("catgut_session")) read_export(j, where, s);
  else if (j.contains("assessment")) read_assessment(j, where, s);
  else if (j.contains("stitches") || j.contains("tension")) read_interactive(j, where, s);
  else
    throw InputError(where, "is not a session, an assessment, or an export",
                     "write it with catgut assess --json, or save it from the window");
}

Json json_of(const Session& s) {
  Json j;
  j["catgut_session"] = 1;
  j["uid"] = s.uid;
  j["trainee"] = s.trainee;
  j["task"] = s.task;
  j["started"] = s.started;
  j["duration_s"] = s.duration_s;
  j["score"] = number_or_null(s.score);
  j["score_max"] = number_or_null(s.score_max);
  j["passed"] = s.passed < 0 ? Json() : Json(s.passed > 0);
  j["rubric"] = s.rubric;
  j["program"] = s.program;
  j["station"] = s.station;
  j["recording"] = s.recording;
  for (const auto& [key, from] : {std::pair{"settings", &s.settings}, {"details", &s.details}}) {
    j[key] = from->empty() ? Json() : Json::parse(*from, nullptr, false);
    if (j[key].is_discarded()) j[key] = Json();
  }
  j["metrics"] = Json::array();
  for (const Metric& m : s.metric)
    j["metrics"].push_back({{"name", m.name},
                            {"value", m.value},
                            {"unit", m.unit},
                            {"low", number_or_null(m.low)},
                            {"high", number_or_null(m.high)}});
  j["events"] = Json::array();
  for (const SessionEvent& e : s.event) j["events"].push_back({{"at_s", e.at_s}, {"kind", e.kind}, {"text", e.text}});
  j["lost"] = Json::array();
  for (const LostPoints& l : s.lost)
    j["lost"].push_back({{"item", l.item},
                         {"reason", l.reason},
                         {"place", l.place},
                         {"points", l.points},
                         {"at_s", number_or_null(l.at_s)},
                         {"critical", l.critical}});
  return j;
}

// Version 4, as the store makes it.
bool is_uuid(const std::string& uid) {
  return uid.size() == 32 && uid.find_first_not_of("0123456789abcdef") == std::string::npos && uid[12] == '4' &&
         std::string_view("89ab").find(uid[16]) != std::string_view::npos;
}

std::string pretty(const Json& j) { return j.dump(1, ' ', false, Json::error_handler_t::replace) + "\n"; }

}  // namespace

void read_session_json(const std::string& json, const std::string& where, Session& session) {
  read_any(parse(json, where), where, session);
}

std::vector<Session> read_sessions_json(const std::string& json, const std::string& where) {
  const Json j = parse(json, where);
  std::vector<Session> all;
  if (j.contains("sessions")) {
    for (const Json& one : list(j, "sessions", where)) read_any(one, where, all.emplace_back());
  } else {
    read_any(j, where, all.emplace_back());
  }
  return all;
}

std::string session_to_json(const Session& session) { return pretty(json_of(session)); }

std::string person_to_json(const Store& store, const std::string& pseudonym) {
  const Person p = store.person(pseudonym);
  Json j;
  j["pseudonym"] = p.pseudonym;
  j["role"] = role_name(p.role);
  j["cohort"] = p.cohort;
  j["level"] = p.level;
  j["sessions"] = Json::array();
  SessionFilter filter;
  filter.trainee = pseudonym;
  for (const Session& s : store.sessions(filter)) j["sessions"].push_back(json_of(store.session(s.id)));
  j["answers"] = Json::array();
  for (const std::string& survey : store.surveys())
    for (const SurveyAnswer& a : store.answers(survey))
      if (a.respondent == pseudonym)
        j["answers"].push_back({{"survey", a.survey},
                                {"version", a.version},
                                {"group", a.group},
                                {"at", a.at},
                                {"question", a.question},
                                {"value", number_or_null(a.value)},
                                {"text", a.text}});
  return pretty(j);
}

std::string sessions_to_json(const Store& store, const SessionFilter& filter) {
  Json j;
  j["sessions"] = Json::array();
  for (const Session& s : store.sessions(filter)) j["sessions"].push_back(json_of(store.session(s.id)));
  return pretty(j);
}

std::string sessions_to_xapi(const Store& store, const SessionFilter& filter, const std::string& home) {
  Json all = Json::array();
  for (const Session& s : store.sessions(filter)) {
    const char* verb = s.passed < 0 ? "completed" : s.passed ? "passed" : "failed";
    Json result = {{"completion", true}, {"duration", fmt::format("PT{:.2f}S", s.duration_s)}};
    if (s.passed >= 0) result["success"] = s.passed > 0;
    if (std::isfinite(s.score)) {
      result["score"] = {{"raw", s.score}};
      if (std::isfinite(s.score_max) && s.score_max > 0) {
        if (s.score >= 0 && s.score <= s.score_max)  // the standard wants raw between them
          result["score"]["min"] = 0, result["score"]["max"] = s.score_max;
        // The standard limits it to [-1, 1].
        result["score"]["scaled"] = std::min(1.0, std::max(-1.0, s.score / s.score_max));
      }
    }
    // xAPI wants a UUID: the identifier of the session where it is one, else left to the receiver.
    Json statement;
    if (is_uuid(s.uid))
      statement["id"] = fmt::format("{}-{}-{}-{}-{}", s.uid.substr(0, 8), s.uid.substr(8, 4), s.uid.substr(12, 4),
                                    s.uid.substr(16, 4), s.uid.substr(20));
    statement["actor"] = {{"objectType", "Agent"}, {"account", {{"homePage", home}, {"name", s.trainee}}}};
    statement["verb"] = {{"id", fmt::format("http://adlnet.gov/expapi/verbs/{}", verb)}, {"display", {{"en-US", verb}}}};
    statement["object"] = {
        {"objectType", "Activity"},
        {"id", home + "/tasks/" + s.task},
        {"definition", {{"name", {{"en-US", s.task}}}, {"type", "http://adlnet.gov/expapi/activities/simulation"}}}};
    statement["result"] = result;
    statement["context"] = {{"platform", "Catgut " + s.program}};
    statement["timestamp"] = s.started;
    all.push_back(statement);
  }
  return pretty(all);
}

}  // namespace catgut
