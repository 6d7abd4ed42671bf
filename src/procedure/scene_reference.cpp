// procedure: writes the manual of scene files from the table; see scene_reference.h.
#include "procedure/scene_reference.h"

#include <fmt/format.h>

#include "core/check.h"
#include "procedure/scene_fields.h"

namespace catgut {
namespace {

std::string heading(const std::string& section) {
  if (section.empty()) return "";
  return section == "body" ? "[[body]]" : fmt::format("[{}]", section);
}

std::string one_key(const Field& f) {
  const std::string unit = f.unit, range = range_text(f);
  std::string out = fmt::format("{}\n  {}\n  type     {}\n", full_key(f), f.meaning, type_name(f));
  if (!unit.empty()) out += fmt::format("  unit     {}\n", unit);
  out += fmt::format("  default  {}\n", default_text(f));
  if (!range.empty()) out += fmt::format("  range    {}\n", range);
  return out;
}

std::string results_text() {
  std::string out = fmt::format("[expect]   {}\n", section_meaning("expect"));
  out += "  write `name = 12` for equality or `name = {min = 10, max = 14}`; the names are\n";
  for (const ResultName& r : result_names())
    out += fmt::format("  {:<28} {}{}\n", r.name, r.meaning, r.unit.empty() ? "" : fmt::format(" [{}]", r.unit));
  return out;
}

std::string section_text(const std::string& section) {
  if (section == "expect") return results_text();
  std::string out = section.empty() ? "" : fmt::format("{}   {}\n", heading(section), section_meaning(section));
  for (const Field& f : scene_fields()) {
    if (section != f.section) continue;
    const std::string unit = f.unit;
    out += fmt::format("  {:<20} {:<13} {:<9} {:<18} {}\n", f.key, type_name(f), unit.empty() ? "" : fmt::format("[{}]", unit),
                       default_text(f), f.meaning);
  }
  return out;
}

// Tables in Markdown split at bars.
std::string cell(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '|') out += '\\';
    out += c;
  }
  return out;
}

}  // namespace

std::string describe(const std::string& key) {
  if (key.empty()) {
    std::string out = section_text("");
    for (const std::string& section : scene_sections()) (out += '\n') += section_text(section);
    return out;
  }
  std::string plain = key;  // "body[].radius" and "body[0].radius" mean the same key here
  if (const size_t open = plain.find('['), close = plain.find(']');
      open != std::string::npos && close != std::string::npos && close > open)
    plain.erase(open, close - open + 1);
  std::vector<std::string> known = scene_sections();
  for (const std::string& section : scene_sections())
    if (section == plain) return section_text(section);
  std::string found;
  for (const Field& f : scene_fields()) {
    const std::string full = *f.section ? fmt::format("{}.{}", f.section, f.key) : std::string(f.key);
    if (full == plain) return one_key(f);
    if (plain == f.key) found += one_key(f);
    known.push_back(full);
    known.push_back(f.key);
  }
  if (!found.empty()) return found;
  for (const ResultName& r : result_names()) {
    if (plain == fmt::format("expect.{}", r.name) || plain == r.name)
      return fmt::format("expect.{}\n  {}\n", r.name, r.meaning);
    known.push_back(fmt::format("expect.{}", r.name));
  }
  const std::string nearest = nearest_word(plain, known);
  throw InputError(key, "a scene has no such key",
                   nearest.empty() ? "`catgut describe` lists them all" : fmt::format("did you mean \"{}\"?", nearest));
}

std::string reference_markdown() {
  std::string out =
      "# Scene files: every key\n\n"
      "This page is written by `catgut describe --markdown`; a test keeps it so. A scene is a TOML file; a key left out keeps "
      "its\n"
      "default. Units are SI. `catgut describe KEY` prints one entry, `--set key=value` on the command line changes one.\n";
  const auto table = [&](const std::string& section) {
    out +=
        fmt::format("\n## {}{}\n\n", section.empty() ? "" : fmt::format("`{}` ", heading(section)), section_meaning(section));
    out += "| key | type | unit | default | range | meaning |\n|---|---|---|---|---|---|\n";
    for (const Field& f : scene_fields())
      if (section == f.section)
        out += fmt::format("| `{}` | {} | {} | `{}` | {} | {} |\n", f.key, type_name(f), f.unit, default_text(f),
                           cell(range_text(f)), cell(f.meaning));
  };
  table("");
  for (const std::string& section : scene_sections())
    if (section != "expect") table(section);
  out += fmt::format("\n## `[expect]` {}\n\n", section_meaning("expect"));
  out +=
      "`name = 12` asks for equality, `name = {min = 10, max = 14}` for bounds (either may be left out). A run whose\n"
      "expectations do not all hold ends with exit code 1.\n\n| result | unit | meaning |\n|---|---|---|\n";
  for (const ResultName& r : result_names()) out += fmt::format("| `{}` | {} | {} |\n", r.name, r.unit, r.meaning);
  return out;
}

}  // namespace catgut
