// SPDX-License-Identifier: Apache-2.0
// tests/exchange: which suture a button means.
#include "exchange/buttons.h"

#include <gtest/gtest.h>

namespace catgut {
namespace {

// Three straight threads along x, 10 mm apart in z, of 5 particles each.
Snapshot three_threads() {
  Snapshot seen;
  seen.suture.resize(3);
  for (uint32_t k = 0; k < 3; ++k)
    for (uint32_t i = 0; i < 5; ++i) {
      seen.suture[k].thread_order.push_back(static_cast<uint32_t>(seen.particle.size()));
      seen.particle.push_back({0.004f * static_cast<float>(i), 0, 0.01f * static_cast<float>(k)});
      if (i > 0) seen.suture[k].thread_cut.push_back(0);
    }
  return seen;
}

TEST(Buttons, a_cut_means_the_thread_at_the_jaws) {
  Snapshot seen = three_threads();
  seen.tool[2].pose.p = {0.006f, 0.002f, 0.011f};  // between two particles of thread 1
  EXPECT_EQ(suture_to_cut(seen, 2), 1u);
  seen.suture[1].thread_cut.assign(4, 1);
  EXPECT_EQ(suture_to_cut(seen, 2), 2u) << "what is cut already is not cut again";
  seen.tool[2].held = Held::needle, seen.tool[2].held_suture = 0;
  EXPECT_EQ(suture_to_cut(seen, 2), 0u) << "a needle in the jaws: the thread is cut off it";
}

TEST(Buttons, a_new_suture_replaces_the_one_in_the_hand_else_the_active_one) {
  Snapshot seen = three_threads();
  seen.active_suture = 1;
  EXPECT_EQ(suture_to_replace(seen, 0), 1u);
  seen.tool[0].held = Held::tissue, seen.tool[0].held_suture = 2;
  EXPECT_EQ(suture_to_replace(seen, 0), 1u);
  seen.tool[0].held = Held::thread;
  EXPECT_EQ(suture_to_replace(seen, 0), 2u);
}

TEST(Buttons, each_press_is_one_command_of_its_hand) {
  const Snapshot seen = three_threads();
  CommandList out;
  add_commands(out, 3, 0, seen);
  EXPECT_EQ(out.count, 0u);
  add_commands(out, 3, kButtonCut | kButtonNewSuture | 1u << 7, seen);
  ASSERT_EQ(out.count, 2u);
  EXPECT_TRUE(out.row[0].kind == CommandKind::cut && out.row[0].hand == 3);
  EXPECT_TRUE(out.row[1].kind == CommandKind::new_suture && out.row[1].hand == 3);
}

}  // namespace
}  // namespace catgut
