// SPDX-License-Identifier: Apache-2.0
// app/window: see language.h.
#include "window/language.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <unordered_map>

#include "core/check.h"
#include "core/data.h"
#include "core/file.h"
#include "procedure/toml.h"

namespace catgut {
namespace {
namespace fs = std::filesystem;

constexpr int kDeepest = 6;           // patterns within patterns
constexpr size_t kMostCached = 2000;  // lines

std::vector<std::string> pieces(const std::string& text) {
  std::vector<std::string> out;
  size_t from = 0;
  for (size_t at; (at = text.find("{}", from)) != std::string::npos; from = at + 2) out.push_back(text.substr(from, at - from));
  out.push_back(text.substr(from));
  return out;
}

size_t letters_in(const Language::Pattern& p) {
  size_t n = 0;
  for (const std::string& s : p.piece) n += s.size();
  return n;
}

// Number of placeholders of a translation; -1: one is not valid.
int placeholders(const std::string& to) {
  int n = 0;
  for (size_t at = to.find('{'); at != std::string::npos; at = to.find('{', at + 1)) {
    const size_t end = to.find('}', at);
    if (end == std::string::npos || end > at + 2 || (end == at + 2 && (to[at + 1] < '0' || to[at + 1] > '9'))) return -1;
    ++n;
  }
  return n;
}

bool match(const Language::Pattern& p, const std::string& text, std::vector<std::string>& part) {
  part.clear();
  if (text.compare(0, p.piece.front().size(), p.piece.front()) != 0) return false;
  size_t at = p.piece.front().size();
  for (size_t k = 1; k < p.piece.size(); ++k) {
    const std::string& next = p.piece[k];
    const bool last = k + 1 == p.piece.size();
    size_t to = 0;
    if (last) {
      if (text.size() < at + next.size() || text.compare(text.size() - next.size(), next.size(), next) != 0) return false;
      to = text.size() - next.size();
    } else {
      to = text.find(next, at);
      if (to == std::string::npos) return false;
    }
    if (to == at) return false;  // nothing between them
    part.push_back(text.substr(at, to - at));
    at = to + next.size();
  }
  return true;
}

const std::string* word_of(const Language& l, const std::string& english) {
  const auto at = std::lower_bound(l.word.begin(), l.word.end(), english,
                                   [](const auto& w, const std::string& wanted) { return w.first < wanted; });
  return at != l.word.end() && at->first == english ? &at->second : nullptr;
}

std::string translate(const Language& l, const std::string& english, int depth) {
  if (const std::string* word = word_of(l, english)) return *word;
  if (depth >= kDeepest) return english;
  std::vector<std::string> part;
  for (const Language::Pattern& p : l.pattern) {
    if (!match(p, english, part)) continue;
    std::string out;
    size_t next = 0;
    for (size_t i = 0; i < p.to.size(); ++i) {
      if (p.to[i] != '{') {
        out += p.to[i];
        continue;
      }
      const size_t which = p.to[i + 1] == '}' ? next++ : static_cast<size_t>(p.to[i + 1] - '0');
      out += translate(l, part[which], depth + 1);
      i = p.to.find('}', i);
    }
    return out;
  }
  // Several sentences, each known alone.
  for (size_t at = english.rfind(". "); at != std::string::npos && at > 0; at = english.rfind(". ", at - 1))
    if (const std::string* first = word_of(l, english.substr(0, at + 1)))
      return *first + " " + translate(l, english.substr(at + 2), depth + 1);
  return english;
}

struct Used {
  std::optional<Language> language;  // none: English
  std::unordered_map<std::string, std::string> cache;
};
Used& used() {
  static Used now;
  return now;
}

}  // namespace

Language read_language(const std::string& name_or_path) {
  const std::string path =
      name_or_path.ends_with(".toml") ? name_or_path : data_path("languages") + "/" + name_or_path + ".toml";
  Language out;
  out.name = fs::path(path).stem().string();
  toml::table root;
  const auto at = [&](const toml::source_region& r) { return fmt::format("{}:{}", path, r.begin.line); };
  try {
    root = toml::parse(read_file(path), path);
  } catch (const toml::parse_error& error) {
    throw InputError(at(error.source()), std::string(error.description()), "fix the syntax; see docs/languages.md");
  }
  out.title = root["title"].value_or(out.name);
  const toml::table* words = root["words"].as_table();
  if (!words) throw InputError(path, "there is no table [words]", "see docs/languages.md");
  for (const auto& [key, node] : *words) {
    const std::string english(key.str());
    if (!node.is_string()) throw InputError(at(node.source()), "a translation is a text", "write it in quotes");
    const std::string to = *node.value<std::string>();
    Language::Pattern p{pieces(english), to};
    if (placeholders(to) != static_cast<int>(p.piece.size()) - 1)
      throw InputError(at(node.source()), fmt::format("the translation of \"{}\" has other {{}} than the text", english),
                       "use each {} once; {0} and {1} change their order");
    for (const char digit : std::string("0123456789"))
      if (to.find(std::string("{") + digit + "}") != std::string::npos && digit - '0' >= static_cast<int>(p.piece.size()) - 1)
        throw InputError(at(node.source()), fmt::format("there is no {{{}}} in \"{}\"", digit, english), "count from {0}");
    if (p.piece.size() == 1) out.word.push_back({english, to});
    else out.pattern.push_back(std::move(p));
  }
  std::sort(out.word.begin(), out.word.end());
  std::stable_sort(out.pattern.begin(), out.pattern.end(),
                   [](const auto& a, const auto& b) { return letters_in(a) > letters_in(b); });
  return out;
}

std::vector<std::string> language_names() {
  std::vector<std::string> out{"en"};
  std::error_code error;
  for (fs::directory_iterator i(data_path("languages"), error), end; !error && i != end; i.increment(error))
    if (i->path().extension() == ".toml") out.push_back(i->path().stem().string());
  std::sort(out.begin(), out.end());
  return out;
}

std::string language_of_environment() {
  const std::vector<std::string> names = language_names();
  for (const char* variable : {"LC_ALL", "LC_MESSAGES", "LANG"}) {
    const char* value = std::getenv(variable);
    if (!value || !value[0]) continue;
    const std::string name = std::string(value).substr(0, 2);
    return std::find(names.begin(), names.end(), name) != names.end() ? name : "en";
  }
  return "en";
}

std::string translated(const Language& language, const std::string& english) { return translate(language, english, 0); }

void use_language(const std::string& name) {
  const std::string wanted = name.empty() ? language_of_environment() : name;
  Used& now = used();
  if ((now.language ? now.language->name : "en") == wanted) return;
  now.cache.clear();
  now.language.reset();
  if (wanted != "en") now.language = read_language(wanted);
}

std::string tr(const std::string& english) {
  Used& now = used();
  if (!now.language) return english;
  const auto found = now.cache.find(english);
  if (found != now.cache.end()) return found->second;
  if (now.cache.size() >= kMostCached) now.cache.clear();  // numbers vary
  return now.cache[english] = translated(*now.language, english);
}

}  // namespace catgut
