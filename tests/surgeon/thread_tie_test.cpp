// SPDX-License-Identifier: Apache-2.0
// tests/surgeon: what a tie does when the stitch itself fails under it.
#include "surgeon/thread_tie.h"

#include <gtest/gtest.h>

namespace catgut {
namespace {

// A thread along x through a stitch at the origin; the forceps holds the needle, the needle holder is empty.
struct Stitch {
  PictureModel picture;
  Snapshot seen;
  std::array<ScriptedHand, 2> hands;
  Stitch() {
    SutureView& s = seen.active();
    for (uint32_t i = 0; i < 120; ++i)
      seen.particle.push_back({1e-3f * (static_cast<float>(i) - 40), 0, 0}), s.thread_order.push_back(i);
    s.thread_tension.assign(119, 0), s.thread_cut.assign(119, 0);
    for (const uint32_t node : {36u, 44u}) {
      SuturePointView& p = s.suture_point.emplace_back();
      p.anchored = node, p.position = seen.particle[node];
    }
    s.needle.pose.p = seen.particle.back();
    seen.tool[1].held = Held::needle;
  }
};

// The bites were torn out by a pull: there is nothing to tie. A seed of altemeier ended the program here.
TEST(ThreadTie, fails_when_the_bites_of_its_stitch_are_torn_out) {
  Stitch s;
  ThreadTie tie(s.picture, s.hands, {});
  tie.begin(s.seen, 1, 1, true);
  for (int i = 0; i < 10; ++i) ASSERT_FALSE(tie.operate(s.seen, 1.0f / 60));
  EXPECT_FALSE(tie.failed());
  s.seen.active().suture_point.clear();
  EXPECT_TRUE(tie.operate(s.seen, 1.0f / 60));
  EXPECT_TRUE(tie.failed());
}

TEST(ThreadTie, fails_at_once_when_there_is_no_stitch) {
  Stitch s;
  s.seen.active().suture_point.clear();
  ThreadTie tie(s.picture, s.hands, {});
  tie.begin(s.seen, 1, 1, true);
  EXPECT_TRUE(tie.operate(s.seen, 1.0f / 60));
  EXPECT_TRUE(tie.failed());
}

}  // namespace
}  // namespace catgut
