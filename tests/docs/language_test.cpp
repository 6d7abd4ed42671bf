// SPDX-License-Identifier: Apache-2.0
// tests/docs: the language of pages, screens, messages and names is that of docs/glossary.md. The first tests show that the
// checker finds what it should.
#include "language.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

namespace catgut::language {
namespace {
namespace fs = std::filesystem;

const fs::path kRoot = CATGUT_SOURCE_DIR;
constexpr size_t kMostWords = 25;

std::string read_file(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

const std::vector<std::string>& refused() {
  static const std::vector<std::string> kWords = refused_words(read_file(kRoot / "docs/glossary.md"));
  return kWords;
}

std::vector<fs::path> files(const std::vector<std::string>& folders, const std::vector<std::string>& extensions) {
  std::vector<fs::path> out;
  for (const std::string& folder : folders)
    for (const auto& entry : fs::recursive_directory_iterator(kRoot / folder))
      if (std::find(extensions.begin(), extensions.end(), entry.path().extension()) != extensions.end())
        out.push_back(entry.path());
  std::sort(out.begin(), out.end());
  return out;
}

// The glossary names the words that it refuses.
std::vector<fs::path> pages() {
  std::vector<fs::path> out = files({"docs"}, {".md"});
  std::erase(out, kRoot / "docs/glossary.md");
  out.push_back(kRoot / "README.md");
  return out;
}

std::string where(const fs::path& path, size_t line) { return fs::relative(path, kRoot).string() + ":" + std::to_string(line); }

TEST(LanguageChecker, reads_its_words_from_the_glossary) {
  const std::vector<std::string> words = refused_words(
      "## Terms\n| a | b |\n## Words not used\n\n| not | but |\n|---|---|\n| told | stated |\n| dear, dearest | expensive "
      "|\n## More\n| x | y |\n");
  EXPECT_EQ(words, (std::vector<std::string>{"told", "dear", "dearest"}));
  EXPECT_GT(refused().size(), 20u);
}

TEST(LanguageChecker, finds_whole_words_in_any_case) {
  const std::vector<std::string> list{"told", "so much"};
  EXPECT_EQ(words_in("As Told here", list).size(), 1u);
  EXPECT_EQ(words_in("wait so much longer", list).size(), 1u);
  EXPECT_EQ(words_in("event_told_once", list).size(), 1u) << "names of events";
  EXPECT_EQ(words_in("untold, toldx", list).size(), 0u);
  EXPECT_EQ(words_in("it is no driver", list).size(), 1u);
  EXPECT_EQ(words_in("there is no driver; it is no longer so", list).size(), 0u);
}

TEST(LanguageChecker, looks_at_prose_only) {
  const std::vector<std::string> list{"told"};
  EXPECT_EQ(refused_in_page("Fine `told` [fine](told.md)\n\n```\ntold\n```\n", list).size(), 0u);
  const std::vector<Finding> found = refused_in_page("Fine.\n\n| cell | told |\n", list);
  ASSERT_EQ(found.size(), 1u) << "tables too";
  EXPECT_EQ(found[0].line, 3u);
}

TEST(LanguageChecker, finds_long_sentences) {
  std::string sentence = "Start";
  for (int i = 0; i < 24; ++i) sentence += " word";
  EXPECT_EQ(long_sentences(sentence + ".\n", 25).size(), 0u);
  EXPECT_EQ(long_sentences(sentence + " more.\n", 25).size(), 1u);
  EXPECT_EQ(long_sentences(sentence + "\nmore.\n", 25).size(), 1u) << "over a line break";
  EXPECT_EQ(long_sentences(sentence + ". " + sentence + ".\n", 25).size(), 0u) << "two sentences";
  EXPECT_EQ(long_sentences("- " + sentence + "\n- " + sentence + "\n", 25).size(), 0u) << "two items";
  EXPECT_EQ(long_sentences("# " + sentence + " more\n| " + sentence + " more |\n", 25).size(), 0u) << "no sentences";
}

TEST(LanguageChecker, finds_strings_and_comments_of_source) {
  const std::string source = "#include \"told.h\"\nf(\"as \\\"told\\\" here\");  // says \"told\"\nchar c = '\"';\n";
  const std::vector<Finding> strings = strings_of(source);
  ASSERT_EQ(strings.size(), 1u);
  EXPECT_EQ(strings[0].line, 2u);
  EXPECT_NE(strings[0].what.find("told"), std::string::npos);
  ASSERT_EQ(comments_of(source).size(), 1u);
  EXPECT_EQ(comments_of("f(\"http://x\");\n").size(), 0u);
}

TEST(Language, pages_use_no_refused_word) {
  for (const fs::path& page : pages())
    for (const Finding& f : refused_in_page(read_file(page), refused())) ADD_FAILURE() << where(page, f.line) << ": " << f.what;
}

TEST(Language, sentences_of_pages_are_short) {
  for (const fs::path& page : pages())
    for (const Finding& f : long_sentences(read_file(page), kMostWords)) ADD_FAILURE() << where(page, f.line) << ": " << f.what;
}

// Screens, help, messages, descriptions of keys, names of events and results.
TEST(Language, texts_of_the_program_use_no_refused_word) {
  for (const fs::path& file : files({"app", "src"}, {".cpp", ".h"}))
    for (const Finding& text : strings_of(read_file(file)))
      for (const std::string& word : words_in(text.what, refused()))
        ADD_FAILURE() << where(file, text.line) << ": \"" << word << "\": " << text.what;
}

// Quoted code, names with underscores and the product name "Dear ImGui" are exempt, and so are the examples of these tests.
TEST(Language, comments_use_no_refused_word) {
  static const std::regex kExempt(R"(`[^`]*`|\b\w*_\w*\b|\bDear ImGui\b)");
  for (const fs::path& file : files({"app", "bench", "include", "samples", "src", "tests"}, {".cpp", ".h"})) {
    if (file.parent_path() == kRoot / "tests/docs") continue;
    for (const Finding& comment : comments_of(read_file(file)))
      for (const std::string& word : words_in(std::regex_replace(comment.what, kExempt, "Code"), refused()))
        ADD_FAILURE() << where(file, comment.line) << ": \"" << word << "\": " << comment.what;
  }
}

// Comments of scripts and build files begin with '#'.
TEST(Language, comments_of_scripts_use_no_refused_word) {
  static const std::regex kComment(R"((^|\s)#\s+(.*)$)"), kExempt(R"(`[^`]*`|\b\w*_\w*\b|\bDear ImGui\b)");
  std::vector<fs::path> scripts = files({"cmake", "samples", "src", "tools"}, {".cmake", ".py", ".sh"});
  for (const char* name : {"catgut", "CMakeLists.txt", "app/CMakeLists.txt", "bench/CMakeLists.txt", "tests/CMakeLists.txt"})
    scripts.push_back(kRoot / name);
  for (const fs::path& file : scripts) {
    const std::vector<std::string> lines = lines_of(read_file(file));
    for (size_t i = 0; i < lines.size(); ++i) {
      std::smatch found;
      if (!std::regex_search(lines[i], found, kComment)) continue;
      for (const std::string& word : words_in(std::regex_replace(found[2].str(), kExempt, "Code"), refused()))
        ADD_FAILURE() << where(file, i + 1) << ": \"" << word << "\"";
    }
  }
}

TEST(Language, scenes_use_no_refused_word) {
  for (const fs::path& file : files({"scenes"}, {".toml"})) {
    const std::vector<std::string> lines = lines_of(read_file(file));
    for (size_t i = 0; i < lines.size(); ++i)
      for (const std::string& word : words_in(lines[i], refused()))
        ADD_FAILURE() << where(file, i + 1) << ": \"" << word << "\"";
  }
}

}  // namespace
}  // namespace catgut::language
