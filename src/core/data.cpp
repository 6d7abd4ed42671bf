// SPDX-License-Identifier: Apache-2.0
// core/data: the search; see the header.
#include "core/data.h"

#include <cstdlib>
#include <filesystem>
#include <sstream>
#include <vector>

namespace catgut {
namespace {
namespace fs = std::filesystem;

std::string environment(const char* name, const std::string& otherwise = "") {
  const char* value = std::getenv(name);
  return value && *value ? value : otherwise;
}

// Every folder named share that may hold data, in search order.
std::vector<fs::path> share_folders() {
  std::vector<fs::path> found;
  std::error_code error;
  for (fs::path at = fs::read_symlink("/proc/self/exe", error).parent_path(); !at.empty(); at = at.parent_path()) {
    found.push_back(at / "share");
    if (at == at.root_path()) break;
  }
  const std::string home = environment("HOME");
  const std::string user = environment("XDG_DATA_HOME", home.empty() ? "" : home + "/.local/share");
  if (!user.empty()) found.emplace_back(user);
  std::istringstream all(environment("XDG_DATA_DIRS", "/usr/local/share:/usr/share"));
  for (std::string one; std::getline(all, one, ':');)
    if (!one.empty()) found.emplace_back(one);
  found.emplace_back(CATGUT_INSTALLED_SHARE);
  return found;
}

std::string find(const fs::path& relative) {
  std::error_code error;
  for (const fs::path& share : share_folders())
    if (fs::exists(share / relative, error)) return (share / relative).string();
  return "";
}

}  // namespace

std::string data_path(const std::string& name) {
  const std::string given = environment("CATGUT_DATA_DIR");
  std::error_code error;
  if (!given.empty() && fs::exists(fs::path(given) / name, error)) return (fs::path(given) / name).string();
  return find(fs::path("catgut") / name);
}

std::string shared_path(const std::string& name) { return find(name); }

}  // namespace catgut
