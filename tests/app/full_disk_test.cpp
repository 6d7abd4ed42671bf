// SPDX-License-Identifier: Apache-2.0
// tests/app: on a full disk every writer says so in one line with exit code 2, and leaves no empty results or pictures. The
// limit of the file size (ulimit -f 0) makes each write fail like a full disk does.
#include <gtest/gtest.h>

#include "command_line.h"

namespace {
using namespace catgut_test;

class FullDisk : public CommandLine {
 protected:
  // Standard output and error go through a pipe: files cannot grow.
  Outcome run_full(const std::string& arguments) {
    const std::string line = "cd '" + folder_.string() + "' && (ulimit -f 0; trap '' XFSZ; env -u DISPLAY '" CATGUT_APP "' " +
                             arguments + " </dev/null 2>&1 >/dev/null; echo \"code $?\")";
    Outcome o;
    FILE* pipe = popen(("bash -c \"" + escaped(line) + "\"").c_str(), "r");
    char part[512];
    while (pipe && fgets(part, sizeof part, pipe)) o.err += part;
    if (pipe) pclose(pipe);
    const size_t at = o.err.rfind("code ");
    if (at != std::string::npos) o.code = std::atoi(o.err.c_str() + at + 5), o.err.erase(at);
    return o;
  }
  static std::string escaped(const std::string& text) {
    std::string out;
    for (const char c : text)
      out += (c == '"' || c == '$' || c == '\\' || c == '`') ? std::string("\\") + c : std::string(1, c);
    return out;
  }
  void expect_reported(const std::string& arguments, const std::string& file) {
    const Outcome o = run_full(arguments);
    EXPECT_EQ(o.code, 2) << arguments << "\n" << o.err;
    EXPECT_NE(o.err.find(file), std::string::npos) << arguments << ": the file is named\n" << o.err;
    EXPECT_NE(o.err.find("catgut: "), std::string::npos) << o.err;
    // A recording keeps what it holds, and ffmpeg its file.
    if (fs::is_regular_file(folder_ / file) && !file.ends_with(".cgrec") && !file.ends_with(".mp4")) {
      EXPECT_GT(fs::file_size(folder_ / file), 0u) << file << " was left empty";
    }
  }
};

TEST_F(FullDisk, every_writer_reports_it) {
  ASSERT_TRUE(record("r.cgrec"));
  expect_reported("run small.toml --surgeon none --json a.json", "a.json");
  expect_reported("run small.toml --surgeon none --csv a.csv", "a.csv");
  expect_reported("run small.toml --surgeon none --record a.cgrec", "a.cgrec");
  expect_reported("replay r.cgrec --json b.json", "b.json");
  expect_reported("replay r.cgrec --csv b.csv", "b.csv");
  expect_reported("validate --only capstan --json v.json", "v.json");
  expect_reported("bench stages --scene small.toml --seconds 0.2 --json s.json", "s.json");
  expect_reported("assess r.cgrec --rubric stay --json c.json", "c.json");
}

TEST_F(FullDisk, every_picture_reports_it) {
  if (run_catgut("run small.toml --surgeon none --still 0.1:ok.png").code != 0) GTEST_SKIP() << "no pictures here";
  expect_reported("run small.toml --surgeon none --still 0.1:a.png", "a.png");
  expect_reported("run small.toml --surgeon none --contact-sheet b.png", "b.png");
  expect_reported("run small.toml --surgeon none --frames pictures", "pictures");
  expect_reported("run small.toml --surgeon none --video c.mp4", "c.mp4");
}

}  // namespace
