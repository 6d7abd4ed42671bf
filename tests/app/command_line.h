// SPDX-License-Identifier: Apache-2.0
// tests/app: runs the built program as a user would, in a folder of its own.
#pragma once
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

namespace catgut_test {
namespace fs = std::filesystem;

struct Outcome {
  int code = -1;
  std::string out, err;
};

inline std::string read_file(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

class CommandLine : public testing::Test {
 protected:
  void SetUp() override {
    if (!fs::exists(CATGUT_APP)) GTEST_SKIP() << "the program is not built here";
    folder_ = fs::path(testing::TempDir()) / ("catgut_app_" + std::to_string(getpid()));
    fs::create_directories(folder_);
    // Half a second without a surgeon: the subject is the command line.
    std::ofstream(folder_ / "small.toml") << R"(title = "small"
duration = 0.5
settle = 0.05
[[body]]
[technique]
name = "none"
[expect]
state_valid = 1
particles = 1403
)";
  }
  void TearDown() override {
    if (!folder_.empty()) fs::remove_all(folder_);
  }
  Outcome run_catgut(const std::string& arguments) {
    const fs::path out = folder_ / "stdout", err = folder_ / "stderr";
    const std::string line = "cd '" + folder_.string() + "' && env -u DISPLAY -u WAYLAND_DISPLAY '" CATGUT_APP "' " +
                             arguments + " >'" + out.string() + "' 2>'" + err.string() + "' </dev/null";
    const int status = std::system(line.c_str());
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, read_file(out), read_file(err)};
  }
  // Bad input: code 2, and one line on standard error that contains `part`.
  void expect_refused(const std::string& arguments, const std::string& part) {
    const Outcome o = run_catgut(arguments);
    EXPECT_EQ(o.code, 2) << arguments << "\n" << o.err;
    EXPECT_EQ(std::count(o.err.begin(), o.err.end(), '\n'), 1) << arguments << "\n" << o.err;
    EXPECT_EQ(o.err.rfind("catgut: ", 0), 0u) << o.err;
    EXPECT_NE(o.err.find(part), std::string::npos) << arguments << "\n" << o.err;
  }
  bool record(const std::string& name) {
    return run_catgut("run small.toml --surgeon none --headless --record " + name + " --json -").code == 0;
  }
  fs::path folder_;
};

}  // namespace catgut_test
