// SPDX-License-Identifier: Apache-2.0
// runtime: who holds the tools in a run: the scripted surgeon, no one, or the hands of a recording.
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
  bool settles = true;               // false: a recording brings its own settling time along
};

// Physics under hands at a mouse or gamepad. They do not feel where their tools touch and push on: from this on tools slip past
// each other, instead of being pushed aside from where their hands want them.
constexpr float kUnfeltToolForce = 1.5f;  // [N]
void prepare_for_mouse(SceneSpec& scene);

// who: "scripted", "none" or the path of a .cgrec file. Throws InputError.
Hands make_hands(const std::string& who, const SceneSpec& scene, const PictureModel& picture);

}  // namespace catgut
