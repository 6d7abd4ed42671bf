// SPDX-License-Identifier: Apache-2.0
// app/window: see data_folder.h.
#include "window/data_folder.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <cstdlib>
#include <ctime>
#include <filesystem>

#include "commands/commands.h"
#include "core/check.h"
#include "runtime/session_log.h"

namespace catgut {
namespace fs = std::filesystem;

std::string data_folder(const Settings& settings) {
  const auto of = [](const char* name) -> std::string {
    const char* value = std::getenv(name);
    return value && value[0] == '/' ? value : "";
  };
  if (settings.data_folder.rfind("~/", 0) == 0) return of("HOME").empty() ? "" : of("HOME") + settings.data_folder.substr(1);
  if (!settings.data_folder.empty()) return settings.data_folder;
  if (!of("XDG_DATA_HOME").empty()) return of("XDG_DATA_HOME") + "/catgut/sessions";
  return of("HOME").empty() ? "" : of("HOME") + "/.local/share/catgut/sessions";
}

std::string session_file(const std::string& folder, const std::string& scene) {
  if (folder.empty()) throw InputError("data folder", "there is no home folder", "set data_folder in the settings file");
  std::error_code error;
  fs::create_directories(folder, error);
  const std::time_t now = std::time(nullptr);
  const std::string stem =
      fmt::format("{}/{}_{:%Y-%m-%d_%H%M}", folder, scene.empty() ? "session" : scene, fmt::localtime(now));
  std::string path = stem + ".cgrec";
  for (int i = 2; fs::exists(path, error); ++i) path = fmt::format("{}_{}.cgrec", stem, i);
  prepare_output(path);
  return path;
}

void keep_session(const std::string& file, const LiveResult& result, const std::string& json) {
  if (result.map.event.empty()) {
    std::error_code error;
    for (const std::string& part : result.recorded) fs::remove(part, error);
    return;
  }
  write_output(fs::path(file).replace_extension(".json").string(), json);
  write_output(fs::path(file).replace_extension(".csv").string(), session_csv(result));
}

}  // namespace catgut
