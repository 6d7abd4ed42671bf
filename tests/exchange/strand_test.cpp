// SPDX-License-Identifier: Apache-2.0
// tests/exchange: measures of the thread in a Snapshot.
#include <gtest/gtest.h>

#include "exchange/strand.h"

namespace catgut {
namespace {

TEST(Strand, a_stitch_is_cut_off_between_its_last_hole_and_the_needle) {
  SutureView suture;
  for (uint32_t i = 0; i < 10; ++i) suture.thread_order.push_back(100 + i);
  suture.thread_cut.assign(9, 0);
  suture.thread_cut[1] = 1;
  EXPECT_FALSE(is_cut_off(suture)) << "it is not sewn";
  suture.suture_point.resize(2);
  suture.suture_point[0].anchored = 104, suture.suture_point[1].anchored = 106;
  EXPECT_FALSE(is_cut_off(suture)) << "only its tail is cut";
  suture.thread_cut[7] = 1;
  EXPECT_TRUE(is_cut_off(suture));
}

TEST(Strand, largest_tension_leaves_out_what_the_hand_holds_itself) {
  Snapshot seen;
  seen.suture.resize(3);
  seen.active_suture = 1;
  seen.suture[0].thread_tension = {0.1f, 0.3f};
  seen.suture[1].thread_tension = {5, 4, 0.7f, 0.2f};
  seen.suture[2].thread_tension = {0.4f};
  EXPECT_EQ(largest_tension(seen, 0), 5);
  EXPECT_EQ(largest_tension(seen, 2), 0.7f);
  EXPECT_EQ(largest_tension(seen, 4), 0.4f) << "of the other sutures";
  seen.suture.assign(1, {});
  seen.active_suture = 0;
  EXPECT_EQ(largest_tension(seen, 0), 0) << "no thread";
}

// A stitch from (0, 0) to (4, 0) mm, whose tail and strand cross over its middle, and once more far from it.
TEST(Strand, the_knot_is_where_tail_and_strand_touch_near_the_stitch) {
  Snapshot seen;
  SutureView& s = seen.active();
  const auto add = [&](float x, float y) {
    s.thread_order.push_back(static_cast<uint32_t>(seen.particle.size()));
    seen.particle.push_back({1e-3f * x, 1e-3f * y, 0});
  };
  add(40, 30), add(10, 9), add(2.2f, 3), add(0, 0), add(4, 0), add(1.8f, 3), add(-10, 9), add(40, 30.1f);
  s.suture_point.resize(2);
  s.suture_point[0].anchored = 3, s.suture_point[1].anchored = 4;
  const Vec3 stitch{2e-3f, 0, 0};
  EXPECT_LT(distance(knot_center(seen, stitch), {2e-3f, 3e-3f, 0}), 1e-6f);
  seen.particle[2].x += 2e-3f;
  EXPECT_EQ(distance(knot_center(seen, stitch), stitch), 0) << "they touch only far away";
}

}  // namespace
}  // namespace catgut
