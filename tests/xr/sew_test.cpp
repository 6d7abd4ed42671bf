// SPDX-License-Identifier: Apache-2.0
// tests/xr: a stitch through controller actions; the headset lost in the middle of a bite; the same hands with and without a
// headset.
#ifdef CATGUT_TESTS_HEADSET
#include <array>
#include <cstdlib>
#include <vector>

#include "runtime/session.h"
#include "sewing.h"
#include "sim/recording.h"

namespace catgut {
namespace {

using xr::HeadsetState;
using Counts = std::array<size_t, static_cast<size_t>(EventKind::count_)>;

class Stitch : public AtTheHeadset {
 protected:
  void SetUp() override {
    AtTheHeadset::SetUp();
    if (IsSkipped()) return;
    // The robot's hands do not tremble, and its plan expects no delay.
    std::ofstream(folder_ / "catgut/settings.toml") << "quality = \"low\"\nsteady_hands = false\n";
    wearer_.head = {{0, 1.6f, 0}, axis_angle({1, 0, 0}, -0.7f)};
    remote_->set(wearer_);
    layer_->dark = true;
    options_.scene = "stay";
    options_.live.record = (folder_ / "run.cgrec").string();
    options_.on_event = [this](const Event& e) { ++count_[static_cast<size_t>(e.kind)]; };
  }
  size_t count(EventKind kind) const { return count_[static_cast<size_t>(kind)]; }
  bool focused(const WindowLook& now) const { return now.headset && now.headset->state == HeadsetState::focused; }
  void expect_whole(const std::string& path) {
    const Recording recording = read_recording(path);
    EXPECT_FALSE(recording.truncated) << recording.fault;
    EXPECT_GT(recording.tick.size(), 60u);
    const ReplayResult replay = replay_session(recording, path, true, 2);
    EXPECT_FALSE(replay.differs_at.has_value()) << "tick " << replay.differs_at.value_or(0);
  }

  PlayOptions options_;
  Counts count_{};
};

TEST_F(Stitch, a_bite_and_a_throw_through_controller_actions) {
  Sewing sewing("stay");
  std::string doing;
  const int code = sit(options_, 240, [&](const WindowLook& now) {
    if (!focused(now) || now.status.settling) return true;
    sewing.hold(now, wearer_);
    if (sewing.doing() != doing) std::fprintf(stderr, "%6.1f s: %s\n", now.seen.time_s, (doing = sewing.doing()).c_str());
    return count(EventKind::throw_locked) == 0 && !sewing.done();
  });
  EXPECT_EQ(code, 0);
  EXPECT_GE(count(EventKind::needle_grasped), 1u);
  EXPECT_GE(count(EventKind::bite_completed), 1u);
  EXPECT_GE(count(EventKind::loop_formed), 1u);
  EXPECT_GE(count(EventKind::throw_locked), 1u) << doing;

  // Vibration arrived in the runtime, which accepted it.
  const uint32_t pulses = std::min(layer_->pulses.load(), XrLayerState::kPulses);
  size_t strong = 0, throws = 0, refused = 0;
  for (uint32_t i = 0; i < pulses; ++i) {
    strong += layer_->pulse[i].side == 1 && layer_->pulse[i].amplitude > 0.65f && layer_->pulse[i].frequency == 180;
    throws += layer_->pulse[i].amplitude == 1 && layer_->pulse[i].duration > 50'000'000;
    refused += layer_->pulse[i].result != 0;
  }
  std::fprintf(stderr, "%u pulses: %zu at punctures by the right hand, %zu at throws\n", pulses, strong, throws);
  EXPECT_GE(strong, 1u);
  EXPECT_GE(throws, 1u);
  EXPECT_EQ(refused, 0u);
  expect_whole(options_.live.record);

  // Where the wearer looked is in the recording, about once per frame and in the world.
  const Recording recording = read_recording(options_.live.record);
  EXPECT_GT(recording.head.size(), 100u);
  for (const RecordedHead& h : recording.head) {
    ASSERT_LT(h.tick, recording.tick.size());
    const Vec3 ahead = rotate(h.pose.q, {0, 0, -1});
    ASSERT_LT(ahead.y, -0.3f) << "down at the table";
    ASSERT_LT(ahead.z, 0) << "away from the wearer's side";
  }
}

TEST_F(Stitch, a_headset_lost_in_the_middle_of_a_bite_loses_nothing) {
  Sewing sewing("stay");
  int lost_frames = 0, stage = 0;
  size_t released = 0;
  bool held = false, kept = true;
  Vec3 at;
  double lost_at = 0;
  const int code = sit(options_, 240, [&](const WindowLook& now) {
    if (now.status.settling) return true;
    const ToolView& holder = now.seen.tool[0].held == Held::needle ? now.seen.tool[0] : now.seen.tool[1];
    if (stage == 0 && focused(now)) {
      sewing.hold(now, wearer_);
      if (now.seen.active().needle.in_tissue && holder.held == Held::needle) {
        stage = 1, held = true, at = holder.pose.p;
        released = count(EventKind::needle_released);
        layer_->absent = true;
        layer_->lose = 1;
      }
    } else if (stage == 1) {  // the window runs on, the headset is away
      lost_frames += !focused(now);
      if (lost_frames == 1) lost_at = now.seen.time_s;
      if (lost_frames > 0 && now.seen.time_s - lost_at > 1.5) {
        kept =
            holder.held == Held::needle && count(EventKind::needle_released) == released && distance(holder.pose.p, at) < 0.01f;
        layer_->absent = false;
        stage = 2;
      }
    } else if (stage == 2 && focused(now)) {
      kept = kept && (count(EventKind::bite_completed) > 0 || count(EventKind::needle_released) == released);
      stage = 3;
    } else if (stage == 3 && focused(now)) {
      sewing.hold(now, wearer_);
    }
    return count(EventKind::bite_completed) == 0 && !sewing.done();
  });
  EXPECT_EQ(code, 0);
  EXPECT_EQ(stage, 3) << "it came back";
  EXPECT_TRUE(held);
  EXPECT_GT(lost_frames, 5) << "frames of the window meanwhile";
  EXPECT_TRUE(kept) << "the needle stayed in the jaws, where it was";
  EXPECT_GE(count(EventKind::bite_completed), 1u) << sewing.doing();
  EXPECT_EQ(layer_->sessions, 2u);
  expect_whole(options_.live.record);
}

// The hands of a recording, in a window with a headset and in one without: every tick has the same hash. Heads are noted only
// with the headset and change nothing.
TEST_F(Stitch, the_same_hands_give_the_same_ticks_with_and_without_a_headset) {
  if (!std::getenv("CATGUT_LONG")) GTEST_SKIP() << "half a minute; CATGUT_LONG=1 runs it";
  Sewing sewing("stay");
  ASSERT_EQ(sit(options_, 90,
                [&](const WindowLook& now) {
                  if (!focused(now) || now.status.settling) return true;
                  sewing.hold(now, wearer_);
                  return now.seen.time_s < 6;
                }),
            0);
  const Recording first = read_recording(options_.live.record);
  ASSERT_GT(first.tick.size(), 200u);
  std::vector<Recording> again;
  for (const bool headset : {true, false}) {
    PlayOptions options;
    options.scene = "stay";
    options.live.surgeon = options_.live.record;
    options.live.record = (folder_ / (headset ? "headset.cgrec" : "window.cgrec")).string();
    options.headset = headset;
    options.width = 320, options.height = 200;
    options.seconds = static_cast<double>(first.tick.size()) / 60 + 4;
    ASSERT_EQ(play(options), 0);
    again.push_back(read_recording(options.live.record));
  }
  for (const Recording& r : again) {
    const size_t ticks = std::min(first.tick.size(), r.tick.size());
    EXPECT_GT(ticks, first.tick.size() * 3 / 4);
    size_t differ = 0;
    for (size_t i = 0; i < ticks; ++i) differ += first.tick[i].hash != r.tick[i].hash;
    EXPECT_EQ(differ, 0u) << "of " << ticks;
  }
  EXPECT_GT(first.head.size(), 20u);
  EXPECT_TRUE(again[1].head.empty());
}

// Another program takes the input focus: the instruments stay; the session and its pictures continue.
TEST_F(Stitch, without_focus_the_instruments_stay) {
  Sewing sewing("stay");
  int stage = 0, frames = 0;
  Vec3 at;
  bool stayed = false, again = false;
  sit(options_, 90, [&](const WindowLook& now) {
    if (now.status.settling || !now.headset) return true;
    if (stage == 0 && focused(now)) {
      sewing.hold(now, wearer_);
      if (now.seen.time_s > 2.5) stage = 1, layer_->unfocused = true;
    } else if (stage == 1 && now.headset->state == HeadsetState::visible) {
      if (++frames == 8) at = now.seen.tool[0].hand.p;  // the physics has caught up with the last pose
      for (RemoteHand& h : wearer_.hand) h.pose.p += {0.002f, 0, 0};
      if (frames == 30) {
        stayed = distance(at, now.seen.tool[0].hand.p) < 1e-4f;
        layer_->unfocused = false;
        stage = 2;
      }
    } else if (stage == 2 && focused(now)) {
      again = distance(at, now.seen.tool[0].hand.p) > 0.005f;
      return !again;
    }
    return true;
  });
  EXPECT_TRUE(stayed);
  EXPECT_TRUE(again) << "and follow the hands when the focus is back";
}

}  // namespace
}  // namespace catgut
#endif
