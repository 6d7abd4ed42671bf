// SPDX-License-Identifier: Apache-2.0
// tests/xr: the scripted surgeon as the wearer: its tool poses become controller poses and triggers, which travel through the
// remote driver, the runtime and OpenXR's actions before they move an instrument.
#pragma once
#include <algorithm>
#include <array>
#include <memory>

#include "at_the_headset.h"
#include "procedure/scene_file.h"
#include "procedure/scripted_surgeon.h"
#include "sim/simulation.h"

namespace catgut {

class Sewing {
 public:
  explicit Sewing(const std::string& scene) : scene_(read_scene(scene)) {
    picture_ = picture_model(*build_model(scene_));
    surgeon_ = scripted_surgeon(scene_, picture_);
    dt_ = 1.0f / static_cast<float>(scene_.solver.tick_rate);
  }
  bool done() const { return surgeon_->done(); }
  std::string doing() const { return surgeon_->doing(); }

  // The controllers for the newest picture.
  void hold(const WindowLook& now, RemoteWearer& wearer) {
    const uint64_t passed = last_ == 0 ? 1 : now.seen.tick - last_;
    if (passed == 0) return;
    last_ = now.seen.tick;
    TickInput in;
    for (uint64_t i = 0; i < std::min<uint64_t>(passed, 12); ++i) in = surgeon_->operate(now.seen, dt_);
    const xr::Place& place = now.headset->place;
    for (size_t side = 0; side < 2; ++side) {
      const ToolInput& tool = in.hand[xr::tool_of(side, false)];
      RemoteHand& hand = wearer.hand[side];
      hand.pose = place.to_room(xr::grip_of_tool(tool.pose, false, place.loupe));
      hand.trigger = 1 - std::clamp(tool.jaw, 0.0f, 1.0f);
    }
  }

 private:
  SceneSpec scene_;
  PictureModel picture_;
  std::unique_ptr<Surgeon> surgeon_;
  float dt_ = 1.0f / 60;
  uint64_t last_ = 0;
};

}  // namespace catgut
