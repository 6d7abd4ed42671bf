// SPDX-License-Identifier: Apache-2.0
// app/window: a scene from its opening to its end, and a recording that is looked at: what runs, and what of it the screens
// show.
#pragma once
#include <cstdio>
#include <deque>
#include <functional>
#include <string>

#include "runtime/live.h"
#include "runtime/playback.h"
#include "window/panels.h"

namespace catgut {

// A user works, or a surgeon is watched.
struct Visit {
  // events: everything that happens is written there, a JSON object a line; null: nowhere. reported: hears it too, or is empty.
  // Throws InputError.
  Visit(const SceneSpec& scene, const LiveOptions& options, std::FILE* events, std::function<void(const Event&)> on_event);

  void look();  // at the newest picture and what has happened
  LiveResult finish();

  SceneSpec scene;  // with the parameters that were changed since
  Live live;
  bool watching;  // the hands are not the user's
  Snapshot seen;
  bool have = false;  // there is a picture
  std::deque<LogLine> log;
  uint32_t epoch = 0;  // as last looked at

 private:
  void take_events();
  std::FILE* events_;
  std::function<void(const Event&)> on_event_;
};

// A recording. Throws InputError.
struct Viewing {
  explicit Viewing(const std::string& path);
  Viewing(const std::string& path, const Recording& recording);

  void look();
  void go_by(int64_t ticks);
  void change_speed(bool faster);

  std::string file, version, cut;
  Playback playback;
  Snapshot seen;
  bool have = false;
  LiveResult result;  // of what is known so far
  uint64_t gathered = 0;
};

// Recordings in the folder, and those of `also` that are elsewhere; newest first.
std::vector<std::string> recordings_in(const std::string& folder, const std::vector<std::string>& also);

}  // namespace catgut
