// SPDX-License-Identifier: Apache-2.0
// tests/exchange: a stitch is finished when its thread is cut between its last hole and the needle.
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

}  // namespace
}  // namespace catgut
