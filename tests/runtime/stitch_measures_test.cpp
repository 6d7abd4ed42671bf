// SPDX-License-Identifier: Apache-2.0
// tests/runtime: throws of a finished stitch, seen in the form of its thread.
#include "runtime/stitch_measures.h"

#include <gtest/gtest.h>

#include "validation/knot_scenes.h"

namespace catgut {
namespace {

// A bite round a rod, tied with these throws. Suture points on both sides of the middle of the bite; the needle's end of the
// thread is cut off and lies far away, and is tied round nothing.
Snapshot tied(std::span<const validation::Throw> throws, uint32_t suture = 0) {
  const validation::LaidKnot knot = validation::lay_on_rod(throws, 0.35e-3f, 0.5e-3f);
  Snapshot seen;
  seen.suture.resize(suture + 1);
  seen.active_suture = suture;
  SutureView& s = seen.active();
  const uint32_t nodes = static_cast<uint32_t>(knot.state.nodes());
  for (uint32_t i = 0; i < nodes + 10; ++i) {
    seen.particle.push_back(i < nodes ? knot.state.position(i) : Vec3{0.2f + 1e-3f * static_cast<float>(i - nodes), 0.1f, 0});
    s.thread_order.push_back(i);
  }
  s.thread_cut.assign(nodes + 9, 0);
  s.thread_tension.assign(nodes + 9, 0.1f);
  s.thread_cut[nodes - 1] = 1;
  for (const uint32_t node : {knot.load_a - 2, knot.load_a + 2}) {
    SuturePointView& p = s.suture_point.emplace_back();
    p.anchored = node, p.position = seen.particle[node];
  }
  s.thread_tension[knot.load_a] = 0.7f;
  s.thread_tension[2] = 3;  // of the tail
  return seen;
}

TEST(StitchMeasures, name_the_throws_of_the_thread_as_it_lies) {
  const auto of = [](const std::vector<validation::Throw>& throws) {
    const std::vector<StitchMeasures> all = measure_stitches(tied(throws));
    EXPECT_EQ(all.size(), 1u);
    EXPECT_TRUE(all[0].finished);
    EXPECT_FLOAT_EQ(static_cast<float>(all[0].tension), 0.7f) << "between its holes, not that of a tail";
    return all[0];
  };
  const StitchMeasures square = of(validation::square()), granny = of(validation::granny()),
                       one = of(validation::single_throw());
  EXPECT_EQ(square.throws(), 2);
  EXPECT_EQ(square.alternating, 2);
  EXPECT_EQ(granny.throws(), 2);
  EXPECT_EQ(granny.alternating, 1);
  EXPECT_EQ(one.throws(), 1);
}

TEST(StitchMeasures, a_knot_that_has_come_apart_has_no_throws) {
  Snapshot seen = tied(validation::square());
  // Its tails are led away straight: the same thread, drawn out.
  for (uint32_t i = 0; i < seen.particle.size(); ++i) seen.particle[i] = {1e-3f * static_cast<float>(i), 0, 0};
  const std::vector<StitchMeasures> all = measure_stitches(seen);
  EXPECT_EQ(all[0].throws(), 0);
  EXPECT_EQ(throws_held(all), 0);
}

TEST(StitchMeasures, count_the_fewest_throws_of_finished_stitches) {
  std::vector<StitchMeasures> all = measure_stitches(tied(validation::square(), 2));
  ASSERT_EQ(all.size(), 1u);
  EXPECT_EQ(all[0].suture, 2u);
  EXPECT_EQ(throws_held({}), 0);
  EXPECT_EQ(throws_held(all), 2);
  StitchMeasures more = all[0], waits = all[0];
  more.right = 3, more.left = 2;
  waits.right = waits.left = 0, waits.finished = false;
  EXPECT_EQ(throws_held({more, all[0], waits}), 2) << "one that is not finished does not count";
  EXPECT_EQ(throws_held({waits}), 0);
  EXPECT_EQ(stitches_finished({more, all[0], waits}), 2) << "so that one without a knot is missed";
  EXPECT_EQ(stitches_finished({}), 0);
}

}  // namespace
}  // namespace catgut
