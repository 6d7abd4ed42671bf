// SPDX-License-Identifier: Apache-2.0
// tests/surgeon: a bite that fails. The needle tears out of the second wall while it is pulled through: the thread is drawn
// out of the first one, nothing of the bite is left, and the next sweep goes through both.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>

#include "procedure/scene_file.h"
#include "procedure/scripted_surgeon.h"
#include "sim/model.h"
#include "sim/state.h"

namespace catgut {
namespace {

TEST(Surgeon, draws_the_thread_out_of_a_bite_that_failed_and_makes_it_again) {
  const SceneSpec scene = read_scene("interrupted");
  const std::shared_ptr<const Model> model = build_model(scene);
  const StatePtr state = initial_state(*model);
  const std::unique_ptr<Surgeon> surgeon = scripted_surgeon(scene, picture_model(*model));
  Jobs jobs(2);
  Snapshot seen;
  TickInput no_hands;
  for (ToolInput& hand : no_hands.hand) hand.connected = 0;
  publish(*model, *state, seen);
  bool torn = false, drawn_out = false;
  int withdrawn = 0;
  for (uint64_t t = 0; t < 60 * 60 && !surgeon->done(); ++t) {
    TickInput input = t < 30 ? no_hands : surgeon->operate(seen, model->dt);
    input.tick = t;
    physical::Needle& needle = state->physical.world.needle[0];
    const bool pulled = surgeon->doing().find("pull the needle through") != std::string::npos;
    if (!torn && pulled && needle.channels == 2)  // what lies between its channel and the edge gives way
      needle.channel[1].load = {seen.active().bite.back().exit.x > 0 ? -40.0f : 40.0f, 0, 0};
    step(*model, *state, input, jobs);
    publish(*model, *state, seen);
    for (const Event& e : seen.event) {
      if (e.kind == EventKind::technique_fault && e.fault == Fault::needle_torn_out) torn = true;
      if (e.kind == EventKind::bite_withdrawn) ++withdrawn;
      ASSERT_FALSE(e.kind == EventKind::technique_fault && e.fault == Fault::thread_broken);
    }
    if (torn && !drawn_out && seen.active().suture_point.empty() && withdrawn > 0) {
      drawn_out = true;
      EXPECT_TRUE(state->physical.world.thread.eyelet.empty()) << "no thread is left in the wall";
      const auto complete = [](const BiteView& b) { return b.complete; };
      EXPECT_TRUE(std::none_of(seen.active().bite.begin(), seen.active().bite.end(), complete));
      const StatePtr loaded = initial_state(*model);
      EXPECT_NO_THROW(load_state(*model, *loaded, save_state(*model, *state)));
    }
  }
  std::printf("%.1f s, %d retries\n", static_cast<double>(seen.tick) * static_cast<double>(model->dt), surgeon->retries());
  EXPECT_TRUE(torn);
  EXPECT_TRUE(drawn_out);
  EXPECT_EQ(withdrawn, 1);
  EXPECT_FALSE(surgeon->gave_up()) << surgeon->doing();
  EXPECT_GE(surgeon->retries(), 1);
  EXPECT_EQ(seen.active().suture_point.size(), 4u);
  EXPECT_EQ(state->physical.world.thread.eyelet.size(), 4u);
  EXPECT_EQ(std::count_if(seen.active().bite.begin(), seen.active().bite.end(), [](const BiteView& b) { return b.complete; }),
            2);
}

}  // namespace
}  // namespace catgut
