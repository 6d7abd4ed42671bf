// SPDX-License-Identifier: Apache-2.0
// report: the data of pages; see data.h.
#include "report/data.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "core/check.h"

namespace catgut {
namespace {
using Json = nlohmann::ordered_json;

Json number(double v) { return std::isfinite(v) ? Json(v) : Json(); }
std::string dump(const Json& j) { return j.dump(-1, ' ', false, Json::error_handler_t::replace); }
Json judged(int passed) { return passed < 0 ? Json() : Json(passed > 0); }

Json row_of(const Session& s) {
  return {{"id", s.id},
          {"trainee", s.trainee},
          {"task", s.task},
          {"started", s.started},
          {"duration_s", s.duration_s},
          {"score", number(s.score)},
          {"score_max", number(s.score_max)},
          {"passed", judged(s.passed)}};
}

// Score by attempt of everybody in the cohort who trained the task: quartiles for each number of the attempt.
Json curve_of(const std::vector<Session>& sessions) {
  std::map<std::string, size_t> attempt;
  std::vector<std::vector<double>> scores;
  for (const Session& s : sessions) {
    const size_t n = attempt[s.trainee]++;
    if (!std::isfinite(s.score)) continue;
    if (scores.size() <= n) scores.resize(n + 1);
    scores[n].push_back(s.score);
  }
  Json curve = Json::array();
  for (size_t n = 0; n < scores.size(); ++n)
    if (scores[n].size() >= 3)  // fewer would show single people
      curve.push_back({{"attempt", n + 1},
                       {"n", scores[n].size()},
                       {"q1", quantile(scores[n], 0.25)},
                       {"median", quantile(scores[n], 0.5)},
                       {"q3", quantile(scores[n], 0.75)}});
  return curve;
}

Json cusum_of(const std::vector<Session>& own) {
  std::vector<bool> success;
  for (const Session& s : own)
    if (s.passed >= 0) success.push_back(s.passed > 0);
  const Cusum c = cusum(success);
  return {{"p0", c.p0}, {"p1", c.p1}, {"alpha", c.alpha}, {"beta", c.beta},
          {"s", c.s},   {"h0", c.h0}, {"h1", c.h1},       {"line", c.line}};
}

Json losses_of(const std::vector<LostPoints>& lost) {
  Json all = Json::array();
  for (const LostPoints& l : lost) all.push_back({{"item", l.item}, {"sessions", l.points}, {"critical", l.critical}});
  return all;
}

// Sessions of the same task in the person's cohort; without a cohort, of everybody.
std::vector<Session> peers_of(const Store& store, const Person& p, const std::string& task) {
  SessionFilter filter;
  filter.cohort = p.cohort;
  filter.task = task;
  return store.sessions(filter);
}

// The newest session of each trainee.
std::map<int64_t, std::string> newest_of(const std::vector<Session>& sessions) {
  std::map<std::string, int64_t> newest;
  for (const Session& s : sessions) newest[s.trainee] = s.id;
  std::map<int64_t, std::string> ids;
  for (const auto& [trainee, id] : newest) ids[id] = trainee;
  return ids;
}

Json task_of(const Store& store, const Person& p, const std::string& task) {
  const std::vector<Session> peers = peers_of(store, p, task);
  std::vector<Session> own;
  for (const Session& s : peers)
    if (s.trainee == p.pseudonym) own.push_back(s);
  Json j;
  j["task"] = task;
  j["sessions"] = Json::array();
  for (const Session& s : own) j["sessions"].push_back(row_of(s));
  j["curve"] = curve_of(peers);
  j["cusum"] = cusum_of(own);
  // Percentile of the newest score among the newest scores of the others.
  std::vector<double> others;
  double mine = kUnknown;
  const auto newest = newest_of(peers);
  for (const Session& s : peers) {
    if (!newest.count(s.id) || !std::isfinite(s.score)) continue;
    if (s.trainee == p.pseudonym) mine = s.score;
    else others.push_back(s.score);
  }
  j["percentile"] = std::isfinite(mine) ? number(percentile_rank(others, mine)) : Json();
  j["others"] = others.size();
  return j;
}

Json progress_of(const Assignment& a, const std::vector<Session>& sessions, const std::vector<Person>& people) {
  std::map<std::string, int> done;
  for (const Session& s : sessions)
    if (s.task == a.task && (!std::isfinite(a.goal) || s.score >= a.goal)) ++done[s.trainee];
  size_t members = 0, finished = 0;
  Json behind = Json::array();
  for (const Person& p : people) {
    if (p.cohort != a.cohort || p.role != Role::trainee) continue;
    ++members;
    if (done[p.pseudonym] >= a.runs) ++finished;
    else behind.push_back({{"trainee", p.pseudonym}, {"done", done[p.pseudonym]}});
  }
  return {{"id", a.id},   {"cohort", a.cohort}, {"task", a.task},       {"goal", number(a.goal)}, {"runs", a.runs},
          {"due", a.due}, {"members", members}, {"finished", finished}, {"behind", behind}};
}

}  // namespace

std::string session_data(const Store& store, int64_t id) {
  const Session s = store.session(id);
  const Person p = store.person(s.trainee);
  Json j;
  j["kind"] = "session";
  j["session"] = row_of(s);
  j["session"]["rubric"] = s.rubric;
  j["session"]["program"] = s.program;
  j["session"]["station"] = s.station;
  j["session"]["recording"] = s.recording;
  j["session"]["settings"] = s.settings;
  j["person"] = {{"pseudonym", p.pseudonym}, {"cohort", p.cohort}, {"level", p.level}};
  // Where each metric lies among the newest sessions of the other trainees.
  const std::vector<Session> peers = peers_of(store, p, s.task);
  const auto newest = newest_of(peers);
  SessionFilter filter;
  filter.cohort = p.cohort;
  filter.task = s.task;
  j["metrics"] = Json::array();
  for (const Metric& m : s.metric) {
    std::vector<double> others;
    for (const Store::Value& v : store.values(m.name, filter))
      if (const auto found = newest.find(v.session); found != newest.end() && found->second != s.trainee)
        others.push_back(v.value);
    Json row = {{"name", m.name}, {"value", m.value}, {"unit", m.unit}, {"low", number(m.low)}, {"high", number(m.high)}};
    row["others"] = others.size();
    if (!others.empty()) {
      row["rank"] = percentile_rank(others, m.value);
      row["q1"] = quantile(others, 0.25), row["median"] = quantile(others, 0.5), row["q3"] = quantile(others, 0.75);
    }
    j["metrics"].push_back(row);
  }
  j["lost"] = Json::array();
  for (const LostPoints& l : s.lost)
    j["lost"].push_back({{"item", l.item},
                         {"reason", l.reason},
                         {"place", l.place},
                         {"points", l.points},
                         {"at_s", number(l.at_s)},
                         {"critical", l.critical}});
  j["events"] = Json::array();
  for (const SessionEvent& e : s.event) j["events"].push_back({{"at_s", e.at_s}, {"kind", e.kind}, {"text", e.text}});
  Json details = s.details.empty() ? Json::object() : Json::parse(s.details, nullptr, false);
  j["details"] = details.is_object() ? details : Json::object();
  j["task"] = task_of(store, p, s.task);
  return dump(j);
}

std::string trainee_data(const Store& store, const std::string& pseudonym) {
  const Person p = store.person(pseudonym);
  SessionFilter filter;
  filter.trainee = pseudonym;
  const std::vector<Session> own = store.sessions(filter);
  std::vector<std::string> tasks;
  for (const Session& s : own)
    if (std::find(tasks.begin(), tasks.end(), s.task) == tasks.end()) tasks.push_back(s.task);
  Json j;
  j["kind"] = "trainee";
  j["person"] = {{"pseudonym", p.pseudonym}, {"cohort", p.cohort}, {"level", p.level}, {"role", role_name(p.role)}};
  j["tasks"] = Json::array();
  for (const std::string& task : tasks) j["tasks"].push_back(task_of(store, p, task));
  j["losses"] = losses_of(store.frequent_losses(filter));
  j["assignments"] = Json::array();
  for (const Assignment& a : store.assignments()) {
    if (a.cohort != p.cohort || p.cohort.empty()) continue;
    int done = 0;
    for (const Session& s : own) done += s.task == a.task && (!std::isfinite(a.goal) || s.score >= a.goal);
    j["assignments"].push_back({{"task", a.task}, {"goal", number(a.goal)}, {"runs", a.runs}, {"due", a.due}, {"done", done}});
  }
  return dump(j);
}

std::string overview_data(const Store& store, const SessionFilter& filter) {
  const std::vector<Person> people = store.people();
  const std::vector<Session> sessions = store.sessions(filter);
  Json j;
  j["kind"] = "educator";
  j["people"] = Json::array();
  for (const Person& p : people)
    j["people"].push_back({{"pseudonym", p.pseudonym}, {"role", role_name(p.role)}, {"cohort", p.cohort}, {"level", p.level}});
  Json& columns = j["sessions"];
  for (const char* name : {"id", "trainee", "task", "started", "duration_s", "score", "passed"}) columns[name] = Json::array();
  for (const Session& s : sessions) {
    columns["id"].push_back(s.id);
    columns["trainee"].push_back(s.trainee);
    columns["task"].push_back(s.task);
    columns["started"].push_back(s.started);
    columns["duration_s"].push_back(s.duration_s);
    columns["score"].push_back(number(s.score));
    columns["passed"].push_back(judged(s.passed));
  }
  j["metrics"] = Json::array();
  for (const Metric& m : store.metric_names(filter)) j["metrics"].push_back({{"name", m.name}, {"unit", m.unit}});
  j["cohorts"] = store.cohorts();
  j["tasks"] = store.tasks();
  j["assignments"] = Json::array();
  for (const Assignment& a : store.assignments()) j["assignments"].push_back(progress_of(a, sessions, people));
  j["surveys"] = store.surveys();
  return dump(j);
}

std::string metric_data(const Store& store, const std::string& metric, const SessionFilter& filter) {
  Json j;
  j["metric"] = metric;
  j["id"] = Json::array(), j["value"] = Json::array();
  for (const Store::Value& v : store.values(metric, filter)) {
    j["id"].push_back(v.session);
    j["value"].push_back(v.value);
  }
  return dump(j);
}

std::string survey_data(const Questionnaire& q, const SurveyResult& result) {
  Json j;
  j["kind"] = "survey";
  j["name"] = q.name;
  j["version"] = q.version;
  j["title"] = q.title;
  j["intro"] = q.intro;
  j["source"] = q.source;
  j["low"] = q.low, j["high"] = q.high, j["favorable"] = q.favorable;
  j["labels"] = Json::object();
  for (const auto& [at, label] : q.label) j["labels"][std::to_string(at)] = label;
  j["groups"] = q.groups;
  j["questions"] = Json::array();
  for (const Question& one : q.question) j["questions"].push_back({{"key", one.key}, {"text", one.text}, {"free", one.free}});
  j["respondents"] = result.respondents;
  j["rows"] = Json::array();
  for (const QuestionResult& r : result.row)
    j["rows"].push_back({{"key", r.key},
                         {"group", r.group},
                         {"n", r.box.n},
                         {"low", r.box.low},
                         {"q1", r.box.q1},
                         {"median", r.box.median},
                         {"q3", r.box.q3},
                         {"high", r.box.high},
                         {"mean", r.box.mean},
                         {"outliers", r.box.outliers},
                         {"favorable", r.favorable},
                         {"count", r.count}});
  j["p"] = Json::object();
  for (const auto& [key, p] : result.p) j["p"][key] = number(p);
  j["text"] = Json::object();
  for (const auto& [key, all] : result.text) j["text"][key] = all;
  return dump(j);
}

}  // namespace catgut
