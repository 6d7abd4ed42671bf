// SPDX-License-Identifier: Apache-2.0
// tests/technique: the table of techniques is the one place that knows their names.
#include <gtest/gtest.h>

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

}  // namespace
}  // namespace catgut
