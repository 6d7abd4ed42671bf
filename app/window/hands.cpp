// SPDX-License-Identifier: Apache-2.0
// app/window: see hands.h.
#include "window/hands.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "exchange/latest.h"
#include "exchange/ring.h"
#include "runtime/guide.h"

namespace catgut {
namespace {

constexpr float kClosedJaw = 0.4f;  // 0 closed .. 1 open, as in resume_steering

}  // namespace

// Shared by the two threads.
struct WindowHands::Link {
  struct Place {
    Steering steering;
    uint32_t epoch = 0;
  };
  Ring<HandOrder, 256> orders;  // window -> physics; when it is full, motion is lost
  Latest<Place> place;          // physics -> window

  // --- owned by the physics thread ---
  SceneSpec scene;
  bool left_handed = false;
  std::optional<BitePlaces> places;
  PacedHands hands;
  uint32_t epoch = 0;

  std::array<ToolInput, 2> tick(const HandsMoment& now) {
    if (!places || epoch != now.epoch) {
      if (!places) places = bite_places(scene, now.picture);
      if (now.at_start) hands.steering = start_steering(now.picture, left_handed);
      else resume_steering(hands.steering, now.seen);
      hands.left = {};
      epoch = now.epoch;
    }
    for (HandOrder order; orders.pop(order);)
      if (order.epoch == epoch) hear(hands, order, now.seen);
    hands.steering.guide = next_bite(*places, now.picture, now.seen);
    const auto out = catgut::tick(hands, now.picture, now.seen, now.dt);
    place.draft() = {hands.steering, epoch};
    place.publish();
    return out;
  }
};

std::function<std::array<ToolInput, 2>(const HandsMoment&)> WindowHands::begin(const SceneSpec& scene,
                                                                               const Settings& settings) {
  steering = {};
  mouse = {};
  pad = {};
  known_ = false;
  elsewhere_ = {};
  link_ = std::make_shared<Link>();
  link_->scene = scene;
  link_->left_handed = settings.left_handed;
  return [link = link_](const HandsMoment& now) { return link->tick(now); };
}

void WindowHands::move(const WindowInput& in, const Settings& settings, const ViewFrame& view, const Snapshot& seen,
                       std::array<bool, 2> elsewhere, float dt, uint32_t epoch) {
  mouse.hold_to_close = settings.hold_to_close;
  if (in.speed >= 0) speed = static_cast<size_t>(in.speed);
  mouse.speed = kMouseSpeeds[speed] * settings.mouse_speed;
  if (in.moved_ns) moved_ns = in.moved_ns;
  link_->place.update();
  const Link::Place& place = link_->place.seen();
  // After a jump the jaws are those of the tools; until then an order would open them.
  if (place.steering.sequence == 0 || place.epoch != epoch) return;
  steering = place.steering;
  const bool adopt = !known_ || epoch_ != epoch;
  // A stick commands a velocity in the scene: where physics is slower than the clock, its hands are as slow as the tissue.
  const auto passed = adopt ? 0.0f : std::clamp(static_cast<float>(seen.time_s - seen_s_), 0.0f, 0.25f);
  seen_s_ = seen.time_s;
  known_ = true, epoch_ = epoch;
  for (size_t k = 0; k < 2; ++k) {
    SteeredHand& hand = steering.hand[k];
    if (!adopt) hand.closed = closed_[k], hand.opening = opening_[k];
    hand.buttons = 0;
    // What the other device held stays held when it is gone.
    if (elsewhere_[k] || elsewhere[k]) hand.closed = seen.tool[k].jaw < kClosedJaw, hand.opening = 1;
  }
  elsewhere_ = elsewhere;
  HandOrder order;
  order.motion = mouse_motion(mouse, steering, in.mouse, view, dt);
  if (in.has_pad) {
    pad.left_handed = settings.left_handed;
    const std::array<HandMotion, 2> more = gamepad_motion(pad, steering, in.pad, passed);
    for (size_t k = 0; k < 2; ++k) {
      HandMotion &m = order.motion[k], n = more[k];
      m = {m.right + n.right, m.up + n.up,     m.ahead + n.ahead,        m.drive + n.drive, m.yaw + n.yaw,
           m.pitch + n.pitch, m.roll + n.roll, m.together || n.together, m.both + n.both};
    }
  } else {
    pad.trigger = {};  // after reconnection, triggers are ignored until they move: held objects stay held
  }
  for (size_t k = 0; k < 2; ++k) {
    closed_[k] = order.closed[k] = steering.hand[k].closed;
    opening_[k] = order.opening[k] = steering.hand[k].opening;
    // Pressed since the last order: with fewer pictures than ticks, a button that is held would be pressed by every order.
    order.buttons[k] = steering.hand[k].buttons & ~std::exchange(buttons_[k], steering.hand[k].buttons);
  }
  order.view = view;
  order.elsewhere = elsewhere;
  order.assist = settings.assist && settings.guidance != Guidance::exam;
  order.epoch = epoch;
  order.time_ns = moved_ns;
  link_->orders.push(order);
}

}  // namespace catgut
