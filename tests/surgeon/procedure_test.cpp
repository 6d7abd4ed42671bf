// SPDX-License-Identifier: Apache-2.0
// tests/surgeon: whole procedures of the scripted surgeon. Twenty purse-strings take minutes: set CATGUT_LONG=1.
#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>

#include "procedure/scene_file.h"
#include "runtime/session.h"

namespace catgut {
namespace {

// Largest error of the thread's length in ticks in which no particle passed.
struct Lengths {
  double rest = 0;
  float worst = 0, worst_passing = 0;
  void tick(const Snapshot& seen) {
    double length = 0;
    for (size_t i = 1; i < seen.active().thread_order.size(); ++i)
      length +=
          double{distance(seen.particle[seen.active().thread_order[i - 1]], seen.particle[seen.active().thread_order[i]])};
    bool passing = false;
    for (const Event& e : seen.event) passing = passing || e.kind == EventKind::particle_passed;
    float& worst_of = passing ? worst_passing : worst;
    worst_of = std::max(worst_of, static_cast<float>(std::abs(length - rest) / rest));
  }
};

TEST(Procedure, twenty_seeds_close_the_opening) {
  if (!std::getenv("CATGUT_LONG")) GTEST_SKIP() << "set CATGUT_LONG=1";
  for (uint64_t seed = 1; seed <= 20; ++seed) {
    SceneSpec scene = read_scene("purse_string");
    scene.seed = seed;
    Lengths lengths{static_cast<double>(scene.thread.particles - 1) * double{scene.thread.spacing}};
    SessionHooks hooks;
    hooks.on_tick = [&](const Snapshot& seen, const std::string&) { lengths.tick(seen); };
    RunResult r = run_session(scene, {}, hooks);
    std::printf("seed %2d: %.0f bites, opening %.3f, thread length %.4f (passing %.4f), %.1f s\n", static_cast<int>(seed),
                r.value["bites"], r.value["opening_ratio"], static_cast<double>(lengths.worst),
                static_cast<double>(lengths.worst_passing), r.simulated_s);
    std::fflush(stdout);
    EXPECT_EQ(r.value["bites"], scene.surgeon.bites) << seed;
    EXPECT_LE(r.value["opening_ratio"], 0.15) << seed;
    EXPECT_LE(lengths.worst, 0.01f) << seed;
    EXPECT_LE(lengths.worst_passing, 0.03f) << seed;
    EXPECT_EQ(r.value["bite_out_of_order"], 0) << seed;
    EXPECT_EQ(r.value["order_errors"], 0) << seed;
    EXPECT_EQ(r.value["state_valid"], 1) << seed;
    EXPECT_EQ(r.value["surgeon_done"], 1) << seed;
  }
}

// Half a millimeter of tremor, a millimeter of aim error: the first attempts fail, and the surgeon repeats them.
TEST(Procedure, shaky_hands_try_again) {
  for (uint64_t seed : {3, 6}) {
    SceneSpec scene = read_scene("purse_string");
    scene.seed = seed;
    scene.surgeon.tremor = 0.0005f;
    scene.surgeon.aim_error = 0.001f;
    SessionOptions options;
    options.seconds = 22;
    RunResult r = run_session(scene, options);
    EXPECT_GE(r.value["bites"], 1) << seed;
    EXPECT_EQ(r.value["state_valid"], 1) << seed;
    EXPECT_GT(r.simulated_s, 21) << seed << ": gave up";
  }
}

// Every scene states its expected results; all of them must hold. Other seeds, techniques and presets: .ci/nightly seeds.
TEST(Procedure, a_stay_suture_is_tied_and_held) {
  const RunResult r = run_session(read_scene("stay"), {});
  ASSERT_FALSE(r.expect.empty());
  for (const ExpectationResult& e : r.expect) EXPECT_TRUE(e.ok) << e.want.name << " is " << e.got << "; " << r.ended;
}

}  // namespace
}  // namespace catgut
