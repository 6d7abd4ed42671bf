// SPDX-License-Identifier: Apache-2.0
// haptic/z_width: see the header.
#include "haptic/z_width.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <deque>
#include <utility>

namespace catgut {
namespace {

constexpr float kStep = 0.001f;                 // [s] of the servo
constexpr int kParts = 10;                      // of a step, in which the arm moves
constexpr float kPart = kStep / kParts;         // [s]
constexpr float kViscous = 0.5f, kDry = 0.01f;  // [N s/m], [N] the arm's own; nearly none of dry friction: it hides what swings
constexpr float kForce = 3.3f;                  // [N] a Touch
constexpr float kEnergy = 0.5e-3f, kSwing = 2e-4f;  // criterion H3
constexpr uint64_t kBegin = 1000000000;             // [ns]
// An arm that could render anything: the map shows what the method can.
constexpr float kAnyStiffness = 5000, kAnyDamping = 30;

float quantize(float x, float step) { return step > 0 ? std::round(x / step) * step : x; }
float smooth(float s) {
  s = std::clamp(s, 0.0f, 1.0f);
  return s * s * s * (10 + s * (6 * s - 15));
}

// Damped well enough to stand still by themselves.
struct HandCase {
  float mass, grip, grip_damping;  // [kg], [N/m], [N s/m]
};
constexpr HandCase kHands[] = {{0.05f, 50, 0.5f}, {0.1f, 150, 2}, {0.3f, 50, 3}, {0.1f, 800, 4}};

ServoOptions any_arm() {
  ServoOptions o;
  o.limits = {kForce, kForce, kAnyStiffness, kAnyDamping};
  o.limiter.continuous = kForce;
  return o;
}
// Force is let in from the start: the ramp is not measured.
void engage(ServoHand& h) { h.limiter.engaged = Engaged::yes; }

// What the physics says of the wall with the hand at x: tissue of twice the stiffness behind a coupling of twice the stiffness.
ForcePatch wall_patch(const WallCase& c, float x) {
  ForcePatch p;
  p.period = 1 / c.rate;
  p.expiry = std::max(p.expiry, 2 * p.period);
  p.normal = {0, 1, 0};
  p.stiffness = outer({0, 1, 0}, c.stiffness);
  p.damping = outer({0, 1, 0}, c.damping);
  p.point = {0, std::min(x, 0.0f), 0};
  if (x < 0) p.force = {0, -c.stiffness * x, 0}, p.gap = -x;
  return p;
}

WallResult press_with(const WallCase& c, const HandCase& hand) {
  WallResult r;
  ServoHand servo;
  const ServoOptions options = any_arm();
  engage(servo);
  ForceModel model;
  ForceModelOptions bare;
  bare.stiffness = kAnyStiffness, bare.damping = kAnyDamping, bare.damping_time = 0;
  float x = 0.004f, v = 0, seen = x, velocity = 0, force = 0, motors = 0;
  float heard = x, thinking = x, next = 0;
  bool any = false, fresh = false;
  std::deque<std::pair<int, float>> under_way;
  double energy = 0;
  float low = 1e9f, high = -1e9f;
  // Deep enough for 1 N, and half of that again.
  const float deep = 0.002f + 1.5f * (1 / c.stiffness + 1 / hand.grip);
  const auto path = [deep](float t) {
    return 0.004f - (0.004f + deep) * (smooth((t - 0.05f) / 0.3f) - smooth((t - 2.2f) / 0.3f));
  };
  constexpr float kHoldFrom = 1.4f, kHoldTo = 2.1f, kEnd = 2.7f;
  const int late = static_cast<int>(std::lround(c.delay / kPart));
  uint64_t now = kBegin;
  for (int i = 0; i < static_cast<int>(kEnd / kStep); ++i, now += 1000000) {
    const float t = static_cast<float>(i) * kStep, at = quantize(x, c.encoder);
    const float keep = std::exp(-2 * kPi * 50 * kStep);
    velocity = velocity * keep + (at - seen) * ((1 - keep) / kStep);
    seen = at;
    fresh = false;
    if (t >= next - 1e-6f) heard = std::exchange(thinking, at), fresh = true, next += 1 / c.rate;
    switch (c.method) {
      case WallMethod::coupling: {
        // The tool of the last frame, in balance between the coupling and the tissue, and where it touched.
        const float tool = std::min(heard, 0.0f) / 2;
        force = heard < 0 ? std::max(0.0f, 2 * c.stiffness * (tool - at) - c.damping * velocity) : 0;
        break;
      }
      case WallMethod::patch:
        if (fresh) {
          ForcePatch p = wall_patch(c, heard);
          make_safe(p, {kForce, kForce, kAnyStiffness, kAnyDamping});
          receive(model, p, bare);
        }
        any = any || fresh;
        force = any ? evaluate(model, {0, at, 0}, {0, velocity, 0}, kStep, bare).y : 0;
        break;
      case WallMethod::chain: {
        ForcePatch p = wall_patch(c, heard);
        p.time_ns = now > kBegin ? now - static_cast<uint64_t>(1e9f / c.rate) : now;
        ArmSample s;
        s.state = ArmState::ready;
        s.pose.p = {0, at, 0};
        force = servo_step(servo, options, s, fresh ? &p : nullptr, now).force.y;
        break;
      }
    }
    force = std::clamp(force, -kForce, kForce);
    under_way.emplace_back(i * kParts + late, force);
    for (int part = 0; part < kParts; ++part) {
      for (; !under_way.empty() && under_way.front().first <= i * kParts + part; under_way.pop_front())
        motors = under_way.front().second;
      const float when = t + kPart * static_cast<float>(part), wish = path(when), speed = (path(when + kPart) - wish) / kPart;
      v += kPart / hand.mass * (motors + hand.grip * (wish - x) + hand.grip_damping * (speed - v) - kViscous * v);
      const float slow = kDry * kPart / hand.mass;
      v = std::abs(v) > slow ? v - std::copysign(slow, v) : 0;
      x += v * kPart;
      energy += double{(motors - kViscous * v) * v * kPart};
    }
    r.energy = std::max(r.energy, static_cast<float>(energy));
    if (t >= kHoldFrom && t < kHoldTo) low = std::min(low, x), high = std::max(high, x);
  }
  r.swing = high - low;
  return r;
}

}  // namespace

const char* wall_method_name(WallMethod m) {
  switch (m) {
    case WallMethod::coupling:
      return "virtual coupling";
    case WallMethod::patch:
      return "patch alone";
    case WallMethod::chain:
      return "whole chain";
  }
  return "";
}

bool is_passive(const WallResult& r) { return r.energy <= kEnergy && r.swing <= kSwing; }

WallResult press_wall(const WallCase& c) {
  WallResult worst;
  for (const HandCase& h : kHands) {
    const WallResult r = press_with(c, h);
    worst = {std::max(worst.energy, r.energy), std::max(worst.swing, r.swing)};
    if (!is_passive(worst)) break;
  }
  return worst;
}

float z_width(WallCase c, float step, float most) {
  float good = 0;
  for (float k = step; k <= most + 0.5f * step; k += step) {
    c.stiffness = k;
    if (!is_passive(press_wall(c))) break;
    good = k;
  }
  return good;
}

const char* environment_name(Environment e) {
  switch (e) {
    case Environment::wall:
      return "wall";
    case Environment::needle:
      return "needle";
    case Environment::thread:
      return "thread";
  }
  return "";
}

namespace {

// Closed forms of what is felt, y the hand's axis [m], the working point at 0.
constexpr float kA1 = 600, kA2 = 1.5e5f, kCoupling = 300, kDepth = 0.003f;  // wall: a1 z + a2 z^2 behind the coupling
constexpr float kDrag = 0.5f, kPresliding = 0.001f;                         // needle: shaft friction (suture/forces)
constexpr float kTaut = 200, kTension = 0.8f;  // thread: [N/m] of tissue 600 behind 300, [N] drawn with

struct WallForce {
  float force, slope;
};
WallForce wall_at(float depth) {
  if (depth <= 0) return {0, kA1 * kCoupling / (kA1 + kCoupling)};
  const float b = kA1 + kCoupling, z = (-b + std::sqrt(b * b + 4 * kA2 * kCoupling * depth)) / (2 * kA2);
  const float tangent = kA1 + 2 * kA2 * z;
  return {kA1 * z + kA2 * z * z, kCoupling * tangent / (kCoupling + tangent)};
}

}  // namespace

std::vector<SweepPoint> sweep(const SweepCase& c, const std::vector<float>& hz) {
  std::vector<SweepPoint> out;
  for (const float f : hz) {
    ServoHand servo;
    ServoOptions options;  // a Touch
    options.limiter.continuous = options.limiter.force;
    engage(servo);
    const float settle = std::max(0.5f, 1 / f), period = 1 / f, last = settle + period * std::max(2.0f, std::ceil(f));
    const auto path = [&](float t) { return c.amplitude * std::sin(2 * kPi * f * t); };
    float heard = 0, thinking = 0, next = 0, motors = 0, friction = 0, from = 0;
    std::deque<std::pair<int, float>> under_way;
    const int late = static_cast<int>(std::lround(c.delay / kPart));
    std::complex<double> felt{}, truth{};
    double error2 = 0, force2 = 0, sum = 0, felt_sum = 0;
    int n = 0;
    uint64_t now = kBegin;
    std::vector<std::pair<float, float>> pair;  // felt and true
    for (int i = 0; static_cast<float>(i) * kStep < last; ++i, now += 1000000) {
      const float t = static_cast<float>(i) * kStep, at = quantize(path(t), c.encoder);
      bool fresh = false;
      if (t >= next - 1e-6f) heard = std::exchange(thinking, at), fresh = true, next += 1 / c.rate;
      ForcePatch p;
      p.period = 1 / c.rate;
      p.expiry = std::max(p.expiry, 2 * p.period);
      p.time_ns = now > kBegin + 20000000 ? now - static_cast<uint64_t>(1e9f / c.rate) : now;
      p.point = {0, heard, 0};
      switch (c.environment) {
        case Environment::wall: {
          const WallForce w = wall_at(kDepth - heard);
          p.normal = {0, 1, 0};
          p.stiffness = outer({0, 1, 0}, w.slope);
          p.force = {0, w.force, 0};
          p.gap = w.force / w.slope;
          break;
        }
        case Environment::needle:
          p.along = {0, 1, 0};
          p.drag = kDrag, p.presliding = kPresliding;
          break;
        case Environment::thread:
          p.force = {0, -kTension - kTaut * heard, 0};
          p.stiffness = outer({0, 1, 0}, kTaut);
          p.thread_direction = {0, -1, 0}, p.thread_tension = -p.force.y;
          break;
      }
      ArmSample s;
      s.state = ArmState::ready;
      s.pose.p = {0, at, 0};
      under_way.emplace_back(i * kParts + late, servo_step(servo, options, s, fresh ? &p : nullptr, now).force.y);
      for (int part = 0; part < kParts; ++part) {
        for (; !under_way.empty() && under_way.front().first <= i * kParts + part; under_way.pop_front())
          motors = under_way.front().second;
        const float when = t + kPart * static_cast<float>(part), x = path(when);
        float ideal = 0;
        if (c.environment == Environment::wall) ideal = wall_at(kDepth - x).force;
        if (c.environment == Environment::thread) ideal = -kTension - kTaut * x;
        if (c.environment == Environment::needle) {
          friction = std::clamp(friction - (x - from) * (kDrag / kPresliding), -kDrag, kDrag);
          ideal = friction;
        }
        from = x;
        if (when < settle) continue;
        const std::complex<double> turn = std::polar(1.0, -2 * std::acos(-1.0) * double{f} * double{when});
        felt += double{motors} * turn, truth += double{ideal} * turn;
        pair.emplace_back(motors, ideal);
        sum += double{ideal}, felt_sum += double{motors};
        ++n;
      }
    }
    for (const auto& [a, b] : pair) {
      error2 += double{a - b} * double{a - b};
      force2 += (double{b} - sum / n) * (double{b} - sum / n);
    }
    const std::complex<double> ratio = felt / truth;
    SweepPoint point;
    point.hz = f, point.gain = static_cast<float>(std::abs(ratio)), point.phase = static_cast<float>(std::arg(ratio));
    point.rms_error = static_cast<float>(std::sqrt(error2 / n)), point.rms = static_cast<float>(std::sqrt(force2 / n));
    out.push_back(point);
  }
  return out;
}

}  // namespace catgut
