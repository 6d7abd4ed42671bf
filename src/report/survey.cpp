// SPDX-License-Identifier: Apache-2.0
// report: questionnaires and their statistics; see survey.h.
#include "report/survey.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>

#include "core/check.h"
#include "core/data.h"
#include "core/file.h"
#include "procedure/toml.h"
#include "report/csv.h"

namespace catgut {
namespace {
namespace fs = std::filesystem;

[[noreturn]] void fault(const std::string& where, const toml::source_region& at, const std::string& what,
                        const std::string& next) {
  throw InputError(at.begin.line > 0 ? fmt::format("{}:{}", where, at.begin.line) : where, what, next);
}

void only_keys(const toml::table& table, const std::set<std::string>& known, const std::string& where) {
  for (const auto& [key, value] : table)
    if (!known.count(std::string(key.str())))
      fault(where, value.source(), fmt::format("key \"{}\" is unknown", std::string(key.str())), "see docs/sessions.md");
}

std::string text_of(const toml::table& table, const char* key, const std::string& where, bool needed) {
  const toml::node* node = table.get(key);
  if (!node) {
    if (needed) fault(where, table.source(), fmt::format("{} is missing", key), "add it");
    return "";
  }
  const auto text = node->value<std::string>();
  if (!text || text->size() > 4096)
    fault(where, node->source(), fmt::format("{} is not a text of up to 4096 bytes", key), "correct it");
  return *text;
}

int whole_of(const toml::table& table, const char* key, int otherwise, const std::string& where) {
  const toml::node* node = table.get(key);
  if (!node) return otherwise;
  const auto value = node->value_exact<int64_t>();
  if (!value || *value < -100 || *value > 100)
    fault(where, node->source(), fmt::format("{} is not a whole number from -100 to 100", key), "correct it");
  return static_cast<int>(*value);
}

bool is_plain(const std::string& text) {
  return !text.empty() && text.size() <= 64 &&
         text.find_first_not_of("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789._-") == std::string::npos;
}

}  // namespace

Questionnaire parse_questionnaire(const std::string& text, const std::string& where, const std::string& name) {
  toml::table all;
  try {
    all = toml::parse(text, where);
  } catch (const toml::parse_error& error) {
    fault(where, error.source(), std::string(error.description()), "see docs/sessions.md");
  }
  only_keys(all, {"version", "title", "intro", "source", "scale", "groups", "question"}, where);
  Questionnaire q;
  q.name = name;
  if (!is_plain(name)) throw InputError(where, "the file's name is not 1 to 64 of A-Z a-z 0-9 . _ -", "rename it");
  q.version = text_of(all, "version", where, true);
  q.title = text_of(all, "title", where, true);
  q.intro = text_of(all, "intro", where, false);
  q.source = text_of(all, "source", where, false);
  if (const toml::table* scale = all["scale"].as_table()) {
    only_keys(*scale, {"low", "high", "favorable", "labels"}, where);
    q.low = whole_of(*scale, "low", 1, where), q.high = whole_of(*scale, "high", 5, where);
    if (q.high <= q.low || q.high - q.low > 20)
      fault(where, scale->source(), "the scale has not 2 to 21 points", "correct low and high");
    q.favorable = whole_of(*scale, "favorable", (q.low + q.high + 1) / 2, where);
    if (const toml::array* labels = (*scale)["labels"].as_array()) {
      int at = q.low;
      for (const toml::node& label : *labels) q.label[at++] = label.value_or(std::string());
      if (at - 1 > q.high) fault(where, labels->source(), "more labels than points of the scale", "correct it");
    }
  }
  if (const toml::array* groups = all["groups"].as_array())
    for (const toml::node& group : *groups) {
      const auto one = group.value<std::string>();
      if (!one || one->empty() || one->size() > 64) fault(where, group.source(), "a group is not a short text", "correct it");
      q.groups.push_back(*one);
    }
  const toml::array* questions = all["question"].as_array();
  if (!questions || questions->empty()) throw InputError(where, "has no [[question]]", "add one");
  std::set<std::string> keys;
  for (const toml::node& node : *questions) {
    const toml::table* t = node.as_table();
    if (!t) fault(where, node.source(), "a question is not a table", "write [[question]]");
    only_keys(*t, {"key", "text", "free"}, where);
    Question one{text_of(*t, "key", where, true), text_of(*t, "text", where, true), (*t)["free"].value_or(false)};
    if (!is_plain(one.key)) fault(where, t->source(), "key is not 1 to 64 of A-Z a-z 0-9 . _ -", "correct it");
    if (!keys.insert(one.key).second)
      fault(where, t->source(), fmt::format("question {} is there twice", one.key), "rename one");
    q.question.push_back(one);
  }
  return q;
}

std::vector<std::string> questionnaire_names() {
  std::vector<std::string> names;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(data_path("surveys"), error))
    if (entry.path().extension() == ".toml") names.push_back(entry.path().stem());
  std::sort(names.begin(), names.end());
  return names;
}

Questionnaire read_questionnaire(const std::string& name_or_path) {
  std::string path = name_or_path;
  std::error_code error;
  if (path.find('/') == std::string::npos && !path.ends_with(".toml")) {
    path = data_path("surveys") + "/" + path + ".toml";
    if (!fs::exists(path, error)) {
      std::string all;
      for (const std::string& name : questionnaire_names()) all += (all.empty() ? "" : ", ") + name;
      throw InputError("survey " + name_or_path, "is unknown", "use a path, or one of: " + all);
    }
  }
  return parse_questionnaire(read_file(path), path, fs::path(path).stem());
}

void check_answers(const Questionnaire& q, const std::vector<SurveyAnswer>& answers) {
  for (const SurveyAnswer& a : answers) {
    const auto found =
        std::find_if(q.question.begin(), q.question.end(), [&](const Question& o) { return o.key == a.question; });
    const std::string where = fmt::format("survey {}, {:.64}", q.name, a.question);
    if (found == q.question.end()) throw InputError(where, "is not a question of it", "catgut survey show lists them");
    if (found->free) continue;
    if (!(a.value >= q.low && a.value <= q.high && a.value == std::floor(a.value)))
      throw InputError(where, fmt::format("the rating {} is not {} to {}", a.value, q.low, q.high), "correct it");
  }
}

std::vector<SurveyAnswer> answers_of_csv(const Questionnaire& q, const std::string& csv, const std::string& where,
                                         const std::string& now) {
  const std::vector<CsvRow> rows = read_csv(csv, where);
  if (rows.size() < 2) throw InputError(where, "has no rows below its heading", "check the file");
  const CsvRow& head = rows[0];
  const auto column = [&](const std::string& name) {
    return static_cast<size_t>(std::find(head.begin(), head.end(), name) - head.begin());
  };
  const size_t group = column("group"), respondent = column("respondent");
  if (respondent == head.size())
    throw InputError(where, "there is no column respondent", "columns: respondent, group, then the questions");
  for (const std::string& name : head) {
    const bool known = name == "respondent" || name == "group" ||
                       std::any_of(q.question.begin(), q.question.end(), [&](const Question& o) { return o.key == name; });
    if (!known)
      throw InputError(where, fmt::format("column \"{:.64}\" is not a question of {}", name, q.name), "rename or remove it");
  }
  std::vector<SurveyAnswer> out;
  for (size_t r = 1; r < rows.size(); ++r)
    for (const Question& one : q.question) {
      const size_t at = column(one.key);
      if (at == head.size() || rows[r][at].empty()) continue;
      SurveyAnswer a{q.name,   q.version, rows[r][respondent], group < head.size() ? rows[r][group] : "", now, one.key,
                     kUnknown, ""};
      if (one.free) {
        a.text = rows[r][at];
      } else {
        char* end = nullptr;
        a.value = std::strtod(rows[r][at].c_str(), &end);
        if (*end != 0)
          throw InputError(fmt::format("{}: row {}", where, r + 1), fmt::format("\"{:.40}\" is not a rating", rows[r][at]),
                           "correct it");
      }
      out.push_back(a);
    }
  check_answers(q, out);
  return out;
}

std::string answers_csv(const Questionnaire& q, const std::vector<SurveyAnswer>& answers) {
  std::string out = "respondent,group";
  for (const Question& one : q.question) out += "," + csv_cell(one.key);
  out += "\r\n";
  // One row per respondent and moment, in the order of storing.
  std::vector<std::pair<std::string, std::map<std::string, std::string>>> rows;
  std::vector<std::string> group;
  for (const SurveyAnswer& a : answers) {
    const std::string id = a.respondent + "\n" + a.at;
    auto found = std::find_if(rows.begin(), rows.end(), [&](const auto& r) { return r.first == id; });
    if (found == rows.end()) {
      rows.push_back({id, {}});
      group.push_back(a.group);
      found = rows.end() - 1;
    }
    found->second[a.question] = std::isfinite(a.value) ? csv_number(a.value) : csv_cell(a.text);
  }
  for (size_t r = 0; r < rows.size(); ++r) {
    out += csv_cell(rows[r].first.substr(0, rows[r].first.find('\n'))) + "," + csv_cell(group[r]);
    for (const Question& one : q.question) out += "," + rows[r].second[one.key];
    out += "\r\n";
  }
  return out;
}

SurveyResult evaluate(const Questionnaire& q, const std::vector<SurveyAnswer>& answers) {
  SurveyResult result;
  std::set<std::string> respondents;
  std::vector<std::string> groups = q.groups;
  for (const SurveyAnswer& a : answers) {
    respondents.insert(a.respondent + "\n" + a.at);
    if (!a.group.empty() && std::find(groups.begin(), groups.end(), a.group) == groups.end()) groups.push_back(a.group);
  }
  result.respondents = respondents.size();
  const auto ratings = [&](const std::string& key, const std::string& group) {
    std::vector<double> values;
    for (const SurveyAnswer& a : answers)
      if (a.question == key && std::isfinite(a.value) && (group.empty() || a.group == group)) values.push_back(a.value);
    return values;
  };
  groups.insert(groups.begin(), "");
  for (const std::string& group : groups)
    for (const Question& one : q.question) {
      if (one.free) continue;
      const std::vector<double> values = ratings(one.key, group);
      if (values.empty() && !group.empty()) continue;
      QuestionResult row{one.key,        one.text, group,
                         box_of(values), 0,        std::vector<size_t>(static_cast<size_t>(q.high - q.low + 1))};
      for (double v : values) {
        row.favorable += v >= q.favorable;
        if (v >= q.low && v <= q.high) ++row.count[static_cast<size_t>(v - q.low)];
      }
      result.row.push_back(row);
    }
  for (const Question& one : q.question) {
    if (one.free) {
      for (const SurveyAnswer& a : answers)
        if (a.question == one.key && !a.text.empty()) result.text[one.key].push_back(a.text);
    } else if (groups.size() >= 3) {
      result.p[one.key] = mann_whitney(ratings(one.key, groups[1]), ratings(one.key, groups[2]));
    }
  }
  return result;
}

std::string survey_summary(const Questionnaire& q, const SurveyResult& result) {
  std::string out = fmt::format("{}: {} respondents\n{:<8}{:<14}{:>4}{:>8}{:>14}{:>22}\n", q.title, result.respondents,
                                "question", "group", "n", "median", "quartiles", fmt::format("rated {} or more", q.favorable));
  for (const QuestionResult& r : result.row)
    out += fmt::format("{:<8}{:<14}{:>4}{:>8.4g}{:>14}{:>22}\n", r.key, r.group.empty() ? "all" : r.group, r.box.n,
                       r.box.median, fmt::format("{:.4g} to {:.4g}", r.box.q1, r.box.q3),
                       r.box.n ? fmt::format("{} ({:.0f} %)", r.favorable,
                                             100.0 * static_cast<double>(r.favorable) / static_cast<double>(r.box.n))
                               : "");
  for (const auto& [key, p] : result.p)
    if (std::isfinite(p))
      out += fmt::format("{:<8}difference of the first two groups: p = {:.3f} (exact Mann-Whitney)\n", key, p);
  return out;
}

}  // namespace catgut
