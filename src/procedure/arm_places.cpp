// SPDX-License-Identifier: Apache-2.0
// procedure/arm_places: see the header.
#include "procedure/arm_places.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string_view>

#include "core/check.h"
#include "core/file.h"
#include "procedure/toml.h"

namespace catgut {
namespace {

constexpr std::string_view kKeys[] = {"scale", "turn", "x", "y", "z", "qx", "qy", "qz", "qw", "residual_mm", "hand"};
constexpr const char* kNext = "correct or remove the file, then run catgut devices --calibrate";

float number(const toml::table& t, const char* key, float otherwise, float least, float most, const std::string& where) {
  const toml::node* node = t.get(key);
  if (!node) return otherwise;
  const std::optional<double> value = node->value<double>();
  const std::string line = where + ":" + std::to_string(node->source().begin.line);
  if (!value || !(*value >= double{least} && *value <= double{most}))
    throw InputError(line, std::string(key) + " must be a number between " + fmt::format("{} and {}", least, most), kNext);
  return static_cast<float>(*value);
}

}  // namespace

std::string arm_places_file() {
  const auto get = [](const char* name) {
    const char* s = std::getenv(name);
    return std::string(s ? s : "");
  };
  if (const std::string set = get("CATGUT_ARMS"); !set.empty()) return set;
  const std::string config = get("XDG_CONFIG_HOME");
  return (config.empty() ? get("HOME") + "/.config" : config) + "/catgut/arms.toml";
}

std::map<std::string, ArmPlace> read_arm_places(const std::string& path) {
  std::map<std::string, ArmPlace> places;
  std::error_code error;
  using std::filesystem::file_type;
  const file_type type = std::filesystem::status(path, error).type();
  if (type == file_type::directory) throw InputError(path, "is a folder", "set CATGUT_ARMS to a file");
  if (type != file_type::regular && type != file_type::none) return places;
  std::ifstream in(path, std::ios::binary);
  std::string text;
  for (char part[4096]; in.read(part, sizeof part) || in.gcount() > 0;) text.append(part, static_cast<size_t>(in.gcount()));
  if (!in.is_open() || in.bad()) throw InputError(path, "cannot be read", "allow it, or set CATGUT_ARMS to another file");
  toml::table file;
  try {
    file = toml::parse(text, path);
  } catch (const toml::parse_error& e) {
    throw InputError(path + ":" + std::to_string(e.source().begin.line), std::string(e.description()), kNext);
  }
  for (const auto& [serial, node] : file) {
    const auto refuse = [&](const toml::node& at, const std::string& what) {
      throw InputError(path + ":" + std::to_string(at.source().begin.line), what, kNext);
    };
    const toml::table* t = node.as_table();
    if (!t) refuse(node, std::string(serial.str()) + " must be a table [SERIAL NUMBER]");
    for (const auto& [key, value] : *t)
      if (std::find(std::begin(kKeys), std::end(kKeys), key.str()) == std::end(kKeys))
        refuse(value,
               std::string(key.str()) + " is unknown; a device has scale, turn, x, y, z, qx, qy, qz, qw, residual_mm and hand");
    ArmPlace p;
    p.scale = number(*t, "scale", p.scale, 0.1f, 3, path);
    p.turn = number(*t, "turn", p.turn, -180, 180, path);
    p.middle.x = number(*t, "x", 0, -0.5f, 0.5f, path);
    p.middle.y = number(*t, "y", 0, -0.5f, 0.5f, path);
    p.middle.z = number(*t, "z", 0, -0.5f, 0.5f, path);
    p.rotation = {number(*t, "qx", 0, -1, 1, path), number(*t, "qy", 0, -1, 1, path), number(*t, "qz", 0, -1, 1, path),
                  number(*t, "qw", 1, -1, 1, path)};
    p.rotation = normalized(p.rotation);
    if (t->contains("residual_mm")) p.residual = 1e-3f * number(*t, "residual_mm", 0, 0, 100, path);
    if (const toml::node* hand = t->get("hand")) {
      const std::string word = hand->value_or(std::string());
      if (word != "right" && word != "left") refuse(*hand, "hand must be \"right\" or \"left\"");
      p.hand = word == "left" ? 1 : 0;
    }
    places[std::string(serial.str())] = p;
  }
  return places;
}

void write_arm_places(const std::string& path, const std::map<std::string, ArmPlace>& places) {
  std::error_code error;
  std::filesystem::create_directories(std::filesystem::path(path).parent_path(), error);
  toml::table file;
  for (const auto& [serial, p] : places) {
    toml::table t{{"scale", p.scale}, {"turn", p.turn}, {"x", p.middle.x}, {"y", p.middle.y}, {"z", p.middle.z}};
    if (p.residual >= 0) {
      t.insert_or_assign("qx", p.rotation.x), t.insert_or_assign("qy", p.rotation.y);
      t.insert_or_assign("qz", p.rotation.z), t.insert_or_assign("qw", p.rotation.w);
      t.insert_or_assign("residual_mm", 1e3f * p.residual);
    }
    if (p.hand >= 0) t.insert_or_assign("hand", p.hand == 1 ? "left" : "right");
    file.insert_or_assign(serial, t);
  }
  std::ostringstream out;
  out << "# Workspace mapping of haptic devices by serial number, written by catgut devices --calibrate.\n"
         "# scale: field meters per meter of the stylus; turn [degrees]; x, y, z [m]: device position at the center of "
         "the field.\n"
         "# qx, qy, qz, qw: rotation by catgut devices --register, instead of turn; residual_mm of its fit; hand: right or "
         "left.\n"
      << file << "\n";
  write_file(path, out.str());
}

}  // namespace catgut
