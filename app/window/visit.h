// SPDX-License-Identifier: Apache-2.0
// app/window: a scene from opening to closing, and a recording in the viewer: the running simulation and its data for the
// screens.
#pragma once
#include <cstdio>
#include <deque>
#include <functional>
#include <string>

#include "runtime/live.h"
#include "runtime/playback.h"
#include "window/panels.h"

namespace catgut {

// A user works, or the scripted surgeon is watched.
struct Visit {
  // events: receives all events, one JSON object per line; null: none. reported: receives them too, or is empty.
  // Throws InputError.
  Visit(const SceneSpec& scene, const LiveOptions& options, std::FILE* events, std::function<void(const Event&)> on_event);

  void look(double at_s = wall_seconds());  // Fetches the newest picture, as of that moment, and events.
  LiveResult finish();

  SceneSpec scene;  // with the parameters changed since
  Live live;
  bool watching;  // the user does not control the hands
  Snapshot seen;
  bool have = false;  // there is a picture
  std::deque<LogLine> log;
  std::deque<assess::Remark> remarks;  // newest last
  uint32_t epoch = 0;                  // at the last update

 private:
  void take_events();
  std::vector<Event> tip_;  // recent entries and exits
  uint32_t log_epoch_ = 0;
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
  LiveResult result;  // of the scanned part
  uint64_t gathered = 0;
};

// Recordings in the folder, and those of `also` elsewhere; newest first.
std::vector<std::string> recordings_in(const std::string& folder, const std::vector<std::string>& also);

}  // namespace catgut
