// SPDX-License-Identifier: Apache-2.0
// tests/app: every command line in the README and in the pages is carried out, in the order of the pages, in a folder with the
// files that they name, and ends with exit code 0. page_lines.txt lists the lines that are not carried out, or otherwise, each
// with its reason.
#include <chrono>
#include <memory>

#include "../hands/x_server.h"
#include "page_lines.h"

namespace {
using namespace catgut_test;

// The reader's own files, and stand-ins for names that a page leaves open.
void prepare(const fs::path& folder) {
  const auto copy = [&](const fs::path& from, const char* to) { fs::copy_file(kRoot / from, folder / to); };
  copy("rubrics/stay.toml", "my.toml");
  // The scene of the page on scenes.
  std::istringstream page(read_file(kRoot / "docs/own_scene.md"));
  std::ofstream scene(folder / "my_scene.toml");
  bool inside = false;
  for (std::string line; std::getline(page, line);) {
    if (line.rfind("```", 0) == 0) inside = line == "```toml";
    else if (inside) scene << line << '\n';
  }
  scene.close();
  fs::create_directories(folder / "studies");
  for (const char* study : {"cohort.toml", "levels.toml"})
    copy(fs::path("studies") / study, (std::string("studies/") + study).c_str());
  std::ofstream(folder / "plan.toml")
      << "title = \"small\"\nscenes = [\"stay\"]\nsurgeons = [\"scripted:novice\", \"scripted:expert\"]\n"
         "seeds = [1, 2]\nseconds = 3\n";
  std::ofstream(folder / "curve.csv")
      << "participant,group,time_1,time_2,score_1,score_2,errors_1,errors_2\n1,a,95.5,1:20,60,70,3,2\n";
  std::ofstream(folder / "curve.toml")
      << "title = \"Curve\"\ntask = \"peg_transfer\"\ntrainee = { column = \"participant\", prefix = \"P\" }\n"
         "sessions = 2\nduration = { column = \"time_{n}\" }\nscore = { column = \"score_{n}\" }\n";
  std::ofstream(folder / "answers.csv") << "respondent,group,Q1,Q2,Q3,Q4,Q5\nR1,novice,4,3,5,2,4\nR2,expert,3,3,4,2,3\n";
}

// "run SCENE" as "run stay". A number stands for "S" and the like in page_lines.txt only.
std::string filled_in(const std::string& arguments) {
  const std::map<std::string, std::string> stands_for{
      {"SCENE", "stay"},        {"NAME", "stay"},      {"KEY", "solver"}, {"FILE", "file.out"}, {"FILE.cgrec", "today.cgrec"},
      {"FILE.mp4", "film.mp4"}, {"F.mp4", "film.mp4"}, {"DIR", "folder"}};
  std::istringstream in(arguments);
  std::string out;
  for (std::string word; in >> word;) {
    const auto found = stands_for.find(word);
    out += (out.empty() ? "" : " ") + (found == stands_for.end() ? word : found->second);
  }
  return out;
}

// Every day those that take no time; all with CATGUT_LONG=1 (the nightly run). CATGUT_LINES: a regular expression; only lines
// that contain it.
constexpr const char* kQuick = "^(describe|assess --(metrics|rubric)|store (info|person|import)|survey|bridge)";

TEST_F(CommandLine, every_line_of_the_pages_is_carried_out) {
  const char* given = std::getenv("CATGUT_LINES");
  const bool all = !given && std::getenv("CATGUT_LONG");
  const std::regex only(given ? given : all ? "" : kQuick);
  prepare(folder_);
  std::unique_ptr<catgut::XServer> x;  // for windows, of which the quick lines open none
  if (all || given) x = std::make_unique<catgut::XServer>();
  if (x && x->display.empty()) GTEST_SKIP() << "Xvfb does not start here (Debian: apt install xvfb)";
  const std::string surroundings = "cd '" + folder_.string() + "' && export DISPLAY='" + (x ? x->display : "") + "'" +
                                   " SDL_VIDEODRIVER=x11 XDG_CONFIG_HOME=\"$PWD/config\" XDG_DATA_HOME=\"$PWD/data\" "
                                   "XDG_RUNTIME_DIR=\"$PWD\" CATGUT_STORE=\"$PWD/sessions.db\"; ";
  const std::string recording =
      "'" CATGUT_APP "' run stay --headless --seconds 2 --no-expect --record short.cgrec >stdout.txt 2>stderr.txt";
  if (x && std::system((surroundings + recording).c_str()) != 0) FAIL() << read_file(folder_ / "stderr.txt");
  const std::map<std::string, Exception> exception = exceptions();
  std::map<std::string, bool> done;
  size_t carried_out = 0, skipped = 0;
  for (const Line& l : command_lines()) {
    if (!done.emplace(l.arguments, true).second) continue;
    if (l.arguments.find_first_of("|[<…") != std::string::npos || l.arguments.find("...") != std::string::npos)
      continue;  // choices
    const auto found = exception.find(l.arguments);
    if (found != exception.end() && found->second.skip) {
      ++skipped;
      continue;
    }
    const std::string arguments = found == exception.end() ? filled_in(l.arguments) : found->second.instead;
    if (!std::regex_search(arguments, only)) continue;
    const auto began = std::chrono::steady_clock::now();
    const int status = std::system(
        (surroundings + "timeout 1800 '" CATGUT_APP "' " + arguments + " >stdout.txt 2>stderr.txt </dev/null").c_str());
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
    std::printf("%6.1f s  %s\n", seconds, arguments.c_str());
    std::fflush(stdout);
    ++carried_out;
    EXPECT_EQ(status, 0) << l.where << ": catgut " << arguments << "\n" << read_file(folder_ / "stderr.txt").substr(0, 2000);
  }
  std::printf("%zu lines carried out, %zu not (page_lines.txt)\n", carried_out, skipped);
  EXPECT_GT(carried_out, all ? size_t{60} : given ? size_t{0} : size_t{8});
}

}  // namespace
