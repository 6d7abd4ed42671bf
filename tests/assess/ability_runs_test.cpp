// SPDX-License-Identifier: Apache-2.0
// tests/assess: an ability that is turned on alone is found by its own metric in a simulated session.
#include <gtest/gtest.h>

#include "procedure/scene_file.h"
#include "runtime/assessment.h"

namespace catgut {
namespace {

assess::Result result_of(const std::vector<std::string>& set) {
  SceneSpec scene = read_scene("stay");
  for (const std::string& s : set) set_value(scene, s);
  SessionHooks hooks;
  Assessor assessor(scene);
  assessor.attach(hooks);
  const RunResult run = run_session(scene, SessionOptions{}, hooks);
  return assessor.finish(run, {});
}

TEST(AbilityRuns, each_error_is_seen_by_its_metric) {
  const assess::Result clean = result_of({});
  EXPECT_EQ(clean.value("missed_grasps"), 0);
  EXPECT_EQ(clean.value("square"), 1);
  EXPECT_GT(result_of({"surgeon.grasp_error=0.5"}).value("missed_grasps"), 0);
  EXPECT_LT(result_of({"surgeon.order_error=1"}).value("square"), 1);
  EXPECT_GT(result_of({"surgeon.pause=2"}).value("pause"), 2 * clean.value("pause"));
  EXPECT_GT(result_of({"surgeon.tremor=0.0003"}).value("tremor"), 2 * clean.value("tremor"));
  EXPECT_GT(result_of({"surgeon.speed=0.08"}).value("time"), 1.1 * clean.value("time"));
}

}  // namespace
}  // namespace catgut
