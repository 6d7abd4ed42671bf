// SPDX-License-Identifier: Apache-2.0
// procedure: scene files. A scene is a TOML file of the keys in scene_fields; keys left out keep the defaults of
// sim/scene.h. Every error is an InputError of one line that names file:line, the error and the most similar valid key.
#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "sim/scene.h"

namespace catgut {

// name_or_path: "purse_string" (from the scenes folder) or the path of a .toml file. Organ meshes with a relative path are
// first searched beside the file.
SceneSpec read_scene(const std::string& name_or_path);

// filename: for messages, and for the scene's name (its stem) if the text does not give one.
SceneSpec parse_scene(const std::string& text, const std::string& filename);

// The whole scene, every key resolved. parse_scene(write_scene(s)) equals s bit for bit.
std::string write_scene(const SceneSpec& scene);

// "solver.substeps=8", "title=dry run", "body[0].radius=0.02", "body.particles=1228" (every body), "expect.bites={min = 8}".
// "solver.preset=paper" sets every solver key, so deviations from the preset must follow it.
// where: opens the error message.
void set_value(SceneSpec& scene, const std::string& key_equals_value, const std::string& where = "--set");

// Sets the preset and all that it implies; InputError naming the presets if it is unknown.
void use_preset(SceneSpec& scene, std::string preset, const std::string& where = "--preset");

// CATGUT_SCENES in the environment, else the folder scenes of Catgut's data (core/data.h); empty: not found.
std::string scenes_folder();
std::vector<std::string> scene_names();  // of the files in that folder, sorted

bool same_scene(const SceneSpec& a, const SceneSpec& b);  // every key and every expectation, bit for bit

}  // namespace catgut
