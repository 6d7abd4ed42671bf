// SPDX-License-Identifier: Apache-2.0
// assess: reads rubrics; see rubric.h. Every error names the line, the fault and the nearest valid word.
#include "assess/rubric.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "assess/metrics.h"
#include "core/check.h"
#include "core/data.h"
#include "core/hash.h"
#include "procedure/scene_fields.h"
#include "procedure/toml.h"

namespace catgut::assess {
namespace {
namespace fs = std::filesystem;

struct Reader {
  const std::string& file;

  std::string at(const toml::node& node) const {
    return node.source().begin.line ? fmt::format("{}:{}", file, node.source().begin.line) : file;
  }
  void only(const toml::table& table, const std::vector<std::string>& keys, const char* what) const {
    for (const auto& [key, node] : table) {
      const std::string name(key.str());
      if (std::find(keys.begin(), keys.end(), name) != keys.end()) continue;
      const std::string nearest = nearest_word(name, keys);
      throw InputError(at(node), fmt::format("{} has no key \"{}\"", what, name),
                       nearest.empty() ? "the keys are " + fmt::format("{}", fmt::join(keys, ", "))
                                       : fmt::format("did you mean \"{}\"?", nearest));
    }
  }
  std::string text(const toml::table& t, const char* key, const std::string& otherwise) const {
    const toml::node* n = t.get(key);
    if (!n) return otherwise;
    if (!n->is_string()) throw InputError(at(*n), fmt::format("{} is not a text", key), "write it in quotes");
    return *n->value<std::string>();
  }
  bool flag(const toml::table& t, const char* key, bool otherwise) const {
    const toml::node* n = t.get(key);
    if (!n) return otherwise;
    if (!n->is_boolean()) throw InputError(at(*n), fmt::format("{} is not a flag", key), "write true or false");
    return *n->value<bool>();
  }
  double number(const toml::node& n, const char* key) const {
    if (!n.is_number()) throw InputError(at(n), fmt::format("{} is not a number", key), "write a number, without quotes");
    const double v = *n.value<double>();
    if (std::isnan(v)) throw InputError(at(n), fmt::format("{} is not a number", key), "write a number; inf is allowed");
    return v;
  }
  double number(const toml::table& t, const char* key, double otherwise, double low, double high) const {
    const toml::node* n = t.get(key);
    if (!n) return otherwise;
    const double v = number(*n, key);
    if (!(v >= low && v <= high))
      throw InputError(at(*n), fmt::format("{} = {} is out of range", key, v),
                       fmt::format("it is a number, {}..{}", low, high));
    return v;
  }
  bool band(const toml::table& t, const char* key, Band& out) const {
    const toml::node* n = t.get(key);
    if (!n) return false;
    const toml::array* a = n->as_array();
    if (!a || a->size() != 2)
      throw InputError(at(*n), fmt::format("{} is not a band", key), "write it as [low, high]; inf and -inf are allowed");
    out = {number(*a->get(0), key), number(*a->get(1), key)};
    if (out.low > out.high)
      throw InputError(at(*n), fmt::format("{} = [{}, {}] is empty", key, out.low, out.high), "write the smaller number first");
    return true;
  }
};

const std::vector<std::string> kTop{"title", "technique", "version", "pass", "every_item", "needs_stitch", "whole", "item"};
const std::vector<std::string> kWhole{"bites", "throws", "cuts", "closure", "cut"};
const std::vector<std::string> kItem{"key",      "title", "metric", "stage",    "weight",    "full",   "half",
                                     "critical", "each",  "pass",   "required", "validated", "source", "why"};

RubricItem read_item(const Reader& in, const toml::table& t) {
  in.only(t, kItem, "an item");
  RubricItem item;
  const std::string where = in.at(t);
  item.metric = in.text(t, "metric", "");
  const MetricRow* row = find_metric(item.metric);
  if (!row) {
    std::vector<std::string> keys;
    for (const MetricRow& r : metric_rows()) keys.push_back(r.key);
    const std::string nearest = nearest_word(item.metric, keys);
    const toml::node* node = t.get("metric");
    throw InputError(node ? in.at(*node) : where,
                     item.metric.empty() ? "an item without a metric" : fmt::format("there is no metric \"{}\"", item.metric),
                     nearest.empty() || item.metric.empty() ? "`catgut assess --metrics` lists them"
                                                            : fmt::format("did you mean \"{}\"?", nearest));
  }
  item.key = in.text(t, "key", item.metric);
  item.title = in.text(t, "title", row->name);
  item.stage = in.text(t, "stage", "");
  item.weight = in.number(t, "weight", 1, 0, 1000);
  item.pass = in.number(t, "pass", 0.5, 0, 1);
  const bool one = row->summary == Summary::count || row->summary == Summary::spread || row->summary == Summary::only;
  item.each = in.flag(t, "each", !one);
  if (item.each && one)
    throw InputError(in.at(*t.get("each")), fmt::format("the samples of {} are not judged one by one", item.metric),
                     "leave out `each`");
  item.required = in.flag(t, "required", true);
  item.validated = in.flag(t, "validated", false);
  item.source = in.text(t, "source", "");
  item.why = in.text(t, "why", "");
  const bool full = in.band(t, "full", item.full);
  if (!in.band(t, "half", item.half)) item.half = item.full;
  item.has_critical = in.band(t, "critical", item.critical);
  if (!full && !item.has_critical)
    throw InputError(where, fmt::format("the item {} has no band", item.key),
                     "add full = [low, high], or critical = [low, high]");
  if (item.half.low > item.full.low || item.half.high < item.full.high)
    throw InputError(in.at(*t.get("half")), fmt::format("half does not contain full in the item {}", item.key),
                     "half is the wider band");
  if (item.validated && item.source.empty())
    throw InputError(where, fmt::format("the item {} is validated but has no source", item.key), "name the study in `source`");
  return item;
}

std::string band_text(Band b, const std::string& unit) {
  const std::string u = unit.empty() ? "" : " " + unit;
  const bool low = b.low > -1e299 && std::isfinite(b.low), high = b.high < 1e299 && std::isfinite(b.high);
  if (low && high) return b.low == b.high ? fmt::format("{}{}", b.low, u) : fmt::format("{} to {}{}", b.low, b.high, u);
  return low ? fmt::format("at least {}{}", b.low, u) : fmt::format("at most {}{}", b.high, u);
}

std::string short_number(double v) { return v == std::floor(v) ? fmt::format("{:.0f}", v) : fmt::format("{:.2f}", v); }

}  // namespace

std::string rubrics_folder() { return data_path("rubrics"); }

std::vector<std::string> rubric_names() {
  std::vector<std::string> names;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(rubrics_folder(), error))
    if (entry.path().extension() == ".toml") names.push_back(entry.path().stem());
  std::sort(names.begin(), names.end());
  return names;
}

Rubric read_rubric(const std::string& name_or_path) {
  std::string path = name_or_path;
  if (!fs::is_regular_file(path)) path = (fs::path(rubrics_folder()) / (name_or_path + ".toml")).string();
  std::ifstream in(path, std::ios::binary);
  if (!in || !fs::is_regular_file(path)) {
    const std::string nearest = nearest_word(name_or_path, rubric_names());
    throw InputError(name_or_path, "there is no such rubric",
                     nearest.empty()
                         ? fmt::format("there are {}, or give the path of a .toml file", fmt::join(rubric_names(), ", "))
                         : fmt::format("did you mean \"{}\"?", nearest));
  }
  std::ostringstream text;
  text << in.rdbuf();
  return parse_rubric(text.str(), path);
}

std::string rubric_for(const std::string& technique) {
  const std::vector<std::string> names = rubric_names();
  return std::find(names.begin(), names.end(), technique) != names.end() ? technique : "";
}

Rubric parse_rubric(const std::string& text, const std::string& filename) {
  toml::table table;
  try {
    table = toml::parse(text, filename);
  } catch (const toml::parse_error& e) {
    throw InputError(fmt::format("{}:{}", filename, e.source().begin.line), std::string(e.description()),
                     "a rubric is a TOML file; docs/assessment.md explains it");
  }
  const Reader in{filename};
  in.only(table, kTop, "a rubric");
  Rubric r;
  r.name = fs::path(filename).stem();
  r.hash = hash_bytes(text.data(), text.size(), 0);
  r.title = in.text(table, "title", r.name);
  r.technique = in.text(table, "technique", "");
  r.version = in.text(table, "version", "");
  if (r.version.empty())
    throw InputError(filename, "the rubric has no version", "add version = \"1\", and raise it with every change");
  r.pass = in.number(table, "pass", 70, 0, 100);
  r.every_item = in.flag(table, "every_item", false);
  r.needs_stitch = in.flag(table, "needs_stitch", true);
  if (const toml::node* whole = table.get("whole")) {
    const toml::table* t = whole->as_table();
    if (!t) throw InputError(in.at(*whole), "whole is not a table", "write whole = {bites = 2, throws = 2}");
    in.only(*t, kWhole, "whole");
    r.whole = {in.number(*t, "bites", 0, 0, 1000), in.number(*t, "throws", 0, 0, 1000), in.number(*t, "cuts", 0, 0, 1000),
               in.number(*t, "closure", 0, 0, 1), in.number(*t, "cut", 0, 0, 10000)};
  }
  const toml::node* items = table.get("item");
  const toml::array* list = items ? items->as_array() : nullptr;
  if (!list || list->empty()) throw InputError(filename, "the rubric has no items", "add [[item]] tables");
  for (const toml::node& node : *list) {
    const toml::table* t = node.as_table();
    if (!t) throw InputError(in.at(node), "an item is not a table", "write [[item]]");
    r.item.push_back(read_item(in, *t));
    for (size_t i = 0; i + 1 < r.item.size(); ++i)
      if (r.item[i].key == r.item.back().key)
        throw InputError(in.at(node), fmt::format("there are two items \"{}\"", r.item[i].key),
                         "give one of them another `key`");
  }
  return r;
}

namespace {

bool nothing_sewn(const Result& result) {
  const Metric* bites = result.find("bites");
  return bites && bites->value == 0 && result.knot.empty();
}

// Most items count errors, and an idle session has none. Without this rule it has half of the points.
Score mark_nothing(Score s, const Rubric& rubric, const Result& result) {
  for (const RubricItem& item : rubric.item) {
    ItemScore out;
    out.item = item.key, out.title = item.title, out.stage = item.stage, out.metric = item.metric,
    out.unit = find_metric(item.metric)->unit;
    out.validated = item.validated, out.source = item.source;
    out.observed = out.passed = false;
    out.of = item.required ? item.weight : 0;
    s.of += out.of;
    s.item.push_back(out);
  }
  LostPoint lost;
  lost.item = "bites", lost.value = kNotObserved, lost.points = s.of, lost.critical = true;
  lost.tick = result.ticks, lost.time_s = static_cast<double>(result.ticks) * result.tick_s;
  lost.why = "no bite was completed and no throw was locked: there is nothing to judge, so there are no points";
  s.lost.push_back(lost);
  s.verdict = "failed: no stitch";
  s.completed = 0;
  return s;
}

double sum_of(const Result& result, std::string_view key) {
  const Metric* m = result.find(key);
  double total = 0;
  if (m)
    for (const Sample& sample : m->sample) total += sample.value;
  return total;
}

}  // namespace

double completed(const WholeTask& whole, const Result& result, std::string* reason) {
  const auto value = [&](std::string_view key) { return std::isfinite(result.value(key)) ? result.value(key) : 0.0; };
  const auto samples = [&](std::string_view key) {
    const Metric* m = result.find(key);
    return m ? static_cast<double>(m->sample.size()) : 0.0;
  };
  const struct {
    double done, all;
    const char* unit;
  } part[] = {{value("bites"), whole.bites, "bites"},
              {sum_of(result, "throws"), whole.throws, "throws"},
              {samples("tail"), whole.cuts, "cuts of the thread"},
              {value("closure"), whole.closure, "closure"},
              {samples("cut_edge"), whole.cut, "mm of the cut"}};  // one per millimeter
  double done = 0, all = 0;
  std::string text;
  for (const auto& p : part) {
    done += std::clamp(p.done, 0.0, p.all), all += p.all;
    if (p.all > 0 && p.done < p.all)
      text += fmt::format("{}{} of {} {}", text.empty() ? "" : ", ", short_number(p.done), short_number(p.all), p.unit);
  }
  if (reason) *reason = text;
  return all > 0 ? done / all : 1;
}

Score mark(const Rubric& rubric, const Result& result) {
  Score s;
  s.rubric = rubric.name, s.title = rubric.title, s.version = rubric.version, s.rubric_hash = rubric.hash;
  s.pass = rubric.pass, s.every_item = rubric.every_item;
  if (rubric.needs_stitch && nothing_sewn(result)) return mark_nothing(std::move(s), rubric, result);
  std::string missing;
  s.completed = completed(rubric.whole, result, &missing);
  size_t failed = 0, critical = 0;
  for (const RubricItem& item : rubric.item) {
    const MetricRow* row = find_metric(item.metric);
    const Metric* metric = result.find(item.metric);
    const double weight = s.completed * item.weight;  // work that was not done has no errors and takes no time
    ItemScore out;
    out.item = item.key, out.title = item.title, out.stage = item.stage, out.metric = item.metric, out.unit = row->unit;
    out.validated = item.validated, out.source = item.source;
    out.value = metric ? metric->value : kNotObserved;
    out.of = item.weight;
    const auto judge = [&](const Sample& sample, double share) {
      const double part = item.full.holds(sample.value) ? 1 : item.half.holds(sample.value) ? 0.5 : 0;
      out.points += part * share;
      const bool fatal = item.has_critical && !item.critical.holds(sample.value);
      critical += fatal;
      if (part == 1 && !fatal) return;
      LostPoint lost;
      lost.item = item.key, lost.of = sample.of, lost.value = sample.value, lost.points = (1 - part) * share;
      lost.tick = sample.tick, lost.time_s = static_cast<double>(sample.tick) * result.tick_s;
      lost.where = sample.where, lost.critical = fatal;
      lost.why = fmt::format("{}{}: {}{}{}, required {}{}{}", sample.of.empty() ? "" : sample.of + ": ", item.title,
                             short_number(sample.value), *row->unit ? " " : "", row->unit,
                             band_text(fatal && part == 1 ? item.critical : item.full, row->unit),
                             item.why.empty() ? "" : "; " + item.why, item.validated ? "" : " (band not validated)");
      s.lost.push_back(lost);
    };
    const bool count = row->summary == Summary::count;
    if (item.each && metric && !metric->sample.empty()) {
      for (const Sample& sample : metric->sample) judge(sample, weight / static_cast<double>(metric->sample.size()));
    } else if (!item.each && metric && std::isfinite(metric->value)) {
      // Shown at the sample that is furthest from the band; of counts the first.
      Sample sample{metric->value, result.ticks, {}, {}};
      if (!metric->sample.empty()) {
        const auto off = [&](const Sample& x) { return std::max(item.full.low - x.value, x.value - item.full.high); };
        const auto worst = count ? metric->sample.begin()
                                 : std::max_element(metric->sample.begin(), metric->sample.end(),
                                                    [&](const Sample& a, const Sample& b) { return off(a) < off(b); });
        sample.tick = worst->tick, sample.where = worst->where;
        if (count || row->summary == Summary::maximum) sample.of = worst->of;
      }
      judge(sample, weight);
    } else {
      out.observed = false;
      if (item.required) {
        LostPoint lost;
        lost.item = item.key, lost.value = kNotObserved, lost.points = weight;
        lost.critical = item.has_critical, critical += item.has_critical;  // a knot that was not tied does not hold
        lost.tick = result.ticks, lost.time_s = static_cast<double>(result.ticks) * result.tick_s;
        lost.why = fmt::format("{}: not observed in this session, required {}", item.title, band_text(item.full, row->unit));
        s.lost.push_back(lost);
      } else {
        out.of = 0;
      }
    }
    out.passed = !item.required && !out.observed ? true : out.points >= item.pass * out.of - 1e-9;
    failed += !out.passed;
    s.points += out.points, s.of += out.of;
    s.item.push_back(out);
  }
  if (s.completed < 1) {
    LostPoint lost;
    lost.item = "whole_task", lost.value = s.completed, lost.points = (1 - s.completed) * s.of;
    lost.tick = result.ticks, lost.time_s = static_cast<double>(result.ticks) * result.tick_s;
    lost.why =
        fmt::format("the task is not complete: {}; every item earns {:.0f} % of its points, the part of the task that was done",
                    missing, 100 * s.completed);
    s.lost.push_back(lost);
  }
  s.percent = s.of > 0 ? 100 * s.points / s.of : 0;
  s.passed = s.percent >= s.pass && critical == 0 && s.completed >= 1 && (!s.every_item || failed == 0);
  const bool unproven = std::any_of(s.item.begin(), s.item.end(), [](const ItemScore& i) { return !i.validated; });
  s.verdict = critical > 0         ? fmt::format("failed: {} critical {}", critical, critical == 1 ? "error" : "errors")
              : s.completed < 1    ? fmt::format("failed: the task is not complete: {}", missing)
              : s.percent < s.pass ? fmt::format("failed: {:.1f} % of the points, {} % required", s.percent, s.pass)
              : !s.passed ? fmt::format("failed: {} of {} items below their limit, every item must pass", failed, s.item.size())
                          : fmt::format("passed: {:.1f} % of the points", s.percent);
  if (unproven) s.verdict += "; for practice only: no study with people has validated all bands";
  std::stable_sort(s.lost.begin(), s.lost.end(), [](const LostPoint& a, const LostPoint& b) { return a.tick < b.tick; });
  return s;
}

std::string score_text(const Score& s) {
  std::string out = fmt::format("{} (rubric {}, version {})\n{}\n{:.1f} of {} points\n\n", s.title, s.rubric, s.version,
                                s.verdict, s.points, s.of);
  for (size_t k = 0; k < s.item.size(); ++k) {
    const ItemScore& i = s.item[k];
    if (!i.stage.empty() && (k == 0 || s.item[k - 1].stage != i.stage)) {
      double points = 0, of = 0;
      for (const ItemScore& other : s.item)
        if (other.stage == i.stage) points += other.points, of += other.of;
      out += fmt::format(" {}: {:.1f} of {}\n", i.stage, points, of);
    }
    out += fmt::format("  {:<34} {:>10} {:<4} {:>6.2f} of {:<5} {}{}\n", i.title,
                       std::isfinite(i.value) ? short_number(i.value) : "-", i.unit, i.points, i.of,
                       i.observed ? i.passed ? "" : "below the limit" : "not observed", i.validated ? "" : "  *");
  }
  out += "  * no study with people has validated this band\n";
  if (!s.lost.empty()) out += "\nLost points\n";
  for (const LostPoint& l : s.lost)
    out += fmt::format("  {:>7.2f} s  tick {:<6} {}{:.2f}  {}\n", l.time_s, l.tick, l.critical ? "CRITICAL -" : "-", l.points,
                       l.why);
  return out;
}

}  // namespace catgut::assess
