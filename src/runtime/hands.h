// SPDX-License-Identifier: Apache-2.0
// runtime: the source of hands in a run: the scripted surgeon, none, or a recording.
#pragma once
#include <memory>
#include <string>

#include "exchange/picture.h"
#include "procedure/scripted_surgeon.h"
#include "sim/scene.h"
#include "surgeon/surgeon.h"

namespace catgut {

struct Hands {
  std::unique_ptr<Surgeon> surgeon;  // null: no hands
  bool settles = true;               // false: a recording includes its own settling time
};

// Physics for hands with mouse or gamepad. Without force feedback they push on after contact, so tools slip past each other
// instead of being displaced from the hands.
constexpr float kUnfeltToolForce = 1.5f;  // [N]
void prepare_for_mouse(SceneSpec& scene);

// who: "scripted", "none" or the path of a .cgrec file. Throws InputError.
Hands make_hands(const std::string& who, const SceneSpec& scene, const PictureModel& picture);

}  // namespace catgut
