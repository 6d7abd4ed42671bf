// SPDX-License-Identifier: Apache-2.0
// tests/assess: studies: plans, the table, resumption, division; abilities of scripted surgeons.
#include "runtime/study.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>

#include "core/check.h"
#include "procedure/ability.h"
#include "procedure/scene_file.h"

namespace catgut {
namespace {
namespace fs = std::filesystem;

std::string fault_of(const std::string& text) {
  try {
    parse_study(text, "my.toml");
  } catch (const InputError& e) { return e.what(); }
  return "";
}

struct Folder {
  std::string path = (fs::temp_directory_path() / ("catgut_study_" + std::to_string(::getpid()))).string();
  Folder() { fs::remove_all(path); }
  ~Folder() { fs::remove_all(path); }
};

const char* const kShort =
    "scenes = [\"stay\"]\nsurgeons = [\"scripted:novice\", \"scripted:expert\"]\nseeds = [1, 2]\nseconds = 1.5\n";

TEST(Study, bad_plans_are_one_line) {
  EXPECT_EQ(fault_of(kShort), "");
  EXPECT_EQ(fault_of("surgeons = [\"none\"]\n"), "my.toml: the study has no scenes; add scenes = [\"stay\"]");
  EXPECT_EQ(fault_of(std::string(kShort) + "seed = [1, 2]\n"),
            "my.toml:5: a study has no key \"seed\"; did you mean \"seeds\"?");
  EXPECT_NE(fault_of("scenes = [\"stai\"]\nsurgeons = [\"none\"]\n").find("stai"), std::string::npos);
  EXPECT_NE(fault_of("scenes = [\"stay\"]\nsurgeons = [\"scripted:expart\"]\n").find("did you mean \"expert\"?"),
            std::string::npos);
  EXPECT_NE(fault_of("scenes = [\"stay\"]\nsurgeons = [\"none\"]\nseeds = [4, 2]\n").find("my.toml:3"), std::string::npos);
  EXPECT_NE(fault_of("scenes = [\"stay\"]\nsurgeons = [\"none\"]\n[[setting]]\nset = [\"solver.substep=3\"]\n").find("substep"),
            std::string::npos);
}

TEST(Study, runs_are_divided_resumed_and_repeated_to_the_bit) {
  const Folder folder;
  const StudyPlan plan = parse_study(kShort, "short.toml");
  ASSERT_EQ(runs_of(plan).size(), 4u);
  StudyOptions o;
  o.folder = folder.path;
  o.of = 2, o.index = 1;  // as the second of two machines
  StudyOutcome first = make_runs(plan, o);
  EXPECT_EQ(first.made, 2u);
  EXPECT_EQ(first.missing, 2u);
  o.of = 1, o.index = 0, o.jobs = 2;
  const StudyOutcome rest = make_runs(plan, o);
  EXPECT_EQ(rest.made, 2u);
  EXPECT_EQ(rest.kept, 2u);
  EXPECT_EQ(rest.missing, 0u);
  EXPECT_TRUE(rest.failed.empty());
  const std::string table = study_table(plan, folder.path);
  EXPECT_EQ(std::count(table.begin(), table.end(), '\n'), 5);
  EXPECT_EQ(make_runs(plan, o).made, 0u);
  // A file that a crash left behind, and one of other inputs.
  std::ofstream(folder.path + "/run_000001.csv") << "half a li";
  StudyPlan longer = plan;
  EXPECT_EQ(make_runs(longer, o).made, 1u);
  EXPECT_EQ(study_table(plan, folder.path), table);
  longer.seconds = 1.6;
  EXPECT_EQ(make_runs(longer, o).made, 4u);
}

TEST(Study, the_studies_of_the_pages_are_valid) {
  const std::string folder = CATGUT_SOURCE_DIR "/studies/";
  EXPECT_EQ(runs_of(read_study(folder + "levels.toml")).size(), 480u);
  EXPECT_EQ(runs_of(read_study(folder + "cohort.toml")).size(), 1200u);
}

// A cohort: seeds are trainees, settings are sessions.
TEST(Study, practice_leads_from_the_drawn_abilities_to_those_of_an_expert) {
  std::string text = "scenes = [\"stay\"]\nsurgeons = [\"scripted:novice\"]\nseeds = [1, 2]\nseconds = 6\n";
  for (const char* share : {"0.0", "1.0"})
    text += std::string("[[setting]]\nname = \"") + share + "\"\npractice = " + share + "\n";
  const StudyPlan plan = parse_study(text, "cohort.toml");
  EXPECT_NE(fault_of(text + "[[setting]]\npractice = 2\n").find("practice is not a share"), std::string::npos);
  const Folder folder;
  StudyOptions o;
  o.folder = folder.path;
  EXPECT_EQ(make_runs(plan, o).made, 4u);
  std::istringstream table(study_table(plan, folder.path));
  std::vector<double> tremor[2];
  size_t column = 0, row = 0;
  for (std::string line; std::getline(table, line); ++row) {
    std::vector<std::string> cell{""};
    for (const char c : line) c == ',' ? cell.emplace_back() : (cell.back() += c, cell.back());
    if (row == 0) column = static_cast<size_t>(std::find(cell.begin(), cell.end(), "tremor") - cell.begin());
    else tremor[cell[2] == "1.0"].push_back(std::stod(cell[column]));
  }
  ASSERT_EQ(tremor[0].size(), 2u);
  ASSERT_EQ(tremor[1].size(), 2u);
  // A novice's hand trembles four times as much as an expert's.
  for (size_t k = 0; k < 2; ++k) EXPECT_GT(tremor[0][k], 1.5 * tremor[1][k]) << k;
  EXPECT_NE(tremor[0][0], tremor[0][1]);
}

TEST(Study, area_under_the_curve) {
  EXPECT_DOUBLE_EQ(area_under_curve({1, 2, 3}, {4, 5}), 1);
  EXPECT_DOUBLE_EQ(area_under_curve({4, 5}, {1, 2, 3}), 0);
  EXPECT_DOUBLE_EQ(area_under_curve({1, 1}, {1, 1}), 0.5);
  // Hanley and McNeil's counting: 1 wins 3 of 3, 4 wins 1 of 3, and one tie.
  EXPECT_DOUBLE_EQ(area_under_curve({1, 4}, {2, 4, 5}), (3 + 1 + 0.5) / 6);
  EXPECT_TRUE(std::isnan(area_under_curve({}, {1})));
  EXPECT_DOUBLE_EQ(area_under_curve({1, std::nan("")}, {2}), 1);
}

TEST(Ability, levels_are_drawn_from_their_means_and_spreads) {
  SceneSpec scene = read_scene("stay");
  const SceneSpec plain = scene;
  EXPECT_EQ(apply_ability(scene, "scripted"), "scripted");
  EXPECT_TRUE(same_scene(scene, plain));
  EXPECT_THROW(apply_ability(scene, "scripted:master"), InputError);
  for (const AbilityRow& row : abilities()) {
    double sum = 0, squares = 0;
    constexpr int kMany = 4000;
    for (int k = 0; k < kMany; ++k) {
      scene.seed = static_cast<uint64_t>(k);
      EXPECT_EQ(apply_ability(scene, "scripted:novice"), "scripted");
      const double v = static_cast<double>(scene.surgeon.*row.member) / static_cast<double>(row.novice);
      sum += v, squares += v * v;
    }
    const double mean = sum / kMany, spread = std::sqrt(squares / kMany - mean * mean);
    EXPECT_NEAR(mean, 1, 0.03) << row.key;
    EXPECT_NEAR(spread / static_cast<double>(row.spread), 1, 0.12) << row.key;
  }
  // The same surgeon twice, another one with another seed; all of it in the scene that a recording keeps.
  SceneSpec a = plain, b = plain;
  apply_ability(a, "scripted:expert"), apply_ability(b, "scripted:expert");
  EXPECT_TRUE(same_scene(a, b));
  b = plain, b.seed = 9;
  apply_ability(b, "scripted:expert");
  EXPECT_NE(a.surgeon.tremor, b.surgeon.tremor);
  EXPECT_EQ(parse_scene(write_scene(a), "a.toml").surgeon.pause, a.surgeon.pause);
}

}  // namespace
}  // namespace catgut
