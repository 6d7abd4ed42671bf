// SPDX-License-Identifier: Apache-2.0
// app/xr: a headset by OpenXR 1.0: session, views, images, controllers. Reads the runtime; writes what the wearer did and draws
// through an EyeRenderer. It holds no simulation: a lost session, a runtime that quits or a headset that is taken off changes
// only what this class reports.
//
// All functions on the thread of the window. Only wait() blocks, until the runtime wants the next frame.
#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "render/eyes.h"
#include "xr/space_hands.h"
#include "xr/vibration.h"

namespace catgut::xr {

enum class HeadsetState : uint8_t {
  off,           // no session: not started, or lost; see Headset::poll
  idle,          // a session that does not run: the headset is not worn, or another program has it
  synchronized,  // runs, not shown
  visible,       // shown, without input
  focused,       // shown, with input
};
const char* headset_state_name(HeadsetState state);

// Whether a runtime is installed and active on this machine, by the files that OpenXR's loader reads. Loads nothing.
bool headset_offered();

struct HeadsetOptions {
  std::string font;                                // of the board
  bool whole_resolution = false;                   // never less than the recommended size: for pictures
  std::function<void(const std::string&)> report;  // one line per change; empty: dropped
};

struct HeadsetFrame {
  bool render = false;      // the runtime shows a picture of this frame
  uint64_t shown_ns = 0;    // predicted display time and
  uint64_t period_ns = 0;   // frame period, on wall_ns() of runtime/live
  bool recentered = false;  // the runtime moved its reference space
  bool posed = false;       // head and eyes are valid; they stay at their last values otherwise
  Pose head;                // room
  std::array<Pose, 2> eye;  // room, left and right
  std::array<Frustum, 2> frustum;
  std::array<HandState, 2> hand;       // left, right
  std::array<std::string, 2> profile;  // interaction profile of each hand, empty: none
};

struct HeadsetCounts {
  uint64_t frames = 0;    // given to the runtime
  uint64_t late = 0;      // of them later than their predicted display time, or with a period left out before them
  uint64_t sessions = 0;  // created so far
  float resolution = 1;   // part of the recommended size in each direction
  float work_ms = 0;      // recent time from wait()'s return to the end of the frame
  float lead_ms = 0;      // recent time from wait()'s return to the predicted display time
};

class Headset {
 public:
  // Connects to the runtime of this machine. Never throws: without a runtime or a headset the reason is reported in one line,
  // and state() stays off.
  explicit Headset(const HeadsetOptions& options);
  ~Headset();
  Headset(const Headset&) = delete;
  Headset& operator=(const Headset&) = delete;

  // Handles the runtime's events; looks again for a lost headset every second. True: frames are due, call wait().
  bool poll();
  HeadsetState state() const;
  bool failed() const;  // there was no runtime, or no headset, from the start

  EyeRenderer* renderer();  // null while there is none; a new one after the runtime was restarted

  // Starts the next frame. False: there is none now.
  bool wait(HeadsetFrame& frame);
  // Draws and submits the frame: cameras, images and size are filled in here. Call once after every wait() that returned true.
  // world: from the room. work: [m] distance of the work from the eyes.
  void submit(const HeadsetFrame& frame, EyeRenderer::Frame picture, const Place& place, float work);

  void vibrate(size_t side, const Vibration& vibration);
  void leave();  // asks the runtime to end the session
  const HeadsetCounts& counts() const;

 private:
  struct Work;
  std::unique_ptr<Work> work_;
};

}  // namespace catgut::xr
