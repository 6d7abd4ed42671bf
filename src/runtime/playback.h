// SPDX-License-Identifier: Apache-2.0
// runtime: plays a recording: play, pause, seek in both directions, at any speed. On its own thread, like
// runtime/live. It first scans the whole recording as fast as possible, between displayed ticks. It stores keyframes for fast
// seeking, compares every tick's hash with the recorded one, and gathers the results.
//
// Only one thread (the window's) may call a Playback's functions; none waits for the simulation, except the
// constructor and the destructor.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "exchange/picture.h"
#include "exchange/snapshot.h"
#include "runtime/live.h"
#include "sim/recording.h"

namespace catgut {

struct PlaybackStatus {
  uint64_t ticks = 0;  // recorded
  uint64_t known = 0;  // ticks scanned so far; later ones cannot be shown yet
  uint64_t at = 0;     // ticks played up to the shown one
  uint64_t first = 0;  // tick of the start state: a recording may start in the middle of a procedure
  double tick_s = 1.0 / 60;
  bool playing = false;
  float speed = 1;
  std::optional<uint64_t> differs_at;  // the first tick, from 1, whose state differs from the recording
  std::string fault;                   // not empty: the replay has stopped, and why
  uint64_t gathered = 0;               // counts updates of result()
};

// Ticks to play up to a time of the session [s], as its clock shows it: a recording may start in the middle.
inline uint64_t ticks_to(const PlaybackStatus& s, double time_s) {
  const double ticks = time_s / s.tick_s - static_cast<double>(s.first);
  return static_cast<uint64_t>(std::llround(std::clamp(ticks, 0.0, static_cast<double>(s.ticks))));
}

class Playback {
 public:
  // Throws InputError (another layout of the state, a scene that cannot be built). name: for messages.
  Playback(const Recording& recording, const std::string& name);
  ~Playback();
  Playback(const Playback&) = delete;
  Playback& operator=(const Playback&) = delete;

  const SceneSpec& scene() const;
  const PictureModel& picture() const;

  void play(bool on);
  void speed(float of_real_time);        // 0.05 .. 16
  void go_to(uint64_t tick);             // 0 .. ticks, also during play
  bool look(Snapshot& out);              // like Live::look
  const PlaybackStatus& status() const;  // as of the last look()
  // The head of the wearer at the shown tick [m, world]; null: none was recorded.
  const Pose* head() const;
  LiveResult result() const;  // of the scanned part; its `recorded` is the recording's name

 private:
  struct Work;
  std::unique_ptr<Work> work_;
};

}  // namespace catgut
