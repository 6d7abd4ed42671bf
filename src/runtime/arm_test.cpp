// SPDX-License-Identifier: Apache-2.0
// runtime/arm_test: see the header.
#include "runtime/arm_test.h"

#include <cmath>
#include <cstdio>
#include <thread>

#include "core/check.h"
#include "exchange/latest.h"
#include "haptic/servo.h"
#include "runtime/live.h"

namespace catgut {
namespace {

constexpr std::array<const char*, 3> kAxis{"right", "up", "toward you"};
constexpr float kMoved = 0.0005f;  // [m] minimum displacement of any hand under half a newton

struct Side {
  // Owned by the servo.
  Limiter limiter;
  LimiterOptions limits;
  Vec3 from, last;
  size_t axis = 3;
  uint64_t last_ns = 0;
  // Written by one thread, read by the other.
  std::atomic<int> wanted{3};  // axis, 3: none
  std::atomic<bool> off{false}, lost{false};
  std::array<std::atomic<float>, 3> along{};  // [m] maximum displacement along the push (signed)
  std::atomic<float> felt{0};                 // [N] of the last axis
};

struct Test {
  std::array<Side, 2> side;
  ArmTestOptions options;

  static ArmForce step(void* user, size_t arm, const ArmSample& s) {
    Test& t = *static_cast<Test*>(user);
    Side& side = t.side[arm];
    const uint64_t now = wall_ns();
    const float dt = side.last_ns > 0 ? 1e-9f * static_cast<float>(now - side.last_ns) : 0.001f;
    side.last_ns = now;
    const bool ready = s.state == ArmState::ready && is_finite(s.pose.p);
    if (!ready) side.lost = true;
    const size_t axis = static_cast<size_t>(side.wanted.load(std::memory_order_relaxed));
    if (axis != side.axis) side.from = s.pose.p, side.axis = axis;
    LimiterInput in;
    in.ready = ready && !s.forced_off;
    in.speed = length(s.velocity);
    in.warmth = s.warmth;
    const Vec3 moved = s.pose.p - side.from;
    if (axis < 3 && ready) {
      const Vec3 way = axis == 0 ? Vec3{1, 0, 0} : axis == 1 ? Vec3{0, 1, 0} : Vec3{0, 0, 1};
      const float along = dot(moved, way);
      if (std::abs(along) > std::abs(side.along[axis].load())) side.along[axis] = along;
      if (length(moved) > t.options.far) side.off = true;
      if (!side.off) in.wanted.force = way * t.options.force;
    }
    const ArmForce out = limit(side.limiter, in, dt, side.limits);
    side.felt.store(length(out.force), std::memory_order_relaxed);
    return out;
  }
};

}  // namespace

ArmTestResult test_arms(ArmPort port, const ArmTestOptions& options, const std::function<void(const std::string&)>& say,
                        const std::atomic<bool>& stop) {
  Test test;
  test.options = options;
  for (size_t k = 0; k < 2; ++k) {
    LimiterOptions& l = test.side[k].limits;
    ServoOptions o;
    fit_to_arm(o, port.arm[k].limits);
    l = o.limiter;
    l.force = std::min(l.force, options.force);
    l.slew = 2 * options.force / std::max(0.1f, options.push);  // half of the time up, and as slowly down
    l.slew_recovery = l.slew;
    l.ramp = 0.1f;
  }
  std::string why;
  if (!port.start(port.self, {Test::step, &test}, why))
    throw InputError(port.kind, why, "close other programs that use the devices");
  const auto wait = [&](double seconds) {
    for (const double until = wall_seconds() + seconds; wall_seconds() < until && !stop;)
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
  };
  for (int left = static_cast<int>(options.countdown); left > 0 && !stop; --left) {
    say("hold each stylus lightly, like a pen: " + std::to_string(left));
    wait(1);
  }
  // The limiter engages at zero force only, so a pause precedes the first push even without a countdown.
  wait(std::max(0.1, double{options.countdown} - std::floor(double{options.countdown})));
  const ArmStatus first = port.status(port.self, port.arm[0].present ? 0 : 1);
  const double start = wall_seconds();
  for (int axis = 0; axis < 3 && !stop; ++axis) {
    char text[64];
    std::snprintf(text, sizeof text, "%.1f N %s", double{options.force}, kAxis[static_cast<size_t>(axis)]);
    say(text);
    for (Side& s : test.side) s.wanted = axis;
    wait(double{options.push});
    for (Side& s : test.side) s.wanted = 3;
    wait(0.5 * double{options.push} + 0.1);
  }
  const double rate = static_cast<double>(port.status(port.self, port.arm[0].present ? 0 : 1).steps - first.steps) /
                      std::max(1e-3, wall_seconds() - start);
  port.stop(port.self);

  ArmTestResult result;
  for (size_t k = 0; k < 2; ++k) {
    if (!port.arm[k].present) continue;
    const Side& s = test.side[k];
    char text[256];
    std::snprintf(text, sizeof text, "%s device: %.0f samples/s; moved %.1f mm right, %.1f mm up, %.1f mm toward you",
                  k == 0 ? "right" : "left", rate, 1e3 * double{s.along[0].load()}, 1e3 * double{s.along[1].load()},
                  1e3 * double{s.along[2].load()});
    std::string line = text;
    bool ok = true;
    for (size_t axis = 0; axis < 3 && !stop; ++axis) {
      const float along = s.along[axis].load();
      if (along < -kMoved)
        line += std::string("; WRONG WAY when pushed ") + kAxis[axis] + ": a motor or encoder is inverted", ok = false;
      else if (along < kMoved)
        line += std::string("; no motion when pushed ") + kAxis[axis] + ": no force, or held too firmly", ok = false;
    }
    if (s.off) line += "; ran away unheld, force switched off", ok = false;
    if (s.lost) line += "; samples lost", ok = false;
    if (stop) line += "; stopped", ok = false;
    if (ok) line += ": ok";
    result.line.push_back(line);
    result.ok &= ok;
  }
  return result;
}

std::array<Vec3, 2> held_places(ArmPort port, float countdown, const std::function<void(const std::string&)>& say,
                                const std::atomic<bool>& stop, std::array<bool, 2>& known) {
  struct Watch {
    std::array<Latest<ArmSample>, 2> box;
    static ArmForce step(void* user, size_t arm, const ArmSample& s) {
      Latest<ArmSample>& box = static_cast<Watch*>(user)->box[arm];
      box.draft() = s;
      box.publish();
      return {};
    }
  };
  Watch watch;
  std::string why;
  if (!port.start(port.self, {Watch::step, &watch}, why))
    throw InputError(port.kind, why, "close other programs that use the devices");
  for (double until = wall_seconds() + double{countdown}, messages = 1e9; wall_seconds() < until && !stop;) {
    const double left = std::ceil(until - wall_seconds());
    if (left < messages)
      say("hold each stylus at the center of its side of the field: " + std::to_string(static_cast<int>(left)));
    messages = left;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  port.stop(port.self);
  std::array<Vec3, 2> at;
  for (size_t k = 0; k < 2; ++k) {
    watch.box[k].update();
    const ArmSample& s = watch.box[k].seen();
    known[k] = port.arm[k].present && s.state == ArmState::ready && is_finite(s.pose.p) && !stop;
    at[k] = s.pose.p;
  }
  return at;
}

}  // namespace catgut
