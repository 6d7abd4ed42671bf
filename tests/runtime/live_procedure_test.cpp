// SPDX-License-Identifier: Apache-2.0
// tests/runtime: a procedure in an interactive session. One stage alone, from the surgeon's work or a saved state; time that
// stands still while a stage is read; a demonstration that leaves no trace; counts that agree after an undo.
#include <gtest/gtest.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <thread>

#include "procedure/procedure_file.h"
#include "procedure/scene_file.h"
#include "runtime/live.h"
#include "runtime/session.h"
#include "sim/recording.h"
#include "sim/simulation.h"

namespace catgut {
namespace {

struct Desk {
  explicit Desk(const Procedure& p, size_t stage, bool tutorial = true) {
    LiveOptions options;
    options.procedure = std::make_shared<const Procedure>(p);
    options.stage = stage;
    options.tutorial = tutorial;
    live = std::make_unique<Live>(scene_of(p), options);
  }
  // Looks until it is so, at most a minute.
  bool until(const std::function<bool(const LiveStatus&)>& so) {
    for (int i = 0; i < 6000; ++i) {
      if (live->look(seen)) {
        for (Event e; live->event(e);) ++events[static_cast<size_t>(e.kind)];
        if (so(live->status())) return true;
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return false;
  }
  std::unique_ptr<Live> live;
  Snapshot seen;
  std::array<size_t, static_cast<size_t>(EventKind::count_)> events{};
};

TEST(LiveProcedure, time_stands_still_while_a_stage_is_read_and_a_demonstration_leaves_no_trace) {
  const Procedure lesson = read_procedure("first_stitch");
  const size_t pull = find_stage(lesson, "pull", "");
  Desk desk(lesson, pull);
  ASSERT_TRUE(desk.until([](const LiveStatus& s) { return s.reading; }));
  const LiveStatus at = desk.live->status();
  EXPECT_TRUE(at.prepared);
  EXPECT_EQ(at.procedure.stage, pull);
  EXPECT_EQ(at.procedure.bites, 2u) << "the surgeon made them";
  EXPECT_EQ(at.metrics.bites, 0u) << "not the user";
  EXPECT_EQ(desk.events[static_cast<size_t>(EventKind::bite_completed)], 0u);
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  desk.live->look(desk.seen);
  EXPECT_EQ(desk.live->status().tick, at.tick);

  const std::vector<Vec3> before = desk.seen.particle;
  desk.events = {};
  desk.live->command(LiveCommand::show_stage);
  ASSERT_TRUE(desk.until([](const LiveStatus& s) { return s.demonstrating; }));
  EXPECT_EQ(desk.live->status().speed, 0.5f) << "slow motion";
  ASSERT_TRUE(desk.until([](const LiveStatus& s) { return s.shown; }));
  ASSERT_TRUE(desk.until([](const LiveStatus& s) { return !s.demonstrating; }));
  const LiveStatus& after = desk.live->status();
  EXPECT_FALSE(after.not_shown) << "its goal was reached";
  EXPECT_TRUE(after.reading) << "and the user reads on";
  EXPECT_EQ(after.tick, at.tick);
  EXPECT_EQ(after.speed, 1.0f);
  EXPECT_EQ(after.procedure.stage, pull);
  EXPECT_TRUE(after.procedure.record[pull].assisted);
  for (const size_t n : desk.events) EXPECT_EQ(n, 0u) << "its events are not the user's";
  ASSERT_EQ(desk.seen.particle.size(), before.size());
  for (size_t i = 0; i < before.size(); ++i) ASSERT_EQ(distance(desk.seen.particle[i], before[i]), 0.0f);

  desk.live->command(LiveCommand::begin_stage);
  EXPECT_TRUE(desk.until([&](const LiveStatus& s) { return s.tick > at.tick + 5; }));
}

TEST(LiveProcedure, a_stage_starts_from_a_saved_state) {
  Procedure p = read_procedure("stay");
  const SceneSpec scene = scene_of(p);
  const auto model = build_model(scene);
  const StatePtr state = initial_state(*model);
  Jobs jobs(1);
  TickInput nothing;
  for (ToolInput& hand : nothing.hand) hand.connected = 0;
  for (int i = 0; i < 40; ++i) step(*model, *state, nothing, jobs);
  const std::string file = testing::TempDir() + "stage.cgrec";
  Recorder(file, RecordingHeader{catgut_version(), kStateVersion, write_scene(scene)}, save_state(*model, *state))
      .finish(false);
  p.stage[3].start = file;
  Desk desk(p, 3, false);
  ASSERT_TRUE(desk.until([](const LiveStatus& s) { return !s.settling && s.procedure.begun; }));
  EXPECT_EQ(desk.live->status().procedure.stage, 3u);
  EXPECT_GE(desk.seen.tick, 40u);
  EXPECT_LT(desk.seen.tick, 400u) << "the surgeon did not work";
  desk.live->finish();
  std::remove(file.c_str());
}

// The surgeon has clamped and cut. What the stage asks about was measured before it began.
TEST(LiveProcedure, a_stage_after_the_cut_knows_where_the_specimen_came_free_and_no_pen_is_on) {
  if (!std::getenv("CATGUT_LONG")) GTEST_SKIP() << "set CATGUT_LONG=1";
  const Procedure p = read_procedure("altemeier");
  Desk desk(p, 2, false);
  ASSERT_TRUE(desk.until([](const LiveStatus& s) { return !s.settling && s.procedure.begun && !s.preparing; }));
  EXPECT_EQ(desk.live->status().procedure.stage, 2u);
  EXPECT_GT(desk.seen.wound.freed_mass, 3e-3f) << "the specimen, and not a sliver";
  EXPECT_LT(length(desk.seen.wound.freed_at), 0.03f);
  for (const InstrumentView& i : desk.seen.instrument) EXPECT_EQ(i.pen, PenMode::off);
  desk.live->finish();
}

}  // namespace
}  // namespace catgut
