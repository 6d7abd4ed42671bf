// SPDX-License-Identifier: Apache-2.0
// tests/runtime: the live loop: its pace, its commands, and that its recording is correct. Loose bounds on time: the
// machine that runs this may be busy. Meaningful under the thread sanitizer.
#include "runtime/live.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <functional>
#include <thread>

#include "core/check.h"
#include "procedure/scene_file.h"
#include "runtime/blend.h"
#include "runtime/hands.h"
#include "runtime/session.h"
#include "sim/simulation.h"
#include "small.h"
#include "surgeon/surgeon.h"

namespace catgut {
namespace {

// Looks until `done`, at most `seconds`.
bool wait_for(Live& live, double seconds, const std::function<bool(const LiveStatus&)>& done) {
  const double until = wall_seconds() + seconds;
  Snapshot seen;
  do {
    live.look(seen);
    if (done(live.status())) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  } while (wall_seconds() < until);
  return false;
}
bool is_working(const LiveStatus& s) { return !s.settling; }

ToolInput hand_at(Vec3 p) {
  ToolInput hand;
  hand.pose.p = p;
  return hand;
}

TEST(Live, keeps_the_scenes_time) {
  Live live(small_scene(), {});
  ASSERT_TRUE(wait_for(live, 20, is_working));
  const uint64_t before = live.status().tick;
  const double start = wall_seconds();
  wait_for(live, 1.0, [](auto&) { return false; });
  const double passed = wall_seconds() - start, ticks = static_cast<double>(live.status().tick - before);
  EXPECT_LT(ticks, passed * 60 * 1.2 + 3) << "never faster than real time, but for what is caught up";
  EXPECT_NEAR(ticks + static_cast<double>(live.status().late), passed * 60, passed * 60 * 0.5) << "missing ticks are counted";
  EXPECT_TRUE(live.status().fault.empty());
}

TEST(Live, slow_motion_is_slow) {
  Live live(small_scene(), {});
  ASSERT_TRUE(wait_for(live, 20, is_working));
  for (int i = 0; i < 9; ++i) live.command(LiveCommand::slower);
  ASSERT_TRUE(wait_for(live, 5, [](auto& s) { return s.speed == kLiveSpeeds.back(); }));
  const uint64_t before = live.status().tick;
  wait_for(live, 0.5, [](auto&) { return false; });
  EXPECT_LE(live.status().tick - before, 8u) << "a tenth of 30";
  EXPECT_TRUE(wait_for(live, 5, [&](auto& s) { return s.tick > before; })) << "but it goes on";
}

TEST(Live, a_scene_too_heavy_for_the_machine_says_so) {
  SceneSpec scene = small_scene();
  scene.body[0].particles = 1228;
  scene.solver.substeps = 16;
  scene.solver.tick_rate = 20000;  // faster than any machine
  scene.settle = 0.001f;
  Live live(scene, {});
  ASSERT_TRUE(wait_for(live, 20, is_working));
  EXPECT_TRUE(wait_for(live, 20, [](auto& s) { return s.late > 100 && s.time_factor > 0 && s.time_factor < 0.9f; }))
      << "late " << live.status().late << ", factor " << live.status().time_factor;
  EXPECT_TRUE(live.status().fault.empty());
}

TEST(Live, pause_stops_and_a_single_step_is_one_tick) {
  LiveOptions options;
  options.start_paused = true;
  Live live(small_scene(), options);
  ASSERT_TRUE(wait_for(live, 20, is_working));
  const uint64_t settled = live.status().tick;
  EXPECT_EQ(settled, 3u) << "settling is not paused";
  wait_for(live, 0.2, [](auto&) { return false; });
  EXPECT_EQ(live.status().tick, settled);
  live.command(LiveCommand::single_step);
  EXPECT_TRUE(wait_for(live, 5, [&](auto& s) { return s.tick == settled + 1; }));
  wait_for(live, 0.2, [](auto&) { return false; });
  EXPECT_EQ(live.status().tick, settled + 1);
  for (int i = 0; i < 3; ++i) live.command(LiveCommand::single_step);
  wait_for(live, 0.4, [](auto&) { return false; });
  EXPECT_EQ(live.status().tick, settled + 4);
  live.command(LiveCommand::resume);
  EXPECT_TRUE(wait_for(live, 5, [&](auto& s) { return s.tick > settled + 10; }));
  live.command(LiveCommand::pause);
  ASSERT_TRUE(wait_for(live, 5, [](auto& s) { return s.paused; }));
  const uint64_t at = live.status().tick;
  wait_for(live, 0.2, [](auto&) { return false; });
  EXPECT_EQ(live.status().tick, at);
}

TEST(Live, tools_follow_the_hands_at_a_hands_speed) {
  LiveOptions options;
  options.start_paused = true;
  Live live(small_scene(), options);
  ASSERT_TRUE(wait_for(live, 20, is_working));
  const auto one_tick = [&] {
    const uint64_t at = live.status().tick;
    live.command(LiveCommand::single_step);
    EXPECT_TRUE(wait_for(live, 5, [&](auto& s) { return s.tick > at; }));
    Snapshot seen;
    live.look(seen);
    return seen.tool[0].hand.p;
  };
  live.hand(0, hand_at({0, 0.2f, 0}));
  EXPECT_EQ(one_tick().y, 0.2f) << "a hand that appears is where it is";
  live.hand(0, hand_at({0, 0.25f, 0}));
  EXPECT_NEAR(one_tick().y, 0.21f, 1e-4f) << "0.6 m/s, a sixtieth of a second";
  EXPECT_NEAR(one_tick().y, 0.22f, 1e-4f);
  ToolInput pressed = hand_at({0, 0.25f, 0}), open = pressed;
  pressed.buttons = kButtonNewSuture;
  live.hand(0, pressed);
  live.hand(0, open);  // before the next tick
  one_tick();
  bool taken = false;
  for (Event e; live.event(e);) taken = taken || e.kind == EventKind::suture_loaded;
  EXPECT_TRUE(taken) << "a button pressed and let go between two ticks still counts";
}

TEST(Live, restart_is_the_settled_scene) {
  LiveOptions options;
  options.start_paused = true;
  Live live(small_scene(), options);
  ASSERT_TRUE(wait_for(live, 20, is_working));
  Snapshot first, later, again;
  live.look(first);
  live.hand(0, hand_at({0, 0.01f, 0.02f}));  // into the tissue
  for (int i = 0; i < 5; ++i) live.command(LiveCommand::single_step);
  ASSERT_TRUE(wait_for(live, 10, [&](auto& s) { return s.tick == first.tick + 5; }));
  live.look(later);
  EXPECT_GT(live.status().metrics.time_s, 0.05);
  live.command(LiveCommand::restart);
  ASSERT_TRUE(wait_for(live, 5, [](auto& s) { return s.epoch == 1; }));
  live.look(again);
  EXPECT_EQ(again.tick, first.tick);
  EXPECT_TRUE(again.particle == first.particle);
  EXPECT_FALSE(later.particle == first.particle);
  EXPECT_EQ(live.status().metrics.time_s, 0);
}

TEST(Live, the_recording_replays) {
  const std::string path = testing::TempDir() + "catgut_live_" + std::to_string(::getpid()) + ".cgrec";
  LiveOptions options;
  options.record = path;
  LiveResult result;
  {
    Live live(small_scene(), options);
    ASSERT_TRUE(wait_for(live, 20, is_working));
    uint64_t turn = 0;
    wait_for(live, 0.5, [&](auto&) {
      const float a = 0.01f * static_cast<float>(++turn);
      live.hand(turn & 1, hand_at({0.03f * std::cos(a), 0.01f, 0.03f * std::sin(a)}));
      return false;
    });
    live.command(LiveCommand::restart);
    ASSERT_TRUE(wait_for(live, 5, [](auto& s) { return s.epoch == 1; }));
    const uint64_t at = live.status().tick;
    live.hand(0, hand_at({0, 0.02f, 0}));
    ASSERT_TRUE(wait_for(live, 10, [&](auto& s) { return s.tick > at + 10; }));
    result = live.finish();
  }
  ASSERT_EQ(result.recorded.size(), 2u) << "a restart begins another file";
  EXPECT_EQ(result.recorded[1], path.substr(0, path.size() - 6) + ".2.cgrec");
  uint64_t ticks = 0, hash = 0;
  for (const std::string& file : result.recorded) {
    const Recording recording = read_recording(file);
    EXPECT_FALSE(recording.truncated) << recording.fault;
    const ReplayResult replay = replay_session(recording, file, true, 2);
    EXPECT_FALSE(replay.differs_at.has_value()) << file;
    ticks += recording.tick.size();
    hash = replay.run.state_hash;
    std::filesystem::remove(file);
  }
  EXPECT_EQ(ticks, result.ticks);
  EXPECT_EQ(hash, result.state_hash);
}

// Frames that take half a second, repeatedly. The hashes of the recording, which is all of the physics, equal
// those with smooth frames, tick for tick, and no time is lost. The hands are a recording's: they depend only on time.
TEST(Live, a_picture_that_stalls_changes_no_bit_and_loses_no_tick) {
  const std::string folder = testing::TempDir(), id = std::to_string(::getpid());
  const std::string hands = folder + "catgut_hands_" + id + ".cgrec";
  {
    const auto model = build_model(small_scene());
    Recorder recorder(hands, {catgut_version(), kStateVersion, write_scene(small_scene())},
                      save_state(*model, *initial_state(*model)));
    TickInput input;
    for (input.tick = 0; input.tick < 600; ++input.tick) {
      const float a = 0.03f * static_cast<float>(input.tick);
      input.hand[0] = hand_at({0.02f * std::cos(a), 0.012f * std::cos(2 * a), 0.02f * std::sin(a)});
      recorder.tick(input, 0);
    }
    recorder.finish(false);
  }
  std::vector<RecordedTick> ticks[2];
  for (const bool stalls : {false, true}) {
    LiveOptions options;
    options.surgeon = hands;
    options.record = folder + "catgut_stall_" + id + ".cgrec";
    {
      Live live(small_scene(), options);
      ASSERT_TRUE(wait_for(live, 20, is_working));
      Snapshot seen;
      const double start = wall_seconds();
      const uint64_t first = live.status().tick;
      for (int picture = 0; picture < 3; ++picture) {
        live.look(seen);
        const uint64_t before = live.status().tick, late = live.status().late;
        if (stalls) std::this_thread::sleep_for(std::chrono::milliseconds(500));
        else wait_for(live, 0.5, [](auto&) { return false; });
        live.look(seen);
        EXPECT_NEAR(static_cast<double>(live.status().tick - before + live.status().late - late), 30, 8) << "time goes on";
      }
      const double passed = wall_seconds() - start;
      EXPECT_NEAR(static_cast<double>(live.status().tick - first + live.status().late), passed * 60, 8);
      EXPECT_EQ(live.status().events_lost, 0u);
      live.finish();
    }
    const Recording r = read_recording(options.record);
    EXPECT_FALSE(r.truncated) << r.fault;
    EXPECT_FALSE(replay_session(r, "stall", true, 1).differs_at.has_value());
    ticks[stalls] = r.tick;
    std::filesystem::remove(options.record);
  }
  std::filesystem::remove(hands);
  const size_t both = std::min(ticks[0].size(), ticks[1].size());
  ASSERT_GT(both, 40u);
  for (size_t k = 0; k < both; ++k) ASSERT_EQ(ticks[0][k].hash, ticks[1][k].hash) << "tick " << k;
}

TEST(Live, a_parameter_changed_in_between_is_in_the_recording) {
  LiveOptions options;
  options.record = testing::TempDir() + "catgut_change_" + std::to_string(::getpid()) + ".cgrec";
  LiveResult result;
  {
    Live live(small_scene(), options);
    live.watch(true);
    ASSERT_TRUE(wait_for(live, 20, is_working));
    live.hand(0, hand_at({0, 0.01f, 0.02f}));
    uint64_t at = live.status().tick;
    ASSERT_TRUE(wait_for(live, 10, [&](auto& s) { return s.tick > at + 10; }));
    EXPECT_TRUE(live.change("solver.damping=17"));
    EXPECT_TRUE(live.change("solver.dampin=17"));
    ASSERT_TRUE(wait_for(live, 20, [&](auto& s) { return !s.refused.empty(); }));
    EXPECT_NE(live.status().refused.find("did you mean"), std::string::npos);
    EXPECT_EQ(live.status().epoch, 0u) << "nobody jumps";
    EXPECT_GT(live.status().metrics.time_s, 0.1);
    at = live.status().tick;
    ASSERT_TRUE(wait_for(live, 10, [&](auto& s) { return s.tick > at + 10; }));
    const Measures& m = live.status().measures;
    EXPECT_EQ(m.particles, 330u);
    EXPECT_EQ(m.thread_particles, 30u);
    EXPECT_GT(m.clusters, 100u);
    EXPECT_GT(m.stage_ms[static_cast<size_t>(Stage::shape)], 0);
    live.change("body.particles=200");
    ASSERT_TRUE(wait_for(live, 20, [&](auto& s) { return s.refused.find("did you mean") == std::string::npos; }));
    EXPECT_FALSE(live.status().refused.empty()) << "a state that does not fit is refused";
    at = live.status().tick;
    EXPECT_TRUE(wait_for(live, 10, [&](auto& s) { return s.tick > at + 3; })) << "and the work goes on";
    result = live.finish();
  }
  ASSERT_EQ(result.recorded.size(), 2u);
  for (const std::string& file : result.recorded) {
    const Recording r = read_recording(file);
    EXPECT_FALSE(replay_session(r, file, true, 1).differs_at.has_value()) << file;
    EXPECT_EQ(parse_scene(r.header.scene, file).solver.damping == 17, file != options.record);
    std::filesystem::remove(file);
  }
}

// The maximum force between tools depends on the source of the hands; the recording states it.
TEST(Live, hands_that_feel_nothing_press_their_tools_softly) {
  const auto recorded = [](float force, const std::string& surgeon) {
    LiveOptions options;
    options.record = testing::TempDir() + "catgut_force_" + std::to_string(::getpid()) + ".cgrec";
    options.surgeon = surgeon;
    SceneSpec scene = small_scene();
    scene.solver.tool_force = force;
    {
      Live live(scene, options);
      EXPECT_TRUE(wait_for(live, 20, [](auto& s) { return s.tick > 3; }));
      live.finish();
    }
    const Recording r = read_recording(options.record);
    std::filesystem::remove(options.record);
    return parse_scene(r.header.scene, options.record).solver.tool_force;
  };
  EXPECT_EQ(recorded(8, ""), kUnfeltToolForce);
  EXPECT_EQ(recorded(1, ""), 1) << "softer than that was asked for";
  EXPECT_EQ(recorded(8, "none"), 8) << "nobody's hands push on";
}

TEST(Live, every_live_parameter_is_one) {
  const SceneSpec scene = read_scene("purse_string");
  for (const LiveParameter& p : live_parameters()) {
    for (const float v : {p.low, p.high}) {
      SceneSpec changed = scene;
      EXPECT_NO_THROW(set_value(changed, std::string(p.key) + "=" + std::to_string(v))) << p.key;
      EXPECT_NEAR(p.value(changed), v, 1e-6f) << p.key;
    }
    EXPECT_GE(p.value(scene), p.low) << p.key;
    EXPECT_LE(p.value(scene), p.high) << p.key;
  }
}

TEST(Live, what_cannot_be_recorded_is_refused_before_it_starts) {
  LiveOptions options;
  options.record = "/proc/nowhere/x.cgrec";
  EXPECT_THROW(Live(small_scene(), options), InputError);
}

// A whole bite by hands that publish like any device; then it is undone.
TEST(Live, a_bite_can_be_taken_back) {
#ifdef CATGUT_SANITIZED
  GTEST_SKIP() << "a bite in real time is out of reach under a sanitizer";
#endif
  const SceneSpec scene = read_scene("purse_string");
  Live live(scene, {});
  const auto surgeon = make_surgeon("purse_string", live.picture(), SurgeonSkill{});
  const float dt = 1 / scene.solver.tick_rate;
  Snapshot seen;
  uint64_t acted = 0, entered_at = 0;
  double until = wall_seconds() + 90;
  bool completed = false;
  while (!completed && wall_seconds() < until) {
    live.look(seen);
    for (Event e; live.event(e);) {
      if (e.kind == EventKind::tip_entered) entered_at = e.tick;
      completed = completed || e.kind == EventKind::bite_completed;
    }
    if (is_working(live.status()) && live.status().tick > acted) {
      acted = live.status().tick;
      const auto hands = surgeon->operate(seen, dt).hand;
      for (size_t k = 0; k < 2; ++k) live.hand(k, hands[k]);
    } else {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }
  ASSERT_TRUE(completed) << surgeon->doing();
  ASSERT_TRUE(wait_for(live, 5, [](auto& s) { return s.metrics.bites == 1; }));
  ASSERT_EQ(live.status().to_take_back, 1u);
  EXPECT_GT(live.status().metrics.path[0], 0.05f);
  live.command(LiveCommand::take_back);
  live.command(LiveCommand::pause);
  ASSERT_TRUE(wait_for(live, 5, [](auto& s) { return s.epoch == 1 && s.paused; }));
  live.look(seen);
  EXPECT_LT(seen.tick, entered_at - static_cast<uint64_t>(0.2f / dt));
  EXPECT_GT(seen.tick + static_cast<uint64_t>(2.0f / dt), entered_at) << "not further back than needed";
  EXPECT_TRUE(seen.active().bite.empty());
  EXPECT_TRUE(seen.active().suture_point.empty());
  EXPECT_EQ(seen.tool[0].held, Held::needle);
  EXPECT_EQ(live.status().metrics.bites, 0u);
  EXPECT_EQ(live.status().metrics.undos, 1u);
  EXPECT_EQ(live.status().to_take_back, 0u);
  // The hands that were sent before are not followed: the tool stays until newer ones arrive.
  const Vec3 hand = seen.tool[0].hand.p;
  for (int i = 0; i < 3; ++i) live.command(LiveCommand::single_step);
  const uint64_t at = seen.tick;
  ASSERT_TRUE(wait_for(live, 5, [&](auto& s) { return s.tick == at + 3; }));
  live.look(seen);
  EXPECT_LT(distance(seen.tool[0].hand.p, hand), 1e-6f);
  EXPECT_EQ(seen.tool[0].held, Held::needle);
  EXPECT_TRUE(live.finish().map.bite.empty()) << "nor is it in what was sewn";
}

TEST(Blend, is_between_the_two_and_ends_at_the_newer) {
  Snapshot a, b, out;
  a.tick = 4, b.tick = 5;
  a.time_s = 1, b.time_s = 2;
  a.particle = {{0, 0, 0}, {1, 0, 0}};
  b.particle = {{0, 1, 0}, {1, 2, 0}};
  b.tool[0].pose.p = {0.01f, 0, 0};
  b.tool[1].pose.p = {1, 0, 0};
  blend(a, b, 0.25f, out);
  EXPECT_EQ(out.time_s, 1.25);
  EXPECT_NEAR(out.particle[1].y, 0.5f, 1e-6f);
  EXPECT_NEAR(out.tool[0].pose.p.x, 0.0025f, 1e-6f);
  EXPECT_EQ(out.tool[1].pose.p.x, 1) << "it was placed there, it did not fly";
  blend(a, b, 7, out);
  EXPECT_TRUE(out.particle == b.particle);
  b.tick = 9;
  blend(a, b, 0.25f, out);
  EXPECT_TRUE(out.particle == b.particle) << "two that do not follow each other are not mixed";
}

}  // namespace
}  // namespace catgut
