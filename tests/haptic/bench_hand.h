// SPDX-License-Identifier: Apache-2.0
// tests/haptic: a hand, a device and a piece of tissue in lock step, around the real servo. The device has mass and friction,
// the hand is a spring to its target, the tissue is a wall that a needle can puncture, computed at any rate and delayed by one
// frame, like a simulation. Realistic devices quantize their position, have delays, and lose calls or make them late.
#pragma once
#include <cmath>
#include <deque>
#include <functional>
#include <utility>
#include <vector>

#include "core/random.h"
#include "haptic/servo.h"

namespace catgut {

struct BenchTissue {
  float a1 = 600, a2 = 1.5e5f;  // [N/m], [N/m^2] before the tip goes in: f = a1 z + a2 z^2
  float coupling = 300;         // [N/m]
  float friction = 0.3f;
  float pierce_force = 0;  // [N] 0: a wall without puncture
  float cutting = 0.2f;    // [N] while the tip is in
  float drag = 40;         // [N/m] shaft friction per meter of needle in the tissue
  bool held = false;       // the tool holds tissue: a bilateral spring without sliding
};

// Imperfections of a real device.
struct Unkind {
  float encoder = 0;    // [m] step of the position (Touch: 0.055 mm)
  float transport = 0;  // [s] from the call that computes a force to the motors
  float jitter = 0;     // [s] standard deviation of the period
  float late = 0;       // chance of a call that comes 2 to 8 ms late
  float lost = 0;       // chance of a call that never comes
  // Of a bridge: [s] each way, [s] of spread, chance of a lost packet.
  float link = 0, link_jitter = 0, link_lost = 0;
};
// A Touch on a busy computer, with the transport delay given.
inline Unkind touch_like(float transport = 0.002f) { return {5.5e-5f, transport, 5e-5f, 0.002f, 0.002f, 0, 0, 0}; }

struct Bench {
  BenchTissue tissue;
  float rate = 60;        // [1/s] of the physics
  bool late = true;       // delayed by one frame
  float mass = 0.1f;      // [kg] arm and finger
  float viscous = 0.5f;   // [N s/m]
  float coulomb = 0.05f;  // [N] of the arm
  float grip = 150, grip_damping = 2;
  Unkind unkind;
  EnergyPool* pool = nullptr;       // shared with the other hand, and
  size_t hand = 0;                  // index of this hand
  std::function<Vec3(float)> path;  // [m] target of the hand

  ServoHand servo;
  ServoOptions options;
  Vec3 x{0, 0.005f, 0}, v;
  bool pierced = false;
  uint32_t discontinuity_id = 0;
  uint64_t ticks = 0;
  double energy = 0, energy_most = 0;    // [J] out of the motors
  double to_hand = 0, to_hand_most = 0;  // [J] of that, what remains for the hand after the device's own damping
  float step_most = 0;                   // [N] from one call to the next
  float force_most = 0;
  float gap_most = 0;  // [s] between two calls
  Vec3 force;          // of the last call
  Vec3 motors;         // [N] that act
  uint64_t now_ns = 1000000000;
  float time = 0;
  float next = 0;
  ForcePatch thinking;
  bool thought = false;
  std::function<void(ForcePatch&)> spoil;    // faults of a simulation
  std::function<bool(float)> physics_works;  // false: it is stalled
  // Of realistic devices: data in flight, with the time of arrival [tenths of a millisecond since the start].
  Random chance{11};
  uint64_t part = 0, next_call = 0;
  std::deque<std::pair<uint64_t, Vec3>> to_motors;
  std::vector<std::pair<uint64_t, ForcePatch>> patches;
  std::deque<std::pair<uint64_t, Vec3>> samples;  // on their way to the physics
  Vec3 seen{0, 0.005f, 0};                        // the newest one that arrived there
  uint64_t seen_ns = 0;
  ForcePatch arrived;
  bool any_arrived = false;

  static uint64_t parts(float seconds) { return static_cast<uint64_t>(std::lround(std::max(0.0f, seconds) * 1e4f)); }
  Vec3 sampled() const {
    if (unkind.encoder <= 0) return x;
    const auto step = [this](float f) { return std::round(f / unkind.encoder) * unkind.encoder; };
    return {step(x.x), step(x.y), step(x.z)};
  }
  bool linked() const { return unkind.link > 0 || unkind.link_lost > 0 || unkind.link_jitter > 0; }
  uint64_t through_link() { return part + parts(unkind.link + unkind.link_jitter * chance.uniform()); }

  float wall_force(float z) const { return tissue.a1 * z + tissue.a2 * z * z; }
  ForcePatch think() {
    ForcePatch p;
    p.tick = ++ticks;
    p.period = 1 / rate;
    p.time_ns = linked() ? seen_ns : now_ns;
    p.point = seen;
    if (tissue.held) {
      const float k = tissue.a1 * tissue.coupling / (tissue.a1 + tissue.coupling);
      p.force = seen * -k;
      p.stiffness = identity(k);
      return p;
    }
    // coupling (u) = f(z), u + z = depth of the hand.
    const float depth = -seen.y;
    if (pierced && depth < 0) pierced = false, ++discontinuity_id;
    if (pierced) {
      p.drag = tissue.cutting + tissue.drag * depth;
      p.along = {0, 1, 0};
    } else {
      p.normal = {0, 1, 0};
      const float b = tissue.a1 + tissue.coupling, d = std::max(1e-7f, depth);
      const float z = (-b + std::sqrt(b * b + 4 * tissue.a2 * tissue.coupling * d)) / (2 * tissue.a2);
      const float tangent = tissue.a1 + 2 * tissue.a2 * z, slope = tissue.coupling * tangent / (tissue.coupling + tangent);
      p.stiffness = outer({0, 1, 0}, slope);
      if (depth > 0) {
        p.force = {0, wall_force(z), 0};
        p.gap = p.force.y / slope;
      } else {
        p.point = {seen.x, 0, seen.z};
      }
      p.coefficient = tissue.friction;
      if (tissue.pierce_force > 0) {
        p.pierce = {0, -1, 0};
        p.pierce_force = tissue.pierce_force;
        p.pierce_keep = std::min(1.0f, (tissue.cutting + 0.05f) / tissue.pierce_force);
        if (depth > 0 && p.force.y > tissue.pierce_force) {
          pierced = true;
          ++discontinuity_id;
          p.discontinuity_id = discontinuity_id;
          return think();
        }
      }
    }
    p.discontinuity_id = discontinuity_id;
    return p;
  }

  void physics() {
    if (!linked()) seen = sampled(), seen_ns = now_ns;
    for (; !samples.empty() && samples.front().first <= part; samples.pop_front())
      if (samples.front().first > 0)
        seen = samples.front().second, seen_ns = now_ns - static_cast<uint64_t>(1e9f * unkind.link);
    if (time < next - 1e-6f) return;
    next += 1 / rate;
    const bool works = !physics_works || physics_works(time);
    ForcePatch fresh;
    bool any = false;
    if (!late && works) fresh = think(), any = true;
    if (late && thought) fresh = thinking, any = true, thought = false;
    if (late && works) thinking = think(), thought = true;
    if (!any) return;
    if (!linked()) fresh.time_ns = now_ns;
    if (spoil) spoil(fresh);
    if (chance_of(unkind.link_lost)) return;
    patches.emplace_back(linked() ? through_link() : part, fresh);
  }
  bool chance_of(float p) { return p > 0 && chance.uniform() < p; }

  // The servo's call, and the time of the next one.
  void call() {
    // The newest arrived one: overtaken ones are dropped, as the bridge does.
    const ForcePatch* newest = nullptr;
    for (auto at = patches.begin(); at != patches.end();) {
      if (at->first > part) {
        ++at;
        continue;
      }
      if (!any_arrived || at->second.tick >= arrived.tick) arrived = at->second, any_arrived = true, newest = &arrived;
      at = patches.erase(at);
    }
    ForcePatch taken;
    if (newest) {
      taken = *newest;
      if (linked()) {  // runtime/arm_server's accept_patch
        taken.period += 1e-9f * static_cast<float>(now_ns - std::min(now_ns, taken.time_ns));
        taken.expiry = std::min(taken.expiry, 0.03f);
        taken.time_ns = now_ns;
      }
      newest = &taken;
    }
    ArmSample sample;
    sample.state = ArmState::ready;
    sample.pose.p = sampled();
    const Vec3 before = force;
    force = servo_step(servo, options, sample, newest, now_ns, pool, hand).force;
    step_most = std::max(step_most, length(force - before));
    force_most = std::max(force_most, length(force));
    to_motors.emplace_back(part + parts(unkind.transport), force);
    if (linked() && !chance_of(unkind.link_lost)) samples.emplace_back(through_link(), sample.pose.p);
    uint64_t period = 10;
    if (unkind.jitter > 0) {
      const float spread = chance.uniform() + chance.uniform() + chance.uniform() - 1.5f;  // deviation 1/2
      period = std::max<uint64_t>(5, parts(0.001f + 2 * unkind.jitter * spread));
    }
    if (chance_of(unkind.lost)) period += 10;
    if (chance_of(unkind.late)) period += parts(0.002f + 0.006f * chance.uniform());
    next_call = part + period;
    gap_most = std::max(gap_most, 1e-4f * static_cast<float>(period));
  }

  void run(float seconds) {
    const int steps = static_cast<int>(std::lround(seconds / 0.001f));
    for (int i = 0; i < 10 * steps; ++i) {
      if (part % 10 == 0) physics();
      if (part >= next_call) call();
      for (; !to_motors.empty() && to_motors.front().first <= part; to_motors.pop_front()) motors = to_motors.front().second;
      const Vec3 from = x;
      constexpr float h = 1e-4f;
      const float at = time + h * static_cast<float>(part % 10);
      const Vec3 wish = path(at), speed = (path(at + h) - wish) / h;
      v += (motors + (wish - x) * grip + (speed - v) * grip_damping - v * viscous) * (h / mass);
      // Dry friction reduces speed and never reverses it.
      const float slow = coulomb * h / mass, l = length(v);
      v = l > slow ? v * (1 - slow / l) : Vec3{};
      x += v * h;
      energy += double{dot(motors, x - from)};
      energy_most = std::max(energy_most, energy);
      to_hand += double{dot(motors - v * viscous, x - from)};
      to_hand_most = std::max(to_hand_most, to_hand);
      now_ns += 100000;
      if (++part % 10 == 0) time += 0.001f;
    }
  }
  // Until the device is engaged and at full force: the hand waits above the tissue.
  void warm_up(Vec3 at) {
    const auto wanted = path;
    seen = at;
    path = [at](float) { return at; };
    x = at;
    run(2.3f);
    path = wanted;
    time = next = 0;
    energy = energy_most = to_hand = to_hand_most = 0;
    step_most = force_most = 0;
    gap_most = 0;
    servo.passivity = {};
  }
};

inline float smooth(float s) {
  s = std::clamp(s, 0.0f, 1.0f);
  return s * s * s * (10 + s * (6 * s - 15));
}

}  // namespace catgut
