// SPDX-License-Identifier: Apache-2.0
// tests/hands: a whole stitch of the stay scene, from the needle on the drape to a knot of two throws, by a user with a mouse
// or a gamepad. In lock step, without a window.
#include <gtest/gtest.h>

#include "lock_step.h"

namespace catgut {
namespace {

void make_a_stitch(WorkQueue& desk) {
  Person me(desk);
  ASSERT_TRUE(me.take_needle()) << me.doing();
  ASSERT_TRUE(me.bite()) << me.doing();
  ASSERT_TRUE(me.hand_back()) << me.doing();
  ASSERT_TRUE(me.bite()) << me.doing();
  ASSERT_TRUE(me.pull_tail(0.09f)) << me.doing();
  ASSERT_TRUE(me.draw_together()) << me.doing();
  ASSERT_TRUE(me.tie(1)) << me.doing();
  ASSERT_TRUE(me.tie(-1)) << me.doing();
  EXPECT_EQ(desk.count(EventKind::bite_completed), 2u);
  EXPECT_GE(desk.count(EventKind::seam_closed), 1u);
  EXPECT_EQ(desk.count(EventKind::throw_locked), 2u);
  EXPECT_EQ(desk.count(EventKind::technique_fault), 0u);
  ASSERT_EQ(desk.look().seen.active().knot.size(), 1u);
  const KnotView& knot = desk.look().seen.active().knot[0];
  EXPECT_EQ(knot.throws, 2u);
  EXPECT_NE(knot.thrown[0].chirality, knot.thrown[1].chirality) << "a reef knot, no granny";
}

// A frame every tick, and ten frames per second, as on a machine without a graphics card.
class Stitch : public testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Pictures, Stitch, testing::Values(1, 6));

TEST_P(Stitch, by_mouse) {
  AtTheMouse desk(GetParam());
  make_a_stitch(desk);
}

TEST_P(Stitch, by_gamepad) {
  AtThePad desk(GetParam());
  make_a_stitch(desk);
}

}  // namespace
}  // namespace catgut
