// SPDX-License-Identifier: Apache-2.0
// tests/app: the launcher's first words come at once, and long work reports its progress. Its helpers (dpkg-query, apt-get, id)
// are replaced by scripts: nothing is installed.
#include <gtest/gtest.h>

#include "command_line.h"

namespace {
using namespace catgut_test;

TEST(Launcher, reports_at_once_what_it_does_and_its_progress) {
  const fs::path folder = fs::path(testing::TempDir()) / ("catgut_launcher_" + std::to_string(getpid()));
  fs::create_directories(folder / "bin");
  fs::copy_file(fs::path(CATGUT_SOURCE_DIR) / "catgut", folder / "catgut");
  const auto script = [&](const std::string& name, const std::string& body) {
    std::ofstream(folder / "bin" / name) << "#!/bin/sh\n" << body << "\n";
    fs::permissions(folder / "bin" / name, fs::perms::owner_all);
  };
  script("dpkg-query", "echo");  // nothing is installed
  script("id", "echo 0");
  script("apt-get", "echo unpacking something; sleep 1.3; exit 1");
  const auto run = [&](const std::string& command) {
    return std::system(("cd '" + folder.string() + "' && PATH='" + (folder / "bin").string() + ":'$PATH CATGUT_NEWS_EVERY=1 " +
                        command + " >out 2>err </dev/null")
                           .c_str());
  };
  EXPECT_NE(run("timeout 0.8 ./catgut demo"), 0);
  EXPECT_NE(read_file(folder / "err").find("catgut: installing g++ cmake"), std::string::npos) << "within the first second";
  EXPECT_NE(run("./catgut demo"), 0);
  const std::string said = read_file(folder / "err");
  EXPECT_NE(said.find("catgut: installing, 1 s: unpacking something"), std::string::npos) << said;
  EXPECT_NE(said.find("packages could not be installed; try: "), std::string::npos) << said;
  fs::remove_all(folder);
}

}  // namespace
