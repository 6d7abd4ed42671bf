// SPDX-License-Identifier: Apache-2.0
// tests/docs: statements of the pages about the repository are true: the README's program is the tested sample, links
// resolve, and named files exist.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <regex>
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

}  // namespace
