// SPDX-License-Identifier: Apache-2.0
// app/xr: what a controller's vibration reports. Pure. A controller renders no force: short pulses mark moments that a surgeon
// feels, and a pulse train marks a strand that is about to slip from the jaws.
#pragma once
#include <array>
#include <span>

#include "exchange/event.h"
#include "exchange/picture.h"
#include "exchange/snapshot.h"

namespace catgut::xr {

struct Vibration {
  float amplitude = 0;     // 0..1; 0: none
  float seconds = 0;       // [s]
  float frequency_hz = 0;  // [Hz], 0: the controller's own
  const char* why = "";    // "puncture", "contact", "throw", "thread", for logs
};

struct VibrationState {
  std::array<bool, 2> touching{};
  std::array<float, 2> since_thread{1, 1};  // [s] since the last pulse for a tight thread
};

// Per tool. events: since the last call. dt: [s]. When several apply, the strongest.
std::array<Vibration, 2> vibration(VibrationState& state, std::span<const Event> events, const Snapshot& seen,
                                   const PictureModel& picture, float dt);

}  // namespace catgut::xr
