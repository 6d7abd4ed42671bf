// SPDX-License-Identifier: Apache-2.0
// procedure: the scripted surgeon of a scene: its [surgeon] and [technique] tables as skill and plan.
#pragma once
#include <memory>

#include "exchange/picture.h"
#include "sim/scene.h"
#include "surgeon/surgeon.h"

namespace catgut {

SurgeonSkill skill_of(const SceneSpec& scene);
std::string plan_of(const SceneSpec& scene);  // surgeon.plan, else that of the technique; "": none

// Throws InputError when the scene has no technique, or one without a script.
std::unique_ptr<Surgeon> scripted_surgeon(const SceneSpec& scene, const PictureModel& picture);

}  // namespace catgut
