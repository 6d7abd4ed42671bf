// SPDX-License-Identifier: Apache-2.0
// procedure: see procedure_file.h.
#include "procedure/procedure_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>
#include <stdexcept>

#include "core/check.h"
#include "core/data.h"
#include "procedure/measures.h"
#include "procedure/scene_fields.h"
#include "procedure/scene_file.h"
#include "procedure/scripted_surgeon.h"
#include "procedure/toml.h"

namespace catgut {
namespace {
namespace fs = std::filesystem;

constexpr size_t kMostStages = 400;

std::string meant(const std::string& word, const std::vector<std::string>& known, const std::string& otherwise) {
  const std::string nearest = nearest_word(word, known);
  return nearest.empty() ? otherwise : fmt::format("did you mean \"{}\"?", nearest);
}

std::string listed(const std::vector<std::string>& words) { return fmt::format("there is: {}", fmt::join(words, ", ")); }

// One table of the file. Keys that are read are known; finish() refuses all others.
class Section {
 public:
  Section(const toml::table& table, std::string name, const std::string& file)
      : table_(table), name_(std::move(name)), file_(file) {}

  std::string at(const toml::node* node) const {
    const auto line = node ? node->source().begin.line : table_.source().begin.line;
    return line ? fmt::format("{}:{}", file_, line) : file_;
  }
  const toml::node* get(const char* key) {
    known_.push_back(key);
    return table_.get(key);
  }
  [[noreturn]] void wrong(const char* key, const toml::node* node, const std::string& wanted) const {
    throw InputError(at(node), fmt::format("{}.{} is not {}", name_, key, wanted), "see docs/procedures.md");
  }
  std::string text(const char* key, bool required = false) {
    const toml::node* node = get(key);
    if (!node) {
      if (required) missing(key);
      return "";
    }
    if (!node->is_string()) wrong(key, node, "a text in quotes");
    const std::string value = *node->value<std::string>();
    if (required && value.empty()) missing(key);
    return value;
  }
  [[noreturn]] void missing(const char* key) const {
    throw InputError(at(nullptr), fmt::format("{} has no \"{}\"", name_, key), "add it; see docs/procedures.md");
  }
  bool flag(const char* key) {
    const toml::node* node = get(key);
    if (node && !node->is_boolean()) wrong(key, node, "true or false");
    return node && *node->value<bool>();
  }
  std::vector<std::pair<std::string, const toml::node*>> words(const char* key) {
    std::vector<std::pair<std::string, const toml::node*>> out;
    const toml::node* node = get(key);
    if (!node) return out;
    const toml::array* list = node->as_array();
    if (!list) wrong(key, node, "a list of texts, such as [\"needle_holder\"]");
    for (const toml::node& each : *list) {
      if (!each.is_string()) wrong(key, &each, "a list of texts");
      out.push_back({*each.value<std::string>(), &each});
    }
    return out;
  }
  Conditions conditions(const char* key, bool required = false) {
    Conditions out;
    const toml::node* node = get(key);
    if (!node) {
      if (required) missing(key);
      return out;
    }
    const toml::table* table = node->as_table();
    if (!table || table->empty()) wrong(key, node, "a table of measures, such as {bites = {min = 1}}");
    for (const auto& [name, bound] : *table) out.push_back(condition(key, std::string(name.str()), bound));
    std::sort(out.begin(), out.end(), [](const Condition& a, const Condition& b) { return a.measure < b.measure; });
    return out;
  }
  // {when = ..., text = ...}
  std::optional<Section> part(const char* key) {
    const toml::node* node = get(key);
    if (!node) return {};
    if (!node->is_table()) wrong(key, node, "a table, such as {when = {bites = {min = 2}}, text = \"...\"}");
    return Section(*node->as_table(), name_ + "." + key, file_);
  }
  std::vector<Section> rows(const char* key, const std::string& of) {
    std::vector<Section> out;
    const toml::node* node = get(key);
    if (!node) return out;
    const toml::array* list = node->as_array();
    if (!list || list->empty() || !list->is_homogeneous(toml::node_type::table))
      wrong(key, node, fmt::format("a list: write [[{}]] in double brackets", of));
    for (const toml::node& row : *list) out.emplace_back(*row.as_table(), of, file_);
    return out;
  }
  void finish() const {
    for (const auto& [key, node] : table_) {
      const std::string name(key.str());
      if (std::find(known_.begin(), known_.end(), name) != known_.end()) continue;
      throw InputError(fmt::format("{}:{}", file_, key.source().begin.line), fmt::format("{} has no key \"{}\"", name_, name),
                       meant(name, known_, listed(known_)));
    }
  }
  const std::string& name() const { return name_; }

 private:
  Condition condition(const char* key, const std::string& name, const toml::node& bound) const {
    std::vector<std::string> known;
    for (const Measure& m : measures()) known.push_back(m.name);
    const auto found = std::find(known.begin(), known.end(), name);
    if (found == known.end())
      throw InputError(at(&bound), fmt::format("{}.{}: there is no measure \"{}\"", name_, key, name),
                       meant(name, known, "`catgut describe procedure` lists them"));
    Condition c;
    c.measure = static_cast<uint32_t>(found - known.begin());
    const std::string how = "write a number for equality, or {min = ..., max = ...}";
    if (bound.is_number()) {
      c.min = c.max = *bound.value<double>();
    } else if (const toml::table* table = bound.as_table(); table && !table->empty()) {
      for (const auto& [edge, number] : *table) {
        if ((edge.str() != "min" && edge.str() != "max") || !number.is_number())
          throw InputError(at(&number), fmt::format("{}.{}.{}: \"{}\" is not a bound", name_, key, name, edge.str()), how);
        (edge.str() == "min" ? c.min : c.max) = *number.value<double>();
      }
    } else {
      throw InputError(at(&bound), fmt::format("{}.{}.{} is not a number or bounds", name_, key, name), how);
    }
    if (!(c.min <= c.max))
      throw InputError(at(&bound), fmt::format("{}.{}.{} allows nothing: min is above max", name_, key, name), how);
    return c;
  }

  const toml::table& table_;
  std::string name_;
  const std::string& file_;
  std::vector<std::string> known_;
};

// "bite 3": kind and number.
DemoTask demo_task(std::string text, const std::string& where) {
  DemoTask task;
  const size_t space = text.rfind(' ');
  if (space != std::string::npos) {
    const std::string number = text.substr(space + 1);
    const bool digits = !number.empty() && number.size() < 5 && number.find_first_not_of("0123456789") == std::string::npos;
    if (!digits || std::stoul(number) == 0)
      throw InputError(where, fmt::format("\"{}\" is not a task and its number", text), "write for example \"bite 2\"");
    task.number = std::stoul(number);
    text.resize(space);
  }
  std::vector<std::string> known;
  for (const char* name : task_names()) known.push_back(name);
  const auto found = std::find(known.begin(), known.end(), text);
  if (found == known.end())
    throw InputError(where, fmt::format("the scripted surgeon has no task \"{}\"", text), meant(text, known, listed(known)));
  task.kind = static_cast<TaskKind>(found - known.begin());
  return task;
}

// "{n}" and "{all}" of a repeated stage.
std::string filled(std::string text, size_t n, size_t all) {
  for (const auto& [mark, number] : {std::pair<std::string, size_t>{"{n}", n}, {"{all}", all}})
    for (size_t at; (at = text.find(mark)) != std::string::npos;) text.replace(at, mark.size(), std::to_string(number));
  return text;
}

// A stage as written, before repeated stages are copied.
struct Written {
  ProcedureStage stage;
  std::vector<std::pair<std::string, std::string>> demo;  // text and place
  std::string demo_from, demo_from_at, repeat_from, repeat_at, start_at;
  size_t times = 1;
};

Written read_stage(Section& s, const std::vector<std::string>& default_tray, const std::string& folder) {
  Written w;
  ProcedureStage& stage = w.stage;
  stage.base = s.text("name", true);
  stage.title = s.text("title", true);
  stage.text = s.text("text", true);
  stage.goal = s.conditions("goal", true);
  stage.good = s.conditions("good");
  const toml::node* hint = s.get("hint");
  if (hint && hint->is_string()) {
    stage.hint.push_back({{}, *hint->value<std::string>()});
  } else if (hint) {
    for (Section& row : s.rows("hint", "stage.hint")) {
      stage.hint.push_back({row.conditions("when"), row.text("text", true)});
      row.finish();
    }
  }
  if (auto guard = s.part("guard")) {
    stage.guard = guard->conditions("when", true);
    stage.guard_text = guard->text("text", true);
    guard->finish();
  }
  if (auto skip = s.part("skip")) {
    stage.skip = skip->conditions("when", true);
    stage.skip_text = skip->text("text", true);
    stage.skip_is_error = skip->flag("error");
    skip->finish();
  }
  stage.tray = default_tray;
  if (const auto tray = s.words("tray"); !tray.empty()) {
    stage.tray.clear();
    for (const auto& [kind, node] : tray) stage.tray.push_back(kind);
  }
  for (const auto& [task, node] : s.words("demo")) w.demo.push_back({task, s.at(node)});
  w.demo_from_at = s.at(s.get("demo_from"));
  w.demo_from = s.text("demo_from");
  stage.start = s.text("start");
  w.start_at = s.at(s.get("start"));
  if (!stage.start.empty() && !fs::path(stage.start).is_absolute()) stage.start = (fs::path(folder) / stage.start).string();
  w.repeat_at = s.at(s.get("repeat"));
  if (auto repeat = s.part("repeat")) {
    w.repeat_from = repeat->text("from", true);
    const toml::node* times = repeat->get("times");
    if (!times || !times->is_integer() || *times->value<int64_t>() < 2 || *times->value<int64_t>() > 100)
      repeat->wrong("times", times, "a whole number from 2 to 100");
    w.times = static_cast<size_t>(*times->value<int64_t>());
    repeat->finish();
  }
  s.finish();
  return w;
}

// Copies the stages from `repeat.from` to the one that has it, as many times as it says.
void expand(const std::vector<Written>& written, Procedure& p) {
  std::vector<std::string> names;
  for (const Written& w : written) names.push_back(w.stage.base);
  struct Pass {
    size_t of, n, all;
  };
  std::vector<Pass> order;
  for (size_t k = 0; k < written.size(); ++k) {
    order.push_back({k, 1, 1});
    const Written& w = written[k];
    if (w.repeat_from.empty()) continue;
    const size_t from = static_cast<size_t>(
        std::find(names.begin(), names.begin() + static_cast<ptrdiff_t>(k) + 1, w.repeat_from) - names.begin());
    if (from > k)
      throw InputError(w.repeat_at, fmt::format("repeat.from: there is no stage \"{}\" before this one", w.repeat_from),
                       meant(w.repeat_from, names, listed(names)));
    const size_t group = k + 1 - from;
    if (order.size() + group * w.times > kMostStages)
      throw InputError(w.repeat_at, "too many stages", fmt::format("at most {}", kMostStages));
    for (size_t i = order.size() - group; i < order.size(); ++i) {
      if (order[i].all != 1)
        throw InputError(w.repeat_at, "a repeated stage cannot be repeated again", "use one repeat, with more times");
      order[i].all = w.times;
    }
    for (size_t n = 2; n <= w.times; ++n)
      for (size_t i = from; i <= k; ++i) order.push_back({i, n, w.times});
  }
  for (const Pass& pass : order) {
    const Written& w = written[pass.of];
    ProcedureStage s = w.stage;
    s.name = pass.all > 1 ? fmt::format("{} {}", s.base, pass.n) : s.base;
    for (std::string* t : {&s.title, &s.text, &s.guard_text, &s.skip_text}) *t = filled(*t, pass.n, pass.all);
    for (StageHint& h : s.hint) h.text = filled(h.text, pass.n, pass.all);
    for (const auto& [task, where] : w.demo) s.demo.push_back(demo_task(filled(task, pass.n, pass.all), where));
    s.demo_from = p.stage.size();
    if (!w.demo_from.empty()) {  // the nearest stage of that name, here or before
      for (size_t k = p.stage.size();;) {
        if (k-- == 0)
          throw InputError(w.demo_from_at, fmt::format("demo_from: there is no stage \"{}\" before this one", w.demo_from),
                           meant(w.demo_from, names, listed(names)));
        if (p.stage[k].base != w.demo_from) continue;
        s.demo_from = k;
        break;
      }
    }
    p.stage.push_back(s);
  }
}

void read_error(Section& s, Procedure& p) {
  StageError e;
  e.name = s.text("name", true);
  e.text = s.text("text", true);
  e.why = s.text("why", true);
  const toml::node* on = s.get("on");
  const std::string event = s.text("on"), fault = s.text("fault");
  if (!event.empty()) {
    std::vector<std::string> known;
    for (size_t k = 0; k < static_cast<size_t>(EventKind::count_); ++k) known.push_back(event_name(static_cast<EventKind>(k)));
    const auto found = std::find(known.begin(), known.end(), event);
    if (found == known.end())
      throw InputError(s.at(on), fmt::format("there is no event \"{}\"", event), meant(event, known, listed(known)));
    e.on = static_cast<EventKind>(found - known.begin());
  }
  if (!fault.empty()) {
    std::vector<std::string> known;
    for (size_t k = 1; k < static_cast<size_t>(Fault::count_); ++k) known.push_back(fault_name(static_cast<Fault>(k)));
    const auto found = std::find(known.begin(), known.end(), fault);
    if (found == known.end())
      throw InputError(s.at(s.get("fault")), fmt::format("there is no fault \"{}\"", fault),
                       meant(fault, known, listed(known)));
    e.fault = static_cast<Fault>(found - known.begin() + 1);
  }
  if (const toml::node* value = s.get("value")) {
    if (!value->is_number()) s.wrong("value", value, "a number: the least value of the event that counts");
    e.value_min = *value->value<double>();
  }
  e.when = s.conditions("when");
  if ((e.on == EventKind::count_) == e.when.empty())
    throw InputError(s.at(nullptr), fmt::format("error \"{}\" needs either \"on\" (an event) or \"when\" (measures)", e.name),
                     "see docs/procedures.md");
  std::vector<std::string> names;
  for (const ProcedureStage& stage : p.stage) names.push_back(stage.name), names.push_back(stage.base);
  const auto in = s.words("in"), except = s.words("except");
  for (const auto& [name, node] : in.empty() ? except : in)
    if (std::find(names.begin(), names.end(), name) == names.end())
      throw InputError(s.at(node), fmt::format("there is no stage \"{}\"", name), meant(name, names, listed(names)));
  const auto listed_in = [](const auto& list, const ProcedureStage& stage) {
    return std::any_of(list.begin(), list.end(), [&](const auto& w) { return w.first == stage.name || w.first == stage.base; });
  };
  for (const ProcedureStage& stage : p.stage) e.in.push_back((in.empty() || listed_in(in, stage)) && !listed_in(except, stage));
  p.error.push_back(e);
  s.finish();
}

Procedure procedure_of_table(const toml::table& root, const std::string& file) {
  Procedure p;
  p.name = fs::path(file).stem().string();
  p.where = file;
  const std::string folder = fs::path(file).parent_path().string();
  Section top(root, "a procedure", file);
  p.title = top.text("title", true);
  p.text = top.text("text");
  p.scene = top.text("scene", true);
  p.technique = top.text("technique");
  std::vector<std::string> tray;
  for (const auto& [kind, node] : top.words("tray")) tray.push_back(kind);
  std::vector<Written> written;
  for (Section& s : top.rows("stage", "stage")) {
    written.push_back(read_stage(s, tray, folder));
    const std::string& name = written.back().stage.base;
    if (std::count_if(written.begin(), written.end(), [&](const Written& w) { return w.stage.base == name; }) > 1)
      throw InputError(s.at(nullptr), fmt::format("two stages have the name \"{}\"", name), "give each a name of its own");
  }
  const std::vector<Section> errors = top.rows("error", "error");
  top.finish();  // a misspelled "stage" is reported as such
  if (written.empty()) throw InputError(file, "a procedure has no [[stage]]", "add one; see docs/procedures.md");
  expand(written, p);
  for (Section s : errors) read_error(s, p);
  // What it refers to in its scene.
  SceneSpec scene;
  try {
    scene = scene_of(p);
  } catch (const InputError& error) {
    throw InputError(top.at(root.get("scene")), fmt::format("scene \"{}\"", p.scene), error.what());
  }
  if (!p.technique.empty() && p.technique != scene.technique.name)
    throw InputError(
        top.at(root.get("technique")),
        fmt::format("the scene \"{}\" has technique \"{}\", not \"{}\"", p.scene, scene.technique.name, p.technique),
        "name the scene's technique, or another scene");
  std::vector<std::string> kinds;
  for (const InstrumentSpec& i : scene.instrument) kinds.push_back(i.kind);
  if (kinds.empty()) kinds = {"needle_holder", "forceps"};
  for (const ProcedureStage& s : p.stage)
    for (const std::string& kind : s.tray)
      if (std::find(kinds.begin(), kinds.end(), kind) == kinds.end())
        throw InputError(file, fmt::format("stage \"{}\": the scene \"{}\" has no instrument \"{}\"", s.name, p.scene, kind),
                         meant(kind, kinds, listed(kinds)));
  p.instrument = kinds;
  // Every procedure that names its trays has this error.
  if (std::any_of(p.stage.begin(), p.stage.end(), [](const ProcedureStage& s) { return !s.tray.empty(); })) {
    StageError error;
    error.name = "tray";
    error.text = "An instrument was taken that this stage does not need.";
    error.on = EventKind::instrument_taken;
    error.off_tray = true;
    error.in.assign(p.stage.size(), 1);
    p.error.push_back(error);
  }
  return p;
}

bool is_file(const fs::path& path) {
  std::error_code error;
  return fs::is_regular_file(path, error);
}

}  // namespace

std::string procedures_folder() {
  const char* given = std::getenv("CATGUT_PROCEDURES");
  return given && *given ? given : data_path("procedures");
}

std::vector<std::string> procedure_names() {
  std::vector<std::string> names;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(procedures_folder(), error))
    if (entry.path().extension() == ".toml") names.push_back(entry.path().stem().string());
  std::sort(names.begin(), names.end());
  return names;
}

Procedure read_procedure(const std::string& name_or_path) {
  fs::path path = name_or_path;
  const bool bare = name_or_path.find('/') == std::string::npos;
  if (!is_file(path) && bare) {
    path = fs::path(procedures_folder()) / name_or_path;
    if (path.extension() != ".toml") path += ".toml";
  }
  if (!is_file(path)) {
    const std::vector<std::string> names = procedure_names();
    throw InputError(name_or_path, "there is no such procedure",
                     meant(name_or_path, names, listed(names) + " (or give the path of a .toml file)"));
  }
  std::ifstream in(path, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  if (!in) throw InputError(path.string(), "cannot be read", "check its permissions");
  return parse_procedure(text.str(), path.string());
}

Procedure parse_procedure(const std::string& text, const std::string& filename) {
  try {
    return procedure_of_table(toml::parse(text, filename), filename);
  } catch (const toml::parse_error& error) {
    const auto at = error.source().begin;
    throw InputError(fmt::format("{}:{}:{}", filename, at.line, at.column), std::string(error.description()),
                     "correct the TOML there");
  }
}

SceneSpec scene_of(const Procedure& p) {
  const fs::path beside = fs::path(p.where).parent_path() / p.scene;  // "my_scene.toml"
  return read_scene(p.scene.ends_with(".toml") && is_file(beside) ? beside.string() : p.scene);
}

size_t find_stage(const Procedure& p, const std::string& name, const std::string& option) {
  std::vector<std::string> names;
  for (const ProcedureStage& s : p.stage) names.push_back(s.name);
  for (size_t k = 0; k < p.stage.size(); ++k)
    if (p.stage[k].name == name || std::to_string(k + 1) == name) return k;
  for (size_t k = 0; k < p.stage.size(); ++k)
    if (p.stage[k].base == name) return k;
  throw InputError(option, fmt::format("{} has no stage \"{}\"", p.name, name), meant(name, names, listed(names)));
}

std::vector<size_t> demo_tasks(const Procedure& p, size_t stage, const SceneSpec& scene, const PictureModel& picture) {
  std::vector<size_t> out;
  if (p.stage[stage].demo.empty()) return out;
  Plan plan;
  try {
    plan = make_plan(plan_of(scene), picture, skill_of(scene));
  } catch (const std::invalid_argument& error) { throw InputError(p.where, error.what(), "remove \"demo\" from its stages"); }
  for (const DemoTask& wanted : p.stage[stage].demo) {
    size_t n = 0, at = 0;
    while (at < plan.task.size() && (plan.task[at].kind != wanted.kind || ++n != wanted.number)) ++at;
    if (at == plan.task.size())
      throw InputError(p.where,
                       fmt::format("stage \"{}\": the surgeon's plan has no task \"{} {}\"", p.stage[stage].name,
                                   task_names()[static_cast<size_t>(wanted.kind)], wanted.number),
                       fmt::format("it has {} of them", n));
    out.push_back(at);
  }
  return out;
}

}  // namespace catgut
