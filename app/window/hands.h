// SPDX-License-Identifier: Apache-2.0
// app/window: combines mouse and gamepad input since the last frame into orders for the hands. The physics thread steers by
// them, tick by tick (device/paced_hands), and returns where the hands are.
#pragma once
#include <array>
#include <functional>
#include <memory>

#include "device/gamepad.h"
#include "device/mouse.h"
#include "device/paced_hands.h"
#include "device/steer.h"
#include "runtime/live.h"
#include "window/input.h"
#include "window/settings.h"

namespace catgut {

class WindowHands {
 public:
  Steering steering;  // as of the newest tick, with the jaws as the user wants them
  MouseHand mouse;
  GamepadHand pad;
  size_t speed = 1;       // of kMouseSpeeds
  uint64_t moved_ns = 0;  // time of the newest motion

  // A session begins; the result is its LiveOptions::hands.
  std::function<std::array<ToolInput, 2>(const HandsMoment&)> begin(const SceneSpec& scene, const Settings& settings);
  void jumped() { mouse.was_down = false; }  // the tools are elsewhere: a restart, an undone bite
  // elsewhere: hands that another device moves. epoch: of the newest status.
  void move(const WindowInput& in, const Settings& settings, const ViewFrame& view, const Snapshot& seen,
            std::array<bool, 2> elsewhere, float dt, uint32_t epoch);

 private:
  struct Link;
  std::shared_ptr<Link> link_;
  std::array<bool, 2> closed_{};
  std::array<float, 2> opening_{1, 1};
  std::array<uint32_t, 2> buttons_{};  // of the last order
  std::array<bool, 2> elsewhere_{};
  bool known_ = false;  // that was adopted from the tools, of
  uint32_t epoch_ = 0;
  double seen_s_ = 0;  // [s] simulated, of the Snapshot before
};

}  // namespace catgut
