// SPDX-License-Identifier: Apache-2.0
// app/window: see hands.h.
#include "window/hands.h"

namespace catgut {

void WindowHands::begin(const PictureModel& picture, const Settings& settings) {
  steering = start_steering(picture, settings.left_handed);
  mouse = {};
  pad = {};
}

void WindowHands::jumped(const PictureModel& picture, const Snapshot& seen, const Settings& settings, bool at_start) {
  if (at_start) steering = start_steering(picture, settings.left_handed);
  else resume_steering(steering, seen);
  mouse.was_down = false;
}

std::array<ToolInput, 2> WindowHands::move(const WindowInput& in, const Settings& settings, const ViewFrame& view,
                                           const PictureModel& picture, const Snapshot& seen, float dt) {
  steering.assist = settings.assist && settings.guidance != Guidance::exam;
  mouse.hold_to_close = settings.hold_to_close;
  if (in.speed >= 0) speed = static_cast<size_t>(in.speed);
  mouse.speed = kMouseSpeeds[speed] * settings.mouse_speed;
  std::array<HandMotion, 2> motion = mouse_motion(mouse, steering, in.mouse, view, dt);
  if (in.has_pad) {
    pad.left_handed = settings.left_handed;
    const std::array<HandMotion, 2> more = gamepad_motion(pad, steering, in.pad, dt);
    for (size_t k = 0; k < 2; ++k) {
      HandMotion &m = motion[k], n = more[k];
      m = {m.right + n.right, m.up + n.up,     m.ahead + n.ahead,        m.drive + n.drive, m.yaw + n.yaw,
           m.pitch + n.pitch, m.roll + n.roll, m.together || n.together, m.both + n.both};
    }
  } else {
    pad.trigger = {};  // after reconnection, triggers are ignored until they move: held objects stay held
  }
  if (in.moved_ns) moved_ns = in.moved_ns;
  return steer(steering, motion, view, picture, seen, dt, moved_ns);
}

}  // namespace catgut
