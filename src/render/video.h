// SPDX-License-Identifier: Apache-2.0
// render/video: frames piped to the `ffmpeg` program. The program and not the library, so that Catgut links
// no encoder. Writes the file at `path` (H.264, yuv420p, so that every player shows it).
#pragma once
#include <memory>
#include <string>

#include "render/image.h"

namespace catgut {

bool video_available();  // whether the ffmpeg program can be started

class VideoWriter {
 public:
  // Throws std::runtime_error when ffmpeg is missing or cannot be started. Width and height must be even (yuv420p).
  VideoWriter(const std::string& path, int width, int height, double frames_per_second);
  ~VideoWriter();  // finishes the file; errors are ignored, call finish() to receive them
  VideoWriter(const VideoWriter&) = delete;
  VideoWriter& operator=(const VideoWriter&) = delete;

  void add(const Image& frame);  // throws when ffmpeg has exited; the program continues
  void finish();                 // closes the file; throws when ffmpeg reports a failure

 private:
  struct Pipe;
  std::unique_ptr<Pipe> pipe_;
};

}  // namespace catgut
