// render/filament: see start_engine.h.
#include "render/filament/start_engine.h"

#include <unistd.h>

#include <cstdio>
#include <stdexcept>

namespace catgut {
namespace {

// Another thread's output in that moment would go the same way.
class QuietStart {
 public:
  QuietStart() {
    std::fflush(stdout);
    saved_ = ::dup(STDOUT_FILENO);
    if (saved_ >= 0) ::dup2(STDERR_FILENO, STDOUT_FILENO);
  }
  ~QuietStart() {
    if (saved_ < 0) return;
    std::fflush(stdout);
    ::dup2(saved_, STDOUT_FILENO);
    ::close(saved_);
  }
  QuietStart(const QuietStart&) = delete;
  QuietStart& operator=(const QuietStart&) = delete;

 private:
  int saved_ = -1;
};

}  // namespace

filament::Engine* start_engine(filament::backend::Platform& platform) {
  const QuietStart quiet;
  filament::Engine* engine = filament::Engine::create(filament::Engine::Backend::OPENGL, &platform);
  if (!engine) throw std::runtime_error("no pictures: the graphics driver refused to start");
  return engine;
}

}  // namespace catgut
