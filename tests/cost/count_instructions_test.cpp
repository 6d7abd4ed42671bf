// SPDX-License-Identifier: Apache-2.0
// tests/cost: tools/count_instructions.sh fails when it should. Counting itself takes valgrind and half a
// minute, and is a separate step of CI.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>

namespace {
namespace fs = std::filesystem;

struct Outcome {
  int code = -1;
  std::string out;
};

class CountInstructions : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(testing::TempDir()) / ("catgut_cost_" + std::to_string(getpid()));
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  Outcome compare(const std::string& now, const std::string& record) {
    const fs::path a = folder_ / "now", b = folder_ / "record";
    std::ofstream(a) << now;
    std::ofstream(b) << record;
    const std::string command =
        std::string(CATGUT_SOURCE_DIR) + "/tools/count_instructions.sh --compare " + a.string() + " " + b.string() + " 2>&1";
    Outcome o;
    std::FILE* pipe = popen(command.c_str(), "r");
    if (!pipe) return o;
    std::array<char, 4096> text;
    while (const size_t n = std::fread(text.data(), 1, text.size(), pipe)) o.out.append(text.data(), n);
    const int status = pclose(pipe);
    o.code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
    return o;
  }

  fs::path folder_;
};

const std::string kRecord = "# a comment\nstay bite 1000000\nlembert knot 2000000\n";

TEST_F(CountInstructions, nine_per_cent_either_way_is_no_news) {
  const Outcome o = compare("stay bite 1090000\nlembert knot 1820000\n", kRecord);
  EXPECT_EQ(o.code, 0) << o.out;
  EXPECT_EQ(o.out.find("ALARM"), std::string::npos) << o.out;
  EXPECT_EQ(o.out.find("Note"), std::string::npos) << o.out;
}

TEST_F(CountInstructions, more_than_a_tenth_dearer_is_an_alarm_that_says_what_to_do) {
  const Outcome o = compare("stay bite 1110000\nlembert knot 2000000\n", kRecord);
  EXPECT_EQ(o.code, 1) << o.out;
  for (const char* said : {"ALARM", "stay", "1000000", "1110000", "+11.00%", "--update"})
    EXPECT_NE(o.out.find(said), std::string::npos) << said << " is not in\n" << o.out;
}

TEST_F(CountInstructions, more_than_a_tenth_cheaper_is_told) {
  const Outcome o = compare("stay bite 880000\nlembert knot 2000000\n", kRecord);
  EXPECT_EQ(o.code, 0) << o.out;
  EXPECT_NE(o.out.find("Note"), std::string::npos) << o.out;
  EXPECT_NE(o.out.find("--update"), std::string::npos) << o.out;
}

TEST_F(CountInstructions, what_is_missing_or_damaged_is_a_fault) {
  EXPECT_EQ(compare("stay bite 1000000\n", kRecord).code, 1);                                                // not counted
  EXPECT_EQ(compare("stay bite 1000000\nlembert knot 2000000\nstay knot 5\n", kRecord).code, 1);             // not on record
  EXPECT_EQ(compare("", kRecord).code, 1);                                                                   // nothing at all
  EXPECT_EQ(compare("stay bite\nlembert knot 2000000\n", kRecord).code, 1);                                  // no count
  EXPECT_EQ(compare("stay bite 1000000\nlembert knot 2000000\n", "stay bite 0\nlembert knot 1\n").code, 1);  // no record
}

// The record for the comparison in CI exists and has every scene.
TEST_F(CountInstructions, the_record_has_every_technique) {
  std::ifstream in(std::string(CATGUT_SOURCE_DIR) + "/bench/instructions.txt");
  const std::string record((std::istreambuf_iterator<char>(in)), {});
  for (const char* scene : {"purse_string", "connell", "stay", "lembert"})
    EXPECT_NE(record.find(std::string("\n") + scene + " bite "), std::string::npos) << scene;
  std::string now;
  for (size_t at = 0, end; at < record.size(); at = end + 1) {
    end = std::min(record.find('\n', at), record.size());
    if (record[at] != '#') now += record.substr(at, end - at) + "\n";
  }
  EXPECT_EQ(compare(now, record).code, 0);
}

}  // namespace
