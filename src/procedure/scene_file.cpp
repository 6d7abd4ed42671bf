// SPDX-License-Identifier: Apache-2.0
// procedure: reads and writes scene files. Uses the table in scene_fields; its only own key is `expect`.
#include "procedure/scene_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "core/check.h"
#include "core/data.h"
#include "procedure/scene_fields.h"
#include "procedure/toml.h"

namespace catgut {
namespace {
namespace fs = std::filesystem;

std::string at_line(const std::string& file, const toml::source_region& source) {
  return source.begin.line ? fmt::format("{}:{}", file, source.begin.line) : file;
}

std::vector<std::string> keys_of(std::string_view section) {
  std::vector<std::string> keys;
  for (const Field& f : scene_fields())
    if (section == f.section) keys.push_back(f.key);
  if (section.empty()) keys.insert(keys.end(), scene_sections().begin(), scene_sections().end());
  return keys;
}

[[noreturn]] void unknown_key(const std::string& where, std::string_view section, std::string_view key) {
  std::string nearest = nearest_word(key, keys_of(section));
  // A key of a table within the section, without that table's name.
  for (const Field& f : scene_fields())
    if (nearest.empty() && section == f.section && std::string_view(f.key).ends_with("." + std::string(key))) nearest = f.key;
  // A key written in the wrong section is more likely than a distant misspelling.
  for (const Field& f : scene_fields())
    if (nearest.empty() && key == f.key) nearest = full_key(f);
  const std::string what = fmt::format("{} has no key \"{}\"", section.empty() ? "a scene" : section, key);
  if (!nearest.empty()) throw InputError(where, what, fmt::format("did you mean \"{}\"?", nearest));
  throw InputError(
      where, what,
      section.empty() ? "`catgut describe` lists the keys" : fmt::format("`catgut describe {}` lists its keys", section));
}

std::string found_text(const toml::node& node) {
  std::ostringstream out;
  switch (node.type()) {
    case toml::node_type::string:
      out << "the text \"" << *node.value<std::string>() << "\"";
      break;
    case toml::node_type::integer:
      out << *node.value<int64_t>();
      break;
    case toml::node_type::floating_point:
      out << number_text(*node.value<double>());
      break;
    case toml::node_type::boolean:
      out << (*node.value<bool>() ? "true" : "false");
      break;
    case toml::node_type::array:
      out << "a list of " << node.as_array()->size();
      break;
    case toml::node_type::table:
      out << "a table";
      break;
    default:
      out << "a date or time";
      break;
  }
  return out.str();
}

// Writes one value to its location in the table, or reports why it cannot.
struct Assign {
  const Field& field;
  const toml::node& node;
  const std::string& where;

  [[noreturn]] void fail(const std::string& what) const {
    const std::string range = range_text(field), unit = field.unit;
    throw InputError(where, fmt::format("{} {}", full_key(field), what),
                     fmt::format("it is a {}{}{}", type_name(field), range.empty() ? "" : ", " + range,
                                 unit.empty() ? "" : fmt::format(" [{}]", unit)));
  }
  [[noreturn]] void wrong_type() const { fail("cannot be " + found_text(node)); }
  double number(const toml::node& n) const {
    if (!n.is_number()) wrong_type();
    const double v = *n.value<double>();
    if (!(v >= field.min && v <= field.max)) fail(fmt::format("= {} is out of range", number_text(v)));
    return v;
  }
  int64_t integer() const {
    if (!node.is_integer()) wrong_type();
    number(node);
    return *node.value<int64_t>();
  }

  void operator()(std::string* v) const {
    if (!node.is_string()) wrong_type();
    const std::string text = *node.value<std::string>();
    if (field.choices) {
      const std::vector<std::string> words = choices();
      if (std::find(words.begin(), words.end(), text) == words.end()) {
        const std::string nearest = nearest_word(text, words);
        const std::string what = fmt::format("{} \"{}\" is not known", full_key(field), text);
        if (nearest.empty()) throw InputError(where, what, "there is " + range_text(field));
        throw InputError(where, what, fmt::format("did you mean \"{}\"?", nearest));
      }
    }
    *v = text;
  }
  void operator()(int* v) const { *v = static_cast<int>(integer()); }
  void operator()(uint64_t* v) const { *v = static_cast<uint64_t>(integer()); }
  void operator()(float* v) const { *v = static_cast<float>(number(node)); }
  void operator()(bool* v) const {
    if (!node.is_boolean()) wrong_type();
    *v = *node.value<bool>();
  }
  void operator()(Vec3* v) const {
    const toml::array* a = node.as_array();
    if (!a || a->size() != 3) wrong_type();
    *v = {static_cast<float>(number((*a)[0])), static_cast<float>(number((*a)[1])), static_cast<float>(number((*a)[2]))};
  }
  std::vector<std::string> choices() const {
    std::vector<std::string> words;
    std::istringstream in(field.choices.text());
    for (std::string w; std::getline(in, w, '|');) words.push_back(w);
    return words;
  }
};

bool has_keys_within(std::string_view section, const std::string& table) {
  return std::any_of(scene_fields().begin(), scene_fields().end(),
                     [&](const Field& f) { return section == f.section && std::string_view(f.key).starts_with(table); });
}

bool is_preset(const Field& f) { return std::strcmp(f.section, "solver") == 0 && std::strcmp(f.key, "preset") == 0; }

void assign(SceneSpec& scene, const Field& field, size_t body, const toml::node& node, const std::string& where) {
  std::visit(Assign{field, node, where}, field.at(scene, body));
  if (is_preset(field)) use_preset(scene, scene.solver.preset, where);
}

// within: "" or "thread.", a table inside the section.
void read_section(SceneSpec& scene, const char* section, size_t body, const toml::table& table, const std::string& file,
                  const std::string& within = "") {
  // The preset is applied before the other keys, at any position in the section.
  if (std::strcmp(section, "solver") == 0)
    if (const toml::node* preset = table.get("preset"))
      assign(scene, *find_field("solver", "preset"), 0, *preset, at_line(file, preset->source()));
  for (const auto& [name, node] : table) {
    const std::string key = within + std::string(name.str());
    const Field* field = find_field(section, key);
    const toml::table* inner = node.as_table();
    if (!field && inner && has_keys_within(section, key + ".")) {
      read_section(scene, section, body, *inner, file, key + ".");
      continue;
    }
    if (!field) unknown_key(at_line(file, name.source()), section, key);
    if (!is_preset(*field)) assign(scene, *field, body, node, at_line(file, node.source()));
  }
}

void read_expectation(SceneSpec& scene, std::string_view name, const toml::node& node, const std::string& where) {
  std::vector<std::string> known;
  for (const ResultName& r : result_names()) known.push_back(r.name);
  if (std::find(known.begin(), known.end(), name) == known.end()) {
    const std::string nearest = nearest_word(name, known);
    throw InputError(where, fmt::format("expect: a run has no result \"{}\"", name),
                     nearest.empty() ? "`catgut describe expect` lists them" : fmt::format("did you mean \"{}\"?", nearest));
  }
  Expectation e;
  e.name = name;
  const std::string how = "write a number for equality, or {min = ..., max = ...}";
  if (node.is_number()) {
    e.min = e.max = *node.value<double>();
  } else if (const toml::table* bounds = node.as_table(); bounds && !bounds->empty()) {
    for (const auto& [key, bound] : *bounds) {
      if (key.str() != "min" && key.str() != "max")
        throw InputError(where, fmt::format("expect.{} has no key \"{}\"", name, key.str()), how);
      if (!bound.is_number())
        throw InputError(where, fmt::format("expect.{}.{} cannot be {}", name, key.str(), found_text(bound)), how);
      (key.str() == "min" ? e.min : e.max) = *bound.value<double>();
    }
  } else {
    throw InputError(where, fmt::format("expect.{} cannot be {}", name, found_text(node)), how);
  }
  if (!(e.min <= e.max)) throw InputError(where, fmt::format("expect.{} allows nothing: min is above max", name), how);
  for (Expectation& old : scene.expect)
    if (old.name == e.name) {
      old = e;
      return;
    }
  scene.expect.push_back(e);
}

[[noreturn]] void rethrow(const toml::parse_error& error, const std::string& file) {
  std::string what(error.description());
  std::replace(what.begin(), what.end(), '\n', ' ');
  const auto at = error.source().begin;
  throw InputError(fmt::format("{}:{}:{}", file, at.line, at.column), what, "correct the TOML there");
}

bool is_toml_text(const std::string& text) {
  std::string copy = text;
  try {
    return !toml::parse("v = " + value_text(&copy)).empty();
  } catch (const toml::parse_error&) { return false; }
}

void read_list(SceneSpec& scene, const std::string& section, const toml::node& node, const std::string& where,
               const std::string& file) {
  const toml::array* list = node.as_array();
  if (!list || !list->is_homogeneous(toml::node_type::table))
    throw InputError(where, section + " cannot be " + found_text(node),
                     fmt::format("write [[{}]] in double brackets for every {}{}", section, section,
                                 section == "suture" ? "; its mechanics are in [mechanics]" : ""));
  for (const toml::node& row : *list) {
    add_row(scene, section);
    read_section(scene, section.c_str(), rows_of(scene, section) - 1, *row.as_table(), file);
  }
}

SceneSpec scene_of_table(const toml::table& root, const std::string& file) {
  SceneSpec scene;
  scene.name = fs::path(file).stem().string();
  if (!is_toml_text(scene.name)) scene.name = "scene";  // a file's name may have any bytes; a scene's is text
  for (const auto& [key, node] : root) {
    const std::string section(key.str());
    const std::string where = at_line(file, key.source());
    const auto& sections = scene_sections();
    if (std::find(sections.begin(), sections.end(), section) == sections.end()) {
      const Field* field = find_field("", section);
      if (!field) unknown_key(where, "", section);
      assign(scene, *field, 0, node, at_line(file, node.source()));
    } else if (section == "suture") {
      // Below: it inherits [thread] and [needle], wherever in the file they are.
    } else if (is_list(section)) {
      read_list(scene, section, node, where, file);
    } else if (const toml::table* table = node.as_table()) {
      if (section != "expect") {
        read_section(scene, section.c_str(), 0, *table, file);
        continue;
      }
      // In file order, not alphabetical: reports follow the scene.
      std::vector<std::pair<toml::source_position, std::string>> order;
      for (const auto& [name, bound] : *table) order.push_back({name.source().begin, std::string(name.str())});
      std::sort(order.begin(), order.end());
      for (const auto& [position, name] : order)
        read_expectation(scene, name, *table->get(name), fmt::format("{}:{}", file, position.line));
    } else {
      throw InputError(where, fmt::format("{} cannot be {}", section, found_text(node)),
                       fmt::format("it is a table: write [{}]", section));
    }
  }
  if (const auto sutures = root.find("suture"); sutures != root.end())
    read_list(scene, "suture", sutures->second, at_line(file, sutures->first.source()), file);
  return scene;
}

bool is_readable_file(const fs::path& path) {
  std::error_code error;
  return fs::is_regular_file(path, error);
}

std::string read_text(const fs::path& path, const std::string& where) {
  std::ifstream in(path, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  if (!in) throw InputError(where, "cannot be read", "check its permissions");
  return text.str();
}

// A mesh path relative to the scene file stays valid for any working directory.
void seek_meshes_beside(SceneSpec& scene, const fs::path& folder) {
  for (BodySpec& body : scene.body) {
    const std::string file = body.mesh.substr(0, body.mesh.find('#'));
    if (file.empty() || fs::path(file).is_absolute()) continue;
    if (is_readable_file(folder / file)) body.mesh = (folder / body.mesh).lexically_normal().string();
  }
}

}  // namespace

std::string scenes_folder() {
  const char* given = std::getenv("CATGUT_SCENES");
  return given && *given ? given : data_path("scenes");
}

std::vector<std::string> scene_names() {
  std::vector<std::string> names;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(scenes_folder(), error))
    if (entry.path().extension() == ".toml") names.push_back(entry.path().stem().string());
  std::sort(names.begin(), names.end());
  return names;
}

SceneSpec read_scene(const std::string& name_or_path) {
  fs::path path = name_or_path;
  std::string shown = name_or_path;
  const bool bare = name_or_path.find('/') == std::string::npos;
  if (!is_readable_file(path) && bare) {
    path = fs::path(scenes_folder()) / name_or_path;
    if (path.extension() != ".toml") path += ".toml";
    shown = path.filename().string();
  }
  if (!is_readable_file(path)) {
    const std::vector<std::string> names = scene_names();
    const std::string nearest = bare ? nearest_word(name_or_path, names) : "";
    std::string next = "give the path of a .toml file, or set CATGUT_DATA_DIR to the folder that holds Catgut's own scenes/";
    if (!names.empty()) next = fmt::format("the scenes are: {} (or give the path of a .toml file)", fmt::join(names, ", "));
    if (!nearest.empty()) next = fmt::format("did you mean \"{}\"? {}", nearest, next);
    throw InputError(name_or_path, "there is no such scene", next);
  }
  SceneSpec scene = parse_scene(read_text(path, shown), shown);
  seek_meshes_beside(scene, path.parent_path());
  return scene;
}

SceneSpec parse_scene(const std::string& text, const std::string& filename) {
  try {
    return scene_of_table(toml::parse(text, filename), filename);
  } catch (const toml::parse_error& error) { rethrow(error, filename); }
}

std::string write_scene(const SceneSpec& scene) {
  SceneSpec s = scene;  // the table has non-const pointers; nothing is changed here
  std::string out;
  const auto write_keys = [&](const std::string& section, size_t body) {
    for (const Field& f : scene_fields())
      if (section == f.section) out += fmt::format("{} = {}\n", f.key, value_text(f.at(s, body)));
  };
  write_keys("", 0);
  for (const std::string& section : scene_sections()) {
    if (section == "expect") continue;
    for (size_t b = 0; b < rows_of(s, section); ++b) {
      out += is_list(section) ? fmt::format("\n[[{}]]\n", section) : fmt::format("\n[{}]\n", section);
      write_keys(section, b);
    }
  }
  if (s.expect.empty()) return out;
  out += "\n[expect]\n";
  const Expectation open;
  for (const Expectation& e : s.expect) {
    if (e.min == e.max) {
      out += fmt::format("{} = {}\n", e.name, number_text(e.min));
      continue;
    }
    std::vector<std::string> bounds;
    if (e.min != open.min) bounds.push_back("min = " + number_text(e.min));
    if (e.max != open.max || bounds.empty()) bounds.push_back("max = " + number_text(e.max));
    out += fmt::format("{} = {{{}}}\n", e.name, fmt::join(bounds, ", "));
  }
  return out;
}

void set_value(SceneSpec& scene, const std::string& key_equals_value, const std::string& where) {
  const size_t equals = key_equals_value.find('=');
  if (equals == std::string::npos || equals == 0)
    throw InputError(where, fmt::format("\"{}\" is not key=value", key_equals_value), "write for example solver.substeps=8");
  const auto trimmed = [](std::string s) {
    s.erase(0, s.find_first_not_of(" \t"));
    s.erase(s.find_last_not_of(" \t") + 1);
    return s;
  };
  const std::string path = trimmed(key_equals_value.substr(0, equals));
  const std::string value = trimmed(key_equals_value.substr(equals + 1));
  const std::string here = where + " " + path;

  const size_t dot = path.find('.');
  std::string section = dot == std::string::npos ? "" : path.substr(0, dot);
  const std::string key = dot == std::string::npos ? path : path.substr(dot + 1);
  size_t first = 0, last = 1;
  const size_t bracket = section.find('[');
  const std::string list = section.substr(0, bracket);
  if (is_list(list) && (bracket == std::string::npos || section.back() == ']')) {
    const std::string number = bracket == std::string::npos ? "" : section.substr(bracket + 1, section.size() - bracket - 2);
    last = rows_of(scene, list);
    if (!number.empty()) {
      const bool digits = number.size() < 7 && number.find_first_not_of("0123456789") == std::string::npos;
      first = digits ? std::stoul(number) : last;
      if (first >= last)
        throw InputError(here,
                         list == "body" ? fmt::format("the scene has {} bodies, counted from 0", last)
                                        : fmt::format("the scene has {} of [[{}]], counted from 0", last, list),
                         list + ".key sets all of them");
      last = first + 1;
    }
    section = list;
  }

  const auto& sections = scene_sections();
  if (!section.empty() && std::find(sections.begin(), sections.end(), section) == sections.end()) {
    const std::string nearest = nearest_word(section, sections);
    throw InputError(
        here, fmt::format("a scene has no section \"{}\"", section),
        nearest.empty() ? fmt::format("there is {}", fmt::join(sections, ", ")) : fmt::format("did you mean \"{}\"?", nearest));
  }
  const Field* field = section == "expect" ? nullptr : find_field(section, key);
  if (!field && section != "expect") unknown_key(here, section, key);
  if (first == last) throw InputError(here, fmt::format("the scene has no {}", section), "add one to the scene file");

  // On a command line text needs no quotes.
  const bool is_text = field && type_name(*field) == "text";
  toml::table parsed;
  if (is_text && (value.empty() || (value[0] != '"' && value[0] != '\''))) {
    if (!is_toml_text(value)) throw InputError(here, "the value is not text in UTF-8", "check the terminal's encoding");
    parsed.insert("v", value);
  } else {
    try {
      parsed = toml::parse("v = " + value);
    } catch (const toml::parse_error&) {
      throw InputError(here, fmt::format("\"{}\" is not a value", value),
                       field ? fmt::format("it is a {}, for example {}", type_name(*field), default_text(*field))
                             : "write a number, or {min = ..., max = ...}");
    }
    if (parsed.size() != 1) throw InputError(here, "more than one value", "give one --set for each key");
  }
  const toml::node& node = *parsed.get("v");
  if (section == "expect") {
    read_expectation(scene, key, node, here);
  } else {
    for (size_t b = first; b < last; ++b) assign(scene, *field, b, node, here);
    // [thread] and [needle] are those of every suture.
    if (const Field* inherited = find_field("suture", section + "." + key))
      for (size_t b = 0; b < scene.suture.size(); ++b) assign(scene, *inherited, b, node, here);
  }
}

// By value: the text may be overwritten by apply_preset.
void use_preset(SceneSpec& scene, std::string preset, const std::string& where) {
  if (!apply_preset(scene.solver, preset))
    throw InputError(where, fmt::format("there is no preset \"{}\"", preset),
                     "there is " + range_text(*find_field("solver", "preset")));
  scene.solver.preset = preset;
}

bool same_scene(const SceneSpec& a, const SceneSpec& b) {
  if (a.body.size() != b.body.size() || a.instrument.size() != b.instrument.size() || a.suture.size() != b.suture.size() ||
      a.expect.size() != b.expect.size())
    return false;
  SceneSpec x = a, y = b;
  for (const Field& f : scene_fields())
    for (size_t i = 0; i < rows_of(x, f.section); ++i)
      if (value_text(f.at(x, i)) != value_text(f.at(y, i))) return false;  // texts are unique per bit pattern
  for (size_t i = 0; i < a.expect.size(); ++i)
    if (a.expect[i].name != b.expect[i].name || a.expect[i].min != b.expect[i].min || a.expect[i].max != b.expect[i].max)
      return false;
  return true;
}

}  // namespace catgut
