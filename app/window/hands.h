// SPDX-License-Identifier: Apache-2.0
// app/window: combines mouse and gamepad input since the last frame into the published hands.
#pragma once
#include <array>

#include "device/gamepad.h"
#include "device/mouse.h"
#include "device/steer.h"
#include "window/input.h"
#include "window/settings.h"

namespace catgut {

struct WindowHands {
  Steering steering;
  MouseHand mouse;
  GamepadHand pad;
  size_t speed = 1;       // of kMouseSpeeds
  uint64_t moved_ns = 0;  // time of the newest motion

  void begin(const PictureModel& picture, const Settings& settings);
  // After a restart or an undone bite the hands continue from the present tool poses.
  void jumped(const PictureModel& picture, const Snapshot& seen, const Settings& settings, bool at_start);
  std::array<ToolInput, 2> move(const WindowInput& in, const Settings& settings, const ViewFrame& view,
                                const PictureModel& picture, const Snapshot& seen, float dt);
};

}  // namespace catgut
