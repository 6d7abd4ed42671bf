// SPDX-License-Identifier: Apache-2.0
// tests/technique: the table of techniques is the one place that knows their names.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <set>
#include <string>

#include "core/check.h"
#include "procedure/scene_file.h"
#include "sim/simulation.h"
#include "technique/technique.h"

namespace catgut {
namespace {

TEST(TechniqueTable, every_name_finds_its_row_and_no_other_does) {
  std::set<std::string> names;
  std::string choices;
  for (const TechniqueRow* row : techniques()) {
    EXPECT_EQ(find_technique(row->name), row);
    EXPECT_TRUE(names.insert(row->name).second) << row->name << " is there twice";
    choices += std::string(row->name) + "|";
  }
  EXPECT_EQ(names.size(), 4u);
  EXPECT_EQ(find_technique("none"), nullptr);
  EXPECT_EQ(find_technique("purse"), nullptr);
  EXPECT_EQ(technique_choices(), choices + "none");
}

TEST(TechniqueTable, a_scene_without_the_rims_that_a_technique_needs_is_refused_with_its_message) {
  for (const TechniqueRow* row : techniques()) {
    SceneSpec scene = read_scene("purse_string");  // one body with one open rim
    scene.technique.name = row->name;
    if (row->walls < 2) {
      EXPECT_NO_THROW(build_model(scene));
      continue;
    }
    try {
      build_model(scene);
      ADD_FAILURE() << row->name;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(row->missing), std::string::npos) << error.what();
    }
  }
}

// A technique of the host program: scenes may name it, the build refuses what it refuses, its memory is saved. What it does is
// in samples/06_own_technique.cpp.
TEST(TechniqueTable, a_registered_technique_is_one_like_the_others) {
  static TechniqueRow own = kStay;
  own.name = "own_stitch", own.walls = 1;
  own.begin = [](const TechniqueSetup&, TechniqueModel& model) { model.own = std::make_shared<const int>(7); };
  own.tick = [](const TechniqueModel& model, TechniqueState& state, const TechniqueView&, ClosurePlan&, EventList&) {
    state.own.index.assign(1, static_cast<uint32_t>(*static_cast<const int*>(model.own.get())));
    state.own.value.push_back(0.5f);
  };
  own.fits = [](const TechniqueState& state, size_t, size_t) { return state.own.index.size() < 2; };
  const std::string scene_text = "[[body]]\n[technique]\nname = \"own_stitch\"\n";
  EXPECT_THROW(parse_scene(scene_text, "s.toml"), InputError) << "unknown until it is registered";
  register_technique(own);
  EXPECT_THROW(register_technique(own), std::invalid_argument) << "once";
  EXPECT_THROW(register_technique(kStay), std::invalid_argument) << "a name that is taken";
  const SceneSpec scene = parse_scene(scene_text, "s.toml");
  const auto model = build_model(scene);
  const auto state = initial_state(*model), other = initial_state(*model);
  Jobs jobs(1);
  TickInput input;
  input.hand = no_hands();
  for (; input.tick < 3; ++input.tick) step(*model, *state, input, jobs);
  load_state(*model, *other, save_state(*model, *state));
  EXPECT_EQ(hash_state(*model, *other), hash_state(*model, *state));
  step(*model, *state, input, jobs), step(*model, *other, input, jobs);
  EXPECT_EQ(hash_state(*model, *other), hash_state(*model, *state)) << "it goes on from its memory";
}

// No source outside the table compares a technique's name.
TEST(TechniqueTable, names_are_compared_nowhere_else) {
  namespace fs = std::filesystem;
  for (const char* folder : {"src", "app"})
    for (const auto& entry : fs::recursive_directory_iterator(fs::path(CATGUT_SOURCE_DIR) / folder)) {
      const std::string ext = entry.path().extension().string();
      if (ext != ".h" && ext != ".cpp") continue;
      std::ifstream in(entry.path());
      int number = 0;
      for (std::string line; std::getline(in, line);) {
        ++number;
        for (const TechniqueRow* row : techniques())
          for (const char* how : {"== \"", "!= \"", "compare(\""})
            EXPECT_EQ(line.find(how + std::string(row->name) + "\""), std::string::npos) << entry.path() << ":" << number;
      }
    }
}

}  // namespace
}  // namespace catgut
