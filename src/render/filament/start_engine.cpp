// SPDX-License-Identifier: Apache-2.0
// render/filament: see start_engine.h.
#include "render/filament/start_engine.h"

#include <sys/mman.h>
#include <unistd.h>

#include <cstdio>
#include <stdexcept>
#include <string>

namespace catgut {
namespace {

// Filament's normal messages.
bool is_greeting(const std::string& line) {
  return line.empty() || line.find("FEngine ") == 0 || line.find("WARNING: Using soft CircularBuffer") == 0;
}

// Redirects standard output while the engine starts, then passes the messages on. Output of another thread at that moment
// is redirected too.
class QuietStart {
 public:
  QuietStart() {
    std::fflush(stdout);
    said_ = ::memfd_create("engine", MFD_CLOEXEC);
    if (said_ < 0) return;
    saved_ = ::dup(STDOUT_FILENO);
    if (saved_ >= 0) ::dup2(said_, STDOUT_FILENO);
  }
  ~QuietStart() {
    if (said_ < 0) return;
    if (saved_ >= 0) {
      std::fflush(stdout);
      ::dup2(saved_, STDOUT_FILENO);
      ::close(saved_);
    }
    ::lseek(said_, 0, SEEK_SET);
    if (std::FILE* said = ::fdopen(said_, "r")) {
      std::string line;
      for (int c; (c = std::fgetc(said)) != EOF || !line.empty();) {
        if (c != '\n' && c != EOF) {
          line += static_cast<char>(c);
          continue;
        }
        if (!is_greeting(line)) std::fprintf(stderr, "%s\n", line.c_str());
        line.clear();
        if (c == EOF) break;
      }
      std::fclose(said);
    } else {
      ::close(said_);
    }
  }
  QuietStart(const QuietStart&) = delete;
  QuietStart& operator=(const QuietStart&) = delete;

 private:
  int said_ = -1, saved_ = -1;
};

filament::Engine* start(filament::Engine::Backend backend, filament::backend::Platform* platform, void* shared = nullptr) {
  const QuietStart quiet;
  filament::Engine* engine = filament::Engine::create(backend, platform, shared);
  if (!engine) throw std::runtime_error("no pictures: the graphics driver refused to start");
  return engine;
}

}  // namespace

filament::Engine* start_engine(filament::backend::Platform& platform) {
  return start(filament::Engine::Backend::OPENGL, &platform);
}

filament::Engine* start_engine_on_glx(void* shared) { return start(filament::Engine::Backend::OPENGL, nullptr, shared); }

filament::Engine* start_engine_without_driver() { return start(filament::Engine::Backend::NOOP, nullptr); }

}  // namespace catgut
