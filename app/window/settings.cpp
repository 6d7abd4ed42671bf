// SPDX-License-Identifier: Apache-2.0
// app/window: see settings.h.
#include "window/settings.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <sstream>
#include <vector>

#include "core/check.h"
#include "procedure/scene_fields.h"
#include "procedure/toml.h"
#include "window/language.h"

namespace catgut {
namespace {
namespace fs = std::filesystem;

constexpr size_t kMostBytes = 64 * 1024;  // far above any valid file

constexpr const char* kQualities[] = {"low", "medium", "high"};
constexpr const char* kGuidances[] = {"learn", "practice", "exam"};
constexpr const char* kFeedbacks[] = {"silent", "stitch", "live"};

// One row per key: how it is read (false: invalid value) and written. Reader, writer and messages use this list.
struct Key {
  const char* name;
  const char* wants;
  std::function<bool(const toml::node&, Settings&)> read;
  std::function<std::string(const Settings&)> write;
};

Key flag(const char* name, bool Settings::*member) {
  return {name, "write true or false",
          [member](const toml::node& n, Settings& s) {
            const auto v = n.value_exact<bool>();
            if (v) s.*member = *v;
            return v.has_value();
          },
          [member](const Settings& s) { return s.*member ? "true" : "false"; }};
}

std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) out += c == '"' || c == '\\' ? std::string("\\") + c : std::string(1, c);
  return out + "\"";
}

Key line(const char* name, const char* wants, std::string Settings::*member, bool (*valid)(const std::string&)) {
  return {name, wants,
          [=](const toml::node& n, Settings& s) {
            const auto v = n.value_exact<std::string>();
            if (!v || v->find_first_of("\n\r\t") != std::string::npos || !valid(*v)) return false;
            s.*member = *v;
            return true;
          },
          [member](const Settings& s) { return quoted(s.*member); }};
}

bool is_folder_name(const std::string& s) { return s.empty() || s[0] == '/' || s.rfind("~/", 0) == 0; }
bool is_language(const std::string& s) {
  const std::vector<std::string> names = language_names();
  return s.empty() || std::find(names.begin(), names.end(), s) != names.end();
}

Key number(const char* name, const char* wants, float Settings::*member, double low, double high) {
  return {name, wants,
          [=](const toml::node& n, Settings& s) {
            if (!n.is_number()) return false;
            const double v = n.value<double>().value_or(std::nan(""));
            if (!(v >= low && v <= high)) return false;
            s.*member = static_cast<float>(v);
            return true;
          },
          [member](const Settings& s) {
            const std::string text = fmt::format("{}", s.*member);
            return text.find_first_of(".e") == std::string::npos ? text + ".0" : text;
          }};
}

template <typename Enum>
Key word(const char* name, const char* wants, Enum Settings::*member, const char* const (&names)[3]) {
  return {name, wants,
          [member, &names](const toml::node& n, Settings& s) {
            const auto v = n.value_exact<std::string>();
            for (int k = 0; v && k < 3; ++k)
              if (*v == names[k]) {
                s.*member = static_cast<Enum>(k);
                return true;
              }
            return false;
          },
          [member, &names](const Settings& s) { return fmt::format("\"{}\"", names[static_cast<size_t>(s.*member)]); }};
}

// A text without quotes, backslashes and control characters. valid: empty texts are always.
Key words(const char* name, const char* wants, std::string Settings::*member, bool (*valid)(const std::string&)) {
  return {name, wants,
          [=](const toml::node& n, Settings& s) {
            const auto v = n.value_exact<std::string>();
            if (!v || (!v->empty() && !valid(*v))) return false;
            s.*member = *v;
            return true;
          },
          [member](const Settings& s) { return "\"" + s.*member + "\""; }};
}

bool plain_text(const std::string& text) {
  return text.size() <= 200 && std::all_of(text.begin(), text.end(), [](char c) {
           return c != '"' && c != '\\' && static_cast<unsigned char>(c) >= 32 && c != 127;
         });
}

const std::vector<Key>& keys() {
  static const std::vector<Key> kKeys{
      word("quality", "write \"low\", \"medium\" or \"high\"", &Settings::quality, kQualities),
      word("guidance", "write \"learn\", \"practice\" or \"exam\"", &Settings::guidance, kGuidances),
      word("feedback", "write \"silent\", \"stitch\" or \"live\"", &Settings::feedback, kFeedbacks),
      flag("left_handed", &Settings::left_handed),
      flag("hold_to_close", &Settings::hold_to_close),
      flag("assist", &Settings::assist),
      flag("suture_points", &Settings::suture_points),
      flag("hints", &Settings::hints),
      flag("inset", &Settings::inset),
      flag("sound", &Settings::sound),
      number("mouse_speed", "write a number from 0.2 to 4", &Settings::mouse_speed, 0.2, 4),
      flag("steady_hands", &Settings::steady_hands),
      number("hand_scale", "write a number from 0.2 to 1", &Settings::hand_scale, 0.2, 1),
      number("text_size", "write a number from 0.7 to 2", &Settings::text_size, 0.7, 2),
      flag("record", &Settings::record),
      line("data_folder", "write a whole path, such as \"/data/catgut\" or \"~/catgut\"", &Settings::data_folder,
           is_folder_name),
      line("language", "write \"en\", \"de\", or the name of another file in languages/", &Settings::language, is_language),
      number("force_right", "write a number from 0.2 to 2", &Settings::force_right, 0.2, 2),
      number("force_left", "write a number from 0.2 to 2", &Settings::force_left, 0.2, 2),
      words("trainee", "write a pseudonym of letters, digits, dot, dash and underscore", &Settings::trainee, is_pseudonym),
      words("survey", "write the name of a file in surveys/, or its path", &Settings::survey, plain_text),
  };
  return kKeys;
}

std::string read_small_file(const std::string& path) {
  std::error_code error;
  if (!fs::is_regular_file(path, error)) throw InputError(path, "the settings are not a file", "defaults are used");
  std::ifstream in(path, std::ios::binary);
  std::string text(kMostBytes + 1, '\0');
  in.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (in.bad() || (!in && !in.eof())) throw InputError(path, "the settings cannot be read", "defaults are used");
  text.resize(static_cast<size_t>(in.gcount()));
  if (text.size() > kMostBytes) throw InputError(path, "the settings file is too long", "defaults are used");
  return text;
}

// Content is flushed before the rename, so that no crash leaves a partial file.
void write_whole(const std::string& path, const std::string& text) {
  const std::string beside = path + ".new";
  const int file = ::open(beside.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  bool good = file >= 0;
  for (size_t done = 0; good && done < text.size();) {
    const ssize_t n = ::write(file, text.data() + done, text.size() - done);
    good = n > 0;
    if (good) done += static_cast<size_t>(n);
  }
  good = good && ::fsync(file) == 0;
  if (file >= 0) good = ::close(file) == 0 && good;
  good = good && std::rename(beside.c_str(), path.c_str()) == 0;
  if (good) return;
  if (file >= 0) ::unlink(beside.c_str());
  throw InputError(path, "the settings cannot be written", "they apply until the program ends");
}

}  // namespace

const char* quality_name(Quality quality) { return kQualities[static_cast<size_t>(quality)]; }
const char* guidance_name(Guidance guidance) { return kGuidances[static_cast<size_t>(guidance)]; }
const char* feedback_name(FeedbackLevel level) { return kFeedbacks[static_cast<size_t>(level)]; }

bool is_pseudonym(const std::string& text) {
  return !text.empty() && text.size() <= 64 &&
         text.find_first_not_of("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789._-") == std::string::npos;
}

Settings parse_settings(const std::string& text, const std::string& name) {
  Settings out;
  toml::table root;
  const auto at = [&](const toml::source_region& r) { return r.begin.line ? fmt::format("{}:{}", name, r.begin.line) : name; };
  try {
    root = toml::parse(text, name);
  } catch (const toml::parse_error& error) {
    throw InputError(at(error.source()), std::string(error.description()), "fix the syntax, or delete the file");
  }
  for (const auto& [key, node] : root) {
    const std::string_view wanted = key.str();
    const Key* found = nullptr;
    std::vector<std::string> names;
    for (const Key& k : keys()) {
      names.push_back(k.name);
      if (wanted == k.name) found = &k;
    }
    if (!found) {
      const std::string nearest = nearest_word(wanted, names);
      throw InputError(at(node.source()), fmt::format("there is no setting \"{}\"", wanted),
                       nearest.empty() ? "remove it" : fmt::format("did you mean \"{}\"?", nearest));
    }
    if (!found->read(node, out))
      throw InputError(at(node.source()), fmt::format("{} has an invalid value", found->name), found->wants);
  }
  return out;
}

std::string settings_text(const Settings& settings) {
  std::string text = "# Settings of Catgut's window, which writes this file.\n";
  for (const Key& k : keys()) text += fmt::format("{} = {}\n", k.name, k.write(settings));
  return text;
}

LoadedSettings load_settings(const std::string& path) {
  LoadedSettings out;
  std::error_code error;
  out.first = path.empty() || !fs::exists(path, error);
  if (out.first) return out;
  try {
    out.settings = parse_settings(read_small_file(path), path);
  } catch (const InputError& fault) { out.fault = fault.what(); }
  return out;
}

void save_settings(const Settings& settings, const std::string& path) {
  if (path.empty()) throw InputError("settings", "no config directory", "set HOME or XDG_CONFIG_HOME");
  std::error_code error;
  fs::create_directories(fs::path(path).parent_path(), error);
  if (!load_settings(path).fault.empty()) std::rename(path.c_str(), (path + ".bad").c_str());
  write_whole(path, settings_text(settings));
}

std::string settings_path() {
  const auto of = [](const char* name) -> fs::path {
    const char* value = std::getenv(name);
    return value && value[0] == '/' ? value : "";  // the specification requires absolute paths, and ignores others
  };
  fs::path folder = of("XDG_CONFIG_HOME");
  if (folder.empty() && !of("HOME").empty()) folder = of("HOME") / ".config";
  return folder.empty() ? "" : (folder / "catgut" / "settings.toml").string();
}

}  // namespace catgut
