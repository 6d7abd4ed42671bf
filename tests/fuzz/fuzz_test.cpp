// SPDX-License-Identifier: Apache-2.0
// tests/fuzz: the fuzzing in every build: each file of the corpus unchanged, and two thousand seeded mutations of them.
// The seeds are constant: a failure is reproducible. For longer runs see docs/fuzzing.md.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "core/random.h"
#include "entry_points.h"

namespace catgut::fuzz {
namespace {
namespace fs = std::filesystem;

std::vector<std::string> corpus(const std::string& entry) {
  std::vector<fs::path> path;
  for (const auto& file : fs::directory_iterator(fs::path(CATGUT_SOURCE_DIR) / "tests/fuzz/corpus" / entry))
    path.push_back(file.path());
  std::sort(path.begin(), path.end());
  std::vector<std::string> out;
  for (const fs::path& p : path) {
    std::ifstream in(p, std::ios::binary);
    std::ostringstream bytes;
    bytes << in.rdbuf();
    out.push_back(bytes.str());
  }
  return out;
}

// Mutations that often break readers: boundary numbers, cut files, repeated and swapped pieces, flipped bits, another file's
// middle.
void mutate(std::string& s, const std::vector<std::string>& all, Random& random) {
  static const char* const kWord[] = {"-1",
                                      "0",
                                      "1e309",
                                      "-0",
                                      "nan",
                                      "inf",
                                      "999999999999999999999",
                                      "\"",
                                      "[",
                                      "]",
                                      "{",
                                      "\n",
                                      "=",
                                      "#",
                                      "[[",
                                      "1e-320",
                                      "f 1 2 99999999\n",
                                      "v 1e38 nan 0\n",
                                      ".",
                                      "body",
                                      "\\u0000",
                                      "\xff",
                                      "'''",
                                      "0x7fffffffffffffff"};
  const auto below = [&](size_t n) { return n == 0 ? size_t{0} : random.next() % n; };
  for (size_t rounds = 1 + below(4); rounds-- > 0;) {
    const size_t at = below(s.size() + 1), length = below(std::min<size_t>(64, s.size() - at) + 1);
    switch (below(8)) {
      case 0:
        if (at < s.size()) s[at] = static_cast<char>(s[at] ^ (1 << below(8)));
        break;
      case 1:
        if (at < s.size()) s[at] = static_cast<char>(random.next());
        break;
      case 2:
        s.erase(at, length);
        break;
      case 3:
        s.insert(at, s.substr(below(s.size()), length));
        break;
      case 4:
        s.insert(at, kWord[below(std::size(kWord))]);
        break;
      case 5:
        s.replace(at, length, kWord[below(std::size(kWord))]);
        break;
      case 6:
        if (below(4) == 0) s.resize(at);
        break;
      default: {
        const std::string& other = all[below(all.size())];
        s.replace(at, length, other.substr(below(other.size()), below(200)));
      }
    }
  }
  if (s.size() > 1 << 16) s.resize(1 << 16);
}

void fuzz(const std::string& name, size_t mutations) {
  const auto entry = std::find_if(entries().begin(), entries().end(), [&](const Entry& e) { return name == e.name; });
  ASSERT_NE(entry, entries().end());
  const std::vector<std::string> seeds = corpus(name);
  ASSERT_FALSE(seeds.empty());
  const auto run = [&](const std::string& bytes) {
    return entry->run(reinterpret_cast<const uint8_t*>(bytes.data()), bytes.size());
  };
  size_t good = 0;
  for (const std::string& s : seeds) good += run(s);
  EXPECT_GT(good, 0u) << "a corpus in which nothing is accepted tests only the door";
  Random random(1);
  for (size_t i = 0; i < mutations; ++i) {
    std::string bytes = seeds[i % seeds.size()];
    mutate(bytes, seeds, random);
    run(bytes);
  }
}

TEST(Fuzz, scene) { fuzz("scene", 600); }
TEST(Fuzz, setting) { fuzz("setting", 600); }
TEST(Fuzz, recording) { fuzz("recording", 400); }
TEST(Fuzz, state) { fuzz("state", 200); }
TEST(Fuzz, mesh) { fuzz("mesh", 200); }

}  // namespace
}  // namespace catgut::fuzz
