// SPDX-License-Identifier: Apache-2.0
// core/file: see file.h. POSIX calls, because a stream does not reliably report a full disk.
#include "core/file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "core/check.h"

namespace catgut {
namespace {

const char* next_step(int error) {
  switch (error) {
    case ENOSPC:
    case EDQUOT:
      return "free some space, or choose another disk";
    case ENOENT:
    case ENOTDIR:
      return "create its folder, or choose another place";
    case EACCES:
    case EPERM:
    case EROFS:
      return "choose a folder that you may write to";
    default:
      return "choose another place";
  }
}

[[noreturn]] void fail(const std::string& path, int error) {
  throw InputError(path, std::string("cannot be written: ") + std::strerror(error), next_step(error));
}

// 0, or the errno of the call that failed. Closes fd in every case.
int write_and_close(int fd, std::string_view bytes, bool flush) {
  int error = 0;
  while (error == 0 && !bytes.empty()) {
    const ssize_t n = ::write(fd, bytes.data(), bytes.size());
    if (n >= 0) bytes.remove_prefix(static_cast<size_t>(n));
    else if (errno != EINTR) error = errno;
  }
  // Some file systems report a full disk only at fsync.
  if (error == 0 && flush && ::fsync(fd) != 0 && errno != EINVAL) error = errno;
  if (::close(fd) != 0 && error == 0) error = errno;
  return error;
}

}  // namespace

void write_file(const std::string& path, std::string_view bytes) {
  struct stat there = {};
  const bool exists = ::stat(path.c_str(), &there) == 0;
  if (exists && S_ISDIR(there.st_mode)) fail(path, EISDIR);
  if (exists && !S_ISREG(there.st_mode)) {
    const int fd = ::open(path.c_str(), O_WRONLY | O_CLOEXEC);
    if (fd < 0) fail(path, errno);
    if (const int error = write_and_close(fd, bytes, false)) fail(path, error);
    return;
  }
  // A link is followed, so that the file it points to is replaced, not the link.
  std::error_code ignored;
  const std::filesystem::path real = exists ? std::filesystem::canonical(path, ignored) : std::filesystem::path(path);
  const std::string target = real.empty() ? path : real.string(), part = target + ".part" + std::to_string(::getpid());
  const int fd = ::open(part.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, exists ? there.st_mode & 0777 : 0666);
  if (fd < 0) fail(path, errno);
  int error = write_and_close(fd, bytes, true);
  if (error == 0 && ::rename(part.c_str(), target.c_str()) != 0) error = errno;
  if (error == 0) return;
  ::unlink(part.c_str());
  fail(path, error);
}

void check_suffix(const std::string& path, std::string_view suffix, const std::string& option) {
  if (path.empty() || path == "-") return;
  std::string end = path.size() < suffix.size() ? path : path.substr(path.size() - suffix.size());
  std::transform(end.begin(), end.end(), end.begin(), [](unsigned char c) { return std::tolower(c); });
  if (end != suffix || path.size() == suffix.size())
    throw InputError(option + " " + path, "the file name does not end in " + std::string(suffix),
                     "name it, for example, " + std::filesystem::path(path).stem().string() + std::string(suffix));
}

std::string read_file(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  std::error_code error;
  if (!in || std::filesystem::is_directory(path, error)) throw InputError(path, "cannot be read", "check the path");
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

}  // namespace catgut
