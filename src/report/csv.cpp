// SPDX-License-Identifier: Apache-2.0
// report: reads and writes comma-separated values; see csv.h.
#include "report/csv.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <map>
#include <set>
#include <sstream>

#include "core/check.h"
#include "procedure/toml.h"

namespace catgut {
namespace {

char likely_separator(const std::string& text) {
  const std::string first = text.substr(0, text.find('\n'));
  char best = ',';
  for (char c : {';', '\t'})
    if (std::count(first.begin(), first.end(), c) > std::count(first.begin(), first.end(), best)) best = c;
  return best;
}

}  // namespace

std::vector<CsvRow> read_csv(const std::string& text, const std::string& where, char separator) {
  constexpr size_t kMostColumns = 200, kMostRows = 1000000;
  std::vector<CsvRow> rows;
  size_t i = text.rfind("\xef\xbb\xbf", 0) == 0 ? 3 : 0, line = 1;
  if (!separator) separator = likely_separator(text);
  const auto fault = [&](const std::string& what, const std::string& next) {
    throw InputError(where + ":" + std::to_string(line), what, next);
  };
  while (i < text.size()) {
    CsvRow row;
    const size_t start = line;
    for (bool more = true; more;) {
      std::string cell;
      if (i < text.size() && text[i] == '"') {
        for (++i;; ++i) {
          if (i >= text.size()) {
            line = start;
            fault("a quote is not closed", "close it with \"");
          }
          if (text[i] == '"' && (i + 1 >= text.size() || text[i + 1] != '"')) break;
          if (text[i] == '"') ++i;
          line += text[i] == '\n';
          cell += text[i];
        }
        ++i;
        if (i < text.size() && text[i] != separator && text[i] != '\n' && text[i] != '\r')
          fault("a text follows a closing quote", "double the quotes inside a quoted cell");
      } else {
        while (i < text.size() && text[i] != separator && text[i] != '\n' && text[i] != '\r') cell += text[i++];
      }
      row.push_back(std::move(cell));
      if (row.size() > kMostColumns) fault("more than 200 columns", "check the separator");
      more = i < text.size() && text[i] == separator;
      if (more) ++i;
    }
    if (i < text.size() && text[i] == '\r') ++i;
    if (i < text.size() && text[i] == '\n') ++i;
    if (row.size() > 1 || !row[0].empty()) {
      if (!rows.empty() && row.size() != rows[0].size()) {
        line = start;
        fault(fmt::format("{} cells where the first row has {}", row.size(), rows[0].size()), "check separators and quotes");
      }
      rows.push_back(std::move(row));
      if (rows.size() > kMostRows) fault("more than a million rows", "split the file");
    }
    ++line;
  }
  return rows;
}

std::string csv_cell(const std::string& text) {
  std::string out = text;
  if (!out.empty() && std::string("=+-@\t\r").find(out[0]) != std::string::npos) out = "'" + out;
  if (out.find_first_of(",;\"\r\n\t") == std::string::npos) return out;
  std::string quoted = "\"";
  for (char c : out) quoted += c == '"' ? "\"\"" : std::string(1, c);
  return quoted + "\"";
}

std::string csv_number(double value) { return std::isfinite(value) ? fmt::format("{}", value) : ""; }

namespace {

// A value of the mapping: the text of a column, or a constant.
struct Source {
  std::string column, constant, prefix;
  bool given() const { return !column.empty() || !constant.empty(); }
};

struct Table {
  std::vector<CsvRow> row;
  std::map<std::string, size_t> column;
  std::string where;

  // "{n}" in the name of a column is the number of the session.
  const std::string& cell(const CsvRow& r, std::string name, int n) const {
    if (const size_t at = name.find("{n}"); at != std::string::npos) name.replace(at, 3, std::to_string(n));
    const auto found = column.find(name);
    if (found == column.end()) {
      std::string all;
      for (const auto& [known, index] : column) all += (all.empty() ? "" : ", ") + known;
      throw InputError(where, fmt::format("there is no column \"{}\"", name), "the columns are " + all.substr(0, 300));
    }
    return r[found->second];
  }
  std::string text(const CsvRow& r, const Source& s, int n) const {
    return s.column.empty() ? s.constant : s.prefix + cell(r, s.column, n);
  }
};

bool is_missing(const std::string& text) {
  static const std::set<std::string> kMissing{"", "NA", "N/A", "na", "NaN", "nan", "null", "-", "."};
  return kMissing.count(text) > 0;
}

double number(const std::string& text, const std::string& where, const std::string& column) {
  if (is_missing(text)) return kUnknown;
  std::string plain = text;
  if (plain.find('.') == std::string::npos) std::replace(plain.begin(), plain.end(), ',', '.');  // a decimal comma
  char* end = nullptr;
  const double value = std::strtod(plain.c_str(), &end);
  if (end == plain.c_str() || *end != 0 || !std::isfinite(value))
    throw InputError(where, fmt::format("\"{:.40}\" in column {} is not a number", text, column),
                     "correct it, or leave it empty");
  return value;
}

// Seconds, also written as minutes:seconds or hours:minutes:seconds.
double seconds(const std::string& text, const std::string& where, const std::string& column) {
  if (text.find(':') == std::string::npos) return number(text, where, column);
  double total = 0;
  size_t parts = 0;
  std::istringstream rest(text + ":");
  for (std::string part; std::getline(rest, part, ':'); ++parts) {
    const bool digits = !part.empty() && part.size() <= 6 && part.find_first_not_of("0123456789.") == std::string::npos;
    const double value = digits ? number(part, where, column) : kUnknown;
    if (!std::isfinite(value) || parts > 2 || (parts > 0 && value >= 60))
      throw InputError(where, fmt::format("\"{:.40}\" in column {} is not a time", text, column),
                       "write seconds, 9:55 or 1:09:55, or leave it empty");
    total = 60 * total + value;
  }
  return total;
}

// Pseudonyms and tasks take plain characters only.
std::string plain_name(const std::string& text) {
  std::string out;
  for (char c : text)
    out +=
        std::string("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789._-").find(c) == std::string::npos ? '_' : c;
  return out.substr(0, 64);
}

// The day `days` after a date.
std::string day_after(const std::string& date, int days, const std::string& where) {
  std::tm t{};
  if (date.size() != 10 || !strptime(date.c_str(), "%Y-%m-%d", &t))
    throw InputError(where, fmt::format("\"{:.40}\" is not a date", date), "write it as 2026-11-22");
  t.tm_hour = 12;
  const std::time_t at = timegm(&t) + static_cast<std::time_t>(days) * 86400;
  gmtime_r(&at, &t);
  return fmt::format("{:04}-{:02}-{:02}T12:00:00Z", t.tm_year + 1900, t.tm_mon + 1, t.tm_mday);
}

Source source_of(const toml::table& map, const char* key, const std::string& where) {
  Source s;
  const toml::node* node = map.get(key);
  if (!node) return s;
  if (const auto text = node->value<std::string>()) {
    s.constant = *text;
  } else if (const toml::table* t = node->as_table()) {
    s.column = (*t)["column"].value_or(std::string());
    s.prefix = (*t)["prefix"].value_or(std::string());
    if (s.column.empty()) throw InputError(where, fmt::format("{} names no column", key), "write { column = \"NAME\" }");
  } else {
    throw InputError(where, fmt::format("{} is neither a text nor a table", key),
                     "write { column = \"NAME\" } or \"a constant\"");
  }
  return s;
}

}  // namespace

std::vector<Session> sessions_of_table(const std::string& csv, const std::string& where, const std::string& mapping,
                                       const std::string& mapping_where, std::vector<Person>* people) {
  toml::table map;
  try {
    map = toml::parse(mapping, mapping_where);
  } catch (const toml::parse_error& error) {
    throw InputError(fmt::format("{}:{}", mapping_where, error.source().begin.line), std::string(error.description()),
                     "see docs/sessions.md");
  }
  static const std::set<std::string> kKeys{"title",  "source",    "separator", "task",     "trainee",
                                           "cohort", "level",     "session",   "sessions", "start",
                                           "score",  "score_max", "pass_at",   "duration", "metric"};
  for (const auto& [key, value] : map)
    if (!kKeys.count(std::string(key.str())))
      throw InputError(mapping_where, fmt::format("key \"{}\" is unknown", std::string(key.str())), "see docs/sessions.md");

  Table table;
  table.where = where;
  const std::string separator = map["separator"].value_or(std::string());
  table.row = read_csv(csv, where, separator.empty() ? 0 : separator[0]);
  if (table.row.size() < 2) throw InputError(where, "has no rows below its heading", "check the file");
  for (size_t i = 0; i < table.row[0].size(); ++i) table.column[table.row[0][i]] = i;

  const Source task = source_of(map, "task", mapping_where), trainee = source_of(map, "trainee", mapping_where),
               cohort = source_of(map, "cohort", mapping_where), level = source_of(map, "level", mapping_where),
               session = source_of(map, "session", mapping_where), score = source_of(map, "score", mapping_where),
               duration = source_of(map, "duration", mapping_where);
  if (!task.given() || !trainee.given()) throw InputError(mapping_where, "task or trainee is missing", "see docs/sessions.md");
  const int64_t wide = map["sessions"].value_or(int64_t{0});
  if (wide < 0 || wide > 1000) throw InputError(mapping_where, "sessions is not 0 to 1000", "correct it");
  if ((wide > 0) == session.given())
    throw InputError(mapping_where,
                     "either `session` (a column with its number) or `sessions` (how many columns {n}) is needed",
                     "see docs/sessions.md");
  const std::string start = map["start"].value_or(std::string("2000-01-01"));
  const double most = map["score_max"].value_or(kUnknown), pass_at = map["pass_at"].value_or(kUnknown);

  struct Column {
    std::string column, name, unit;
  };
  std::vector<Column> metrics;
  if (const toml::array* all = map["metric"].as_array())
    for (const toml::node& node : *all) {
      const toml::table* t = node.as_table();
      Column c;
      if (t)
        c = {(*t)["column"].value_or(std::string()), (*t)["name"].value_or(std::string()),
             (*t)["unit"].value_or(std::string("1"))};
      if (c.column.empty()) throw InputError(mapping_where, "a [[metric]] names no column", "see docs/sessions.md");
      if (c.name.empty()) c.name = c.column;
      metrics.push_back(c);
    }

  std::vector<Session> out;
  for (size_t r = 1; r < table.row.size(); ++r) {
    const CsvRow& row = table.row[r];
    const std::string here = fmt::format("{}: row {}", where, r + 1);
    for (int k = 1; k <= (wide > 0 ? wide : 1); ++k) {
      int n = k;
      if (wide == 0) {
        const double given = number(table.text(row, session, 1), here, "session");
        if (!(given >= 0 && given <= 10000)) throw InputError(here, "the session's number is not 0 to 10000", "correct it");
        n = static_cast<int>(given);
      }
      Session s;
      s.trainee = plain_name(table.text(row, trainee, n));
      s.task = plain_name(table.text(row, task, n));
      s.started = day_after(start, n, mapping_where);
      s.uid = plain_name(fmt::format("{}-{}-{}", s.task.substr(0, 24), s.trainee.substr(0, 24), n));
      s.station = "import";
      s.rubric = map["title"].value_or(std::string());
      if (score.given()) s.score = number(table.text(row, score, n), here, "score"), s.score_max = most;
      if (std::isfinite(s.score) && std::isfinite(pass_at)) s.passed = s.score >= pass_at;
      if (duration.given()) {
        const double taken = seconds(table.text(row, duration, n), here, "duration");
        if (std::isfinite(taken)) s.duration_s = taken;
      }
      for (const Column& c : metrics) {
        const std::string& cell = table.cell(row, c.column, n);
        const double value = c.unit == "s" ? seconds(cell, here, c.column) : number(cell, here, c.column);
        if (std::isfinite(value)) s.metric.push_back({c.name, value, c.unit, kUnknown, kUnknown});
      }
      if (s.metric.empty() && !std::isfinite(s.score)) continue;  // the trainee missed this session
      if (people && (people->empty() || people->back().pseudonym != s.trainee))
        people->push_back({s.trainee, Role::trainee, table.text(row, cohort, n), table.text(row, level, n), 0});
      out.push_back(std::move(s));
    }
  }
  // In the order of the sessions, so that every trainee's curve is in order whatever the order of rows.
  std::stable_sort(out.begin(), out.end(), [](const Session& a, const Session& b) { return a.started < b.started; });
  return out;
}

std::string sessions_csv(const Store& store, const SessionFilter& filter) {
  const std::vector<Session> sessions = store.sessions(filter);
  const std::vector<Metric> names = store.metric_names(filter);
  std::map<std::string, Person> people;
  for (const Person& p : store.people()) people[p.pseudonym] = p;
  std::string out = "id,uid,trainee,cohort,level,task,started,duration_s,score,score_max,passed,rubric,program";
  std::vector<std::map<int64_t, double>> values;
  for (const Metric& m : names) {
    out += "," + csv_cell(m.unit.empty() || m.unit == "1" ? m.name : m.name + " [" + m.unit + "]");
    auto& column = values.emplace_back();
    for (const Store::Value& v : store.values(m.name, filter)) column[v.session] = v.value;
  }
  out += "\r\n";
  for (const Session& s : sessions) {
    const Person& p = people[s.trainee];
    out += fmt::format("{},{},{},{},{},{},{},{},{},{},{},{},{}", s.id, csv_cell(s.uid), csv_cell(s.trainee), csv_cell(p.cohort),
                       csv_cell(p.level), csv_cell(s.task), s.started, csv_number(s.duration_s), csv_number(s.score),
                       csv_number(s.score_max),
                       s.passed < 0 ? ""
                       : s.passed   ? "1"
                                    : "0",
                       csv_cell(s.rubric), csv_cell(s.program));
    for (const auto& column : values) {
      const auto found = column.find(s.id);
      out += "," + (found == column.end() ? "" : csv_number(found->second));
    }
    out += "\r\n";
  }
  return out;
}

}  // namespace catgut
