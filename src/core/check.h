// SPDX-License-Identifier: Apache-2.0
// core/check: the one way bad input is reported.
// Every reader (scene, mesh, recording, device, command line) throws InputError with one line: place, fault and remedy. The
// program prints it and exits with code 2. Programming errors are CATGUT_CHECK, which aborts at once.
#pragma once
#include <cstdio>
#include <cstdlib>
#include <stdexcept>
#include <string>

namespace catgut {

struct InputError : std::runtime_error {
  // where: "scene.toml:14" or a file or an option; what: the fault; next: the remedy.
  InputError(const std::string& where, const std::string& what, const std::string& next)
      : std::runtime_error(one_line(where + ": " + what + "; " + next)) {}

 private:
  // Messages quote the input: the quote is kept to one line, without control codes for a terminal.
  static std::string one_line(std::string text) {
    for (char& c : text)
      if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = ' ';
    return text;
  }
};

[[noreturn]] inline void check_failed(const char* file, int line, const char* condition) {
  std::fprintf(stderr, "%s:%d: internal check failed: %s\n", file, line, condition);
  std::abort();
}

}  // namespace catgut

#define CATGUT_CHECK(condition)                                               \
  do {                                                                        \
    if (!(condition)) ::catgut::check_failed(__FILE__, __LINE__, #condition); \
  } while (0)
