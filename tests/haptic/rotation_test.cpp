// SPDX-License-Identifier: Apache-2.0
// tests/haptic: torque and grip force of devices that have motors for them (S8). The torque is that of the force at its lever.
// Every limit and every fault of the force holds for them too, and rotation gives a hand no energy.
#include <gtest/gtest.h>

#include <cstdio>
#include <deque>
#include <limits>

#include "haptic/servo.h"

namespace catgut {
namespace {

constexpr ArmLimits kSigma{12, 12, 4000, 30, 0.2f, 1, 0.07f, 8, 2000};

struct Held {
  ServoOptions options;
  ServoHand hand;
  ArmSample sample;
  uint64_t now = 1000000000;
  ServoOut out;
  float torque_step = 0, grip_step = 0, force_step = 0, torque_most = 0, grip_most = 0;

  explicit Held(const ArmLimits& limits = kSigma) {
    fit_to_arm(options, limits);
    sample.state = ArmState::ready;
    sample.jaw = 1;
  }
  // One call, with a patch for the present pose.
  template <typename F>
  void call(const F& fill, bool fresh = true) {
    now += 1000000;
    ForcePatch p;
    const Pose world = to_world(options.place, sample.pose);
    p.point = world.p, p.turn = world.q, p.time_ns = now, p.period = 0.001f;
    fill(p);
    const ArmForce before = out;
    out = servo_step(hand, options, sample, fresh ? &p : nullptr, now);
    force_step = std::max(force_step, distance(out.force, before.force));
    torque_step = std::max(torque_step, distance(out.torque, before.torque));
    grip_step = std::max(grip_step, std::abs(out.grip - before.grip));
    torque_most = std::max(torque_most, length(out.torque)), grip_most = std::max(grip_most, std::abs(out.grip));
  }
  template <typename F>
  void run(int ms, const F& fill) {
    for (int i = 0; i < ms; ++i) call(fill);
  }
  void engage() {
    run(2200, [](ForcePatch&) {});
  }
};

void nothing(ForcePatch&) {}

// A force F that acts at r from the hand: F and r x F at the motors, whatever the workspace's rotation and scale. A device
// without motors for rotation renders the same force to the bit, and no torque.
TEST(Haptics, S8_torque_is_lever_times_force) {
  const Vec3 f{0.3f, 0.5f, -0.2f}, r{0.02f, -0.01f, 0.03f};
  const auto press = [&](ForcePatch& p) { p.force = f, p.lever = r; };
  for (const float scale : {1.0f, 0.5f}) {
    Held sigma, omega({12, 12, 5000, 30});
    for (Held* h : {&sigma, &omega}) {
      h->options.place.turn = axis_angle(normalized(Vec3{1, 2, 3}), 1), h->options.place.scale = scale;
      h->sample.pose.q = axis_angle({0, 0, 1}, 0.7f);
      h->engage();
      h->run(400, press);
    }
    const Quat turn = sigma.options.place.turn;
    const Vec3 torque = rotate(turn, sigma.out.torque), force = rotate(turn, sigma.out.force) / scale;
    std::printf("S8: scale %.1f: %.2f mN m rendered, r x F = %.2f mN m\n", double{scale}, 1e3 * double{length(torque)},
                1e3 * double{length(cross(r, f))});
    EXPECT_LT(distance(force, f), 1e-4f);
    EXPECT_LT(distance(torque, cross(r, f)), 1e-5f) << "energy is preserved: the torque does not scale";
    EXPECT_TRUE(omega.out.force == sigma.out.force);
    EXPECT_EQ(length(omega.out.torque), 0);
  }
}

// Grip: nothing while the jaws close on air; on a needle, a spring from where they touch it. It ends with the grasp.
TEST(Haptics, S8_grip_force_is_of_what_the_jaws_hold) {
  const auto needle = [](ForcePatch& p) { p.grip_from = 0.35f, p.grip_stiffness = 12; };
  Held h;
  h.engage();
  for (int i = 0; i <= 300; ++i) {
    h.sample.jaw = 1 - static_cast<float>(i) / 300;
    h.call(nothing);
    ASSERT_EQ(h.out.grip, 0) << "air, jaw " << h.sample.jaw;
  }
  for (int i = 300; i >= 0; --i) h.sample.jaw = 1 - static_cast<float>(i) / 300, h.call(nothing);
  for (const float jaw : {0.5f, 0.36f, 0.30f, 0.20f, 0.10f, 0.0f}) {
    for (int i = 0; i < 200; ++i) h.sample.jaw += 0.02f * (jaw - h.sample.jaw), h.call(needle);
    h.sample.jaw = jaw;
    h.run(200, needle);
    const float linear = 12 * std::max(0.0f, 0.35f - jaw), knee = h.options.limiter.knee * 8 / 12;
    const float want = linear <= knee ? linear : knee + 0.5f * (linear - knee);
    std::printf("S8: needle, jaw %.2f: %.2f N, %.2f N in closed form\n", double{jaw}, double{h.out.grip}, double{want});
    EXPECT_NEAR(h.out.grip, want, 0.01f);
  }
  h.run(50, nothing);
  EXPECT_EQ(h.out.grip, 0) << "let go";
  EXPECT_LE(h.grip_step, 0.5f * 8 / 12 + 1e-5f);
  EXPECT_EQ(length(h.out.force), 0);
}

// Peaks, slew, continuous load: those of the device, for torque and grip as for the force.
TEST(Haptics, S8_limits_of_torque_and_grip) {
  Held h;
  h.engage();
  const auto far_too_much = [](ForcePatch& p) {
    p.force = {0, 8, 0}, p.lever = {0.1f, 0, 0}, p.couple = {0, 0.5f, 0.5f}, p.grip_from = 1, p.grip_stiffness = 1000;
  };
  h.sample.jaw = 0;
  h.run(300, far_too_much);
  h.run(100, nothing);
  h.run(300, far_too_much);
  std::printf("S8: at most %.3f N m, %.2f N grip; steps %.2f mN m, %.3f N\n", double{h.torque_most}, double{h.grip_most},
              1e3 * double{h.torque_step}, double{h.grip_step});
  EXPECT_GT(h.torque_most, 0.1f);
  EXPECT_LE(h.torque_most, 0.2f + 1e-6f);
  EXPECT_GT(h.grip_most, 4);
  EXPECT_LE(h.grip_most, 8 + 1e-5f);
  EXPECT_LE(h.force_step, 0.5f + 1e-5f);
  EXPECT_LE(h.torque_step, 0.5f * 0.2f / 12 + 1e-6f) << "0.5 N/ms, in proportion to the peaks";
  EXPECT_LE(h.grip_step, 0.5f * 8 / 12 + 1e-5f);

  // Ten minutes at the peak, on an arm that cannot: the mean is what the motors sustain.
  Limiter limiter;
  LimiterOptions o;
  o.force = 8.5f, o.continuous = 1.4f, o.torque = 0.188f, o.knee = 1.5f * 8.5f / 3.3f;
  double square = 0;
  constexpr int kSteps = 600000;
  for (int i = 0; i < kSteps; ++i) {
    LimiterInput in;
    in.cap = 8.5f;
    if (i >= 10) in.wanted.torque = {0, 0.188f, 0};
    const float t = length(limit(limiter, in, 0.001f, o).torque);
    square += double{t} * double{t};
  }
  const double rms = std::sqrt(square / kSteps), continuous = 0.188 * 1.4 / 8.5;
  std::printf("S8: torque requested at its peak for ten minutes: RMS %.4f N m of %.4f\n", rms, continuous);
  EXPECT_LE(rms, continuous);
  EXPECT_GT(rms, 0.7 * continuous);
}

// Every fault takes torque and grip away as it does the force: within 100 ms, without a step.
TEST(Haptics, S8_faults_take_torque_and_grip_away) {
  const auto press = [](ForcePatch& p) {
    p.force = {0, 0.8f, 0}, p.lever = {0.04f, 0, 0}, p.couple = {0, 0.01f, 0}, p.grip_from = 0.35f, p.grip_stiffness = 12;
  };
  struct Fault {
    const char* name;
    void (*apply)(Held&);
    bool fresh;
    void (*spoil)(ForcePatch&);
  };
  const Fault faults[] = {
      {"the physics stops", [](Held&) {}, false, nothing},
      {"the device is lost", [](Held& h) { h.sample.state = ArmState::absent; }, true, nothing},
      {"the device cuts the force", [](Held& h) { h.sample.forced_off = true; }, true, nothing},
      {"too fast", [](Held& h) { h.sample.pose.p.x += 0.003f; }, true, nothing},
      {"hot motors", [](Held& h) { h.sample.warmth = 1; }, true, nothing},
      {"couple NaN", [](Held&) {}, true, [](ForcePatch& p) { p.couple.x = std::numeric_limits<float>::quiet_NaN(); }},
      {"lever infinite", [](Held&) {}, true, [](ForcePatch& p) { p.lever.z = std::numeric_limits<float>::infinity(); }},
      {"grip NaN", [](Held&) {}, true, [](ForcePatch& p) { p.grip_stiffness = std::numeric_limits<float>::quiet_NaN(); }},
      {"orientation NaN", [](Held& h) { h.sample.pose.q.y = std::numeric_limits<float>::quiet_NaN(); }, true, nothing},
      {"cap 0", [](Held&) {}, true, [](ForcePatch& p) { p.cap = 0; }},
      {"a patch of another orientation", [](Held&) {}, true,
       [](ForcePatch& p) {
         p.turn = axis_angle({0, 0, 1}, 0.5f);
       }},
  };
  for (const Fault& f : faults) {
    SCOPED_TRACE(f.name);
    Held h;
    h.engage();
    h.sample.jaw = 0.2f;
    h.run(400, press);
    ASSERT_GT(length(h.out.torque), 0.02f);
    ASSERT_GT(h.out.grip, 1);
    h.torque_step = h.grip_step = h.force_step = 0;
    int zero = -1;
    for (int ms = 1; ms <= 150; ++ms) {
      f.apply(h);
      h.call([&](ForcePatch& p) { press(p), f.spoil(p); }, f.fresh);
      ASSERT_TRUE(is_finite(h.out.force) && is_finite(h.out.torque) && std::isfinite(h.out.grip));
      const bool none = length(h.out.force) == 0 && length(h.out.torque) == 0 && h.out.grip == 0;
      if (none && zero < 0) zero = ms;
      if (!none) zero = -1;
    }
    std::printf("S8: %-32s no torque and no grip after %d ms\n", f.name, zero);
    EXPECT_GT(zero, 0);
    EXPECT_LE(zero, 100);
    EXPECT_LE(h.torque_step, 0.5f * 0.2f / 12 + 1e-6f);
    EXPECT_LE(h.grip_step, 0.5f * 8 / 12 + 1e-5f);
    EXPECT_LE(h.force_step, 0.5f + 1e-5f);
  }
}

// A hand with a gripper on a device with six degrees of freedom, in lock step: the hand turns, moves and pinches toward where
// it means to be. The tip of a needle, `kTip` from the hand, meets a wall of 600 N/m behind a coupling of 300 N/m.
constexpr Vec3 kTip{0.04f, 0, 0};
constexpr float kWall = 200;  // [N/m] in series

struct Sixth {
  float rate = 960, turn_grip = 0.5f, transport = 0.002f;
  bool unkind = true;
  Held held;
  Vec3 x, v;
  float angle = 0, spin = 0, gap = 0.02f, gap_rate = 0;  // [rad] about z, [m] of the fingers
  double energy = 0, most = 0;                           // [J] to the hand
  std::deque<std::pair<int, ArmForce>> on_the_way;
  ArmForce acting;
  ForcePatch thinking;
  float next = 0;
  int ms = 0;
  Vec3 (*wish)(float) = nullptr;         // [m]
  float (*wish_angle)(float) = nullptr;  // [rad]
  float (*wish_gap)(float) = nullptr;    // [m]
  bool holds = false, bare = false;      // bare: force and torque held from frame to frame, without the account

  static float stepped(float f, float step) { return std::round(f / step) * step; }
  ForcePatch think(const ArmSample& s) const {
    ForcePatch p;
    p.period = 1 / rate;
    p.point = s.pose.p, p.turn = s.pose.q;
    p.lever = rotate(s.pose.q, kTip);
    const float depth = -(p.point + p.lever).y;
    p.normal = {0, 1, 0}, p.stiffness = outer({0, 1, 0}, kWall);
    if (depth > 0) p.force = {0, kWall * depth, 0}, p.gap = depth;
    else p.point.y += depth;
    if (holds) p.grip_from = 0.35f, p.grip_stiffness = 12;
    if (bare) p.couple = cross(p.lever, p.force), p.lever = {}, p.stiffness = {}, p.normal = {};
    return p;
  }
  void step() {
    const float t = 0.001f * static_cast<float>(ms);
    ArmSample& s = held.sample;
    const float fine = unkind ? 2e-5f : 1e-9f;
    s.pose.p = {stepped(x.x, fine), stepped(x.y, fine), stepped(x.z, fine)};
    s.pose.q = axis_angle({0, 0, 1}, stepped(angle, unkind ? 2e-4f : 1e-9f));
    s.jaw = std::clamp(stepped(gap - 0.004f, fine) / kGripTravel, 0.0f, 1.0f);
    const bool fresh = t >= next - 1e-6f;
    const ForcePatch before = thinking;  // a frame late
    if (fresh) thinking = think(s), next += 1 / rate;
    held.now += 1000000;
    ForcePatch p = before;
    p.time_ns = held.now;
    const ArmForce last = held.out;
    held.out = servo_step(held.hand, held.options, s, fresh ? &p : nullptr, held.now);
    held.torque_step = std::max(held.torque_step, distance(held.out.torque, last.torque));
    on_the_way.emplace_back(ms + static_cast<int>(1000 * transport), held.out);
    for (; !on_the_way.empty() && on_the_way.front().first <= ms; on_the_way.pop_front()) acting = on_the_way.front().second;
    constexpr float h = 1e-4f;
    for (int k = 0; k < 10; ++k) {
      const float at = t + h * static_cast<float>(k);
      v += (acting.force + (wish(at) - x) * 150.0f - v * 2.5f) * (h / 0.15f);
      // 2e-4 kg m^2 of wrist and handle, damped by half of critical and by 1 mN m s of the arm; 30 g of fingers.
      const float inertia = 2e-4f, critical = 2 * std::sqrt(turn_grip * inertia);
      spin += (acting.torque.z + (wish_angle(at) - angle) * turn_grip - spin * (0.5f * critical + 1e-3f)) * (h / inertia);
      gap_rate += (acting.grip + (wish_gap(at) - gap) * 400.0f - gap_rate * 4.0f) * (h / 0.03f);
      const Vec3 moved = v * h;
      x += moved, angle += spin * h, gap += gap_rate * h;
      energy += double{dot(acting.force, moved)} + double{acting.torque.z * spin * h} + double{acting.grip * gap_rate * h};
      // What the arm's own damping takes.
      energy -= double{(0.5f * length2(v) + 1e-3f * spin * spin + 0.5f * gap_rate * gap_rate) * h};
    }
    most = std::max(most, energy);
    ++ms;
  }
};

float ramp(float t, float from, float to) {
  const float s = std::clamp((t - from) / (to - from), 0.0f, 1.0f);
  return s * s * (3 - 2 * s);
}

// H3 of rotation: a needle's tip is pressed into a wall by turning the wrist, by moving, and both against each other, then
// held and released. The hand gets no energy and the tip holds still, at every rate and delay.
TEST(Haptics, S8_rotation_is_passive) {
  struct Motion {
    const char* name;
    Vec3 (*wish)(float);
    float (*angle)(float);
    float (*gap)(float);
    bool holds;
  };
  const auto open = [](float) { return 0.02f; };
  const auto over = [](float) { return Vec3{0, 0.004f, 0}; };
  const Motion motions[] = {
      {"turned into the wall", over, [](float t) { return -0.35f * (ramp(t, 2.5f, 2.9f) - ramp(t, 4.4f, 4.8f)); }, open, false},
      {"pressed into the wall",
       [](float t) {
         return Vec3{0, 0.004f - 0.012f * (ramp(t, 2.5f, 2.9f) - ramp(t, 4.4f, 4.8f)), 0};
       },
       [](float) { return 0.0f; }, open, false},
      {"pressed, then turned back and forth",
       [](float t) {
         return Vec3{0, 0.004f - 0.012f * (ramp(t, 2.5f, 2.9f) - ramp(t, 4.4f, 4.8f)), 0};
       },
       [](float t) { return t > 2.9f && t < 3.6f ? 0.1f * std::sin(2 * kPi * 3 * (t - 2.9f)) : 0.0f; }, open, false},
      {"tapped by turning at 5 Hz", over,
       [](float t) { return t > 2.5f && t < 4.3f ? -0.13f - 0.13f * std::sin(2 * kPi * 5 * t) : 0.0f; }, open, false},
      {"a needle pinched", over, [](float) { return 0.0f; },
       [](float t) { return 0.02f - 0.022f * (ramp(t, 2.5f, 2.9f) - ramp(t, 4.4f, 4.8f)); }, true},
  };
  for (const Motion& m : motions)
    for (const float rate : {240.0f, 960.0f})
      for (const float transport : {0.0f, 0.001f, 0.002f, 0.003f}) {
        double most = 0;
        float swing = 0, step = 0, felt = 0, off = 0;
        for (const float grip : {0.1f, 0.5f, 3.0f}) {
          Sixth s;
          s.rate = rate, s.transport = transport, s.turn_grip = grip;
          s.wish = m.wish, s.wish_angle = m.angle, s.wish_gap = m.gap, s.holds = m.holds;
          s.x = m.wish(0);
          float low = 1e9f, high = -1e9f, low_gap = 1e9f, high_gap = -1e9f;
          while (s.ms < 5200) {
            s.step();
            if (s.ms < 4000 || s.ms > 4400) continue;
            const float tip = s.x.y + rotate(axis_angle({0, 0, 1}, s.angle), kTip).y;
            low = std::min(low, tip), high = std::max(high, tip);
            low_gap = std::min(low_gap, s.gap), high_gap = std::max(high_gap, s.gap);
            const Vec3 lever = rotate(axis_angle({0, 0, 1}, s.angle), kTip);
            off = std::max(off, distance(s.held.out.torque, cross(lever, s.held.out.force)));
            felt = std::max({felt, length(s.held.out.torque), s.held.out.grip});
          }
          most = std::max(most, s.most), step = std::max(step, s.held.torque_step);
          if (std::string_view(m.name).substr(0, 6) != "tapped") swing = std::max({swing, high - low, high_gap - low_gap});
        }
        std::printf("H3: %-36s %3.0f Hz, %.0f ms late: %.3f mJ to the hand, swing %.3f mm, step %.2f mN m, felt %.3g\n", m.name,
                    double{rate}, 1e3 * double{transport}, 1e3 * most, 1e3 * double{swing}, 1e3 * double{step}, double{felt});
        EXPECT_LE(most, 0.5e-3) << m.name;
        EXPECT_LE(swing, 0.2e-3f) << m.name;
        EXPECT_LE(step, 0.5f * 0.2f / 12 + 1e-6f);
        EXPECT_GT(felt, 0.005f);
        EXPECT_LT(off, 0.002f) << "the torque is that of the force at the tip";
      }
  // The same motion with the force and torque of the last frame: the test can fail.
  Sixth s;
  s.bare = true, s.rate = 60;
  s.wish = motions[3].wish, s.wish_angle = motions[3].angle, s.wish_gap = motions[3].gap;
  s.x = s.wish(0);
  s.held.options.passivity.damping = s.held.options.passivity.turn_damping = 0;
  while (s.ms < 5200) s.step();
  std::printf("H3: tapped, force and torque held for a frame of 60 Hz, no account: %.2f mJ to the hand\n", 1e3 * s.most);
  EXPECT_GT(s.most, 0.5e-3);
}

// A torque that drives the hand, whatever it does: braked as a force would be. Without the account it gives hundreds of
// millijoules.
TEST(Haptics, S8_a_torque_that_generates_is_braked) {
  Passivity p;
  PassivityOptions o;
  o.turn_damping = 0.07f, o.torque = 0.2f;
  PassivityInput in;
  in.most = 12;
  int braked = -1;
  double given = 0;
  for (int ms = -20; ms < 500; ++ms) {
    in.torque = {0, 0, 0.05f};
    in.spin = {0, 0, ms < 0 ? 0.0f : 1.0f};
    in.turned = in.spin * 0.001f;
    const ArmForce out = keep_passive(p, in, o);
    given += double{out.torque.z * 0.001f};
    if (p.braking && braked < 0) braked = ms;
  }
  std::printf("S8: generating torque: braked after %d ms; %.2f mJ in half a second, 25 mJ without\n", braked, 1e3 * given);
  EXPECT_GE(braked, 0);
  EXPECT_LE(braked, 5);
  EXPECT_LT(given, 5e-3);
}

// S9: the user's own gain of the force in a hand. A change makes no step; nothing exceeds what the device can.
TEST(Haptics, S9_force_gain) {
  const auto press = [](ForcePatch& p) { p.force = {0, 0.5f, 0}, p.lever = {0.03f, 0, 0}; };
  for (const float gain : {0.2f, 0.5f, 1.0f, 2.0f}) {
    Held h;
    h.hand.strength = h.hand.strength_wanted = gain;
    h.engage();
    h.run(400, press);
    EXPECT_NEAR(h.out.force.y, 0.5f * gain, 1e-4f);
    EXPECT_NEAR(h.out.torque.z, 0.015f * gain, 1e-5f);
    // Changed under load.
    h.force_step = 0;
    h.hand.strength_wanted = 1;
    h.run(2000, press);
    EXPECT_NEAR(h.out.force.y, 0.5f, 1e-3f);
    EXPECT_LT(h.force_step, 0.01f);
  }
  // Twice what the arm can: still its peak and its stiffness.
  Held touch({3.3f, 0.88f, 400, 4});
  touch.hand.strength = touch.hand.strength_wanted = 2;
  touch.engage();
  float most = 0;
  for (int i = 0; i < 200; ++i)
    touch.call([](ForcePatch& p) { p.force = {0, 5, 0}; }), most = std::max(most, length(touch.out.force));
  EXPECT_GT(most, 2.5f);
  EXPECT_LE(most, 3.3f + 1e-5f);
  touch.run(20, nothing);
  // A wall of 300 N/m at twice the gain would be 600 N/m: the Touch renders its 400.
  Held wall({3.3f, 0.88f, 400, 4});
  wall.hand.strength = wall.hand.strength_wanted = 2;
  wall.engage();
  const auto spring = [](ForcePatch& p) { p.point = {}, p.stiffness = identity(300); };
  wall.run(100, spring);
  for (int i = 0; i < 100; ++i) wall.sample.pose.p.y -= 1e-5f, wall.call(spring);
  wall.run(200, spring);
  std::printf("S9: gain 2, wall of 300 N/m: %.0f N/m rendered\n", double{wall.out.force.y} / 1e-3);
  EXPECT_NEAR(wall.out.force.y, 0.4f, 0.01f);
}

}  // namespace
}  // namespace catgut
