// SPDX-License-Identifier: Apache-2.0
// app: see keep.h.
#include "commands/keep.h"

#include <fmt/format.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "core/check.h"
#include "core/file.h"
#include "report/session_file.h"

namespace catgut {
namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

Session session_of(const assess::Result& result, const StitchMap& map, const std::string& name) {
  Session s;
  read_session_json(assess::result_json(result), name, s);
  Json details = Json::parse(s.details);
  for (const StitchEdge& edge : map.edge) details["lines"].push_back({{"length_mm", 1e3 * static_cast<double>(edge.length())}});
  Json& tension = details["tension"] = {{"time_s", Json::array()}, {"peak_n", Json::array()}};
  for (const TensionSample& t : map.tension) {
    if (t.tick < result.first_tick) continue;
    tension["time_s"].push_back(static_cast<double>(t.tick) * map.tick_s);
    tension["peak_n"].push_back(t.peak);
  }
  s.details = details.dump();
  return s;
}

std::string session_uid(const std::string& trainee, const std::string& task) {
  std::string uid = fmt::format("{}-{}-{}", trainee.substr(0, 24), task.substr(0, 20), utc_now().substr(0, 19));
  std::erase(uid, ':');
  return uid;
}

std::string keep_recording(const Store& store, const std::string& path, const std::string& uid) {
  check_suffix(path, ".cgrec", "--recording");
  if (!store.is_file()) {
    if (!fs::exists(path)) throw InputError(path, "cannot be read", "check the path");
    return fs::absolute(path).string();
  }
  const fs::path folder = fs::absolute(store.name()).parent_path() / "recordings";
  std::error_code error;
  fs::create_directories(folder, error);
  const std::string kept = (folder / (uid + ".cgrec")).string();
  write_file(kept, read_file(path));
  return kept;
}

}  // namespace catgut
