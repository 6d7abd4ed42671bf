// SPDX-License-Identifier: Apache-2.0
// tests/xr: one streamed session from the runtime's first state to its last: both eyes, a stitch through controller actions,
// another program's focus, the headset lost in the middle of a bite; and the same hands with and without a headset.
#ifdef CATGUT_TESTS_HEADSET
#include <openxr/openxr.h>

#include <array>
#include <cstdlib>
#include <vector>

#include "both_eyes.h"
#include "runtime/session.h"
#include "sewing.h"
#include "sim/recording.h"

namespace catgut {
namespace {

using xr::HeadsetState;
constexpr float kPace = 3;  // of real time; CATGUT_LONG=1: real time, and the whole recording is compared
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
    if (!std::getenv("CATGUT_LONG")) options_.live.pace = kPace;
    options_.live.record = (folder_ / "run.cgrec").string();
    options_.on_event = [this](const Event& e) { ++count_[static_cast<size_t>(e.kind)]; };
  }
  size_t count(EventKind kind) const { return count_[static_cast<size_t>(kind)]; }
  bool focused(const WindowLook& now) const { return now.headset && now.headset->state == HeadsetState::focused; }
  void expect_whole(const std::string& path) {
    const Recording recording = read_recording(path);
    EXPECT_FALSE(recording.truncated) << recording.fault;
    EXPECT_GT(recording.tick.size(), 60u);
    if (!std::getenv("CATGUT_LONG")) return;  // in every build: see expect_same_ticks
    const ReplayResult replay = replay_session(recording, path, true, 2);
    EXPECT_FALSE(replay.differs_at.has_value()) << "tick " << replay.differs_at.value_or(0);
  }
  // The hands of the recording again, in a window with the headset and in one without: every tick has the same hash.
  // CATGUT_LONG=1: all of it, otherwise the first seconds.
  void expect_same_ticks(const Recording& first) {
    const bool all = std::getenv("CATGUT_LONG") != nullptr;
    const std::string scene = (folder_ / "recorded.toml").string();
    std::ofstream(scene) << first.header.scene;
    for (const bool headset : {true, false}) {
      PlayOptions options;
      options.scene = scene;  // a hand without a force display has a limit of its own
      options.live.surgeon = options_.live.record;
      options.live.pace = 12;
      options.live.record = (folder_ / (headset ? "headset.cgrec" : "window.cgrec")).string();
      options.headset = headset;
      options.width = 320, options.height = 200;
      options.seconds = all ? 60 : 1;
      ASSERT_EQ(play(options), 0);
      const Recording again = read_recording(options.live.record);
      const size_t ticks = std::min(first.tick.size(), again.tick.size());
      size_t differ = 0;
      for (size_t i = 0; i < ticks; ++i) differ += first.tick[i].hash != again.tick[i].hash;
      std::fprintf(stderr, "%s: %zu ticks compared\n", headset ? "headset" : "window", ticks);
      EXPECT_GT(ticks, all ? first.tick.size() * 9 / 10 : 60);
      EXPECT_EQ(differ, 0u) << "of " << ticks;
    }
  }

  PlayOptions options_;
  Counts count_{};
};

// What a wearer sees while sewing: the head moves a few centimeters and stays turned to the table.
Pose swaying_head(double t) {
  const auto s = static_cast<float>(std::sin(0.7 * t)), u = static_cast<float>(std::sin(0.43 * t));
  return {{0.09f * s, 1.6f + 0.03f * u, 0.05f * u},
          normalized(axis_angle({0, 1, 0}, 0.2f * s) * axis_angle({1, 0, 0}, -0.72f + 0.08f * u))};
}

// A stitch without pictures, because this runtime draws on the processor; meanwhile another program takes the input focus, and
// the headset is lost with the needle in the tissue. Then the wearer recenters, and both eyes see the field again.
TEST_F(Stitch, a_whole_session) {
  enum class Part { sew, unfocused, refocused, to_bite, lost, gone, back, pictures } part = Part::sew;
  Sewing sewing("stay");
  options_.eye_pictures = true;
  std::array<Image, 2> picture;
  xr::WearerLook look;
  Pose head;
  float darkest = 1e9f;
  double lost_s = 0;
  int shown = 0, frames = 0, lost_frames = 0;
  bool stayed = false, followed = false, in_bite = false, kept = true;
  size_t released = 0;
  Vec3 at;
  std::string doing;
  const int code = sit(options_, 120, [&](const WindowLook& now) {
    const bool in_focus = focused(now);
    const ToolView& holder = now.seen.tool[0].held == Held::needle ? now.seen.tool[0] : now.seen.tool[1];
    const auto sew = [&] {
      sewing.hold(now, wearer_);
      wearer_.head = swaying_head(now.seen.time_s);
      if (sewing.doing() != doing) std::fprintf(stderr, "%6.1f s: %s\n", now.seen.time_s, (doing = sewing.doing()).c_str());
    };
    switch (part) {
      case Part::sew:
        if (!in_focus) break;
        sew();
        if (++frames < 20) break;
        frames = 0;
        part = Part::unfocused, layer_->unfocused = true;
        break;
      case Part::unfocused:
        if (now.headset->state != HeadsetState::visible) break;
        if (++frames == 10) at = now.seen.tool[0].hand.p;  // the physics has caught up with the last pose
        for (RemoteHand& h : wearer_.hand) h.pose.p += {0.002f, 0, 0};
        if (frames < 30) break;
        stayed = distance(at, now.seen.tool[0].hand.p) < 1e-4f;
        layer_->unfocused = false;
        part = Part::refocused;
        break;
      case Part::refocused:
        followed = in_focus && distance(at, now.seen.tool[0].hand.p) > 0.005f;
        if (followed) part = Part::to_bite;
        break;
      case Part::to_bite:
        if (in_focus) sew();
        if (!now.seen.active().needle.in_tissue || holder.held != Held::needle) break;
        in_bite = true, at = holder.pose.p, released = count(EventKind::needle_released);
        layer_->absent = true, layer_->lose = 1;
        part = Part::lost;
        break;
      case Part::lost:
        if (in_focus) break;
        lost_s = now.seen.time_s;
        part = Part::gone;
        break;
      case Part::gone:  // the window runs on
        ++lost_frames;
        if (now.seen.time_s - lost_s < 1.5) break;
        kept =
            holder.held == Held::needle && count(EventKind::needle_released) == released && distance(holder.pose.p, at) < 0.01f;
        layer_->absent = false;
        if (in_focus) part = Part::back;
        break;
      case Part::back:
        if (in_focus) sew();
        if (count(EventKind::throw_locked) == 0) break;
        layer_->dark = false;
        head = wearer_.head;
        wearer_.hand[0].trackpad_force = 1;  // held: recenter
        part = Part::pictures;
        break;
      case Part::pictures: {
        if (!in_focus || !now.headset->picture) break;
        look = *now.headset, picture = *now.headset->picture;
        darkest = std::min(darkest, mean_luma(picture[0]));
        ++shown;
        if (darkest < 2) wearer_.hand[0].trackpad_force = 0;
        return darkest >= 2 || look.brightness < 1 || shown < 8;
      }
    }
    return !sewing.done() || part == Part::pictures;
  });
  EXPECT_EQ(code, 0);
  for (const int state :
       {XR_SESSION_STATE_IDLE, XR_SESSION_STATE_READY, XR_SESSION_STATE_SYNCHRONIZED, XR_SESSION_STATE_VISIBLE,
        XR_SESSION_STATE_FOCUSED, XR_SESSION_STATE_LOSS_PENDING, XR_SESSION_STATE_STOPPING, XR_SESSION_STATE_EXITING})
    EXPECT_TRUE(seen(layer_, state)) << state;
  EXPECT_EQ(layer_->state, XR_SESSION_STATE_EXITING) << "the window ends the session in the specified order";
  EXPECT_EQ(layer_->sessions, 2u);
  EXPECT_EQ(layer_->destroyed, 2u);

  ASSERT_GE(shown, 8);
  EXPECT_GE(layer_->projections, 8u);
  expect_both_eyes_right(*layer_, look, picture, head, "egl");
  EXPECT_LT(darkest, 2) << "the field moves in a black picture";
  EXPECT_GT(mean_luma(picture[0]), 20);
  EXPECT_LT(distance(look.place.to_room(look.place.focus), head.p), 0.65f) << "and lies ahead of the wearer";

  EXPECT_TRUE(stayed) << "without the input focus instruments stay";
  EXPECT_TRUE(followed) << "and follow the hands when it is back";
  EXPECT_TRUE(in_bite);
  EXPECT_EQ(part, Part::pictures) << "the headset came back, and the stitch went on";
  EXPECT_GT(lost_frames, 5) << "frames of the window meanwhile";
  EXPECT_TRUE(kept) << "the needle stayed in the jaws, where it was";

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

  // The recording is whole, and its hands give the same state after every tick, with and without a headset.
  expect_whole(options_.live.record);
  const Recording recording = read_recording(options_.live.record);
  EXPECT_GT(recording.head.size(), 100u);
  for (const RecordedHead& h : recording.head) {
    ASSERT_LT(h.tick, recording.tick.size());
    const Vec3 ahead = rotate(h.pose.q, {0, 0, -1});
    ASSERT_LT(ahead.y, -0.3f) << "down at the table";
    ASSERT_LT(ahead.z, 0) << "away from the wearer's side";
  }
  expect_same_ticks(recording);
}

}  // namespace
}  // namespace catgut
#endif
