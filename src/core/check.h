// core/check: the one way bad input is reported.
// Every reader (scene, mesh, recording, device, command line) throws InputError with one line that says where, what and what
// next; the program prints it and exits with code 2. Programming mistakes are CATGUT_CHECK, which stops at once.
#pragma once
#include <cstdio>
#include <cstdlib>
#include <stdexcept>
#include <string>

namespace catgut {

struct InputError : std::runtime_error {
  // where: "scene.toml:14" or a file or an option; what: the fault; next: what the user can do about it.
  InputError(const std::string& where, const std::string& what, const std::string& next)
      : std::runtime_error(where + ": " + what + "; " + next) {}
};

[[noreturn]] inline void check_failed(const char* file, int line, const char* condition) {
  std::fprintf(stderr, "%s:%d: internal check failed: %s\n", file, line, condition);
  std::abort();
}

}  // namespace catgut

#define CATGUT_CHECK(condition) \
  do { \
    if (!(condition)) ::catgut::check_failed(__FILE__, __LINE__, #condition); \
  } while (0)
