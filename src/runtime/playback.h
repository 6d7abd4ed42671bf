// SPDX-License-Identifier: Apache-2.0
// runtime: a recording to look at: played, held, and gone through in both directions, at any speed. On a thread of its own, as
// runtime/live is. It first looks through the whole recording as fast as it goes, in between what is shown: states are kept on
// the way, so that going back is quick, every tick's hash is compared with the recorded one, and what was sutured is gathered.
//
// One thread at a time calls a Playback's functions (the window's); none of them waits for the simulation, except the
// constructor and the destructor.
#pragma once
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
  uint64_t known = 0;  // ticks scanned so far; nothing later can be shown yet
  uint64_t at = 0;     // ticks played until what is shown
  uint64_t first = 0;  // tick of the start state: a recording may begin in the middle of the work
  double tick_s = 1.0 / 60;
  bool playing = false;
  float speed = 1;
  std::optional<uint64_t> differs_at;  // the first tick, from 1, after which the state was not the recorded one
  std::string fault;                   // not empty: the replay went no further, and why
  uint64_t gathered = 0;               // counts up when result() has more to say
};

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
  void go_to(uint64_t tick);             // 0 .. ticks, also while playing
  bool look(Snapshot& out);              // as Live::look
  const PlaybackStatus& status() const;  // as of the last look()
  LiveResult result() const;             // of what is known so far; its `recorded` is the recording's name

 private:
  struct Work;
  std::unique_ptr<Work> work_;
};

}  // namespace catgut
