// SPDX-License-Identifier: Apache-2.0
// app/window: the words of the screens in the user's language. The program's own words are English; languages/NAME.toml maps
// them to another language, whole lines or patterns with {} for what varies. What a file does not name stays English.
#pragma once
#include <string>
#include <utility>
#include <vector>

namespace catgut {

struct Language {
  std::string name, title;                                // "de", "Deutsch"
  std::vector<std::pair<std::string, std::string>> word;  // sorted: without {}
  struct Pattern {
    std::vector<std::string> piece;  // between the {}
    std::string to;                  // {} in the same order, or {0}, {1}
  };
  std::vector<Pattern> pattern;  // the one with most letters first
};

// Throws InputError (file:line) for a file that is not one, or a translation whose {} do not fit.
Language read_language(const std::string& name_or_path);
std::vector<std::string> language_names();  // "en" and the files in languages/, sorted
std::string language_of_environment();      // by LC_ALL, LC_MESSAGES, LANG; "en" where there is no file for it

std::string translated(const Language& language, const std::string& english);

// Of this process, for all screens; set before they are drawn.
void use_language(const std::string& name);  // "": of the environment
std::string tr(const std::string& english);

}  // namespace catgut
