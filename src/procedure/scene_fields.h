// SPDX-License-Identifier: Apache-2.0
// procedure: the table of all scene keys. The reader, the writer, --set, `catgut describe`,
// docs/scene_reference.md and the tests all use it, so a key added here is complete everywhere.
// Default values are not repeated in the table: they are read from a default-constructed SceneSpec.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "sim/scene.h"

namespace catgut {

// Location of a value; its alternative is also the key's type.
using FieldRef = std::variant<std::string*, int*, uint64_t*, float*, bool*, Vec3*>;

// The allowed words of a text, separated by '|': fixed, or known when they are asked for. Neither: any text.
struct Choices {
  const char* fixed = nullptr;
  std::string (*now)() = nullptr;
  constexpr Choices(std::nullptr_t) {}
  constexpr Choices(const char* words) : fixed(words) {}
  constexpr Choices(std::string (*words)()) : now(words) {}
  explicit operator bool() const { return fixed || now; }
  std::string text() const { return now ? now() : fixed ? fixed : ""; }
};

struct Field {
  const char* section;  // "" for keys at the top of the file; see is_list
  const char* key;
  const char* unit;  // SI; "" when the value has none
  double min, max;   // inclusive, per component of a vector; ignored for text and flags
  Choices choices;   // text: the allowed words
  const char* meaning;
  FieldRef (*at)(SceneSpec& scene, size_t row);  // row: of a list section, else unused
};

std::span<const Field> scene_fields();
const std::vector<std::string>& scene_sections();       // "body", "thread", ... in file order, "" left out
const char* section_meaning(std::string_view section);  // one line for the reference
// A list of tables ([[body]], [[instrument]], [[suture]]) has any number of rows; any other section has one. A new row of
// [[suture]] begins as the scene's [thread] and [needle].
bool is_list(std::string_view section);
size_t rows_of(const SceneSpec& scene, std::string_view section);
void add_row(SceneSpec& scene, std::string_view section);

const Field* find_field(std::string_view section, std::string_view key);  // nullptr if there is none
std::string full_key(const Field& field);                                 // "solver.substeps", "body[].radius", "title"

std::string type_name(const Field& field);     // "text", "whole number", "number", "flag", "vector"
std::string range_text(const Field& field);    // "1..64", "purse_string or none", "" when unrestricted
std::string default_text(const Field& field);  // as it would be written in a scene file

// A value as TOML, in the shortest form that reads back to the same bits.
std::string value_text(FieldRef value);
std::string number_text(double value);

// The results of a run that [expect] may bound: runtime/session fills them.
struct ResultName {
  std::string name, unit, meaning;
};
const std::vector<ResultName>& result_names();

// The most similar candidate to a misspelled word; "" if none is similar enough.
std::string nearest_word(std::string_view word, const std::vector<std::string>& candidates);

}  // namespace catgut
