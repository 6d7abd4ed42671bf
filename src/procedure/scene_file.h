// SPDX-License-Identifier: Apache-2.0
// procedure: scene files. A scene is a TOML file of the keys in scene_fields; whatever it leaves out keeps the default of
// sim/scene.h. Every fault is an InputError of one line that names file:line, the fault and the nearest right key.
#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "sim/scene.h"

namespace catgut {

// name_or_path: "purse_string" (from the scenes folder) or the path of a .toml file. Organ meshes with a relative path are
// sought beside the file first.
SceneSpec read_scene(const std::string& name_or_path);

// filename: for messages, and for the scene's name (its stem) when the text does not give one.
SceneSpec parse_scene(const std::string& text, const std::string& filename);

// The whole scene, every key resolved. parse_scene(write_scene(s)) equals s bit for bit.
std::string write_scene(const SceneSpec& scene);

// "solver.substeps=8", "title=dry run", "body[0].radius=0.02", "body.particles=1228" (every body), "expect.bites={min = 8}".
// "solver.preset=paper" sets every solver key, so what should differ from the preset comes after it.
// where: opens the message of a fault.
void set_value(SceneSpec& scene, const std::string& key_equals_value, const std::string& where = "--set");

// Sets the preset and all it implies; InputError naming the presets when there is none of that name.
void use_preset(SceneSpec& scene, std::string preset, const std::string& where = "--preset");

// CATGUT_SCENES in the environment, else the folder scenes of Catgut's data (core/data.h); empty: not found.
std::string scenes_folder();
std::vector<std::string> scene_names();  // of the files in it, sorted

bool same_scene(const SceneSpec& a, const SceneSpec& b);  // every key and every expectation, bit for bit

}  // namespace catgut
