// SPDX-License-Identifier: Apache-2.0
// tests/layers: the dependencies of rooms. Reads build/rooms.txt (written by catgut_room in CMake) and every source file; an
// #include upward or sideways fails here with its file and line.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

namespace {
namespace fs = std::filesystem;

using Rooms = std::map<std::string, std::set<std::string>>;  // room -> rooms it may include from, itself included

Rooms read_rooms() {
  Rooms rooms;
  std::ifstream in(std::string(CATGUT_BINARY_DIR) + "/rooms.txt");
  for (std::string line; std::getline(in, line);) {
    std::istringstream words(line);
    std::string room, below;
    std::getline(words, room, ':');
    rooms[room].insert(room);
    while (words >> below) rooms[room].insert(below);
  }
  return rooms;
}

bool is_source(const fs::path& path) { return path.extension() == ".h" || path.extension() == ".cpp"; }

std::vector<fs::path> sources_under(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.is_regular_file() && is_source(entry.path())) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

const fs::path kSource = fs::path(CATGUT_SOURCE_DIR) / "src";

// "" for a valid line, else the error.
std::string fault_of(const Rooms& rooms, const std::string& room, const std::string& line) {
  static const std::regex kInclude(R"re(^\s*#\s*include\s*"([^"]+)")re");
  std::smatch match;
  if (!std::regex_search(line, match, kInclude)) return "";
  const std::string path = match[1];
  const std::string target = path.substr(0, path.find('/'));
  if (path.find('/') == std::string::npos) {
    // A generated source file (a compiled material) has no room; a header has.
    return path.size() > 2 && path.substr(path.size() - 2) == ".h" ? "name the room: \"" + room + "/" + path + "\"" : "";
  }
  if (path.find("..") != std::string::npos) return "\"" + path + "\" climbs out of its room";
  if (!rooms.count(target)) return "there is no room \"" + target + "\"";
  if (!rooms.at(room).count(target)) return room + " may not see " + target;
  return "";
}

TEST(Layers, includes_follow_the_arrows) {
  const Rooms rooms = read_rooms();
  ASSERT_GT(rooms.size(), 5u) << "build/rooms.txt is missing or empty";
  for (const fs::path& file : sources_under(kSource)) {
    const fs::path relative = fs::relative(file, kSource);
    const std::string room = relative.begin()->string();
    ASSERT_TRUE(rooms.count(room)) << "src/" << relative.string() << ": the folder is no room of CMakeLists.txt";
    std::ifstream in(file);
    int number = 0;
    for (std::string line; std::getline(in, line);) {
      ++number;
      const std::string fault = fault_of(rooms, room, line);
      EXPECT_TRUE(fault.empty()) << "src/" << relative.string() << ":" << number << ": " << fault;
    }
  }
}

TEST(Layers, every_file_opens_with_its_room) {
  for (const fs::path& file : sources_under(kSource)) {
    const fs::path relative = fs::relative(file, kSource);
    const std::string room = relative.begin()->string();
    std::ifstream in(file);
    std::string first;
    std::getline(in, first);
    if (first.rfind("// SPDX-License-Identifier:", 0) == 0) std::getline(in, first);
    EXPECT_TRUE(first.rfind("// " + room, 0) == 0)
        << "src/" << relative.string() << ":1: opens with \"" << first << "\", not with \"// " << room << ": what it does\"";
  }
}

// All code that determines the bits of a run calls functions with the same bits everywhere.
TEST(Layers, no_function_of_the_c_library_that_differs_between_machines) {
  static const std::regex kDiffers(
      R"re(std::(a?sinh?|a?cosh?|a?tanh?|atan2|exp2?|expm1|log2?|log10|log1p|pow|cbrt|hypot|fma|tgamma|lgamma|erfc?)\()re");
  const Rooms rooms = read_rooms();
  for (const std::string& room : rooms.at("procedure"))
    for (const fs::path& file : sources_under(kSource / room)) {
      std::ifstream in(file);
      int number = 0;
      for (std::string line; std::getline(in, line);) {
        ++number;
        EXPECT_FALSE(std::regex_search(line, kDiffers)) << "src/" << fs::relative(file, kSource).string() << ":" << number
                                                        << ": call portable:: of core/elementary.h instead\n"
                                                        << line;
      }
    }
}

TEST(Layers, no_file_is_too_long_to_read) {
  for (const fs::path& file : sources_under(kSource)) {
    std::ifstream in(file);
    const auto lines = std::count(std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>(), '\n');
    EXPECT_LE(lines, 600) << "src/" << fs::relative(file, kSource).string() << ": split it";
  }
}

TEST(Layers, the_test_itself_sees_a_wrong_arrow) {
  const Rooms rooms{{"core", {"core"}}, {"solver", {"solver", "core"}}, {"sim", {"sim", "solver", "core"}}};
  EXPECT_EQ(fault_of(rooms, "solver", "#include \"sim/model.h\""), "solver may not see sim");
  EXPECT_EQ(fault_of(rooms, "sim", "#include \"solver/x.h\""), "");
  EXPECT_EQ(fault_of(rooms, "sim", "  #  include \"nowhere/x.h\""), "there is no room \"nowhere\"");
  EXPECT_NE(fault_of(rooms, "sim", "#include \"model.h\""), "");
  EXPECT_EQ(fault_of(rooms, "sim", "#include <vector>"), "");
}

}  // namespace
