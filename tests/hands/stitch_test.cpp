// tests/hands: a whole stitch of the stay scene, from the needle on the drape to a knot of two throws, by somebody with a mouse
// or a gamepad. In lock step, without a window: device rooms and the simulation alone.
#include <gtest/gtest.h>

#include "device/gamepad.h"
#include "person.h"
#include "procedure/scene_file.h"
#include "runtime/guide.h"
#include "runtime/live.h"
#include "sim/simulation.h"

namespace catgut {
namespace {

constexpr float kTick = 1.0f / 60;

// ticks: of the simulation between two pictures; hands get there as they do in runtime/live.
class LockStep : public Desk {
 public:
  explicit LockStep(int ticks)
      : ticks_(ticks),
        scene_(read_scene("stay")),
        model_(build_model(scene_)),
        state_(initial_state(*model_)),
        picture_(picture_model(*model_)) {
    places_ = bite_places(scene_, picture_);
    look_.steering = start_steering(picture_, false);
    look_.dt = kTick * static_cast<float>(ticks);
    const Vec3 target = picture_.focus + Vec3{0.01f, 0, 0};
    look_.view = view_frame(target + Vec3{0.06f, 0.16f, 0.16f}, target, {0, 1, 0}, 30, 360);
    for (int i = 0; i < 30; ++i) step(*model_, *state_, nobody(), jobs_);
    publish(*model_, *state_, look_.seen);
  }
  const PictureModel& picture() const override { return picture_; }
  const Look& look() const override { return look_; }
  size_t count(EventKind kind) const override { return happened_[static_cast<size_t>(kind)]; }
  bool act(const Act& act) override {
    look_.steering.guide = next_bite(places_, picture_, look_.seen);
    const auto hand = steer(look_.steering, moved(act), look_.view, picture_, look_.seen, look_.dt, 0);
    for (int i = 0; i < ticks_; ++i) {
      for (size_t k = 0; k < 2; ++k)
        in_.hand[k] =
            started_ ? hand_toward(in_.hand[k], hand[k], 0.6f, 12, kTick, hand_share(static_cast<float>(ticks_))) : hand[k];
      started_ = true;
      step(*model_, *state_, in_, jobs_);
      publish(*model_, *state_, look_.seen);
      for (const Event& e : look_.seen.event) ++happened_[static_cast<size_t>(e.kind)];
    }
    return look_.seen.time_s < 400;
  }

 protected:
  virtual std::array<HandMotion, 2> moved(const Act& act) = 0;
  static TickInput nobody() {
    TickInput in;
    in.hand[0].connected = in.hand[1].connected = 0;
    return in;
  }
  int ticks_;
  SceneSpec scene_;
  std::shared_ptr<const Model> model_;
  StatePtr state_;
  PictureModel picture_;
  BitePlaces places_;
  Look look_;
  TickInput in_;
  bool started_ = false;
  Jobs jobs_{1};
  std::array<size_t, static_cast<size_t>(EventKind::count_)> happened_{};
};

class AtTheMouse : public LockStep {
 public:
  using LockStep::LockStep;

 private:
  std::array<HandMotion, 2> moved(const Act& act) override {
    MouseInput in = by_mouse(act, look_, mouse_.speed);
    in.hand_changes = act.hand != mouse_.active;
    return mouse_motion(mouse_, look_.steering, in, look_.view, look_.dt);
  }
  MouseHand mouse_;
};

class AtThePad : public LockStep {
 public:
  using LockStep::LockStep;

 private:
  std::array<HandMotion, 2> moved(const Act& act) override {
    return gamepad_motion(pad_, look_.steering, by_pad(act, look_, input_), look_.dt);
  }
  GamepadHand pad_;
  GamepadInput input_;
};

void make_a_stitch(Desk& desk) {
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
  EXPECT_EQ(desk.count(EventKind::knot_locked), 2u);
  EXPECT_EQ(desk.count(EventKind::technique_fault), 0u);
  ASSERT_EQ(desk.look().seen.knot.size(), 1u);
  const KnotView& knot = desk.look().seen.knot[0];
  EXPECT_EQ(knot.throws, 2u);
  EXPECT_NE(knot.thrown[0].handed, knot.thrown[1].handed) << "a reef knot, no granny";
}

// A picture every tick, and ten pictures a second, which is what a machine without a graphics card gives.
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
