// tests/haptic: a hand, an arm and a piece of tissue in lock step, around the real servo. The arm has mass and friction, the
// hand is a spring to where it means to be, the tissue is a wall that a needle can go through, worked out at any rate and heard
// one frame late, as a simulation is.
#pragma once
#include <cmath>
#include <functional>
#include <vector>

#include "haptic/servo.h"

namespace catgut {

struct BenchTissue {
  float a1 = 600, a2 = 1.5e5f;  // [N/m], [N/m^2] before the tip goes in: f = a1 z + a2 z^2
  float coupling = 300;         // [N/m]
  float friction = 0.3f;
  float pierce_force = 0;  // [N] 0: a wall that nothing pierces
  float cutting = 0.2f;    // [N] while the tip is in
  float drag = 40;         // [N/m] shaft friction per metre of needle in the tissue
  bool held = false;       // the tool holds tissue: a spring both ways, and nothing slides
};

struct Bench {
  BenchTissue tissue;
  float rate = 60;        // [1/s] of the physics
  bool late = true;       // heard one frame later
  float mass = 0.1f;      // [kg] arm and finger
  float viscous = 0.5f;   // [N s/m]
  float coulomb = 0.05f;  // [N] of the arm
  float grip = 150, grip_damping = 2;
  std::function<Vec3(float)> path;  // [m] where the hand means to be

  ServoHand servo;
  ServoOptions options;
  Vec3 x{0, 0.005f, 0}, v;
  bool pierced = false;
  uint32_t topology = 0;
  double energy = 0, energy_most = 0;  // [J] into the hand
  float step_most = 0;                 // [N] from one millisecond to the next
  float force_most = 0;
  Vec3 force;
  uint64_t now_ns = 1000000000;
  float time = 0;
  float next = 0;
  ForcePatch thinking;
  bool thought = false;
  std::function<void(ForcePatch&)> spoil;    // what a bad simulation sends
  std::function<bool(float)> physics_works;  // false: it is stalled

  float wall_force(float z) const { return tissue.a1 * z + tissue.a2 * z * z; }
  ForcePatch think() {
    ForcePatch p;
    p.period = 1 / rate;
    p.time_ns = now_ns;
    p.point = x;
    if (tissue.held) {
      const float k = tissue.a1 * tissue.coupling / (tissue.a1 + tissue.coupling);
      p.force = x * -k;
      p.stiffness = identity(k);
      return p;
    }
    // coupling (u) = f(z), u + z = depth of the hand.
    const float depth = -x.y;
    if (pierced && depth < 0) pierced = false, ++topology;
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
        p.point = {x.x, 0, x.z};
      }
      p.coefficient = tissue.friction;
      if (tissue.pierce_force > 0) {
        p.pierce = {0, -1, 0};
        p.pierce_force = tissue.pierce_force;
        p.pierce_keep = std::min(1.0f, (tissue.cutting + 0.05f) / tissue.pierce_force);
        if (depth > 0 && p.force.y > tissue.pierce_force) {
          pierced = true;
          ++topology;
          p.topology = topology;
          return think();
        }
      }
    }
    p.topology = topology;
    return p;
  }

  void run(float seconds) {
    const int steps = static_cast<int>(std::lround(seconds / 0.001f));
    for (int i = 0; i < steps; ++i) {
      ForcePatch fresh;
      bool any = false;
      if (time >= next - 1e-6f) {
        next += 1 / rate;
        const bool works = !physics_works || physics_works(time);
        if (!late && works) fresh = think(), any = true;
        if (late && thought) fresh = thinking, any = true, thought = false;
        if (late && works) thinking = think(), thought = true;
        if (any) fresh.time_ns = now_ns;
        if (any && spoil) spoil(fresh);
      }
      ArmSample sample;
      sample.state = ArmState::ready;
      sample.pose.p = x;
      const Vec3 before = force;
      force = servo_step(servo, options, sample, any ? &fresh : nullptr, now_ns).force;
      step_most = std::max(step_most, length(force - before));
      force_most = std::max(force_most, length(force));
      const Vec3 from = x;
      constexpr int kParts = 10;
      for (int k = 0; k < kParts; ++k) {
        const float h = 0.001f / kParts, at = time + h * static_cast<float>(k);
        const Vec3 wish = path(at), speed = (path(at + h) - wish) / h;
        v += (force + (wish - x) * grip + (speed - v) * grip_damping - v * viscous) * (h / mass);
        // Dry friction takes speed away and never turns it round.
        const float slow = coulomb * h / mass, l = length(v);
        v = l > slow ? v * (1 - slow / l) : Vec3{};
        x += v * h;
      }
      energy += double{dot(force, x - from)};
      energy_most = std::max(energy_most, energy);
      now_ns += 1000000;
      time += 0.001f;
    }
  }
  // Until the arm is engaged and at full force: the hand waits above the tissue.
  void warm_up(Vec3 at) {
    const auto wanted = path;
    path = [at](float) { return at; };
    x = at;
    run(2.3f);
    path = wanted;
    time = next = 0;
    energy = energy_most = 0;
    step_most = force_most = 0;
    servo.passivity = {};
  }
};

inline float smooth(float s) {
  s = std::clamp(s, 0.0f, 1.0f);
  return s * s * s * (10 + s * (6 * s - 15));
}

}  // namespace catgut
