// SPDX-License-Identifier: Apache-2.0
// app/xr: fade of the picture around a change of the wearer's place. Pure. The place changes only in a black frame, so that the
// wearer never sees the room jump.
#pragma once
#include <algorithm>

namespace catgut::xr {

constexpr float kFadeOut = 0.15f, kFadeIn = 0.35f;  // [s]

struct Fade {
  float brightness = 0;  // 0 black .. 1; a session starts black
  bool leaving = false;  // toward black

  void out() { leaving = true; }
  void cut() { brightness = 0, leaving = false; }  // the runtime has moved the room already
  // Once per frame. True: this frame is black, and what out() was called for may be done.
  bool step(float dt) {
    if (!leaving) {
      brightness = std::min(1.0f, brightness + dt / kFadeIn);
      return false;
    }
    brightness -= dt / kFadeOut;
    if (brightness > 0) return false;
    cut();
    return true;
  }
};

}  // namespace catgut::xr
