// SPDX-License-Identifier: Apache-2.0
// tests/app: every command line in the README and in the pages is understood by the program, and names scenes and procedures
// that exist. The lines are parsed by the program itself (catgut --parse-only), not carried out.
#include <gtest/gtest.h>

#include "page_lines.h"

namespace {
using namespace catgut_test;

// A name of the reader's own: "my_scene.toml", "SCENE", "./one_bite.toml".
bool own(const std::string& word) {
  return word.find('.') != std::string::npos || std::isupper(static_cast<unsigned char>(word[0]));
}

TEST_F(CommandLine, every_line_of_the_pages_is_understood) {
  const std::vector<Line> lines = command_lines();
  EXPECT_GT(lines.size(), 60u);
  std::string script;
  size_t tried = 0;
  for (const Line& l : lines) {
    std::istringstream in(l.arguments);
    std::vector<std::string> word;
    for (std::string w; in >> w;) word.push_back(w);
    if (word.back() == "S") word.pop_back(), word.pop_back();  // "--seconds S": S stands for a number
    if (word[0] == "demo" || word[0] == "test") continue;      // of the launcher
    if (l.arguments.find_first_of("|[<…") != std::string::npos || l.arguments.find("...") != std::string::npos) continue;
    for (size_t k = 0; k < word.size(); ++k) {
      const bool scene = k == 1 && (word[0] == "run" || word[0] == "play") && word[1][0] != '-';
      const bool procedure = k > 0 && word[k - 1] == "--procedure";
      if ((!scene && !procedure) || own(word[k])) continue;
      EXPECT_TRUE(fs::exists(kRoot / (scene ? "scenes" : "procedures") / (word[k] + ".toml"))) << l.where << ": " << word[k];
    }
    ++tried;
    std::string arguments;
    for (const std::string& w : word) arguments += w + " ";
    script += "'" CATGUT_APP "' --parse-only " + arguments + "</dev/null >>out 2>err || { echo \"" + l.where + ": " +
              std::regex_replace(l.arguments, std::regex("[\"`$\\\\]"), "_") + ": $(cat err)\" >>wrong; }\n";
  }
  EXPECT_GT(tried, 50u);
  std::ofstream(folder_ / "script.sh") << script;
  ASSERT_EQ(std::system(("cd '" + folder_.string() + "' && sh script.sh").c_str()), 0);
  EXPECT_EQ(read_file(folder_ / "wrong"), "");
}

// The list of lines that are not carried out as they stand has no row for a line that is gone.
TEST_F(CommandLine, every_exception_is_a_line_of_the_pages) {
  std::map<std::string, Exception> left = exceptions();
  EXPECT_GT(left.size(), 10u);
  for (const Line& l : command_lines()) left.erase(l.arguments);
  for (const auto& [line, what] : left) ADD_FAILURE() << "page_lines.txt: no page has \"" << line << '"';
}

TEST_F(CommandLine, a_line_that_is_only_parsed_does_nothing) {
  EXPECT_EQ(run_catgut("--parse-only run small.toml --surgeon none --json made.json").code, 0);
  EXPECT_FALSE(fs::exists(folder_ / "made.json"));
  expect_refused("--parse-only run small.toml --jsn made.json", "did you mean --json?");
}

TEST_F(CommandLine, a_misspelled_subcommand_is_named) {
  expect_refused("--parse-only store lst", "store has no command \"lst\"; did you mean \"list\"?");
  expect_refused("--parse-only survey shwo", "survey has no command \"shwo\"; did you mean \"show\"?");
  expect_refused("--parse-only store list --chort A", "did you mean --cohort?");
}

}  // namespace
