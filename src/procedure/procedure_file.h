// SPDX-License-Identifier: Apache-2.0
// procedure: reads procedures/NAME.toml. Every error is an InputError of one line that names file:line, the error and the most
// similar valid word.
#pragma once
#include <array>
#include <string>
#include <vector>

#include "exchange/picture.h"
#include "procedure/procedure.h"
#include "sim/scene.h"

namespace catgut {

// The lessons of the start screen, in their order. T, and catgut play --teach, open the first.
inline constexpr std::array<const char*, 2> kLessons{"simple_suture", "first_stitch"};
inline constexpr const char* kFirstLesson = kLessons[0];

// name_or_path: "stay" (from the procedures folder) or the path of a .toml file. Its scene is checked too.
Procedure read_procedure(const std::string& name_or_path);
Procedure parse_procedure(const std::string& text, const std::string& filename);
SceneSpec scene_of(const Procedure& procedure);

// CATGUT_PROCEDURES in the environment, else the folder procedures of Catgut's data (core/data.h); empty: not found.
std::string procedures_folder();
std::vector<std::string> procedure_names();

// Index of a stage by its name, or by its number from 1. Throws InputError with `option` as the place.
size_t find_stage(const Procedure& procedure, const std::string& name, const std::string& option);

// The tasks of the scene's surgeon that demonstrate a stage. Throws InputError where the plan has no such task.
std::vector<size_t> demo_tasks(const Procedure& procedure, size_t stage, const SceneSpec& scene, const PictureModel& picture);

}  // namespace catgut
