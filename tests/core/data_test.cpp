// SPDX-License-Identifier: Apache-2.0
// core/data: the search order. The test program itself is in a build folder.
#include "core/data.h"

#include <gtest/gtest.h>

#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

namespace catgut {
namespace {
namespace fs = std::filesystem;

TEST(Data, the_environment_wins_and_programs_find_what_lies_beside_them) {
  const fs::path folder = fs::temp_directory_path() / ("catgut_data_" + std::to_string(::getpid()));
  fs::create_directories(folder / "given/scenes");
  fs::create_directories(folder / "user/catgut/words");
  EXPECT_TRUE(fs::exists(data_path("scenes") + "/stay.toml")) << "share/catgut of the build folder";
  ::setenv("CATGUT_DATA_DIR", (folder / "given").c_str(), 1);
  EXPECT_EQ(data_path("scenes"), (folder / "given/scenes").string());
  ::setenv("XDG_DATA_HOME", (folder / "user").c_str(), 1);
  EXPECT_EQ(data_path("words"), (folder / "user/catgut/words").string());
  EXPECT_EQ(data_path("nothing_of_this_name"), "");
  ::unsetenv("CATGUT_DATA_DIR");
  EXPECT_TRUE(fs::exists(data_path("scenes") + "/stay.toml"));
  ::unsetenv("XDG_DATA_HOME");
  fs::remove_all(folder);
}

}  // namespace
}  // namespace catgut
