// SPDX-License-Identifier: Apache-2.0
// render/video: see video.h. POSIX: the encoder is a child process that reads raw pixels from a pipe.
#include "render/video.h"

#include <fcntl.h>
#include <pthread.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <sstream>
#include <stdexcept>
#include <vector>

extern char** environ;

namespace catgut {
namespace {

// A write to a pipe whose reader has exited raises SIGPIPE, which would end the simulator. Blocked for this thread during the
// write; a pending signal is consumed, so that a host's own handling of the signal is unaffected.
bool write_all(int fd, const uint8_t* data, size_t size) {
  sigset_t pipe_signal, before, pending;
  sigemptyset(&pipe_signal);
  sigaddset(&pipe_signal, SIGPIPE);
  sigpending(&pending);
  const bool was_pending = sigismember(&pending, SIGPIPE) == 1;
  pthread_sigmask(SIG_BLOCK, &pipe_signal, &before);
  bool ok = true, broken = false;
  while (ok && size > 0) {
    const ssize_t n = ::write(fd, data, size);
    if (n > 0) data += n, size -= size_t(n);
    else if (n < 0 && errno == EINTR) continue;
    else ok = false, broken = errno == EPIPE;
  }
  if (broken && !was_pending) {
    const timespec now{0, 0};
    while (sigtimedwait(&pipe_signal, nullptr, &now) == -1 && errno == EINTR) {}
  }
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
  return ok;
}

bool on_path(const char* program) {
  const char* path = std::getenv("PATH");
  std::istringstream folders(path ? path : "/usr/bin:/bin");
  for (std::string folder; std::getline(folders, folder, ':');)
    if (::access((folder + "/" + program).c_str(), X_OK) == 0) return true;
  return false;
}

}  // namespace

bool video_available() { return on_path("ffmpeg"); }

struct VideoWriter::Pipe {
  std::string path;
  int width = 0, height = 0;
  int fd = -1;
  pid_t child = -1;

  int close_and_wait() {
    if (fd >= 0) ::close(fd);
    fd = -1;
    if (child < 0) return 0;
    int status = 0;
    while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {}
    child = -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128;
  }
};

VideoWriter::VideoWriter(const std::string& path, int width, int height, double frames_per_second)
    : pipe_(std::make_unique<Pipe>()) {
  if (width <= 0 || height <= 0 || width % 2 || height % 2)
    throw std::runtime_error(path + ": a video needs an even width and height, not " + std::to_string(width) + "x" +
                             std::to_string(height));
  if (!video_available())
    throw std::runtime_error(path + ": cannot write a video: the program ffmpeg is not installed (Debian: apt install ffmpeg)");
  pipe_->path = path;
  pipe_->width = width;
  pipe_->height = height;

  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0) throw std::runtime_error(path + ": cannot open a pipe: " + std::strerror(errno));
  const std::string size = std::to_string(width) + "x" + std::to_string(height);
  const std::string rate = std::to_string(frames_per_second);
  // A path that starts with '-' would be parsed as an option.
  const std::string target = path.starts_with('-') ? "./" + path : path;
  std::vector<std::string> words{"ffmpeg",   "-hide_banner", "-loglevel", "error",   "-nostdin",  "-y",         "-f",
                                 "rawvideo", "-pix_fmt",     "rgba",      "-s",      size,        "-r",         rate,
                                 "-i",       "pipe:0",       "-an",       "-c:v",    "libx264",   "-preset",    "veryfast",
                                 "-crf",     "20",           "-pix_fmt",  "yuv420p", "-movflags", "+faststart", target};
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, ends[0], STDIN_FILENO);
  const int failure = ::posix_spawnp(&pipe_->child, "ffmpeg", &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  ::close(ends[0]);
  pipe_->fd = ends[1];
  if (failure) {
    pipe_->child = -1;
    pipe_->close_and_wait();
    throw std::runtime_error(path + ": cannot start ffmpeg: " + std::strerror(failure));
  }
}

VideoWriter::~VideoWriter() { pipe_->close_and_wait(); }

void VideoWriter::add(const Image& frame) {
  if (pipe_->fd < 0) throw std::runtime_error(pipe_->path + ": the video is already finished");
  if (frame.width != pipe_->width || frame.height != pipe_->height)
    throw std::runtime_error(pipe_->path + ": a frame of another size than the video's");
  if (!write_all(pipe_->fd, frame.rgba.data(), frame.rgba.size())) {
    pipe_->close_and_wait();
    throw std::runtime_error(pipe_->path +
                             ": ffmpeg stopped before the video was done; does the folder exist, and is there room?");
  }
}

void VideoWriter::finish() {
  if (pipe_->fd < 0) return;
  if (const int code = pipe_->close_and_wait())
    throw std::runtime_error(pipe_->path + ": ffmpeg failed with code " + std::to_string(code) + " (its message is above)");
}

}  // namespace catgut
