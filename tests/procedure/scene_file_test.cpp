// SPDX-License-Identifier: Apache-2.0
// tests/procedure: every key of the table passes through the reader, the writer and --set, and every error names its place.
#include "procedure/scene_file.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>

#include "core/check.h"
#include "core/random.h"
#include "procedure/scene_fields.h"
#include "sim/simulation.h"

namespace catgut {
namespace {

std::string fault(const std::string& text) {
  try {
    parse_scene(text, "lembert.toml");
  } catch (const InputError& error) {
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
    return error.what();
  }
  return "no fault";
}

std::string set_fault(const std::string& setting) {
  SceneSpec scene;
  scene.body.resize(2);
  try {
    set_value(scene, setting);
  } catch (const InputError& error) { return error.what(); }
  return "no fault";
}

// Some value in the field's range that is unlikely to be its default.
void randomise(const Field& f, FieldRef ref, Random& random) {
  const double low = f.min, high = std::min(f.max, 1e6);
  const auto number = [&] { return static_cast<float>(low + (high - low) * (0.001 + 0.998 * random.uniform())); };
  if (auto* v = std::get_if<std::string*>(&ref))
    **v = f.choices ? f.choices.text().substr(0, f.choices.text().find('|'))
                    : "a \"b\" \\ \n\t\x01 é " + std::to_string(random.next());
  if (auto* v = std::get_if<int*>(&ref)) **v = static_cast<int>(std::ceil(number()));
  if (auto* v = std::get_if<uint64_t*>(&ref)) **v = static_cast<uint64_t>(random.next()) << 30;
  if (auto* v = std::get_if<float*>(&ref)) **v = number();
  if (auto* v = std::get_if<bool*>(&ref)) **v = !**v;
  if (auto* v = std::get_if<Vec3*>(&ref)) **v = {number(), number(), number()};
}

TEST(SceneFile, every_key_survives_writing_and_reading) {
  for (uint64_t seed = 0; seed < 50; ++seed) {
    Random random(seed);
    SceneSpec scene;
    scene.body.resize(seed % 4);
    scene.instrument.resize(seed % 3);
    scene.suture.resize(seed % 3);
    for (const Field& f : scene_fields()) {
      if (std::string(f.key) == "preset") continue;
      for (size_t b = 0; b < rows_of(scene, f.section); ++b) randomise(f, f.at(scene, b), random);
    }
    scene.expect.push_back({"bites", 10, 1e300});
    scene.expect.push_back({"opening_ratio", -1e300, 0.1 + 1e-17 * static_cast<double>(seed)});
    scene.expect.push_back({"particles", 1403, 1403});
    scene.expect.push_back({"order_errors", -1.0 / 3, 2e-300});
    const std::string text = write_scene(scene);
    const SceneSpec again = parse_scene(text, "other.toml");
    ASSERT_TRUE(same_scene(scene, again)) << text;
    ASSERT_EQ(text, write_scene(again));
  }
}

TEST(SceneFile, hard_floats_survive) {
  for (const float value : {0.1f, 0.02f, 1e-6f, 1.1754944e-38f, 0.33333334f, 0.99999994f, 16777217.0f, 1e-7f, 0.0f}) {
    SceneSpec scene;
    scene.thread.stretch_compliance = std::min(value, 1.0f);
    scene.solver.bend_compliance = value;
    const SceneSpec again = parse_scene(write_scene(scene), "s.toml");
    EXPECT_EQ(again.solver.bend_compliance, value);
    EXPECT_EQ(again.thread.stretch_compliance, scene.thread.stretch_compliance);
  }
}

TEST(SceneFile, every_default_lies_in_its_range) {
  SceneSpec scene;
  scene.body.resize(1);
  scene.instrument.resize(1);
  scene.suture.resize(1);
  for (const Field& f : scene_fields()) {
    const std::string text = default_text(f);
    std::string key = full_key(f);
    EXPECT_NO_THROW(set_value(scene, key + "=" + text)) << key << " = " << text;
    EXPECT_FALSE(std::string(f.meaning).empty()) << key;
  }
}

TEST(SceneFile, what_is_left_out_keeps_its_default) {
  const SceneSpec scene = parse_scene("[[body]]\nradius = 0.03\n", "dir/tube.toml");
  EXPECT_EQ(scene.name, "tube");
  ASSERT_EQ(scene.body.size(), 1u);
  EXPECT_EQ(scene.body[0].radius, 0.03f);
  EXPECT_EQ(scene.body[0].particles, BodySpec{}.particles);
  EXPECT_EQ(scene.solver.substeps, SolverSpec{}.substeps);
  EXPECT_TRUE(scene.expect.empty());
}

TEST(SceneFile, faults_name_file_line_and_the_nearest_key) {
  EXPECT_EQ(fault("\n\n[solver]\nsubstep = 8\n"), "lembert.toml:4: solver has no key \"substep\"; did you mean \"substeps\"?");
  EXPECT_EQ(fault("tilte = 'x'"), "lembert.toml:1: a scene has no key \"tilte\"; did you mean \"title\"?");
  EXPECT_EQ(fault("[solvr]\n"), "lembert.toml:1: a scene has no key \"solvr\"; did you mean \"solver\"?");
  EXPECT_EQ(fault("[[body]]\nparticles = 5\n[[body]]\nparticles = -5\n"),
            "lembert.toml:4: body[].particles = -5 is out of range; it is a whole number, 1..200000");
  EXPECT_EQ(fault("[thread]\nspacing = 'wide'"),
            "lembert.toml:2: thread.spacing cannot be the text \"wide\"; it is a number, 0.0001..0.1 [m]");
  EXPECT_EQ(fault("[thread]\nparticles = 1.5"),
            "lembert.toml:2: thread.particles cannot be 1.5; it is a whole number, 2..10000");
  EXPECT_EQ(fault("[solver]\nvolume = 1"), "lembert.toml:2: solver.volume cannot be 1; it is a flag, true or false");
  EXPECT_EQ(fault("[solver]\ngravity = [0, 1]"),
            "lembert.toml:2: solver.gravity cannot be a list of 2; it is a vector, -1000..1000 [m/s^2]");
  EXPECT_EQ(fault("[solver]\npreset = 'papr'"), "lembert.toml:2: solver.preset \"papr\" is not known; did you mean \"paper\"?");
  EXPECT_EQ(fault("seed = -1"), "lembert.toml:1: seed = -1 is out of range; it is a whole number, 0 or more");
  EXPECT_EQ(fault("solver = 3"), "lembert.toml:1: solver cannot be 3; it is a table: write [solver]");
  EXPECT_EQ(fault("[body]\nradius = 1"),
            "lembert.toml:1: body cannot be a table; write [[body]] in double brackets for every body");
  EXPECT_EQ(fault("[thread]\nspacing = nan"),
            "lembert.toml:2: thread.spacing = nan is out of range; it is a number, 0.0001..0.1 [m]");
  EXPECT_EQ(fault("[thread]\nsubsteps = 3"),
            "lembert.toml:2: thread has no key \"substeps\"; did you mean \"solver.substeps\"?");
  EXPECT_EQ(fault("[expect]\nbite = 3"), "lembert.toml:2: expect: a run has no result \"bite\"; did you mean \"bites\"?");
  EXPECT_NE(fault("[expect]\nbites = {mi = 3}").find("lembert.toml:2: expect.bites has no key \"mi\""), std::string::npos);
  EXPECT_NE(fault("[expect]\nbites = {min = 3, max = 1}").find("min is above max"), std::string::npos);
  EXPECT_NE(fault("[expect]\nbites = 'ten'").find("cannot be the text \"ten\""), std::string::npos);
}

// Two needles with threads: a [[suture]] states where it differs from [thread] and [needle], in any order in the file.
TEST(SceneFile, a_suture_inherits_the_thread_and_the_needle) {
  const SceneSpec one = parse_scene("[thread]\nparticles = 50\n", "s.toml");
  ASSERT_EQ(sutures_of(one).size(), 1u);
  EXPECT_EQ(sutures_of(one)[0].thread.particles, 50);

  SceneSpec two = parse_scene(
      "[[suture]]\nthread.particles = 60\n[suture.needle]\nradius = 0.01\n[[suture]]\n"
      "[thread]\nparticles = 50\nspacing = 0.002\n[needle]\narc = 2.0\n",
      "s.toml");
  ASSERT_EQ(two.suture.size(), 2u);
  EXPECT_EQ(two.suture[0].thread.particles, 60);
  EXPECT_EQ(two.suture[1].thread.particles, 50);
  EXPECT_EQ(two.suture[0].needle.radius, 0.01f);
  EXPECT_EQ(two.suture[1].needle.radius, NeedleSpec{}.radius);
  for (const SutureSpec& s : two.suture) {
    EXPECT_EQ(s.thread.spacing, 0.002f);
    EXPECT_EQ(s.needle.arc, 2.0f);
  }
  // --set: of one, or of all.
  set_value(two, "suture[1].thread.spacing=0.003");
  EXPECT_EQ(two.suture[0].thread.spacing, 0.002f);
  EXPECT_EQ(two.suture[1].thread.spacing, 0.003f);
  set_value(two, "thread.spacing=0.001");
  for (const SutureSpec& s : sutures_of(two)) EXPECT_EQ(s.thread.spacing, 0.001f);
}

TEST(SceneFile, faults_of_a_suture_name_the_key) {
  EXPECT_EQ(fault("[suture]\ngrasp_reach = 0.003\n"),
            "lembert.toml:1: suture cannot be a table; write [[suture]] in double brackets for every suture; its mechanics are "
            "in [mechanics]");
  EXPECT_EQ(fault("[[suture]]\ngrasp_reach = 0.003\n"),
            "lembert.toml:2: suture has no key \"grasp_reach\"; did you mean \"mechanics.grasp_reach\"?");
  EXPECT_EQ(fault("[[suture]]\nthread.particels = 50\n"),
            "lembert.toml:2: suture has no key \"thread.particels\"; did you mean \"thread.particles\"?");
  EXPECT_EQ(fault("[[suture]]\nparticles = 50\n"),
            "lembert.toml:2: suture has no key \"particles\"; did you mean \"thread.particles\"?");
  EXPECT_EQ(fault("[[suture]]\nthread = 3\n").rfind("lembert.toml:2: suture has no key \"thread\"", 0), 0u);
  EXPECT_EQ(fault("[[suture]]\n[suture.thred]\nparticles = 50\n").rfind("lembert.toml:2: suture has no key \"thred\"", 0), 0u);
  EXPECT_EQ(fault("[[suture]]\n[suture.thread]\nspacing = -1\n"),
            "lembert.toml:3: suture[].thread.spacing = -1 is out of range; it is a number, 0.0001..0.1 [m]");
  EXPECT_EQ(set_fault("suture.grasp_reach=0.003"),
            "--set suture.grasp_reach: suture has no key \"grasp_reach\"; did you mean \"mechanics.grasp_reach\"?");
  EXPECT_NE(set_fault("suture.thread.particles=50").find("the scene has no suture"), std::string::npos);
  EXPECT_NE(set_fault("suture[2].thread.particles=50").find("the scene has 0 of [[suture]]"), std::string::npos);
}

TEST(SceneFile, toml_faults_name_line_and_column) {
  EXPECT_EQ(fault("title = 'x'\ntitle = 'y'\n").rfind("lembert.toml:2:", 0), 0u) << fault("title = 'x'\ntitle = 'y'\n");
  EXPECT_EQ(fault("[solver\n").rfind("lembert.toml:1:", 0), 0u);
  EXPECT_EQ(fault("a = \n").rfind("lembert.toml:1:", 0), 0u);
}

TEST(SceneFile, a_missing_scene_names_those_there_are) {
  try {
    read_scene("purse_sting");
    FAIL();
  } catch (const InputError& error) {
    const std::string what = error.what();
    EXPECT_NE(what.find("did you mean \"purse_string\"?"), std::string::npos) << what;
  }
  EXPECT_THROW(read_scene("/no/such/scene.toml"), InputError);
}

TEST(SceneFile, a_scene_is_found_by_name_and_by_path) {
  const SceneSpec by_name = read_scene("purse_string");
  const SceneSpec by_path = read_scene(std::string(CATGUT_SOURCE_DIR) + "/scenes/purse_string.toml");
  EXPECT_TRUE(same_scene(by_name, by_path));
  EXPECT_EQ(by_name.name, "purse_string");
}

TEST(SceneFile, a_mesh_is_sought_beside_the_scene) {
  const std::filesystem::path folder = std::filesystem::path(testing::TempDir()) / "catgut_scene_mesh";
  std::filesystem::create_directories(folder);
  std::ofstream(folder / "organ.obj") << "v 0 0 0\n";
  std::ofstream(folder / "organ.toml") << "[[body]]\nmesh = 'organ.obj#colon'\n[[body]]\nmesh = 'not_there.obj'\n";
  const SceneSpec scene = read_scene((folder / "organ.toml").string());
  EXPECT_EQ(scene.body[0].mesh, (folder / "organ.obj").string() + "#colon");
  EXPECT_EQ(scene.body[1].mesh, "not_there.obj");
  std::filesystem::remove_all(folder);
}

TEST(SceneFile, every_scene_in_the_folder_reads_and_ends_in_expectations) {
  ASSERT_FALSE(scene_names().empty());
  for (const std::string& name : scene_names()) {
    const SceneSpec scene = read_scene(name);
    EXPECT_FALSE(scene.expect.empty()) << name;
    EXPECT_FALSE(scene.title.empty()) << name;
  }
}

// Design: "Particle counts are exact." What a scene expects is what is built.
TEST(SceneFile, every_scene_is_built_with_exactly_the_particles_it_expects) {
  const std::map<std::string, size_t> paper{{"purse_string", 1403}, {"connell", 2471}, {"stay", 2471}, {"lembert", 4155}};
  size_t found = 0;
  for (const std::string& name : scene_names()) {
    SCOPED_TRACE(name);
    const SceneSpec scene = read_scene(name);
    const size_t built = particle_count(*build_model(scene));
    size_t asked = 0;
    for (const SutureSpec& s : sutures_of(scene)) asked += static_cast<size_t>(s.thread.particles);
    for (const BodySpec& b : scene.body) asked += static_cast<size_t>(b.particles);
    EXPECT_EQ(built, asked);
    const auto want = std::find_if(scene.expect.begin(), scene.expect.end(), [](auto& e) { return e.name == "particles"; });
    ASSERT_NE(want, scene.expect.end());
    EXPECT_EQ(want->min, static_cast<double>(built));
    EXPECT_EQ(want->max, static_cast<double>(built));
    if (const auto in_paper = paper.find(name); in_paper != paper.end()) {
      EXPECT_EQ(built, in_paper->second);
      ++found;
    }
  }
  EXPECT_EQ(found, paper.size());
}

TEST(SceneFile, set_reaches_every_kind_of_key) {
  SceneSpec scene;
  scene.body.resize(2);
  set_value(scene, "solver.substeps=8");
  set_value(scene, "title = dry run");
  set_value(scene, "body.particles=600");
  set_value(scene, "body[1].radius=0.025");
  set_value(scene, "solver.gravity=[0, 0, -1.5]");
  set_value(scene, "solver.thread_direct=false");
  set_value(scene, "expect.bites={min = 8}");
  set_value(scene, "expect.bites=9");
  EXPECT_EQ(scene.solver.substeps, 8);
  EXPECT_EQ(scene.title, "dry run");
  EXPECT_EQ(scene.body[0].particles, 600);
  EXPECT_EQ(scene.body[1].particles, 600);
  EXPECT_EQ(scene.body[0].radius, BodySpec{}.radius);
  EXPECT_EQ(scene.body[1].radius, 0.025f);
  EXPECT_TRUE(scene.solver.gravity == (Vec3{0, 0, -1.5f}));
  EXPECT_FALSE(scene.solver.thread_direct);
  ASSERT_EQ(scene.expect.size(), 1u);
  EXPECT_EQ(scene.expect[0].max, 9);
}

TEST(SceneFile, set_says_what_is_wrong) {
  EXPECT_EQ(set_fault("solver.substep=8"), "--set solver.substep: solver has no key \"substep\"; did you mean \"substeps\"?");
  EXPECT_EQ(set_fault("solvr.substeps=8"), "--set solvr.substeps: a scene has no section \"solvr\"; did you mean \"solver\"?");
  EXPECT_NE(set_fault("substeps").find("is not key=value"), std::string::npos);
  EXPECT_NE(set_fault("solver.substeps=many").find("\"many\" is not a value"), std::string::npos);
  EXPECT_NE(set_fault("body[7].radius=0.02").find("2 bodies"), std::string::npos);
  EXPECT_NE(set_fault("body[].particles=-1").find("out of range"), std::string::npos);
  EXPECT_NE(set_fault("expect.bitess=1").find("\"bites\""), std::string::npos);
  EXPECT_EQ(set_fault("solver.tick_rate=0").find("no fault"), std::string::npos);
}

TEST(SceneFile, a_preset_is_the_ground_the_other_keys_stand_on) {
  SolverSpec paper;
  ASSERT_TRUE(apply_preset(paper, "paper"));
  const SceneSpec scene = parse_scene("[solver]\nsubsteps = 5\npreset = 'paper'\n", "s.toml");
  EXPECT_EQ(scene.solver.preset, "paper");
  EXPECT_EQ(scene.solver.substeps, 5);  // though written above the preset
  EXPECT_EQ(scene.solver.shape_sweeps, paper.shape_sweeps);
  SceneSpec other;
  EXPECT_THROW(use_preset(other, "papr"), InputError);
}

}  // namespace
}  // namespace catgut
