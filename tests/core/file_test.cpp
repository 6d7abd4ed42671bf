// SPDX-License-Identifier: Apache-2.0
// tests/core: whole files or none.
#include "core/file.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>

#include "core/check.h"

namespace catgut {
namespace {
namespace fs = std::filesystem;

std::string content(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

class File : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(testing::TempDir()) / ("catgut_file_" + std::to_string(getpid()));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  size_t files() const { return static_cast<size_t>(std::distance(fs::directory_iterator(folder_), {})); }
  fs::path folder_;
};

TEST_F(File, is_replaced_whole) {
  const fs::path path = folder_ / "a.json";
  write_file(path.string(), "old");
  write_file(path.string(), std::string(100000, 'n'));
  EXPECT_EQ(content(path), std::string(100000, 'n'));
  write_file(path.string(), "");
  EXPECT_EQ(content(path), "");
  EXPECT_EQ(files(), 1u);
}

TEST_F(File, follows_a_link) {
  const fs::path path = folder_ / "a.json", link = folder_ / "link.json";
  write_file(path.string(), "old");
  fs::create_symlink(path, link);
  write_file(link.string(), "new");
  EXPECT_TRUE(fs::is_symlink(link));
  EXPECT_EQ(content(path), "new");
}

// The disk is full after 4096 bytes: the old file survives, no other file remains. In a child process, since the limit
// cannot be undone.
TEST_F(File, survives_a_full_disk) {
  const fs::path path = folder_ / "a.json";
  write_file(path.string(), "old");
  const pid_t child = fork();
  if (child == 0) {
    signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{4096, 4096};
    setrlimit(RLIMIT_FSIZE, &limit);
    try {
      write_file(path.string(), std::string(100000, 'n'));
    } catch (const InputError&) { _exit(7); }
    _exit(0);
  }
  int status = 0;
  waitpid(child, &status, 0);
  EXPECT_EQ(WEXITSTATUS(status), 7) << "the fault was reported";
  EXPECT_EQ(content(path), "old");
  EXPECT_EQ(files(), 1u);
}

TEST_F(File, reports_what_the_path_refuses) {
  EXPECT_THROW(write_file((folder_ / "missing" / "a.json").string(), "x"), InputError);
  EXPECT_THROW(write_file(folder_.string(), "x"), InputError);
  if (fs::exists("/dev/full")) {
    EXPECT_THROW(write_file("/dev/full", "x"), InputError);
    EXPECT_TRUE(fs::is_character_file("/dev/full"));
  }
  write_file("/dev/null", "x");
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
}

TEST_F(File, suffix_says_what_it_holds) {
  check_suffix("", ".png", "--still");
  check_suffix("-", ".json", "--json");
  check_suffix("a/b.PNG", ".png", "--still");
  for (const char* wrong : {"a.jpg", "png", ".png", "a.png.gz"})
    EXPECT_THROW(check_suffix(wrong, ".png", "--still"), InputError) << wrong;
}

}  // namespace
}  // namespace catgut
