// SPDX-License-Identifier: Apache-2.0
// runtime: see study.h.
#include "runtime/study.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <mutex>
#include <sstream>
#include <thread>

#include "core/check.h"
#include "core/file.h"
#include "core/hash.h"
#include "procedure/ability.h"
#include "procedure/scene_fields.h"
#include "procedure/scene_file.h"
#include "procedure/toml.h"
#include "runtime/assessment.h"

namespace catgut {
namespace {
namespace fs = std::filesystem;

const std::vector<std::string> kKeys{"title", "scenes", "surgeons", "seeds", "rubric", "seconds", "keep", "setting"};
constexpr size_t kMostRuns = 1000000;

std::string at(const std::string& file, const toml::node& n) {
  return n.source().begin.line ? fmt::format("{}:{}", file, n.source().begin.line) : file;
}

std::vector<std::string> words(const std::string& file, const toml::table& t, const char* key) {
  const toml::node* n = t.get(key);
  std::vector<std::string> out;
  if (!n) return out;
  const toml::array* a = n->as_array();
  if (!a) throw InputError(at(file, *n), fmt::format("{} is not a list", key), fmt::format("write {} = [\"...\"]", key));
  for (const toml::node& w : *a) {
    if (!w.is_string())
      throw InputError(at(file, w), fmt::format("{} holds something that is not a text", key), "write it in quotes");
    out.push_back(*w.value<std::string>());
  }
  return out;
}

// The abilities of one person on the way to those of an expert, as ratios. The person is drawn with the run's seed; the noise
// of each session is its own.
void practise(SceneSpec& scene, const StudyRun& run, double share, size_t session) {
  SceneSpec expert = scene;
  apply_ability(expert, "scripted:expert");
  for (const AbilityRow& row : abilities()) {
    const double from = static_cast<double>(scene.surgeon.*row.member), to = static_cast<double>(expert.surgeon.*row.member);
    if (from > 0 && to > 0) scene.surgeon.*row.member = static_cast<float>(from * std::pow(to / from, share));
  }
  scene.seed = run.seed * 1000 + session;
}

// The scene of a run, ready.
SceneSpec scene_of_run(const StudyPlan& plan, const StudyRun& run, std::string& surgeon) {
  SceneSpec scene = read_scene(run.scene);
  set_value(scene, fmt::format("seed={}", run.seed), "seed");
  surgeon = apply_ability(scene, run.surgeon);
  for (const StudySetting& s : plan.setting) {
    if (s.name != run.setting) continue;
    if (s.practice >= 0) practise(scene, run, s.practice, static_cast<size_t>(&s - plan.setting.data()) + 1);
    for (const std::string& set : s.set) set_value(scene, set, "setting " + s.name);
  }
  return scene;
}

std::string file_of(const std::string& folder, size_t number, const char* suffix = ".csv") {
  return (fs::path(folder) / fmt::format("run_{:06}{}", number, suffix)).string();
}

// First line: the key of the inputs. Second: the row.
bool read_row(const std::string& path, std::string& key, std::string& row) {
  std::ifstream in(path);
  return std::getline(in, key) && std::getline(in, row) && in.good();
}

std::string cell(double v) { return std::isfinite(v) ? fmt::format("{}", v) : ""; }

std::string quoted(const std::string& text) {
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  std::string out = "\"";
  for (const char c : text) out += c == '"' ? "\"\"" : std::string(1, c);
  return out + '"';
}

std::string heading() {
  std::string out = "run,scene,setting,surgeon,seed,surgeon_done,score,passed,lost,critical";
  for (const assess::MetricRow& m : assess::metric_rows()) out += std::string(",") + m.key;
  return out;
}

std::string make_row(const StudyRun& run, const RunResult& result, const assess::Result& r) {
  const auto done = result.value.find("surgeon_done");
  std::string out = fmt::format("{},{},{},{},{},{}", run.number, quoted(run.scene), quoted(run.setting), quoted(run.surgeon),
                                run.seed, done == result.value.end() ? "" : cell(done->second));
  if (r.score.empty()) {
    out += ",,,,";
  } else {
    const assess::Score& s = r.score.front();
    const auto critical = std::count_if(s.lost.begin(), s.lost.end(), [](const assess::LostPoint& l) { return l.critical; });
    out += fmt::format(",{},{},{},{}", cell(s.percent), s.passed ? 1 : 0, s.lost.size(), critical);
  }
  for (const assess::Metric& m : r.metric) out += "," + cell(m.value);
  return out;
}

std::vector<std::string> cells_of(const std::string& row) {
  std::vector<std::string> out{""};
  bool inside = false;
  for (size_t i = 0; i < row.size(); ++i) {
    if (row[i] == '"' && inside && i + 1 < row.size() && row[i + 1] == '"') out.back() += row[++i];
    else if (row[i] == '"') inside = !inside;
    else if (row[i] == ',' && !inside) out.emplace_back();
    else out.back() += row[i];
  }
  return out;
}

double number_of(const std::string& text) { return text.empty() ? std::nan("") : std::strtod(text.c_str(), nullptr); }

double median_of(std::vector<double> v) {
  std::erase_if(v, [](double x) { return !std::isfinite(x); });
  if (v.empty()) return std::nan("");
  std::sort(v.begin(), v.end());
  return 0.5 * (v[(v.size() - 1) / 2] + v[v.size() / 2]);
}

}  // namespace

StudyPlan read_study(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in || !fs::is_regular_file(path)) throw InputError(path, "there is no such study", "docs/assessment.md shows one");
  std::ostringstream text;
  text << in.rdbuf();
  return parse_study(text.str(), path);
}

StudyPlan parse_study(const std::string& text, const std::string& file) {
  toml::table t;
  try {
    t = toml::parse(text, file);
  } catch (const toml::parse_error& e) {
    throw InputError(fmt::format("{}:{}", file, e.source().begin.line), std::string(e.description()), "a study is a TOML file");
  }
  for (const auto& [key, node] : t) {
    const std::string name(key.str());
    if (std::find(kKeys.begin(), kKeys.end(), name) != kKeys.end()) continue;
    const std::string nearest = nearest_word(name, kKeys);
    throw InputError(at(file, node), fmt::format("a study has no key \"{}\"", name),
                     nearest.empty() ? fmt::format("the keys are {}", fmt::join(kKeys, ", "))
                                     : fmt::format("did you mean \"{}\"?", nearest));
  }
  StudyPlan p;
  p.title = t["title"].value_or(std::string(fs::path(file).stem()));
  p.scene = words(file, t, "scenes");
  p.surgeon = words(file, t, "surgeons");
  if (p.scene.empty()) throw InputError(file, "the study has no scenes", "add scenes = [\"stay\"]");
  if (p.surgeon.empty()) throw InputError(file, "the study has no surgeons", "add surgeons = [\"scripted:expert\"]");
  if (const toml::node* n = t.get("seeds")) {
    const toml::array* a = n->as_array();
    const auto seed = [&](size_t i) { return a->get(i)->value<int64_t>().value_or(-1); };
    if (!a || a->size() != 2 || !a->get(0)->is_integer() || !a->get(1)->is_integer() || seed(0) < 0 || seed(1) < seed(0))
      throw InputError(at(file, *n), "seeds is not a range", "write seeds = [first, last]");
    p.first_seed = static_cast<uint64_t>(seed(0)), p.last_seed = static_cast<uint64_t>(seed(1));
  }
  p.rubric = t["rubric"].value_or(std::string());
  if (const toml::node* n = t.get("seconds")) {
    p.seconds = n->is_number() ? *n->value<double>() : -1;
    if (!(p.seconds > 0 && p.seconds < 1e6)) throw InputError(at(file, *n), "seconds is not a time", "write seconds = 60");
  }
  p.keep = t["keep"].value_or(false);
  if (const toml::node* n = t.get("setting")) {
    const toml::array* a = n->as_array();
    if (!a || a->empty()) throw InputError(at(file, *n), "setting is not a list of tables", "write [[setting]]");
    for (const toml::node& row : *a) {
      const toml::table* s = row.as_table();
      if (!s) throw InputError(at(file, row), "a setting is not a table", "write [[setting]]");
      for (const auto& [key, node] : *s)
        if (key.str() != "name" && key.str() != "set" && key.str() != "practice")
          throw InputError(at(file, node), fmt::format("a setting has no key \"{}\"", key.str()),
                           "it has name, set and practice");
      StudySetting made{(*s)["name"].value_or(fmt::format("setting {}", p.setting.size() + 1)), words(file, *s, "set")};
      if (const toml::node* share = s->get("practice")) {
        made.practice = share->value<double>().value_or(-1);
        if (!(made.practice >= 0 && made.practice <= 1))
          throw InputError(at(file, *share), "practice is not a share", "0: as the level was drawn; 1: as an expert");
      }
      p.setting.push_back(made);
    }
  }
  if (p.setting.empty()) p.setting.push_back({"default", {}});
  const double runs = static_cast<double>(p.scene.size() * p.surgeon.size() * p.setting.size()) *
                      (static_cast<double>(p.last_seed - p.first_seed) + 1);
  if (runs > kMostRuns)
    throw InputError(file, fmt::format("the study has {:.0f} runs", runs), fmt::format("at most {}", kMostRuns));
  // Errors of scenes, surgeons and settings show before the first run.
  StudyRun probe;
  for (probe.scene = p.scene[0]; const std::string& scene : p.scene)
    for (const StudySetting& s : p.setting)
      for (const std::string& who : p.surgeon) {
        probe.scene = scene, probe.surgeon = who, probe.setting = s.name, probe.seed = p.first_seed;
        std::string surgeon;
        const SceneSpec spec = scene_of_run(p, probe, surgeon);
        rubrics_for(p.rubric, spec);
      }
  return p;
}

std::vector<StudyRun> runs_of(const StudyPlan& plan) {
  std::vector<StudyRun> out;
  for (const std::string& scene : plan.scene)
    for (const StudySetting& setting : plan.setting)
      for (const std::string& surgeon : plan.surgeon)
        for (uint64_t seed = plan.first_seed; seed <= plan.last_seed; ++seed)
          out.push_back({out.size(), scene, surgeon, setting.name, seed});
  return out;
}

StudyOutcome make_runs(const StudyPlan& plan, const StudyOptions& options) {
  std::error_code error;
  fs::create_directories(options.folder, error);
  if (!fs::is_directory(options.folder)) throw InputError(options.folder, "the folder cannot be made", "choose another place");
  const std::vector<StudyRun> runs = runs_of(plan);
  std::vector<const StudyRun*> mine;
  for (const StudyRun& run : runs)
    if (run.number % options.of == options.index) mine.push_back(&run);
  StudyOutcome outcome;
  std::atomic<size_t> next{0};
  std::mutex lock;
  size_t finished = 0;
  const auto stopped = [&] { return options.stop && options.stop->load(std::memory_order_relaxed); };
  const auto work = [&] {
    for (size_t i; !stopped() && (i = next++) < mine.size();) {
      const StudyRun& run = *mine[i];
      std::string what, fault;
      bool made = false;
      try {
        std::string surgeon;
        const SceneSpec scene = scene_of_run(plan, run, surgeon);
        const auto rubrics = rubrics_for(plan.rubric, scene);
        const std::string input = fmt::format("{}\n{}\n{}\n{}\n{}\n{}", write_scene(scene), surgeon, plan.seconds, heading(),
                                              rubrics.empty() ? 0 : rubrics[0].hash, catgut_version());
        const std::string key = fmt::format("{:016x}", hash_bytes(input.data(), input.size(), 0));
        const std::string path = file_of(options.folder, run.number);
        std::string old_key, old_row;
        if (!(read_row(path, old_key, old_row) && old_key == key)) {
          SessionOptions session;
          session.surgeon = surgeon, session.seconds = plan.seconds;
          if (plan.keep) session.record = file_of(options.folder, run.number, ".cgrec");
          SessionHooks hooks;
          hooks.stop = options.stop;
          Assessor assessor(scene);
          assessor.attach(hooks);
          const RunResult result = run_session(scene, session, hooks);
          if (result.interrupted) return;
          const assess::Result r = assessor.finish(result, rubrics);
          // Renamed when complete: another process, or the next start, never reads a part of a row.
          write_file(path + ".part", key + "\n" + make_row(run, result, r) + "\n");
          fs::rename(path + ".part", path);
          made = true;
          what = r.score.empty() ? "done" : fmt::format("{:.1f} %", r.score[0].percent);
        } else {
          what = "kept";
        }
      } catch (const std::exception& e) { fault = e.what(); }
      const std::lock_guard guard(lock);
      ++finished;
      if (!fault.empty()) outcome.failed.push_back(fmt::format("run {}: {}", run.number, fault));
      else ++(made ? outcome.made : outcome.kept);
      if (options.on_run) options.on_run(run, finished, mine.size(), fault.empty() ? what : fault);
    }
  };
  std::vector<std::thread> workers;
  for (int k = 1; k < options.jobs; ++k) workers.emplace_back(work);
  work();
  for (std::thread& t : workers) t.join();
  std::string key, row;
  for (const StudyRun& run : runs) outcome.missing += !read_row(file_of(options.folder, run.number), key, row);
  return outcome;
}

std::string study_table(const StudyPlan& plan, const std::string& folder) {
  std::string out = heading() + "\n", key, row;
  for (const StudyRun& run : runs_of(plan))
    if (read_row(file_of(folder, run.number), key, row)) out += row + "\n";
  return out;
}

double area_under_curve(const std::vector<double>& a, const std::vector<double>& b) {
  double won = 0, pairs = 0;
  for (const double x : a)
    for (const double y : b)
      if (std::isfinite(x) && std::isfinite(y)) won += x < y ? 1 : x == y ? 0.5 : 0, ++pairs;
  return pairs > 0 ? won / pairs : std::nan("");
}

std::string study_report(const StudyPlan& plan, const std::string& folder) {
  const std::vector<std::string> columns = cells_of(heading());
  constexpr size_t kSurgeonDone = 5, kScore = 6, kFirstMetric = 10;
  // scene -> surgeon -> rows
  std::map<std::string, std::map<std::string, std::vector<std::vector<std::string>>>> rows;
  std::istringstream table(study_table(plan, folder));
  std::string line;
  std::getline(table, line);
  while (std::getline(table, line)) {
    std::vector<std::string> cells = cells_of(line);
    if (cells.size() == columns.size()) rows[cells[1]][cells[3]].push_back(cells);
  }
  const auto column = [](const std::vector<std::vector<std::string>>& of, size_t k) {
    std::vector<double> v;
    for (const auto& r : of) v.push_back(number_of(r[k]));
    return v;
  };
  const auto short_name = [](const std::string& who) {
    return who.substr(who.find(':') == std::string::npos ? 0 : who.find(':') + 1);
  };
  std::string out;
  for (const std::string& scene : plan.scene) {
    auto& of = rows[scene];
    const std::string &first = plan.surgeon.front(), &last = plan.surgeon.back();
    out += fmt::format("### {}: {} against {}\n\n| metric | unit | AUC |", scene, short_name(first), short_name(last));
    for (const std::string& who : plan.surgeon) out += fmt::format(" {} |", short_name(who));
    out += "\n|---|---|---|";
    for (size_t k = 0; k < plan.surgeon.size(); ++k) out += "---|";
    out += "\n";
    struct Line {
      double auc;
      bool against;
      std::string text;
    };
    std::vector<Line> lines;
    const auto add = [&](size_t k, const std::string& name, const char* unit) {
      double auc = area_under_curve(column(of[first], k), column(of[last], k));
      // The first level is expected to have more where less is better. A separation the other way round is shown, not counted.
      const bool known = k >= kFirstMetric && assess::metric_rows()[k - kFirstMetric].better != assess::Better::target;
      const bool less = known && assess::metric_rows()[k - kFirstMetric].better == assess::Better::lower;
      const bool against = known && std::isfinite(auc) && (less ? auc > 0.5 : auc < 0.5);
      if (std::isfinite(auc)) auc = std::max(auc, 1 - auc);
      std::string text = fmt::format("| {} | {} | {}{} |", name, unit, std::isfinite(auc) ? fmt::format("{:.2f}", auc) : "-",
                                     against && auc > 0.55 ? " against" : "");
      for (const std::string& who : plan.surgeon) {
        const double m = median_of(column(of[who], k));
        text += std::isfinite(m) ? fmt::format(" {:.3g} |", m) : " - |";
      }
      lines.push_back({std::isfinite(auc) ? auc : -1, against, text + "\n"});
    };
    add(kScore, "**score**", "%");
    for (size_t k = kFirstMetric; k < columns.size(); ++k)
      add(k, fmt::format("`{}`", columns[k]), assess::metric_rows()[k - kFirstMetric].unit);
    const auto good = std::count_if(lines.begin() + 1, lines.end(), [](const Line& l) { return l.auc >= 0.95 && !l.against; });
    std::stable_sort(lines.begin() + 1, lines.end(), [](const Line& a, const Line& b) { return a.auc > b.auc; });
    for (const Line& l : lines) out += l.text;
    out += "\nRuns:";
    for (const std::string& who : plan.surgeon) {
      const std::vector<double> done = column(of[who], kSurgeonDone);
      out += fmt::format(" {} {} ({} finished the task);", of[who].size(), short_name(who),
                         std::count(done.begin(), done.end(), 1.0));
    }
    out.back() = '.';
    out += fmt::format(" Metrics with an AUC of 0.95 or more: {} of {}.\n\n", good, lines.size() - 1);
  }
  return out;
}

}  // namespace catgut
