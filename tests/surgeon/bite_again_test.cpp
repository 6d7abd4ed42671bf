// SPDX-License-Identifier: Apache-2.0
// tests/surgeon: a bite that fails. The wall gives way under the needle, while it is driven or while it is pulled through: the
// surgeon withdraws it, nothing of the bite is left, and the next sweep goes through both walls.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <functional>

#include "procedure/scene_file.h"
#include "procedure/scripted_surgeon.h"
#include "sim/model.h"
#include "sim/state.h"
#include "surgeon/reach.h"

namespace catgut {
namespace {

// The scripted surgeon makes the stitch of the scene `interrupted`, and something happens in its second wall.
struct OneStitch {
  const std::shared_ptr<const Model> model;
  const StatePtr state;
  const std::unique_ptr<Surgeon> surgeon;
  Snapshot seen;
  int withdrawn = 0, slit = 0, torn_out = 0;

  explicit OneStitch(const SceneSpec& scene)
      : model(build_model(scene)), state(initial_state(*model)), surgeon(scripted_surgeon(scene, picture_model(*model))) {
    publish(*model, *state, seen);
  }

  physical::Needle& needle() { return state->physical.world.needle[0]; }
  bool doing(const char* what) const { return surgeon->doing().find(what) != std::string::npos; }
  // What lies between the needle's second channel and the edge bears this load [N].
  void load_second_channel(float load) {
    if (needle().channels < 2) return;
    const BiteView& bite = seen.active().bite.back();
    needle().channel[1].load = {bite.entry.x > 0 ? -load : load, 0, 0};
  }
  long complete() const {
    return std::count_if(seen.active().bite.begin(), seen.active().bite.end(), [](const BiteView& b) { return b.complete; });
  }
  // Until the surgeon is done. before: a step, after: what it did.
  void sew(const std::function<void()>& before, const std::function<void()>& after) {
    Jobs jobs(2);
    TickInput no_hands;
    for (ToolInput& hand : no_hands.hand) hand.connected = 0;
    for (uint64_t t = 0; t < 60 * 60 && !surgeon->done(); ++t) {
      TickInput input = t < 30 ? no_hands : surgeon->operate(seen, model->dt);
      input.tick = t;
      before();
      step(*model, *state, input, jobs);
      publish(*model, *state, seen);
      for (const Event& e : seen.event) {
        withdrawn += e.kind == EventKind::bite_withdrawn;
        if (e.kind != EventKind::technique_fault) continue;
        slit += e.fault == Fault::bite_torn, torn_out += e.fault == Fault::needle_torn_out;
        ASSERT_NE(e.fault, Fault::thread_broken);
      }
      after();
    }
    std::printf("%.1f s, %d retries\n", static_cast<double>(seen.tick) * static_cast<double>(model->dt), surgeon->retries());
  }
  void expect_a_stitch() {
    EXPECT_FALSE(surgeon->gave_up()) << surgeon->doing();
    EXPECT_GE(surgeon->retries(), 1);
    EXPECT_EQ(seen.active().suture_point.size(), 4u);
    EXPECT_EQ(state->physical.world.thread.eyelet.size(), 4u);
    EXPECT_EQ(complete(), 2);
  }
};

TEST(Surgeon, draws_the_thread_out_of_a_bite_that_failed_and_makes_it_again) {
  OneStitch stitch(read_scene("interrupted"));
  bool drawn_out = false;
  const auto pull = [&] {
    if (stitch.torn_out == 0 && stitch.doing("pull the needle through")) stitch.load_second_channel(40);
  };
  stitch.sew(pull, [&] {
    if (stitch.torn_out == 0 || drawn_out || !stitch.seen.active().suture_point.empty() || stitch.withdrawn == 0) return;
    drawn_out = true;
    EXPECT_TRUE(stitch.state->physical.world.thread.eyelet.empty()) << "no thread is left in the wall";
    EXPECT_EQ(stitch.complete(), 0);
    const StatePtr loaded = initial_state(*stitch.model);
    EXPECT_NO_THROW(load_state(*stitch.model, *loaded, save_state(*stitch.model, *stitch.state)));
  });
  EXPECT_GT(stitch.torn_out, 0);
  EXPECT_TRUE(drawn_out);
  EXPECT_GE(stitch.withdrawn, 1);
  stitch.expect_a_stitch();
}

TEST(Surgeon, withdraws_the_needle_when_it_slits_the_wall_instead_of_driving_it_on) {
  OneStitch stitch(read_scene("interrupted"));
  bool withdraws = false;
  float slit = 0;  // [m] at most, before the needle was withdrawn
  const auto drive = [&] {
    if (!withdraws && stitch.doing("drive the needle")) stitch.load_second_channel(20);
  };
  stitch.sew(drive, [&] {
    withdraws |= stitch.doing("withdraw and retry");
    if (!withdraws && !stitch.seen.active().bite.empty()) slit = std::max(slit, stitch.seen.active().bite.back().torn);
  });
  EXPECT_EQ(stitch.slit, 1);
  EXPECT_TRUE(withdraws);
  EXPECT_GT(slit, 1e-3f);
  EXPECT_LT(slit, 4e-3f);
  stitch.expect_a_stitch();
}

// Thread sticks in its first hole, as a snarl before it would. The strand that was drawn out is too short for a throw: wound
// with it, the jaws would go down into the tissue.
TEST(Surgeon, does_not_tie_a_stitch_whose_thread_is_caught) {
  OneStitch stitch(read_scene("interrupted_tied"));
  float most = 0;  // [N]
  bool sticks = false, ties = false;
  const auto hold_thread = [&] {
    std::vector<thread::Eyelet>& eyelet = stitch.state->physical.world.thread.eyelet;
    if (eyelet.empty() || !stitch.doing("pull the thread")) return;
    eyelet.front().friction = 30, sticks = true;
  };
  stitch.sew(hold_thread, [&] {
    for (const SuturePointView& p : stitch.seen.active().suture_point)
      most = std::max({most, p.tension_needle, p.tension_free});
    ties |= stitch.doing("throw");
  });
  std::printf("%s, at most %.2f N in the holes\n", stitch.surgeon->doing().c_str(), static_cast<double>(most));
  EXPECT_TRUE(sticks);
  EXPECT_FALSE(ties);
  EXPECT_TRUE(stitch.surgeon->gave_up());
  EXPECT_TRUE(stitch.doing("the thread is caught"));
  EXPECT_LT(most, 4);
}

// A wall that turns along the needle is taken along by it, with ever more force, until it tears. The hand feels that.
TEST(Surgeon, withdraws_the_needle_when_a_wall_rides_up_on_it) {
  OneStitch stitch(read_scene("interrupted"));
  bool withdraws = false;
  int felt = 0;  // ticks
  stitch.sew([] {},
             [&] {
               withdraws |= stitch.doing("withdraw and retry");
               if (withdraws || stitch.needle().channels == 0 || !stitch.doing("drive the needle")) return;
               stitch.seen.tool[0].force = {0, 1.8f, 0}, ++felt;
             });
  EXPECT_TRUE(withdraws);
  EXPECT_GT(felt, 10);
  EXPECT_LT(felt, 20);
  stitch.expect_a_stitch();
}

// Thread that runs between closed jaws behind what they hold is pulled along with it.
TEST(Surgeon, sees_thread_between_its_jaws) {
  PictureModel picture;
  Snapshot seen;
  seen.suture.resize(1);
  for (uint32_t i = 0; i < 21; ++i) {
    seen.suture[0].thread_order.push_back(i);
    seen.particle.push_back({0.001f * (static_cast<float>(i) - 10), 0, 0});
  }
  ToolView jaws;
  const auto at = [&](Vec3 p) {
    jaws.pose.p = p;
    return catches_thread(picture, seen, jaws);
  };
  EXPECT_TRUE(at({0, 0, -0.013f})) << "13 mm behind the tip";
  EXPECT_FALSE(at({0, 0, -0.001f})) << "what the tip holds";
  EXPECT_FALSE(at({0, 0, 0.013f})) << "before the tip";
  EXPECT_FALSE(at({0, 0.0014f, -0.013f})) << "on the jaws";
  EXPECT_FALSE(at({0.02f, 0, -0.013f})) << "beyond the thread's end";
}

// A cut-off tail was carried away with the tail of a finished stitch, whose knot came undone (altemeier, seed 3).
TEST(Surgeon, sees_thread_of_another_suture_between_its_jaws) {
  PictureModel picture;
  Snapshot seen;
  seen.suture.resize(2);
  for (uint32_t i = 0; i < 42; ++i) {  // 10 mm apart
    seen.suture[i / 21].thread_order.push_back(i);
    seen.particle.push_back({0.001f * (static_cast<float>(i % 21) - 10), 0.01f * static_cast<float>(i / 21), 0});
  }
  ToolView jaws;
  const auto at = [&](Vec3 p) {
    jaws.pose.p = p;
    return catches_other_thread(picture, seen, jaws);
  };
  EXPECT_FALSE(at({0, 0, -0.001f})) << "its own";
  EXPECT_TRUE(at({0, 0.01f, -0.001f})) << "in the tips";
  EXPECT_TRUE(at({0, 0.01f, -0.013f})) << "13 mm behind them";
  EXPECT_FALSE(at({0, 0.0086f, -0.001f})) << "beside them";
}

}  // namespace
}  // namespace catgut
