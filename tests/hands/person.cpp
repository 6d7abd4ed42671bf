// SPDX-License-Identifier: Apache-2.0
// tests/hands: see person.h.
#include "person.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "exchange/tying.h"

namespace catgut {
namespace {

constexpr float kPatience = 25;  // [s] simulated, for one gesture

Vec3 aside_of(size_t k) { return k == 0 ? Vec3{0.07f, 0.06f, 0.04f} : Vec3{-0.07f, 0.06f, 0.04f}; }

}  // namespace

MouseInput by_mouse(const Act& act, const Look& look, float speed) {
  const HandMotion& m = act.motion;
  const Vec3 p = look.steering.hand[act.hand].pose.p;
  const float pixel = std::max(0.02f, dot(p - look.view.eye, look.view.ahead)) * look.view.pixel * speed;
  MouseInput in;
  if (m.together) {
    in.both = true;
    in.right = std::round(m.both / (0.015f * speed));
  } else if (m.drive != 0) {
    in.turn = true;
    in.right = std::round(m.drive / (0.006f * speed));
  } else {
    in.right = std::round(m.right / pixel);
    in.down = -std::round(m.up / pixel);
    in.wheel = std::round(m.ahead / (0.002f * speed));
  }
  in.jaw_presses = act.click;
  in.cut = act.cut;
  return in;
}

GamepadInput by_pad(const Act& act, const Look& look, GamepadInput& pad) {
  const HandMotion& m = act.motion;
  // Deflection of a stick for that fraction of its full speed: the inverse of the device's mapping.
  const auto stick = [&](float amount, float full) {
    const float part = std::min(1.0f, std::abs(amount) / (full * look.dt));
    return part < 0.003f ? 0.0f : std::copysign(0.15f + 0.85f * std::sqrt(part), amount);
  };
  for (GamepadSide* side : {&pad.left, &pad.right}) side->x = side->y = 0, side->shoulder = false;
  GamepadSide& side = act.hand == 0 ? pad.right : pad.left;
  pad.both = m.together;
  if (m.together) {
    pad.right.x = stick(m.both, 4.0f);
  } else if (m.drive != 0) {
    side.shoulder = true;
    side.x = stick(m.drive, 2.0f);
  } else if (std::abs(m.ahead) > std::max(std::abs(m.right), std::abs(m.up))) {
    side.shoulder = true;
    side.y = -stick(m.ahead, 0.08f);
  } else {
    side.x = stick(m.right, 0.08f);
    side.y = -stick(m.up, 0.08f);
  }
  if (act.click) side.trigger = side.trigger > 0.5f ? 0.0f : 1.0f;
  return pad;
}

bool Person::wait(float seconds, const std::function<bool()>& done, Act act) {
  const double until = seen().time_s + static_cast<double>(seconds);
  while (!done()) {
    if (seen().time_s > until || !desk_.act(act)) return done();
    act.click = false;
  }
  return true;
}

bool Person::point(size_t k, const std::function<Vec3()>& place, const std::function<bool()>& done, bool deep, float patience) {
  const double until = seen().time_s + static_cast<double>(patience);
  while (!done()) {
    const ViewFrame& v = desk_.look().view;
    const Vec3 a = hand(k).pose.p - v.eye, b = place() - v.eye;
    const float deep_a = dot(a, v.ahead), deep_b = dot(b, v.ahead);
    const Vec3 off = b * (deep_a / deep_b) - a;
    Act act;
    act.hand = k;
    const float most = 0.25f * desk_.look().dt;
    act.motion.right = std::clamp(dot(off, v.right), -most, most);
    act.motion.up = std::clamp(dot(off, v.up), -most, most);
    if (deep) act.motion.ahead = std::clamp(deep_b - deep_a, -most, most);
    if (seen().time_s > until || !desk_.act(act)) return done();
  }
  return true;
}

bool Person::take(size_t k, Held what, HelpAt at, const std::function<Vec3()>& place) {
  for (int attempt = 0; attempt < 8; ++attempt) {
    if (attempt > 0) repeated_.push_back(doing_);
    if (!point(k, place, [&] { return hand(k).snapped && hand(k).at == at; })) return false;
    // The tool follows the assist to its target, then the jaw closes.
    const bool tail = at == HelpAt::tail;
    wait(3, [&] { return (!tail || hand(k).hovered) && distance(seen().tool[k].pose.p, hand(k).help.p) < 0.0015f; },
         {k, {}, false});
    if (wait(2, [&] { return seen().tool[k].held == what; }, {k, {}, true})) return true;
    if (seen().tool[k].held != Held::nothing || hand(k).closed) wait(1, [&] { return !hand(k).closed; }, {k, {}, true});
  }
  return false;
}

bool Person::let_go(size_t k) {
  const auto open = [&] { return seen().tool[k].held == Held::nothing && !hand(k).closed; };
  // Twice: a trigger that was not pressed when its gamepad connected has to be pulled before it can be released.
  for (int i = 0; i < 2; ++i)
    if (wait(1, open, {k, {}, !open()})) return true;
  return false;
}

void Person::aside(size_t k) {
  // Out along its own shaft first, or it drags thread along.
  const Vec3 out = hand(k).pose.p + rotate(hand(k).pose.q, {0, 0, 0.03f}), place = desk_.picture().focus + aside_of(k);
  point(
      k, [=] { return out; }, [&] { return distance(hand(k).pose.p, out) < 0.006f; }, true, 3);
  point(
      k, [=] { return place; }, [&] { return distance(hand(k).pose.p, place) < 0.012f; }, true, 5);
}

bool Person::drive(size_t k, const std::function<bool()>& done) {
  Act act;
  act.hand = k;
  // A sweep through two layers is longer than one through one: patience ends when nothing more happens.
  double until = seen().time_s + static_cast<double>(kPatience);
  size_t progress = 0;
  while (!done()) {
    const size_t now = desk_.count(EventKind::tip_entered) + desk_.count(EventKind::tip_exited);
    if (now > std::exchange(progress, now)) until = seen().time_s + static_cast<double>(kPatience);
    act.motion.drive = std::min(0.1f, 3.0f * desk_.look().dt);  // observes between the steps
    if (seen().time_s > until || !desk_.act(act)) return done();
  }
  return true;
}

bool Person::both(float amount, const std::function<bool()>& done, float patience) {
  Act act;
  act.motion.together = true;
  const double until = seen().time_s + static_cast<double>(patience);
  while (!done()) {
    act.motion.both = amount * desk_.look().dt;
    if (seen().time_s > until || !desk_.act(act)) return done();
  }
  return true;
}

bool Person::carry_out(const std::string& lesson) {
  const bool skin = lesson == "simple_suture";
  if (!take_needle() || !bite()) return false;
  // One sweep may pass both edges of skin, or both bowel ends.
  if (desk_.count(EventKind::bite_completed) < 2 && !(hand_back() && bite())) return false;
  return pull_tail(skin ? 0.045f : 0.08f) && draw_together() && tie(1) && tie(-1) && cut_needle() && (!skin || cut_tail());
}

bool Person::take_needle() {
  doing_ = "take the needle";
  return take(0, Held::needle, HelpAt::needle, [&] { return on_needle(desk_.picture(), seen().active().needle.pose, 0.35f); });
}

bool Person::bite() {
  doing_ = "bring the needle to the bite";
  const size_t before = seen().active().bite.size(), completed = desk_.count(EventKind::bite_completed);
  if (!desk_.look().steering.guide) return false;
  // The last seen position: with the needle's last step the guide is that of the next bite.
  BiteGuide last;
  const auto guide = [&] { return last = desk_.look().steering.guide.value_or(last); };
  if (!point(
          0, [&] { return entry_of(guide()); }, [&] { return hand(0).snapped && hand(0).at == HelpAt::bite; }))
    return false;
  if (!wait(6, [&] { return hand(0).hovered && distance(seen().tool[0].pose.p, hand(0).help.p) < 0.002f; })) return false;
  doing_ = "drive the needle";
  const bool out = drive(0, [&] {
    if (seen().active().bite.size() <= before || !seen().active().bite.back().has_exit) return false;
    // The hand is ahead of the image.
    const Pose meant = hand(0).pose * inverse(hand(0).grip);
    const Vec3 exit = seen().active().bite.back().exit;
    return distance(on_needle(desk_.picture(), seen().active().needle.pose, 1), exit) > 0.0062f ||
           distance(on_needle(desk_.picture(), meant, 1), exit) > 0.0075f;
  });
  if (!out) return false;
  doing_ = "take the tip";
  if (!take(1, Held::needle, HelpAt::needle, [&] { return on_needle(desk_.picture(), seen().active().needle.pose, 0.93f); }))
    return false;
  doing_ = "let the driver go";
  if (!let_go(0)) return false;
  aside(0);
  doing_ = "bring the needle through";
  return drive(1, [&] { return !seen().active().needle.in_tissue && desk_.count(EventKind::bite_completed) > completed; });
}

bool Person::hand_back() {
  doing_ = "hand the needle back";
  const Vec3 place = desk_.picture().focus + Vec3{0, 0.06f, 0.03f};
  point(
      1, [=] { return place; }, [&] { return distance(hand(1).pose.p, place) < 0.01f; }, true);
  if (!take(0, Held::needle, HelpAt::needle, [&] { return on_needle(desk_.picture(), seen().active().needle.pose, 0.35f); }))
    return false;
  if (!let_go(1)) return false;
  aside(1);
  return true;
}

bool Person::pull_tail(float tail) {
  doing_ = "pull the thread";
  const Vec3 place = desk_.picture().focus + Vec3{-0.05f, 0.2f, 0.1f};
  return point(
      1, [=] { return place; }, [&] { return length_between(seen(), 0, first_point_node(seen())) < tail; }, true);
}

bool Person::take_tail() {
  return take(0, Held::thread, HelpAt::tail, [&] {
    TailGrip grip;
    tail_grip(desk_.picture(), seen(), 0, grip);
    return hand(0).snapped && hand(0).at == HelpAt::tail ? hand(0).help.p : grip.pose.p;
  });
}

bool Person::lay_tail() {
  const Vec3 at = seen().active().knot.empty()
                      ? 0.5f * (seen().active().suture_point.front().position + seen().active().suture_point.back().position)
                      : seen().active().knot.back().position;
  const Vec3 place = at + 0.034f * normalized(Vec3{0.9f, 0.3f, 0.5f});
  point(
      0, [=] { return place; }, [&] { return distance(hand(0).pose.p, place) < 0.006f; }, true, 2.5f);
  wait(0.5f, [] { return false; });  // it settles before it is released
  if (!let_go(0)) return false;
  aside(0);
  return true;
}

bool Person::draw_together() {
  const auto closed = [&] {
    for (const SeamView& s : seen().active().seam)
      if (s.midpoint && s.progress < 0.985f) return false;
    return !seen().active().seam.empty();
  };
  // If it sticks, or the tail slips: release and grasp again.
  for (int attempt = 0; attempt < 3; ++attempt) {
    if (attempt > 0) repeated_.push_back(doing_);
    doing_ = "take the tail";
    if (!take_tail()) return false;
    doing_ = "draw the ends apart";
    if (both(
            4, [&] { return closed() || seen().tool[0].held != Held::thread; }, 8) &&
        closed())
      return lay_tail();
    if (hand(0).closed) let_go(0);
    aside(0);
  }
  return false;
}

bool Person::wind(int way) {
  doing_ = "wind the strand";
  locked_ = desk_.count(EventKind::throw_locked);
  if (both(
          4.0f * static_cast<float>(way), [&] { return seen().tool[0].loop_wraps > 0; }, 12))
    return true;
  both(
      -4.0f * static_cast<float>(way), [&] { return desk_.look().steering.both.winding.wound < 0; }, 8);
  return false;
}

bool Person::set_throw() {
  doing_ = "draw the throw down";
  // A short throw may have locked while the tail was taken.
  const auto set = [&] { return desk_.count(EventKind::throw_locked) > locked_; };
  if (!both(4, [&] { return set() || seen().tool[0].held == Held::nothing; }) || !set()) return false;
  doing_ = "lay the tail down";
  return lay_tail();
}

bool Person::cut_needle() {
  doing_ = "cut the needle off";
  Act act;
  act.hand = 1;
  act.cut = true;
  if (!desk_.act(act)) return false;
  return wait(3, [&] { return !seen().active().needle_on_thread; }, {1, {}, false});
}

bool Person::cut_tail() {
  doing_ = "cut the tail";
  const auto cuts = [&] { return desk_.count(EventKind::thread_cut); };
  const size_t before = cuts();
  for (float far = 0.009f; far < 0.02f && cuts() == before; far += 0.003f) {
    const auto place = [&] {
      const Vec3 knot = stitch_place(desk_.picture(), seen());
      size_t i = first_point_node(seen());
      while (i > 1 && distance(node_at(seen(), i), knot) < far) --i;
      return node_at(seen(), i);
    };
    point(
        0, place, [&] { return distance(seen().tool[0].pose.p, place()) < 0.002f; }, true, 6);
    Act act;
    act.cut = true;
    if (!desk_.act(act)) return false;
    wait(0.5f, [&] { return cuts() > before; });
  }
  return cuts() > before;
}

bool Person::tie(int way) {
  // Failed actions are repeated.
  for (int attempt = 0; attempt < 8; ++attempt) {
    if (attempt > 0) repeated_.push_back(doing_);
    if (!wind(way)) continue;
    doing_ = "take the tail through the loop";
    if (take_tail() && set_throw()) return true;
    if (hand(0).closed) let_go(0);
    aside(0);
  }
  return false;
}

}  // namespace catgut
