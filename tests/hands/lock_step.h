// SPDX-License-Identifier: Apache-2.0
// tests/hands: a workstation without a window: device rooms and the simulation alone, in lock step.
#pragma once
#include "device/gamepad.h"
#include "device/mouse.h"
#include "device/paced_hands.h"
#include "device/tray.h"
#include "exchange/buttons.h"
#include "person.h"
#include "procedure/scene_file.h"
#include "runtime/guide.h"
#include "runtime/hands.h"
#include "runtime/live.h"
#include "sim/simulation.h"

namespace catgut {

constexpr float kTick = 1.0f / 60;

inline SceneSpec at_the_mouse(const std::string& name) {
  SceneSpec scene = read_scene(name);
  prepare_for_mouse(scene);
  return scene;
}

// ticks: of the simulation per frame; hands move as in runtime/live.
class LockStep : public WorkQueue {
 public:
  explicit LockStep(int ticks, const std::string& scene = "stay")
      : ticks_(ticks),
        scene_(at_the_mouse(scene)),
        model_(build_model(scene_)),
        state_(initial_state(*model_)),
        picture_(picture_model(*model_)) {
    places_ = bite_places(scene_, picture_);
    look_.steering = hands_.steering = start_steering(picture_, false);
    look_.dt = kTick * static_cast<float>(ticks);
    target_ = picture_.focus + Vec3{0.01f, 0, 0};
    look_.view = view_frame(target_ + Vec3{0.06f, 0.16f, 0.16f}, target_, {0, 1, 0}, 30, 360);
    for (int i = 0; i < 30; ++i) step(*model_, *state_, nobody(), jobs_);
    publish(*model_, *state_, look_.seen);
  }
  const PictureModel& picture() const override { return picture_; }
  const SceneSpec& scene() const { return scene_; }
  const Look& look() const override { return look_; }
  size_t count(EventKind kind) const override { return happened_[static_cast<size_t>(kind)]; }
  bool act(const Act& act) override {
    HandOrder order;
    order.motion = moved(act);
    for (size_t k = 0; k < 2; ++k) {
      SteeredHand& hand = look_.steering.hand[k];
      order.closed[k] = hand.closed, order.opening[k] = hand.opening, order.buttons[k] = std::exchange(hand.buttons, 0);
    }
    if (act.orbit != 0) {
      const Quat turn = axis_angle({0, 1, 0}, std::clamp(act.orbit, -1.2f * look_.dt, 1.2f * look_.dt));
      look_.view = view_frame(target_ + rotate(turn, look_.view.eye - target_), target_, {0, 1, 0}, 30, 360);
    }
    order.view = look_.view;
    CommandList wanted;  // of keys
    if (act.next) wanted.push(next_from_tray(look_.seen, act.hand));
    if (act.park) wanted.push(park_or_take_up(look_.seen, act.hand));
    hear(hands_, order, look_.seen);
    for (int i = 0; i < ticks_; ++i) {
      hands_.steering.guide = next_bite(places_, picture_, look_.seen);
      const auto hand = tick(hands_, picture_, look_.seen, kTick);
      for (size_t k = 0; k < 2; ++k) in_.hand[k] = started_ ? hand_toward(in_.hand[k], hand[k], 0.6f, 12, kTick) : hand[k];
      started_ = true;
      in_.commands = std::exchange(wanted, {});
      for (size_t k = 0; k < 2; ++k)
        add_commands(in_.commands, k, hand[k].buttons & ~std::exchange(buttons_[k], hand[k].buttons), look_.seen);
      step(*model_, *state_, in_, jobs_);
      publish(*model_, *state_, look_.seen);
      for (const Event& e : look_.seen.event) ++happened_[static_cast<size_t>(e.kind)];
      if (after_tick) after_tick(look_.seen);
    }
    look_.steering = hands_.steering;
    return look_.seen.time_s < 400;
  }

  std::function<void(const Snapshot&)> after_tick;
  std::vector<std::byte> save() const { return save_state(*model_, *state_); }
  void load(const std::vector<std::byte>& bytes) {
    load_state(*model_, *state_, bytes);
    publish(*model_, *state_, look_.seen);
    for (size_t k = 0; k < 2; ++k) in_.hand[k].pose = look_.seen.tool[k].hand, in_.hand[k].jaw = look_.seen.tool[k].jaw;
  }
  // The scripted surgeon has the tools until `done`; false: it gave up, or finished without.
  bool show(const std::vector<size_t>& tasks, const std::function<bool(const Snapshot&)>& done) {
    const auto surgeon = make_demonstrator(plan_of(scene_), picture_, skill_of(scene_), tasks);
    Snapshot seen = look_.seen;
    for (int i = 0; i < 3600 && !surgeon->done(); ++i) {
      const TickInput in = surgeon->operate(seen, kTick);
      step(*model_, *state_, in, jobs_);
      publish(*model_, *state_, seen);
      if (done(seen)) return true;
    }
    return false;
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
  Vec3 target_;  // of the view
  PacedHands hands_;
  TickInput in_;
  bool started_ = false;
  std::array<uint32_t, 2> buttons_{};
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

}  // namespace catgut
