// SPDX-License-Identifier: Apache-2.0
// tests/app: the command line is a contract that scripts depend on: exit codes, one line per fault, JSON on request.
// Runs the built program as a user would.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "command_line.h"
#include "runtime/haptics.h"
#include "sim/recording.h"

namespace {
namespace fs = std::filesystem;
using nlohmann::json;
using namespace catgut_test;

TEST_F(CommandLine, a_file_name_says_what_it_holds) {
  expect_refused("run small.toml --surgeon none --still 0.1:x.jpg", "does not end in .png");
  expect_refused("run small.toml --surgeon none --video x.png", "does not end in .mp4");
  expect_refused("run small.toml --surgeon none --contact-sheet x.pdf", "does not end in .png");
  expect_refused("run small.toml --surgeon none --record x.json", "does not end in .cgrec");
  expect_refused("run excision --set mechanics.kind=guided", "a wall of guided mechanics cannot be cut");
  expect_refused("run small.toml --surgeon none --json x.cgrec", "does not end in .json");
  expect_refused("validate --json x.png", "does not end in .json");
  expect_refused("bench stages --scene small.toml --json x.png", "does not end in .json");
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), {}), 3) << "the scene and the two outputs: nothing was written";
}

TEST_F(CommandLine, bad_input_is_one_line_and_code_2) {
  expect_refused("validate --only nonsense", "no group of checks begins so");
  EXPECT_EQ(run_catgut("validate --only nonsense").out, "") << "no heading of a table that never comes";
  expect_refused("", "run without it");
  expect_refused("run purse_sting --headless", "did you mean \"purse_string\"?");
  expect_refused("run /no/such/file.toml", "there is no such scene");
  expect_refused("run small.toml --set solver.substep=8", "did you mean \"substeps\"?");
  expect_refused("run small.toml --set body.particles=-5", "out of range");
  expect_refused("run small.toml --preset papr", "there is no preset");
  expect_refused("run small.toml --surgeon nobody", "unknown surgeon");
  expect_refused("run small.toml --surgeon scripted", "--surgeon none");
  expect_refused("run small.toml --bogus", "no option --bogus");
  expect_refused("run small.toml --second 3", "no option --second; did you mean --seconds?");
  expect_refused("runn stay", "no command \"runn\"; did you mean \"run\"?");
  expect_refused("run small.toml --set camera=1", "a scene has no key \"camera\"; `catgut describe` lists the keys");
  expect_refused("run small.toml --threads 0", "--threads");
  expect_refused("run small.toml --seconds -3", "--seconds");
  expect_refused("run small.toml --seconds nan", "nan must be a number in [0.001, 1000000]");
  expect_refused("bench scale --seconds nan", "nan must be a number");
  for (const std::string one : {"stages", "scale", "frame", "haptics"})
    expect_refused("bench " + one + " --scene small.toml --scene stay", "one scene only");
  expect_refused("run small.toml --surgeon none --json /proc/nowhere/x.json", "cannot be written");
  expect_refused("play small.toml --record nowhere/x.cgrec", "nowhere/x.cgrec: no folder nowhere; create it");
  expect_refused("play small.toml --screenshot nowhere/a.png", "no folder nowhere");
  expect_refused("play small.toml --events /proc/x.json", "cannot be written");
  EXPECT_FALSE(fs::exists(folder_ / "nowhere"));
  expect_refused("run", "scene");
  expect_refused("fly", "fly");
  expect_refused("replay nothing.cgrec", "there is no such recording");
  expect_refused("replay small.toml", "not a Catgut recording");
  expect_refused("view nothing.cgrec", "there is no such recording");
  expect_refused("view small.toml", "not a Catgut recording");
  expect_refused("play small.toml --json nowhere/x.json", "no folder nowhere");
  expect_refused("bench paper --scene small.toml", "no technique for the scripted surgeon");
  expect_refused("describe substep", "substeps");
  expect_refused("devices --test", "no haptic device");
  expect_refused("play --haptics spoon", "--haptics");
  expect_refused("devices bridge:host:abc", "\"host:abc\" is not a valid HOST[:PORT]");
  expect_refused("play stay --haptics haply:host:70000", "is not a valid HOST[:PORT]");
}

// The haptic library is loaded at run time; here it is the simulated one.
TEST_F(CommandLine, devices_are_listed_and_pushed) {
  const Outcome none = run_catgut("devices");
  EXPECT_EQ(none.code, 0);
  EXPECT_NE(none.out.find("touch: "), std::string::npos) << "one line says what is missing";
  setenv("CATGUT_LIBHD", CATGUT_FAKE_LIBHD, 1);
  const Outcome both = run_catgut("devices");
  EXPECT_NE(both.out.find("right-0001"), std::string::npos) << both.out;
  EXPECT_NE(both.out.find("left-0002"), std::string::npos) << both.out;
  const std::string places = (folder_ / "arms.toml").string();
  setenv("CATGUT_ARMS", places.c_str(), 1);
  const Outcome laid = run_catgut("devices --calibrate --scale 0.5 --turn 90 --countdown 0.2");
  EXPECT_EQ(laid.code, 0) << laid.err;
  const auto kept = catgut::read_arm_places(places);
  ASSERT_EQ(kept.size(), 2u);
  EXPECT_EQ(kept.at("right-0001").scale, 0.5f);
  // The held position becomes the center; the device's x points along the view axis after a rotation by 90 degrees.
  using catgut::Vec3;
  catgut::ArmInfo arm;
  arm.serial = "right-0001";
  const catgut::Workspace w = catgut::workspace_of(arm, 0, 0, {0, 0.1f, 0}, kept);
  EXPECT_LT(catgut::distance(catgut::to_world(w, {kept.at("right-0001").middle, {}}).p, {0.015f, 0.12f, 0.01f}), 1e-6f);
  EXPECT_LT(catgut::distance(catgut::rotate(w.turn, Vec3{1, 0, 0}), {0, 0, -1}), 1e-6f);
  // The names under which the library knows its devices.
  const Outcome named = run_catgut("devices \"touch:Left Device,Nobody\"");
  EXPECT_NE(named.out.find("right device \"Left Device\""), std::string::npos) << named.out;
  EXPECT_NE(named.out.find("no left device (\"Nobody\")"), std::string::npos) << named.out;
  std::ofstream(places) << "[right-0001]\nscale = 50\n";
  expect_refused("devices --calibrate", "arms.toml:2: scale must be a number between");
  // Any command that reads the file reports its error, and none overwrites it.
  for (const auto& [text, wrong] :
       std::map<std::string, std::string>{{"[right-0001\nscale = 1\n", "arms.toml:1: "},
                                          {"[right-0001]\nturn = nan\n", "arms.toml:2: turn must be"},
                                          {"[right-0001]\nx = \"far\"\n", "arms.toml:2: x must be"},
                                          {"[left-0002]\nscael = 2\n", "arms.toml:2: scael is unknown"},
                                          {"[left-0002]\nhand = \"both\"\n", "arms.toml:2: hand must be"},
                                          {"\nright-0001 = 3\n", "arms.toml:2: right-0001 must be"},
                                          {std::string("\0\xff[", 3), "arms.toml:1: "}}) {
    std::ofstream(places, std::ios::binary) << text;
    expect_refused("devices --calibrate", wrong);
    std::ifstream in(places, std::ios::binary);
    EXPECT_EQ(std::string(std::istreambuf_iterator<char>(in), {}), text);
  }
  setenv("CATGUT_ARMS", folder_.c_str(), 1);
  expect_refused("devices --calibrate", "is a folder; set CATGUT_ARMS to");
  // Unreadable even for root.
  setenv("CATGUT_ARMS", "/proc/self/mem", 1);
  for (const char* command : {"devices", "devices --calibrate"}) expect_refused(command, "/proc/self/mem: cannot be read; ");
  unsetenv("CATGUT_ARMS");
  setenv("FAKE_HD_FAULT", "flip_x:right:0", 1);
  const Outcome flipped = run_catgut("devices --test --countdown 0");
  EXPECT_EQ(flipped.code, 1);
  EXPECT_NE(flipped.out.find("WRONG WAY when pushed right"), std::string::npos) << flipped.out;
  EXPECT_NE(flipped.out.find("left device: "), std::string::npos) << flipped.out;
  unsetenv("FAKE_HD_FAULT");
  unsetenv("CATGUT_LIBHD");
}

// One process serves its devices, another finds them; a missing peer, or one without devices, is one line.
TEST_F(CommandLine, arms_are_lent_over_the_bridge) {
  expect_refused("bridge --arms spoon", "unknown device");
  expect_refused("play --haptics paper:spoon", "unknown device");
  const Outcome nothing = run_catgut("bridge --arms touch:/nowhere/libHD.so");
  EXPECT_EQ(nothing.code, 2);
  EXPECT_NE(nothing.err.find("no haptic device to serve"), std::string::npos) << nothing.err;
  setenv("CATGUT_LIBHD", CATGUT_FAKE_LIBHD, 1);
  expect_refused("bridge --listen 203.0.113.7:0", "use a local address");
  expect_refused("bridge --listen 0.0.0.0:0 --arms touch:/nowhere/libHD.so", "could apply forces");
  FILE* server = popen("echo $$; exec '" CATGUT_APP "' bridge --listen 127.0.0.1:0 --seconds 60", "r");
  unsetenv("CATGUT_LIBHD");
  ASSERT_NE(server, nullptr);
  char line[256];
  ASSERT_NE(fgets(line, sizeof line, server), nullptr);
  const pid_t pid = std::atoi(line);
  std::string port;
  while (port.empty() && fgets(line, sizeof line, server))
    if (const char* at = std::strstr(line, ", port ")) port = std::to_string(std::atoi(at + 7));
  const Outcome lent = run_catgut("devices bridge:127.0.0.1:" + port);
  EXPECT_NE(lent.out.find("bridge: left device"), std::string::npos) << lent.out;
  EXPECT_NE(lent.out.find("right-0001"), std::string::npos) << lent.out;
  EXPECT_EQ(lent.out.find("touch"), std::string::npos) << "of the driver that was asked for alone";
  kill(pid, SIGTERM);
  while (fgets(line, sizeof line, server)) {}
  EXPECT_EQ(pclose(server), 0) << "a clean end";
  const Outcome gone = run_catgut("devices bridge:127.0.0.1:" + port);
  EXPECT_NE(gone.out.find("bridge: no answer"), std::string::npos) << gone.out;
}

TEST_F(CommandLine, faults_in_a_scene_name_its_line) {
  std::ofstream(folder_ / "wrong.toml") << "[solver]\nsubstep = 8\n";
  expect_refused("run wrong.toml", "wrong.toml:2: solver has no key \"substep\"; did you mean \"substeps\"?");
  std::ofstream(folder_ / "minus.toml") << "[[body]]\n\nparticles = -1\n";
  expect_refused("run minus.toml", "minus.toml:3: body[].particles = -1 is out of range");
  std::ofstream(folder_ / "torn.toml") << "title = \"no end\n";
  expect_refused("run torn.toml", "torn.toml:1:");
}

TEST_F(CommandLine, a_wrong_scene_is_refused_before_it_costs_anything) {
  expect_refused("run no_such_scene.toml", "there is no such scene");
  std::ofstream(folder_ / "key.toml") << "title = 'x'\n[thread]\nparticels = 100\n";
  expect_refused("run key.toml", "key.toml:3: thread has no key \"particels\"; did you mean \"particles\"?");
  std::ofstream(folder_ / "negative.toml") << "[thread]\nparticles = -175\n";
  expect_refused("run negative.toml", "negative.toml:2: thread.particles = -175 is out of range");
  std::ofstream(folder_ / "billion.toml") << "[thread]\nparticles = 1_000_000_000\n";
  expect_refused("run billion.toml", "billion.toml:2: thread.particles = 1000000000 is out of range");
  std::ofstream(folder_ / "lines.toml") << "[solver]\npreset = \"a\\nb\\u001b[31m\"\n";
  expect_refused("run lines.toml", "lines.toml:2: solver.preset");
}

TEST_F(CommandLine, a_mesh_that_cannot_be_used_says_why) {
  const auto mesh = [&](const std::string& name, const std::string& text) { std::ofstream(folder_ / name) << text; };
  const auto refused = [&](const std::string& name, const std::string& part) {
    expect_refused("run small.toml --surgeon none --mesh " + name, part);
  };
  refused("nowhere.obj", "nowhere.obj: no such mesh file");
  mesh("flat.obj", "v 0 0 0\nv 0.1 0 0\nv 0.2 0 0\nf 1 2 3\n");
  refused("flat.obj", "no area");
  mesh("point.obj", "v 0 0 0\nv 0 0 0\nv 0 0 0\nf 1 2 3\n");
  refused("point.obj", "no area");
  mesh("km.obj", "v 0 0 0\nv 0.0001 0 0\nv 0 0.0001 0\nf 1 2 3\n");  // a decimeter, written in kilometers
  refused("km.obj", "looks like kilometers: scale by 1000");
  mesh("garbage.glb", "glTF but not really");
  refused("garbage.glb", "cannot be read as a mesh");
  mesh("organ.txt", "v 0 0 0\n");
  refused("organ.txt", "unsupported mesh format");
}

TEST_F(CommandLine, help_and_descriptions_are_code_0) {
  EXPECT_EQ(run_catgut("--help").code, 0);
  EXPECT_EQ(run_catgut("run --help").code, 0);
  EXPECT_EQ(run_catgut("--version").code, 0);
  EXPECT_EQ(run_catgut("devices").code, 0);
  const Outcome all = run_catgut("describe"), one = run_catgut("describe solver.substeps");
  EXPECT_EQ(all.code, 0);
  EXPECT_NE(all.out.find("[solver]"), std::string::npos);
  EXPECT_EQ(one.code, 0);
  EXPECT_NE(one.out.find("per tick"), std::string::npos);
}

TEST_F(CommandLine, the_reference_page_is_what_the_program_says) {
  const Outcome o = run_catgut("describe --markdown");
  EXPECT_EQ(o.code, 0);
  EXPECT_TRUE(o.out == read_file(fs::path(CATGUT_SOURCE_DIR) / "docs/scene_reference.md"))
      << "update it: ./catgut describe --markdown > docs/scene_reference.md";
}

TEST_F(CommandLine, a_run_reports_all_that_the_contract_names) {
  const Outcome o = run_catgut("run small.toml --surgeon none --headless --threads 1 --json -");
  ASSERT_EQ(o.code, 0) << o.err;
  const json j = json::parse(o.out);
  for (const char* key : {"scene", "preset", "particles", "ticks", "simulated_s", "real_time_factor", "solver_ms", "sutures",
                          "knots", "events", "expect", "state_hash", "stages", "catgut"})
    EXPECT_TRUE(j.contains(key)) << key;
  for (const char* key : {"median", "p99", "max"}) EXPECT_TRUE(j["solver_ms"].contains(key)) << key;
  EXPECT_EQ(j["scene"], "small");
  EXPECT_EQ(j["particles"], 1403);
  EXPECT_EQ(j["ticks"], 30);
  EXPECT_EQ(j["expect"]["particles"]["want"], 1403);
  EXPECT_EQ(j["expect"]["particles"]["got"], 1403);
  EXPECT_EQ(j["expect"]["particles"]["ok"], true);
  EXPECT_EQ(j["state_hash"].get<std::string>().size(), 16u);
}

TEST_F(CommandLine, a_failed_expectation_is_code_1) {
  EXPECT_EQ(run_catgut("run small.toml --surgeon none --set expect.bites=3").code, 1);
  const Outcome unchecked = run_catgut("run small.toml --surgeon none --set expect.bites=3 --no-expect");
  EXPECT_EQ(unchecked.code, 0);
  EXPECT_EQ(unchecked.out.find("FAILED"), std::string::npos) << unchecked.out;
  EXPECT_NE(unchecked.out.find("differs bites = 0, expected 3"), std::string::npos) << unchecked.out;
}

// The README's line: a run with a thread of another length is not an error.
TEST_F(CommandLine, another_particle_count_does_not_fail_the_scenes_own) {
  EXPECT_EQ(run_catgut("run small.toml --surgeon none --set thread.particles=200").code, 0);
  EXPECT_EQ(run_catgut("run small.toml --surgeon none --set thread.particles=200 --set expect.particles=1403").code, 1);
  EXPECT_EQ(run_catgut("run small.toml --surgeon none --set body.particles=1300").code, 0);
}

TEST_F(CommandLine, the_bits_do_not_depend_on_threads) {
  const Outcome one = run_catgut("run small.toml --surgeon none --threads 1 --json -");
  const Outcome three = run_catgut("run small.toml --surgeon none --threads 3 --json -");
  ASSERT_EQ(one.code, 0);
  ASSERT_EQ(three.code, 0);
  EXPECT_EQ(json::parse(one.out)["state_hash"], json::parse(three.out)["state_hash"]);
}

TEST_F(CommandLine, a_recording_replays_and_a_changed_one_does_not) {
  ASSERT_TRUE(record("a.cgrec"));
  EXPECT_EQ(run_catgut("replay a.cgrec --check").code, 0);
  EXPECT_EQ(run_catgut("replay a.cgrec --check --threads 2").code, 0);
  const catgut::Recording recording = catgut::read_recording(folder_ / "a.cgrec");
  {
    catgut::Recorder changed(folder_ / "b.cgrec", recording.header, recording.start);
    for (size_t i = 0; i < recording.tick.size(); ++i)
      changed.tick(recording.tick[i].input, recording.tick[i].hash ^ (i >= 11));
    changed.finish(false);
  }
  const Outcome differs = run_catgut("replay b.cgrec --check");
  EXPECT_EQ(differs.code, 1);
  EXPECT_NE(differs.err.find("after tick 12 differs"), std::string::npos) << differs.err;
  EXPECT_EQ(run_catgut("replay b.cgrec").code, 0) << "without --check nothing is compared";
  const Outcome played = run_catgut("run small.toml --surgeon a.cgrec --json -");
  const Outcome live = run_catgut("run small.toml --surgeon none --json -");
  EXPECT_EQ(json::parse(played.out)["state_hash"], json::parse(live.out)["state_hash"]);
}

TEST_F(CommandLine, a_cut_recording_is_named_as_such) {
  ASSERT_TRUE(record("a.cgrec"));
  const std::string whole = read_file(folder_ / "a.cgrec");
  std::ofstream(folder_ / "cut.cgrec", std::ios::binary) << whole.substr(0, whole.size() - 10);
  expect_refused("replay cut.cgrec --check --json cut.json", "truncated recording");
  EXPECT_EQ(json::parse(read_file(folder_ / "cut.json"))["ticks"], 30) << "the ticks it holds are replayed all the same";
  std::ofstream(folder_ / "stump.cgrec", std::ios::binary) << whole.substr(0, 40);
  expect_refused("replay stump.cgrec", "cut or damaged");
  std::string other = whole;
  other[8] = 99;
  std::ofstream(folder_ / "other.cgrec", std::ios::binary) << other;
  expect_refused("replay other.cgrec", "the recording has format 99");
}

// A picture of a moment beyond the run: refused before the work where that is known, else after everything is written.
TEST_F(CommandLine, a_picture_of_a_moment_that_never_comes_takes_no_results_with_it) {
#ifndef CATGUT_TESTS_WINDOW
  GTEST_SKIP() << "this build makes no pictures";
#endif
  expect_refused("run small.toml --surgeon none --headless --seconds 1 --still 2:late.png", "the run ends after 1 s");
  expect_refused("bench haptics --out /proc/nowhere", "cannot be written");

  const Outcome o = run_catgut(
      "run stay --surgeon scripted --headless --set duration=3000 --still 2990:late.png --json end.json --no-expect "
      "--contact-sheet sheet.png");
  EXPECT_EQ(o.code, 2);
  EXPECT_NE(o.err.find("everything else was written"), std::string::npos) << o.err;
  EXPECT_GT(json::parse(read_file(folder_ / "end.json"))["ticks"], 100);
  EXPECT_EQ(read_file(folder_ / "sheet.png").substr(1, 3), "PNG");
  EXPECT_FALSE(fs::exists(folder_ / "late.png"));
}

std::vector<std::vector<std::string>> read_table(const fs::path& path) {
  std::vector<std::vector<std::string>> row;
  std::ifstream in(path);
  for (std::string line; std::getline(in, line);) {
    row.emplace_back();
    std::istringstream cells(line);
    for (std::string cell; std::getline(cells, cell, ',');) row.back().push_back(cell);
  }
  return row;
}
const std::vector<std::string> kLimitsColumns{"suture",         "bites",       "suture_points",    "settled",
                                              "simulated_s",    "ticks",       "solver_ms_median", "solver_ms_p99",
                                              "tick_ms_median", "tick_ms_p99", "contacts",         "fps"};

TEST_F(CommandLine, bench_scale_measures_each_size_on_one_thread_and_on_several) {
  const Outcome o = run_catgut("bench scale --scene small.toml --seconds 0.05 --threads 2 --json -");
  ASSERT_EQ(o.code, 0) << o.err;
  const json all = json::parse(o.out).at("runs");
  ASSERT_EQ(all.size(), 6u);
  for (size_t k = 0; k < 6; ++k) {
    const int times = k < 2 ? 1 : k < 4 ? 4 : 16;
    EXPECT_EQ(all[k].at("times"), times);
    EXPECT_EQ(all[k].at("threads"), k % 2 + 1);
    EXPECT_NEAR(all[k].at("particles").get<int>(), 175 + times * 1228, 2 * times);
    EXPECT_GT(all[k].at("solver_ms").at("median").get<double>(), 0);
    EXPECT_EQ(all[k].at("state_hash"), all[k - k % 2].at("state_hash"));
  }
}

TEST_F(CommandLine, bench_limits_writes_a_row_for_each_suture) {
  const Outcome o = run_catgut("bench limits --scene stress_one_body --sutures 3 --threads 1 --out limits");
  ASSERT_EQ(o.code, 0) << o.err;
  EXPECT_NE(o.out.find("3 of 3 sutures"), std::string::npos) << o.out;
  const auto row = read_table(folder_ / "limits/stress_one_body.csv");
  ASSERT_EQ(row.size(), 4u);
  ASSERT_EQ(row[0], kLimitsColumns);
  double before = 0.5;  // [s] the scene settles
  for (size_t i = 1; i <= 3; ++i) {
    ASSERT_EQ(row[i].size(), kLimitsColumns.size());
    std::vector<double> v;
    for (const std::string& cell : row[i]) v.push_back(std::stod(cell));
    EXPECT_EQ(v[0], i);
    EXPECT_EQ(v[1], i) << "as many bites as the picture shows";
    EXPECT_EQ(v[2], 2 * i) << "two suture points each";
    EXPECT_NEAR(v[4] - before, v[5] / 60, 0.002) << "every tick belongs to one suture";
    EXPECT_GT(v[6], 0);
    EXPECT_GE(v[7], v[6]);
    EXPECT_GT(v[8], v[6]) << "the whole tick takes longer than the solver";
    EXPECT_NEAR(v[11], 1000 / v[8], 0.001 * v[11] + 0.1);
    before = v[4];
  }
  EXPECT_EQ(read_file(folder_ / "limits/stress_one_body.png").substr(1, 3), "PNG");
}

TEST_F(CommandLine, bench_limits_says_how_far_it_came) {
  const Outcome o = run_catgut("bench limits --scene stress_one_body --sutures 3 --set duration=1 --out limits");
  EXPECT_EQ(o.code, 1);
  EXPECT_NE(o.out.find("0 of 3 sutures, 1 s simulated (time limit)"), std::string::npos) << o.out;
  EXPECT_EQ(read_table(folder_ / "limits/stress_one_body.csv").size(), 1u);
  expect_refused("bench limits --scene small.toml", "--surgeon none");
  expect_refused("bench limits --out /proc/nowhere", "cannot be written");
}

TEST_F(CommandLine, an_interrupted_bench_limits_keeps_what_was_measured) {
  const std::string out = folder_ / "limits";
  const pid_t child = fork();
  if (child == 0) {
    if (!std::freopen("/dev/null", "w", stdout)) _exit(98);
    if (!std::freopen("/dev/null", "w", stderr)) _exit(98);
    execl(CATGUT_APP, CATGUT_APP, "bench", "limits", "--scene", "stress_one_body", "--out", out.c_str(), nullptr);
    _exit(99);
  }
  for (int i = 0; i < 6000 && read_table(out + "/stress_one_body.csv").size() < 2; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  kill(child, SIGINT);
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 130);
  const auto row = read_table(out + "/stress_one_body.csv");
  ASSERT_GE(row.size(), 2u);
  ASSERT_LT(row.size(), 51u);
  for (const auto& r : row) EXPECT_EQ(r.size(), kLimitsColumns.size());
  EXPECT_TRUE(fs::exists(out + "/stress_one_body.png"));
}

TEST_F(CommandLine, an_interrupted_run_closes_its_files) {
  const std::string json_path = folder_ / "i.json", record_path = folder_ / "i.cgrec", scene = folder_ / "small.toml";
  const pid_t child = fork();
  if (child == 0) {
    if (!std::freopen("/dev/null", "w", stdout)) _exit(98);
    if (!std::freopen("/dev/null", "w", stderr)) _exit(98);
    execl(CATGUT_APP, CATGUT_APP, "run", scene.c_str(), "--surgeon", "none", "--seconds", "100000", "--record",
          record_path.c_str(), "--json", json_path.c_str(), nullptr);
    _exit(99);
  }
  // The recording is created when the run starts: then it can be interrupted.
  for (int i = 0; i < 2000 && !(fs::exists(record_path) && fs::file_size(record_path) > 40000); ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  kill(child, SIGINT);
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 130);
  const json j = json::parse(read_file(json_path));
  EXPECT_EQ(j["interrupted"], true);
  EXPECT_EQ(run_catgut("replay i.cgrec --check").code, 0) << "an interrupted recording is whole";
}

// kill -9, a power cut: the file on the disk is readable and replays.
TEST_F(CommandLine, a_killed_run_leaves_what_it_had_recorded) {
  const std::string record_path = folder_ / "k.cgrec", scene = folder_ / "small.toml";
  const pid_t child = fork();
  if (child == 0) {
    if (!std::freopen("/dev/null", "w", stdout)) _exit(98);
    if (!std::freopen("/dev/null", "w", stderr)) _exit(98);
    execl(CATGUT_APP, CATGUT_APP, "run", scene.c_str(), "--surgeon", "none", "--seconds", "100000", "--record",
          record_path.c_str(), nullptr);
    _exit(99);
  }
  const auto ticks = [&]() -> size_t {
    try {
      return catgut::read_recording(record_path).tick.size();
    } catch (const std::exception&) { return 0; }
  };
  for (int i = 0; i < 3000 && ticks() == 0; ++i) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  kill(child, SIGKILL);
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFSIGNALED(status));
  const size_t saved = ticks();
  ASSERT_GE(saved, 60u) << "a second of it, at least";
  expect_refused("replay k.cgrec --check --json k.json", "truncated recording");
  EXPECT_EQ(json::parse(read_file(folder_ / "k.json"))["ticks"], saved);
}

}  // namespace
