// SPDX-License-Identifier: Apache-2.0
// tests/docs: statements of the pages about the repository are true: the README's program is the tested sample, links
// resolve, and named files exist.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

namespace {
namespace fs = std::filesystem;

const fs::path kRoot = CATGUT_SOURCE_DIR;

std::string read_file(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

std::vector<fs::path> pages() {
  std::vector<fs::path> out{kRoot / "README.md", kRoot / "CHANGES.md"};
  for (const auto& entry : fs::recursive_directory_iterator(kRoot / "docs"))
    if (entry.path().extension() == ".md") out.push_back(entry.path());
  return out;
}

// The sample without its license line.
std::string program() {
  const std::string text = read_file(kRoot / "samples/embed/main.cpp");
  return text.rfind("// SPDX", 0) == 0 ? text.substr(text.find('\n') + 1) : text;
}

TEST(Docs, the_readme_program_is_the_sample) {
  const std::string readme = read_file(kRoot / "README.md"), fence = "```cpp\n";
  const size_t from = readme.find(fence);
  ASSERT_NE(from, std::string::npos);
  const size_t start = from + fence.size(), end = readme.find("```", start);
  EXPECT_EQ(readme.substr(start, end - start), program());
}

// .ci/run reads the command of the tests from here, so that it is the one that a reader copies.
TEST(Docs, the_readme_has_the_two_commands_on_lines_of_their_own) {
  const std::string readme = read_file(kRoot / "README.md");
  for (const char* command : {"\n./catgut demo", "\n./catgut test"})
    EXPECT_NE(readme.find(command), std::string::npos) << command;
}

TEST(Docs, the_manual_of_the_library_holds_the_sample) {
  std::istringstream lines(program());
  std::string comment;
  for (std::string line; std::getline(lines, line);) comment += line.empty() ? "//\n" : "//   " + line + "\n";
  EXPECT_NE(read_file(kRoot / "include/catgut/catgut.h").find(comment), std::string::npos);
}

TEST(Docs, links_lead_somewhere) {
  static const std::regex kLink(R"re(\]\(([^)#\s]+)[^)]*\))re");
  for (const fs::path& page : pages()) {
    const std::string text = read_file(page);
    for (std::sregex_iterator m(text.begin(), text.end(), kLink), none; m != none; ++m) {
      const std::string target = (*m)[1];
      if (target.find("://") != std::string::npos) continue;
      EXPECT_TRUE(fs::exists(page.parent_path() / target)) << fs::relative(page, kRoot).string() << ": " << target;
    }
  }
}

TEST(Docs, files_that_are_named_exist) {
  static const std::regex kPath(R"re(`((?:src|tests|samples|tools|scenes|docs|app)/[A-Za-z0-9_./]+)`)re");
  for (const fs::path& page : pages()) {
    const std::string text = read_file(page);
    for (std::sregex_iterator m(text.begin(), text.end(), kPath), none; m != none; ++m) {
      const std::string path = (*m)[1];
      if (path.find("NAME") != std::string::npos) continue;  // to be filled in by the reader
      const bool there = fs::exists(kRoot / path) || fs::exists(kRoot / (path + ".h")) || fs::exists(kRoot / (path + ".cpp"));
      EXPECT_TRUE(there) << fs::relative(page, kRoot).string() << ": " << path;
    }
  }
}

TEST(Docs, every_room_has_a_page) {
  for (const auto& room : fs::directory_iterator(kRoot / "src"))
    if (room.is_directory()) {
      EXPECT_TRUE(fs::exists(kRoot / "docs/rooms" / (room.path().filename().string() + ".md"))) << room.path().filename();
    }
}

// Statements of step() in their order, and the rows of the page's stage tables.
TEST(Docs, one_tick_lists_every_stage) {
  const std::string code = read_file(kRoot / "src/sim/step.cpp"), page = read_file(kRoot / "docs/one_tick.md");
  const std::string step = code.substr(code.find("\nvoid step("));
  static const std::regex kCall(R"re(\n +([a-z_]+)\()re"), kRow(R"re(\n\| `([a-z_]+)` \|)re");
  const auto names = [](const std::string& text, const std::regex& pattern) {
    std::vector<std::string> out;
    for (std::sregex_iterator m(text.begin(), text.end(), pattern), none; m != none; ++m) out.push_back((*m)[1]);
    return out;
  };
  EXPECT_EQ(names(step, kCall), names(page, kRow)) << "src/sim/step.cpp and docs/one_tick.md";
}

// The first column of each page's table of files: every name is a file, and every file of a room of src is named.
TEST(Docs, room_pages_list_their_files) {
  static const std::regex kName(R"re(`([^`]+)`)re");
  for (const auto& page : fs::directory_iterator(kRoot / "docs/rooms")) {
    const std::string room = page.path().stem();
    const fs::path folder = kRoot / "src" / room;
    if (!fs::is_directory(folder)) continue;
    std::set<std::string> named;
    std::istringstream lines(read_file(page.path()));
    bool in_table = false;
    for (std::string line; std::getline(lines, line);) {
      if (line.rfind("| file", 0) == 0) in_table = true;
      if (line.empty() || line[0] != '|') in_table = false;
      if (!in_table) continue;
      const std::string cell = line.substr(2, line.find_first_of("|(", 2) - 2);
      for (std::sregex_iterator m(cell.begin(), cell.end(), kName), none; m != none; ++m) {
        const std::string name = (*m)[1];
        named.insert(fs::path(name).stem());
        const bool there = fs::exists(kRoot / name) || fs::exists(folder / name) || fs::exists(folder / (name + ".h")) ||
                           fs::exists(folder / (name + ".cpp"));
        EXPECT_TRUE(there) << "docs/rooms/" << room << ".md: " << name;
      }
    }
    for (const auto& file : fs::directory_iterator(folder)) {
      const std::string stem = file.path().stem(), extension = file.path().extension();
      if ((extension != ".h" && extension != ".cpp") || stem == "reflect") continue;
      EXPECT_TRUE(named.count(stem)) << "docs/rooms/" << room << ".md does not list " << file.path().filename();
    }
  }
}

}  // namespace
