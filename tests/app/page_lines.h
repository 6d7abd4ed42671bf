// SPDX-License-Identifier: Apache-2.0
// tests/app: the command lines of the README and of the pages, and what to do with those that are not carried out as they
// stand: page_lines.txt.
#pragma once
#include <map>
#include <regex>
#include <vector>

#include "command_line.h"

namespace catgut_test {

const fs::path kRoot = CATGUT_SOURCE_DIR;

struct Line {
  std::string where, arguments;
};

// Without the comment after it: "# ...", or a column that two spaces or more set apart.
inline std::string arguments_of(std::string line) {
  for (const char* comment : {" #", "   ", " >"})
    if (const size_t at = line.find(comment); at != std::string::npos) line.erase(at);
  while (!line.empty() && line.back() == ' ') line.pop_back();
  return line;
}

inline std::vector<Line> command_lines() {
  std::vector<fs::path> pages{kRoot / "README.md", kRoot / "CONTRIBUTING.md"};
  for (const auto& entry : fs::recursive_directory_iterator(kRoot / "docs"))
    if (entry.path().extension() == ".md") pages.push_back(entry.path());
  const std::regex whole(R"(^ *(\./)?catgut +([a-z-].*)$)"), quoted(R"(`(\./)?catgut +([a-z-][^`]*)`)");
  std::vector<Line> out;
  for (const fs::path& page : pages) {
    std::istringstream text(read_file(page));
    int number = 0;
    for (std::string line; std::getline(text, line);) {
      ++number;
      const std::string where = fs::relative(page, kRoot).string() + ":" + std::to_string(number);
      std::smatch found;
      if (std::regex_match(line, found, whole)) out.push_back({where, arguments_of(found[2])});
      // In running text, only whole commands: not `catgut study`, not `catgut run --still`.
      for (std::sregex_iterator i(line.begin(), line.end(), quoted), end; i != end; ++i) {
        const std::string arguments = arguments_of((*i)[2]);
        const size_t last = arguments.rfind(' ');
        if (last != std::string::npos && arguments[last + 1] != '-') out.push_back({where, arguments});
      }
    }
  }
  return out;
}

// A row of page_lines.txt: "skip | REASON | LINE", or "run | REASON | LINE | LINE THAT IS CARRIED OUT INSTEAD".
struct Exception {
  bool skip = false;
  std::string reason, instead;
};

inline std::map<std::string, Exception> exceptions() {
  std::map<std::string, Exception> out;
  std::istringstream text(read_file(kRoot / "tests/app/page_lines.txt"));
  int number = 0;
  for (std::string line; std::getline(text, line);) {
    ++number;
    if (line.empty() || line[0] == '#') continue;
    std::vector<std::string> cell;
    std::istringstream in(line);
    for (std::string c; std::getline(in, c, '|');) {
      c.erase(0, c.find_first_not_of(' '));
      c.erase(c.find_last_not_of(' ') + 1);
      cell.push_back(c);
    }
    const bool skip = cell[0] == "skip", well = (skip && cell.size() == 3) || (cell[0] == "run" && cell.size() == 4);
    EXPECT_TRUE(well && !cell[1].empty()) << "page_lines.txt:" << number << ": " << line;
    if (!well) continue;
    EXPECT_TRUE(out.emplace(cell[2], Exception{skip, cell[1], skip ? "" : cell[3]}).second) << "twice: " << line;
  }
  return out;
}

}  // namespace catgut_test
