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

}  // namespace
}  // namespace catgut
