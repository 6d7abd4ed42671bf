// SPDX-License-Identifier: Apache-2.0
// tests/assess: an ability that is turned on alone is found by its own metric in a simulated session. Some seconds of a session
// in every build; CATGUT_LONG=1 (the nightly run): whole sessions, with knots.
#include <gtest/gtest.h>

#include <cstdlib>

#include "procedure/scene_file.h"
#include "runtime/assessment.h"

namespace catgut {
namespace {

assess::Result result_of(const std::vector<std::string>& set, double seconds) {
  SceneSpec scene = read_scene("stay");
  for (const std::string& s : set) set_value(scene, s);
  SessionHooks hooks;
  Assessor assessor(scene);
  assessor.attach(hooks);
  SessionOptions options;
  options.seconds = seconds;
  const RunResult run = run_session(scene, options, hooks);
  return assessor.finish(run, {});
}

TEST(AbilityRuns, tremor_pauses_and_missed_grasps_are_seen) {
  constexpr double kShort = 5;  // [s] simulated
  const assess::Result clean = result_of({}, kShort);
  const assess::Result poor = result_of({"surgeon.grasp_error=0.9", "surgeon.pause=2", "surgeon.tremor=0.0003"}, kShort);
  EXPECT_EQ(clean.value("missed_grasps"), 0);
  EXPECT_GT(poor.value("missed_grasps"), 0);
  EXPECT_GT(poor.value("pause"), clean.value("pause"));
  EXPECT_GT(poor.value("tremor"), 2 * clean.value("tremor"));
}

TEST(AbilityRuns, each_error_is_seen_by_its_metric) {
  if (!std::getenv("CATGUT_LONG")) GTEST_SKIP() << "six whole sessions: set CATGUT_LONG=1 (the nightly run)";
  const assess::Result clean = result_of({}, 0);
  EXPECT_EQ(clean.value("missed_grasps"), 0);
  EXPECT_EQ(clean.value("square"), 1);
  EXPECT_GT(result_of({"surgeon.grasp_error=0.5"}, 0).value("missed_grasps"), 0);
  EXPECT_LT(result_of({"surgeon.order_error=1"}, 0).value("square"), 1);
  EXPECT_GT(result_of({"surgeon.pause=2"}, 0).value("pause"), 2 * clean.value("pause"));
  EXPECT_GT(result_of({"surgeon.tremor=0.0003"}, 0).value("tremor"), 2 * clean.value("tremor"));
  EXPECT_GT(result_of({"surgeon.speed=0.08"}, 0).value("time"), 1.1 * clean.value("time"));
}

}  // namespace
}  // namespace catgut
