// SPDX-License-Identifier: Apache-2.0
// haptic/passivity: see the header.
#include "haptic/passivity.h"

#include <algorithm>
#include <type_traits>

namespace catgut {

namespace {

// `to`, at most `peak` long and `step` away from `from`.
template <typename T>
T bounded(T from, T to, float peak, float step) {
  const auto size = [](const T& v) {
    if constexpr (std::is_same_v<T, float>) return std::abs(v);
    else return length(v);
  };
  if (size(to) > peak) to *= peak / size(to);
  const T change = to - from;
  if (size(change) > step) to = from + change * (step / size(change));
  return to;
}

}  // namespace

ArmForce keep_passive(Passivity& p, const PassivityInput& in, const PassivityOptions& o) {
  p.gave = p.used = 0;
  if (p.any) {
    const Vec3 moved = in.x - p.last;
    const double body = double{dot(p.held.force, moved)} + double{dot(p.held.torque, in.turned)};
    const double given = body + double{p.held.grip * (in.gap - p.gap)};
    if (p.energy > 0) p.energy *= std::exp(-double{in.dt / o.forget});
    p.energy += given;
    p.total += given;
    p.gave = dot(p.rubbed.force, moved) + dot(p.rubbed.torque, in.turned) - static_cast<float>(body);
  }
  const float felt2 = std::max(length2(p.held.force), length2(in.force));
  p.energy = std::max(p.energy, -double{felt2 / std::max(o.least_stiffness, in.stiffness) + in.stored});
  if (p.energy > o.allowance && in.lent > 0) {
    p.used = std::min(in.lent, static_cast<float>(p.energy - 0.5 * o.allowance));
    p.energy -= double{p.used};
  }
  p.most = std::max(p.most, p.energy);
  p.last = in.x;
  p.gap = in.gap;
  p.braking = false;

  ArmForce out{in.force, in.torque, in.grip};
  // One damping coefficient for all; rotation and grip in proportion to what the device can damp there.
  const float turn = o.damping > 0 ? o.turn_damping / o.damping : 0, pinch = o.damping > 0 ? o.grip_damping / o.damping : 0;
  const double speed2 = double{length2(in.v)} + double{turn * length2(in.spin)} + double{pinch * in.gap_rate * in.gap_rate};
  if (p.energy > o.allowance && speed2 > 1e-8 && o.damping > 0) {
    const float alpha = static_cast<float>(std::min((p.energy - o.allowance) / (speed2 * double{in.dt}), double{o.damping}));
    out.force -= in.v * alpha;
    out.torque -= in.spin * (alpha * turn);
    out.grip -= in.gap_rate * (alpha * pinch);
    p.braking = true;
  }
  const float step = o.slew * std::min(in.dt, o.slew_time), part = in.most > 0 ? step / in.most : 0;
  out.force = bounded(p.held.force, out.force, in.most, step);
  out.torque = bounded(p.held.torque, out.torque, o.torque, part * o.torque);
  out.grip = bounded(p.held.grip, out.grip, o.grip, part * o.grip);

  const bool small = length(out.force) < o.small_force && in.most * length(out.torque) <= o.small_force * o.torque &&
                     in.most * std::abs(out.grip) <= o.small_force * o.grip;
  p.quiet = small ? p.quiet + in.dt : 0;
  if (p.quiet > o.quiet_time) p.energy = 0;
  p.held = out;
  p.rubbed = {in.rubbed, in.rubbed_torque, 0};
  p.any = true;
  return out;
}

float lent_to(const EnergyPool& pool, size_t hand) { return pool.of[1 - hand].load(std::memory_order_relaxed); }

void settle(EnergyPool& pool, size_t hand, const Passivity& p, float dt) {
  const auto change = [](std::atomic<float>& energy, float by, float keep) {
    float was = energy.load(std::memory_order_relaxed);
    while (!energy.compare_exchange_weak(was, std::clamp(was * keep + by, 0.0f, kPoolMost), std::memory_order_relaxed)) {}
  };
  change(pool.of[hand], p.gave, std::exp(-dt / kPoolTime));
  if (p.used > 0) change(pool.of[1 - hand], -p.used, 1);
}

}  // namespace catgut
