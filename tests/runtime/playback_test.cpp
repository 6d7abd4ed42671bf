// SPDX-License-Identifier: Apache-2.0
// tests/runtime: the viewer of recordings: every position shows its state, in any order of seeking.
#include "runtime/playback.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <functional>
#include <thread>

#include "core/check.h"
#include "procedure/scene_file.h"
#include "runtime/session.h"
#include "sim/simulation.h"
#include "small.h"

namespace catgut {
namespace {

// Three seconds of a hand that pokes the tissue.
const Recording& poked() {
  static const Recording made = [] {
    const SceneSpec scene = small_scene();
    const auto model = build_model(scene);
    const auto state = initial_state(*model);
    Jobs jobs(1);
    const std::string path = testing::TempDir() + "catgut_playback_" + std::to_string(::getpid()) + ".cgrec";
    {
      Recorder recorder(path, {catgut_version(), kStateVersion, write_scene(scene)}, save_state(*model, *state));
      TickInput input;
      for (input.tick = 0; input.tick < 180; ++input.tick) {
        const float a = 0.05f * static_cast<float>(input.tick);
        input.hand[0].pose.p = {0.02f * std::cos(a), 0.012f * std::cos(2 * a), 0.02f * std::sin(a)};
        step(*model, *state, input, jobs);
        recorder.tick(input, hash_state(*model, *state));
      }
      recorder.finish(false);
    }
    const Recording recording = read_recording(path);
    std::filesystem::remove(path);
    return recording;
  }();
  return made;
}

bool wait_for(Playback& p, Snapshot& seen, const std::function<bool(const PlaybackStatus&)>& done, double seconds = 30) {
  const double until = wall_seconds() + seconds;
  do {
    p.look(seen);
    if (done(p.status())) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  } while (wall_seconds() < until);
  return false;
}

// The recorded truth.
std::vector<Vec3> particles_after(uint64_t ticks) {
  const Recording& r = poked();
  const auto model = build_model(parse_scene(r.header.scene, "small"));
  const auto state = initial_state(*model);
  load_state(*model, *state, r.start);
  Jobs jobs(1);
  for (uint64_t k = 0; k < ticks; ++k) step(*model, *state, r.tick[k].input, jobs);
  Snapshot seen;
  publish(*model, *state, seen);
  return seen.particle;
}

TEST(Playback, any_place_in_any_order_is_what_was_there) {
  Playback p(poked(), "poked");
  Snapshot seen;
  ASSERT_TRUE(wait_for(p, seen, [](auto& s) { return s.known == 180; }));
  EXPECT_FALSE(p.status().differs_at.has_value());
  EXPECT_EQ(p.status().at, 0u) << "it waits at the start";
  for (const uint64_t to : {180u, 7u, 120u, 119u, 61u, 60u, 0u}) {
    p.go_to(to);
    ASSERT_TRUE(wait_for(p, seen, [&](auto& s) { return s.at == to; })) << to;
    EXPECT_EQ(seen.tick, to);
    EXPECT_TRUE(seen.particle == particles_after(to)) << to;
  }
  EXPECT_FALSE(p.status().differs_at.has_value()) << "kept states lead to the recorded hashes too";
  EXPECT_TRUE(p.status().fault.empty());
}

TEST(Playback, a_time_is_that_of_the_session_also_where_the_recording_began_later) {
  PlaybackStatus s;
  s.ticks = 600, s.first = 402;
  EXPECT_EQ(ticks_to(s, 33.0), 600u);
  EXPECT_EQ(ticks_to(s, 10.0), 198u);
  EXPECT_EQ(ticks_to(s, 1.0), 0u);
}

TEST(Playback, it_plays_at_the_speed_that_was_asked_for_and_stops_at_the_end) {
  Playback p(poked(), "poked");
  Snapshot seen;
  ASSERT_TRUE(wait_for(p, seen, [](auto& s) { return s.known == 180; }));
  const double start = wall_seconds();
  p.speed(4);
  p.play(true);
  ASSERT_TRUE(wait_for(p, seen, [](auto& s) { return s.at == 180; }));
  EXPECT_GT(wall_seconds() - start, 0.6) << "three seconds at four times the speed, never faster";
  p.speed(0.1f);
  p.go_to(30);
  ASSERT_TRUE(wait_for(p, seen, [](auto& s) { return s.at >= 30 && s.at < 60; }));
  wait_for(
      p, seen, [](auto&) { return false; }, 0.4);
  EXPECT_LT(p.status().at, 36u) << "a tenth of 24";
}

TEST(Playback, what_was_not_recorded_so_is_told) {
  Recording changed = poked();
  changed.tick[100].input.hand[0].pose.p.y += 0.001f;
  Playback p(changed, "changed");
  Snapshot seen;
  ASSERT_TRUE(wait_for(p, seen, [](auto& s) { return s.known == 180; }));
  ASSERT_TRUE(p.status().differs_at.has_value());
  EXPECT_EQ(*p.status().differs_at, 101u);
}

TEST(Playback, what_was_sewn_is_gathered) {
  Playback p(poked(), "poked");
  Snapshot seen;
  ASSERT_TRUE(wait_for(p, seen, [](auto& s) { return s.known == 180; }));
  const LiveResult r = p.result();
  EXPECT_EQ(r.ticks, 180u);
  EXPECT_EQ(r.state_hash, poked().tick.back().hash);
  EXPECT_NEAR(r.metrics.time_s, 177 / 60.0, 1e-6) << "settling is not practice";
  EXPECT_GT(r.metrics.path[0], 0.05f);
  EXPECT_GE(r.map.tension.size(), 28u);
}

TEST(Playback, what_cannot_be_replayed_is_refused) {
  Recording old = poked();
  old.header.state_version = 1;
  EXPECT_THROW(Playback(old, "old"), InputError);
  Recording none = poked();
  none.tick.clear();
  Playback p(none, "none");
  Snapshot seen;
  EXPECT_TRUE(wait_for(p, seen, [](auto& s) { return s.ticks == 0; }));
  p.go_to(5);
  p.play(true);
  wait_for(
      p, seen, [](auto&) { return false; }, 0.1);
  EXPECT_EQ(p.status().at, 0u);
}

}  // namespace
}  // namespace catgut
