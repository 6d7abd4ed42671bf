// SPDX-License-Identifier: Apache-2.0
// tests/docs: the language checker. Pure: text in, findings out, so that tests can verify its findings.
#pragma once
#include <algorithm>
#include <cctype>
#include <regex>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

namespace catgut::language {

struct Finding {
  size_t line = 0;  // from 1
  std::string what;
};

inline std::string lower(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

inline std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> out;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) out.push_back(line);
  return out;
}

// The first column of the table under "## Words not used" of docs/glossary.md; a cell may hold several words between commas.
inline std::vector<std::string> refused_words(const std::string& glossary) {
  std::vector<std::string> out;
  bool in_table = false;
  for (const std::string& line : lines_of(glossary)) {
    if (line.rfind("## ", 0) == 0) in_table = line == "## Words not used";
    if (!in_table || line.rfind("| ", 0) != 0 || line.rfind("| not |", 0) == 0) continue;
    std::istringstream cell(line.substr(2, line.find(" |", 2) - 2));
    for (std::string word; std::getline(cell, word, ',');) {
      word.erase(0, word.find_first_not_of(' '));
      if (!word.empty()) out.push_back(lower(word));
    }
  }
  return out;
}

inline bool word_char(char c) { return std::isalnum(static_cast<unsigned char>(c)) || c == '\'' || c == '-'; }

// Refused words in one text, as whole words in any case. An underscore separates words, as in names of events.
inline std::vector<std::string> words_in(const std::string& text, const std::vector<std::string>& refused) {
  std::string plain = lower(text);
  std::replace(plain.begin(), plain.end(), '_', ' ');
  std::vector<std::string> out;
  for (const std::string& word : refused)
    for (size_t at = plain.find(word); at != std::string::npos; at = plain.find(word, at + 1)) {
      const size_t end = at + word.size();
      if ((at > 0 && word_char(plain[at - 1])) || (end < plain.size() && word_char(plain[end]))) continue;
      out.push_back(word);
      break;
    }
  // The pattern "X is no Y" instead of "X is not a Y"; "there is no Y" is accepted.
  static const std::regex kIsNo(R"((^|[^a-z])(?!there )([a-z]+) (is|are|was|were) no ([a-z]+))");
  for (std::sregex_iterator m(plain.begin(), plain.end(), kIsNo), none; m != none; ++m)
    if ((*m)[2] != "there" && (*m)[4] != "longer") out.push_back("is no " + (*m)[4].str());
  return out;
}

// Markdown without code (fences, indented blocks, backticks) and without the targets of links; line breaks stay.
inline std::string prose_of(const std::string& markdown) {
  std::string out;
  bool fence = false;
  for (std::string line : lines_of(markdown)) {
    const size_t first = line.find_first_not_of(' ');
    if (first != std::string::npos && line.compare(first, 3, "```") == 0) {
      fence = !fence;
      line.clear();
    }
    const bool item = first != std::string::npos && (line[first] == '-' || line[first] == '*' || std::isdigit(line[first]));
    if (fence || (first != std::string::npos && first >= 4 && !item && (out.size() < 2 || out[out.size() - 2] == '\n')))
      line.clear();
    out += line + '\n';
  }
  out = std::regex_replace(out, std::regex(R"(`[^`\n]*`)"), "Code");
  out = std::regex_replace(out, std::regex(R"(!?\[([^\]]*)\]\([^)]*\))"), "$1");
  return std::regex_replace(out, std::regex(R"(<[^>\n]*>)"), "");
}

inline std::vector<Finding> refused_in_page(const std::string& markdown, const std::vector<std::string>& refused) {
  std::vector<Finding> out;
  const std::vector<std::string> lines = lines_of(prose_of(markdown));
  for (size_t i = 0; i < lines.size(); ++i)
    for (const std::string& word : words_in(lines[i], refused)) out.push_back({i + 1, "\"" + word + "\": " + lines[i]});
  return out;
}

inline size_t count_words(const std::string& sentence) {
  std::istringstream in(sentence);
  size_t n = 0;
  for (std::string word; in >> word;)
    n += std::any_of(word.begin(), word.end(), [](char c) { return std::isalnum(static_cast<unsigned char>(c)); });
  return n;
}

// Sentences of more than `most` words. Tables and headings do not count. A paragraph or list item ends at a blank line, a
// heading, a table or the next item. A sentence at '.', '!' or '?' before a blank, and at ':' or ';' that ends a line's item.
inline std::vector<Finding> long_sentences(const std::string& markdown, size_t most) {
  std::vector<Finding> out;
  std::string block;
  size_t start = 0;
  const auto close = [&] {
    static const std::regex kEnd(R"re(([.!?][)"*]*)\s+(?=["`(*\[A-Z0-9]))re");
    std::string text =
        std::regex_replace(block, std::regex(R"(\b(et al|e\.g|i\.e|fig|sec|eq|vs|approx|No|J|Ann|IEEE Trans)\.)"), "$1");
    text = std::regex_replace(text, std::regex(R"(\b([A-Z])\. )"), "$1 ");
    text = std::regex_replace(text, kEnd, "$1\n");
    for (const std::string& sentence : lines_of(text))
      if (const size_t n = count_words(sentence); n > most) out.push_back({start, std::to_string(n) + " words: " + sentence});
    block.clear();
  };
  const std::vector<std::string> lines = lines_of(prose_of(markdown));
  static const std::regex kItem(R"(^\s*([-*]|\d+\.) )");
  for (size_t i = 0; i < lines.size(); ++i) {
    const std::string& line = lines[i];
    const bool blank = line.find_first_not_of(" \t") == std::string::npos;
    const bool apart = blank || line[0] == '#' || line[0] == '|' || std::regex_search(line, kItem);
    if (apart) close();
    if (blank || line[0] == '#' || line[0] == '|') continue;
    if (block.empty()) start = i + 1;
    block += (block.empty() ? "" : " ") + std::regex_replace(line, kItem, "");
  }
  close();
  return out;
}

// The texts between quotes of C++ source, with their lines; no includes, no comments, adjacent ones one by one.
inline std::vector<Finding> strings_of(const std::string& source) {
  std::vector<Finding> out;
  const std::vector<std::string> lines = lines_of(source);
  for (size_t i = 0; i < lines.size(); ++i) {
    const std::string& line = lines[i];
    if (line.rfind("#include", 0) == 0) continue;
    std::string text;
    bool inside = false;
    for (size_t k = 0; k < line.size(); ++k) {
      if (!inside && line.compare(k, 2, "//") == 0) break;
      if (!inside && line[k] == '\'' && k + 2 < line.size()) {  // '"'
        const size_t end = line.find('\'', k + (line[k + 1] == '\\' ? 3 : 2));
        if (end != std::string::npos && end - k <= 4) k = end;
        continue;
      }
      if (inside && line[k] == '\\') {
        text += ' ';
        ++k;
        continue;
      }
      if (line[k] == '"') {
        if (inside) out.push_back({i + 1, text});
        text.clear();
        inside = !inside;
      } else if (inside) {
        text += line[k];
      }
    }
  }
  return out;
}

// The comments of C++ source, with their lines.
inline std::vector<Finding> comments_of(const std::string& source) {
  std::vector<Finding> out;
  const std::vector<std::string> lines = lines_of(source);
  for (size_t i = 0; i < lines.size(); ++i)
    if (const size_t at = lines[i].find("//"); at != std::string::npos && (at == 0 || lines[i][at - 1] != ':'))
      out.push_back({i + 1, lines[i].substr(at + 2)});
  return out;
}

}  // namespace catgut::language
