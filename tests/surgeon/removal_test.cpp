// SPDX-License-Identifier: Apache-2.0
// tests/surgeon: a stitch that is taken out, before its first throw and after it. No thread is left in the walls or beside
// them, and neither walls nor thread are torn.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>

#include "procedure/scene_file.h"
#include "procedure/scripted_surgeon.h"
#include "runtime/stitch_measures.h"
#include "sim/model.h"
#include "sim/state.h"
#include "surgeon/scripted.h"

namespace catgut {
namespace {

// One surgeon makes the stitch of `interrupted_tied` until it has `throws`, another takes it out.
void take_out(int throws) {
  const SceneSpec scene = read_scene("interrupted_tied");
  const std::shared_ptr<const Model> model = build_model(scene);
  const StatePtr state = initial_state(*model);
  Snapshot seen;
  publish(*model, *state, seen);
  Jobs jobs(2);
  const auto work = [&](Surgeon& surgeon, auto until, uint64_t seconds) {
    for (const uint64_t last = state->tick + seconds * 60; state->tick < last && !surgeon.done() && !until();) {
      TickInput input = surgeon.operate(seen, model->dt);
      input.tick = state->tick;
      if (state->tick < 30)
        for (ToolInput& hand : input.hand) hand.connected = 0;
      step(*model, *state, input, jobs);
      publish(*model, *state, seen);
      for (const Event& e : seen.event) EXPECT_NE(e.kind, EventKind::technique_fault) << static_cast<int>(e.fault);
    }
  };
  const std::unique_ptr<Surgeon> first = scripted_surgeon(scene, picture_model(*model));
  work(
      *first,
      [&] {
        const auto stitch = measure_stitches(seen);
        return first->doing().ends_with("under the strand") && !stitch.empty() && stitch[0].throws() >= throws;
      },
      120);
  const std::vector<StitchMeasures> before = measure_stitches(seen);
  ASSERT_EQ(before.size(), 1u) << first->doing();
  ASSERT_EQ(before[0].points, 4u);
  ASSERT_GE(before[0].throws(), throws) << first->doing();
  const Vec3 place = 0.5f * (seen.active().suture_point.front().position + seen.active().suture_point.back().position);

  Scripted second(plan_of(scene), picture_model(*model), skill_of(scene));
  second.take_over_to_remove();
  work(
      second, [] { return false; }, 60);
  std::printf("%s, %d retries\n", second.doing().c_str(), second.retries());
  EXPECT_EQ(second.doing(), "done");
  EXPECT_TRUE(seen.active().suture_point.empty());
  EXPECT_TRUE(state->physical.world.thread.eyelet.empty());
  float nearest = 1;
  for (const uint32_t slot : seen.active().thread_order) nearest = std::min(nearest, distance(seen.particle[slot], place));
  EXPECT_GT(nearest, 0.02f);
  for (const BiteView& b : seen.active().bite) EXPECT_FALSE(b.torn_out);
  EXPECT_EQ(seen.tool[0].held, Held::nothing);
  EXPECT_EQ(seen.tool[1].held, Held::nothing);
}

TEST(Surgeon, takes_a_stitch_out_that_has_no_throw) { take_out(0); }

TEST(Surgeon, takes_a_stitch_out_with_its_first_throw) {
  if (!std::getenv("CATGUT_LONG")) GTEST_SKIP() << "CATGUT_LONG=1 runs it";
  take_out(2);
}

}  // namespace
}  // namespace catgut
