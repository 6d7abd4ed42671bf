// SPDX-License-Identifier: Apache-2.0
// geometry/gltf_check: see the header. Reads a file; throws InputError.
#include "geometry/gltf_check.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <optional>
#include <set>
#include <string_view>
#include <utility>
#include <vector>

#include "core/check.h"

namespace catgut {

namespace {

constexpr int kDeepest = 64, kDeepestNode = 256;
constexpr size_t kMostNodes = 100000, kMostValues = 1000000;
const char* const kAgain = "open it in a mesh viewer and export the surface again";

// The subset of JSON that the check needs: strings stay raw, escapes included.
struct Json {
  enum class Kind : uint8_t { nothing, number, text, list, object } kind = Kind::nothing;
  double number = 0;
  std::string_view text;
  std::vector<Json> list;  // of an object: its values
  std::vector<std::string_view> name;

  const Json* get(std::string_view key) const {
    for (size_t i = 0; i < name.size(); ++i)
      if (name[i] == key) return &list[i];
    return nullptr;
  }
  // A whole number from 0, or nothing.
  std::optional<size_t> index() const {
    if (kind != Kind::number || !(number >= 0 && number < 4e9) || number != std::floor(number)) return {};
    return static_cast<size_t>(number);
  }
};

class Parser {
 public:
  Parser(std::string_view text, const std::string& path) : text_(text), path_(path) {}
  Json document() {
    Json out = value(0);
    skip();
    if (at_ != text_.size()) fail("there is something after its JSON");
    return out;
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw InputError(path_, "cannot be read as a mesh (" + what + ")", kAgain);
  }
  void skip() {
    while (at_ < text_.size() && std::strchr(" \t\r\n", text_[at_]) && text_[at_] != '\0') ++at_;
  }
  char peek() {
    skip();
    if (at_ == text_.size()) fail("its JSON ends too early");
    return text_[at_];
  }
  std::string_view string() {
    const size_t from = ++at_;
    for (; at_ < text_.size(); ++at_) {
      if (text_[at_] == '\\') ++at_;
      else if (text_[at_] == '"') return text_.substr(from, at_++ - from);
    }
    fail("its JSON ends inside a string");
  }
  Json value(int depth) {
    if (depth > kDeepest) fail("its JSON nests deeper than 64");
    if (++values_ > kMostValues) fail("its JSON has more than a million values");
    Json out;
    const char c = peek();
    if (c == '{' || c == '[') {
      const bool object = c == '{';
      const char close = object ? '}' : ']';
      out.kind = object ? Json::Kind::object : Json::Kind::list;
      ++at_;
      if (peek() == close) return ++at_, out;
      std::set<std::string_view> seen;
      while (true) {
        if (object) {
          if (peek() != '"') fail("its JSON has a member without a name");
          out.name.push_back(string());
          if (!seen.insert(out.name.back()).second) fail("its JSON names a member twice");
          if (peek() != ':') fail("its JSON has a member without a value");
          ++at_;
        }
        out.list.push_back(value(depth + 1));
        const char next = peek();
        ++at_;
        if (next == close) return out;
        if (next != ',') fail("its JSON is broken");
      }
    }
    if (c == '"') {
      out.kind = Json::Kind::text, out.text = string();
    } else if (c == '-' || (c >= '0' && c <= '9')) {
      const size_t from = at_;
      while (at_ < text_.size() && std::strchr("+-.eE0123456789", text_[at_]) && text_[at_] != '\0') ++at_;
      out.kind = Json::Kind::number, out.number = std::strtod(std::string(text_.substr(from, at_ - from)).c_str(), nullptr);
    } else {
      bool word = false;
      for (const std::string_view w : {"true", "false", "null"})
        if (text_.substr(at_, w.size()) == w) at_ += w.size(), word = true;
      if (!word) fail("its JSON is broken");
    }
    return out;
  }
  std::string_view text_;
  const std::string& path_;
  size_t at_ = 0, values_ = 0;
};

const std::vector<Json>& list_of(const Json* parent, std::string_view key) {
  static const std::vector<Json> none;
  const Json* found = parent ? parent->get(key) : nullptr;
  return found && found->kind == Json::Kind::list ? found->list : none;
}

class Check {
 public:
  Check(const Json& root, const std::string& path) : root_(root), path_(path) {}
  void run() {
    const Json* asset = root_.get("asset");
    const Json* version = asset ? asset->get("version") : nullptr;
    if (!version || version->kind != Json::Kind::text || version->text.substr(0, 2) != "2.") refuse("it is not glTF 2");
    nodes();
    geometry();
  }

 private:
  [[noreturn]] void refuse(const std::string& what) const {
    throw InputError(path_, "cannot be read as a mesh (" + what + ")", kAgain);
  }
  void nodes() const {
    const auto& node = list_of(&root_, "nodes");
    if (node.size() > kMostNodes) refuse("it has more than 100000 nodes");
    std::vector<uint8_t> has_parent(node.size(), 0);
    for (const Json& n : node)
      for (const Json& child : list_of(&n, "children")) {
        const auto i = child.index();
        if (!i || *i >= node.size()) refuse("a node has a child that is not there");
        if (has_parent[*i]++) refuse("its nodes do not form a tree: two share a child");
      }
    for (const Json& scene : list_of(&root_, "scenes")) {
      std::vector<uint8_t> seen(node.size(), 0);
      for (const Json& top : list_of(&scene, "nodes")) {
        const auto i = top.index();
        if (!i || *i >= node.size()) refuse("a scene has a node that is not there");
        if (seen[*i]++ || has_parent[*i]) refuse("its nodes do not form a tree: a scene lists one twice");
      }
    }
    // With one parent each, levels below the roots are a forest; the remainder are cycles.
    std::vector<size_t> level;
    for (size_t i = 0; i < node.size(); ++i)
      if (!has_parent[i]) level.push_back(i);
    size_t reached = 0;
    for (int depth = 0; !level.empty(); ++depth) {
      if (depth > kDeepestNode) refuse("its nodes nest deeper than 256");
      reached += level.size();
      std::vector<size_t> next;
      for (size_t i : level)
        for (const Json& child : list_of(&node[i], "children")) next.push_back(*child.index());
      level = std::move(next);
    }
    if (reached < node.size()) refuse("its nodes do not form a tree: they form a ring");
  }
  double count_of(const Json* accessor) const {
    if (!accessor) return 0;
    const auto& all = list_of(&root_, "accessors");
    const auto i = accessor->index();
    if (!i || *i >= all.size()) refuse("it names an accessor that is not there");
    const Json* count = all[*i].get("count");
    if (!count || !count->index()) refuse("an accessor has no count");
    return count->number;
  }
  void geometry() const {
    double sum = 0;
    const auto add = [&](double more) {
      if ((sum += more) > kMostGltfValues) refuse("it describes more than six million vertices and indices");
    };
    const auto add_all = [&](const Json* attributes) {
      if (attributes && attributes->kind == Json::Kind::object)
        for (const Json& a : attributes->list) add(count_of(&a));
    };
    for (const Json& mesh : list_of(&root_, "meshes"))
      for (const Json& part : list_of(&mesh, "primitives")) {
        add(10);
        const Json *attributes = part.get("attributes"), *indices = part.get("indices"), *mode = part.get("mode");
        add_all(attributes);
        for (const Json& target : list_of(&part, "targets")) add_all(&target);
        // Strips, fans, lines and points make a face of nearly every index.
        const double faces = mode && mode->number != 4 ? 3 : 1;
        const Json* position = attributes ? attributes->get("POSITION") : nullptr;
        add(faces * count_of(indices ? indices : position));
      }
    for (const Json& skin : list_of(&root_, "skins")) add(10 + 6 * count_of(skin.get("inverseBindMatrices")));
    for (const Json& animation : list_of(&root_, "animations")) {
      for (const Json& s : list_of(&animation, "samplers"))
        add(10 + 2 * count_of(s.get("input")) + 2 * count_of(s.get("output")));
      // A channel reads its sampler again.
      const auto& sampler = list_of(&animation, "samplers");
      for (const Json& c : list_of(&animation, "channels")) {
        const Json* which = c.get("sampler");
        const auto i = which ? which->index() : std::nullopt;
        if (i && *i < sampler.size())
          add(10 + 2 * count_of(sampler[*i].get("input")) + 2 * count_of(sampler[*i].get("output")));
      }
    }
  }
  const Json& root_;
  const std::string& path_;
};

}  // namespace

void check_gltf(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  std::string_view text = bytes;
  if (text.substr(0, 4) == "glTF") {
    uint32_t version = 0, length = 0, kind = 0;
    if (bytes.size() >= 20) {
      std::memcpy(&version, bytes.data() + 4, 4), std::memcpy(&length, bytes.data() + 12, 4);
      std::memcpy(&kind, bytes.data() + 16, 4);
    }
    if (version != 2 || kind != 0x4E4F534A || length > bytes.size() - 20)
      throw InputError(path, "cannot be read as a mesh (it is not a complete GLB of version 2)", kAgain);
    text = text.substr(20, length);
    while (!text.empty() && (text.back() == ' ' || text.back() == '\0')) text.remove_suffix(1);
  } else if (text.substr(0, 3) == "\xEF\xBB\xBF") {
    text.remove_prefix(3);
  }
  const Json root = Parser(text, path).document();
  Check(root, path).run();
}

}  // namespace catgut
