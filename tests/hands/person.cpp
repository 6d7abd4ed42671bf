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

// Unit, round the axis of an opening that looks up: 0 at the right, counter-clockwise from above.
Vec3 direction(float angle) { return {std::cos(angle), 0, -std::sin(angle)}; }

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
  in.cut = act.cut, in.fresh = act.coagulate;
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
  // Buttons are for the first hand, or for the second with its shoulder.
  pad.cut = act.cut, pad.fresh = act.coagulate;
  if (act.hand == 1 && (act.cut || act.coagulate || act.next || act.park)) side.shoulder = true;
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

Vec3 Person::rim_at(float angle) const {
  const std::vector<uint32_t>& rim = desk_.picture().rim[0];
  Vec3 center{}, best{};
  for (const uint32_t i : rim) center += desk_.picture().particle_rest[i] / static_cast<float>(rim.size());
  float most = -1;
  for (const uint32_t i : rim) {
    const float along = dot(normalized(desk_.picture().particle_rest[i] - center), direction(angle));
    if (along > most) most = along, best = seen().particle[i];
  }
  return best;
}

// On the tissue that stays: the other side of a cut moves away.
Vec3 Person::line_at(float angle, float edge) const {
  const PictureModel& p = desk_.picture();
  float top = -1e9f, radius = 0;
  Vec3 center{};
  for (const uint32_t i : p.rim[0]) {
    center += p.particle_rest[i] / static_cast<float>(p.rim[0].size());
    top = std::max(top, p.particle_rest[i].y);
  }
  for (const uint32_t i : p.rim[0]) radius += distance(p.particle_rest[i], center) / static_cast<float>(p.rim[0].size());
  const Vec3 rest = center + direction(angle) * radius - Vec3{0, edge, 0};
  Vec3 sum{};
  float weight = 0;
  for (uint32_t i = 0; i < 2 * p.columns; i += 2) {
    const float below = top - p.particle_rest[i].y - edge;
    if (p.wall[i] != 0 || below < 0.0035f || below > 0.0105f) continue;
    const float d2 = length2(p.particle_rest[i] - rest), w = 1 / (d2 * d2 + 1e-14f);
    sum += w * (seen().particle[i] + rotate(seen().rotation[i], rest - p.particle_rest[i])), weight += w;
  }
  return sum / weight;
}

bool Person::face(float angle) {
  const auto off = [&] {
    const Vec3 eye = desk_.look().view.eye - desk_.picture().focus;
    return std::remainder(angle - std::atan2(-eye.z, eye.x), 2 * kPi);
  };
  Act act;
  for (int i = 0; std::abs(off()) > 0.15f; ++i) {
    act.orbit = off();
    if (i > 2000 || !desk_.act(act)) return false;
  }
  return true;
}

bool Person::take_instrument(size_t k, const std::string& kind) {
  doing_ = "take " + kind;
  const auto has = [&] {
    const int i = seen().tool[k].instrument;
    return i >= 0 && desk_.picture().instrument[static_cast<size_t>(i)].kind == kind;
  };
  for (size_t tries = 0; !has(); ++tries) {
    if (tries > seen().instrument.size()) return false;
    const int before = seen().tool[k].instrument;
    Act act;
    act.hand = k, act.next = true;
    if (!desk_.act(act)) return false;
    if (!wait(2, [&] { return seen().tool[k].instrument != before; }, {k, {}, false})) return false;
  }
  if (hand(k).closed) return wait(1, [&] { return !hand(k).closed; }, {k, {}, true});
  return true;
}

bool Person::park(size_t k) {
  doing_ = "park it";
  Act act;
  act.hand = k, act.park = true;
  if (!desk_.act(act)) return false;
  return wait(2, [&] { return seen().tool[k].instrument < 0; }, {k, {}, false});
}

bool Person::lay_down(size_t k) {
  doing_ = "lay it down";
  if (hand(k).closed && !let_go(k)) return false;
  Act act;
  act.hand = k, act.park = true;
  if (!desk_.act(act)) return false;
  return wait(2, [&] { return seen().tool[k].instrument < 0; }, {k, {}, false});
}

bool Person::take_up(size_t k, size_t instrument) {
  doing_ = "take up a clamp";
  if (!hand(k).closed) wait(1, [&] { return hand(k).closed; }, {k, {}, true});  // a hand that is open would open it
  const auto place = [&] { return transform(seen().instrument[instrument].pose, {0, 0, 0.05f}); };
  if (!point(
          k, place, [&] { return distance(seen().tool[k].hand.p, place()) < 0.012f; }, true))
    return false;
  Act act;
  act.hand = k, act.park = true;
  if (!desk_.act(act)) return false;
  return wait(2, [&] { return seen().tool[k].instrument == static_cast<int>(instrument); }, {k, {}, false});
}

bool Person::grasp_rim(size_t k, float angle) {
  doing_ = "close it on the rim";
  const auto place = [&] { return rim_at(angle); };
  const auto over = [&] { return hand(k).snapped && hand(k).at == HelpAt::rim; };
  for (int attempt = 0; attempt < 4; ++attempt) {
    if (attempt > 0) repeated_.push_back(doing_);
    const auto there = [&] {
      return over() && hand(k).hovered && distance(hand(k).help.p, place()) < 0.006f &&
             distance(seen().tool[k].pose.p, hand(k).help.p) < 0.0015f;
    };
    if (!point(k, place, there)) return false;
    if (wait(3, [&] { return seen().tool[k].held == Held::tissue; }, {k, {}, true})) return true;
    if (!let_go(k)) return false;
  }
  return false;
}

bool Person::snip(size_t k, float angle, float down) {
  doing_ = "cut with scissors";
  if (!face(angle)) return false;
  const size_t before = desk_.count(EventKind::tissue_snipped);
  const auto place = [&] { return line_at(angle, down); };
  const auto there = [&] {
    return hand(k).snapped && hand(k).at == HelpAt::rim && hand(k).hovered &&
           distance(seen().tool[k].pose.p, hand(k).help.p) < 0.0015f && distance(hand(k).help.p, place()) < 0.003f;
  };
  if (!point(k, place, there)) return false;
  if (!wait(2, [&] { return desk_.count(EventKind::tissue_snipped) > before; }, {k, {}, true})) return false;
  return wait(2, [&] { return !hand(k).closed && seen().tool[k].jaw > 0.8f; }, {k, {}, true});
}

bool Person::pen(size_t k, PenMode mode) {
  const auto now = [&] { return seen().instrument[static_cast<size_t>(seen().tool[k].instrument)].pen; };
  if (now() == mode) return true;
  Act act;
  act.hand = k;
  (mode == PenMode::cut || now() == PenMode::cut ? act.cut : act.coagulate) = true;
  if (!desk_.act(act)) return false;
  return wait(2, [&] { return now() == mode; }, {k, {}, false});
}

bool Person::score(size_t k, float edge, float from, float to) {
  constexpr float kPenSpeed = 0.0035f;  // [m/s] the pen of the scripted surgeon; twice as fast leaves bridges
  constexpr float kAhead = 0.002f;      // [m]
  constexpr double kUnseen = 0.06;      // [s] of the way, at most, from one picture to the next
  if (!face(0.5f * (from + to))) return false;
  doing_ = "put the pen on the line";
  float angle = from;
  const auto place = [&] { return line_at(angle, edge); };
  const auto on_it = [&] {
    const Vec3 off = seen().tool[k].pose.p - place(), ahead = desk_.look().view.ahead;  // depth cannot be seen
    return hand(k).snapped && hand(k).at == HelpAt::face && length(off - ahead * dot(off, ahead)) < 0.0012f &&
           distance(seen().tool[k].pose.p, hand(k).help.p) < 0.0005f;
  };
  if (!point(k, place, on_it)) return false;
  doing_ = "cut along the line";
  if (!pen(k, PenMode::cut)) return false;
  // No smoke: the tip is not on the tissue yet.
  const auto burns = [&] { return seen().instrument[static_cast<size_t>(seen().tool[k].instrument)].burning > 0; };
  Act press;
  press.hand = k, press.motion.ahead = 0.0004f;
  wait(2, burns, press);
  const float radius = distance(place(), line_at(angle + kPi, edge)) / 2;
  // Simulated time: where the machine is late, tissue burns as slowly as the hand moves.
  double last = seen().time_s;
  const bool went = point(k, place, [&] {
    const double passed = std::min(kUnseen, seen().time_s - last);
    last = seen().time_s;
    // A user does not run ahead of the pen.
    if (distance(seen().tool[k].pose.p, place()) < kAhead)
      angle = std::min(to, angle + kPenSpeed / radius * static_cast<float>(passed));
    return angle >= to;
  });
  return pen(k, PenMode::off) && went;
}

// Where the rim still hangs together with the lowest place of its wall: the shortest way over the drawn surface. A sliver
// between two cuts comes free sooner than the end.
std::optional<float> Person::bridge(float edge) const {
  const PictureModel& picture = *seen().topology.picture;
  std::vector<std::vector<uint32_t>> beside(picture.particle_rest.size());
  for (const VisibleMesh& mesh : picture.body)
    for (const auto& t : mesh.triangle) {
      std::optional<uint32_t> first;
      for (const uint32_t v : t)
        for (size_t j = 0; j < 4; ++j) {
          if (mesh.skin_weight[v][j] == 0) continue;
          const uint32_t i = mesh.skin_particle[v][j];
          if (!first) first = i;
          if (i != *first) beside[i].push_back(*first), beside[*first].push_back(i);
        }
    }
  std::vector<uint32_t> reached = desk_.picture().rim[0], from(beside.size(), ~0u);
  const float top = picture.particle_rest[reached[0]].y;
  Vec3 center{};
  for (const uint32_t i : reached) from[i] = i, center += picture.particle_rest[i] / static_cast<float>(reached.size());
  uint32_t lowest = reached[0];
  for (uint32_t i = 0; i < 2 * desk_.picture().columns; ++i)
    if (desk_.picture().wall[i] == 0 && picture.particle_rest[i].y < picture.particle_rest[lowest].y) lowest = i;
  for (size_t k = 0; k < reached.size() && from[lowest] == ~0u; ++k)
    for (const uint32_t i : beside[reached[k]])
      if (from[i] == ~0u) from[i] = reached[k], reached.push_back(i);
  if (from[lowest] == ~0u) return {};
  const auto off = [&](uint32_t i) { return std::abs(top - picture.particle_rest[i].y - edge); };
  uint32_t best = lowest;
  for (uint32_t i = lowest; from[i] != i; i = from[i])
    if (off(i) < off(best)) best = i;
  const Vec3 out = picture.particle_rest[best] - center;
  return std::atan2(-out.z, out.x);
}

bool Person::cut_round(size_t k, float edge) {
  constexpr int kStrokes = 6;
  constexpr float kOverlap = 0.15f;  // [rad]
  for (int stroke = 0; stroke < kStrokes; ++stroke) {
    const float from = 2 * kPi * static_cast<float>(stroke) / kStrokes;
    if (!score(k, edge, from - kOverlap, from + 2 * kPi / kStrokes + kOverlap)) return false;
  }
  doing_ = "cut the last bridge";
  for (int stroke = 0; stroke < kStrokes; ++stroke) {
    const std::optional<float> at = bridge(edge);
    if (!at) return true;
    repeated_.push_back("cut round");
    if (!score(k, edge, *at - 2 * kOverlap, *at + 2 * kOverlap)) return false;
  }
  return !bridge(edge);
}

bool Person::carry(size_t k, Vec3 by) {
  doing_ = "carry it away";
  const Vec3 place = hand(k).pose.p + by;
  return point(
      k, [=] { return place; }, [&] { return distance(hand(k).pose.p, place) < 0.008f; }, true);
}

size_t Person::coagulate(size_t k) {
  doing_ = "coagulate";
  size_t done = 0;
  for (size_t i = 0; i < seen().wound.bleeding.size(); ++i) {
    if (!(seen().wound.bleeding[i].flow > 0)) continue;
    Vec3 off{};  // from the vessel to where the pointer has to be, so that the tip is at the vessel
    const auto vessel = [&] { return seen().wound.bleeding[i].at; };
    const auto place = [&] { return vessel() + off; };
    const auto stopped = [&] { return !(seen().wound.bleeding[i].flow > 0); };
    const Vec3 from = vessel() - desk_.picture().focus;
    if (!face(std::atan2(-from.z, from.x))) return done;
    point(
        k, place, [&] { return distance(seen().tool[k].pose.p, vessel()) < 0.003f; }, false, 2);
    if (!pen(k, PenMode::coagulate)) return done;
    for (int look = 0; look < 3 && !point(k, place, stopped, false, 1); ++look) off += vessel() - seen().tool[k].pose.p;
    done += stopped();
    if (!pen(k, PenMode::off)) return done;
  }
  return done;
}

}  // namespace catgut
