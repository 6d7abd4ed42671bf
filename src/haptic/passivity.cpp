// SPDX-License-Identifier: Apache-2.0
// haptic/passivity: see the header.
#include "haptic/passivity.h"

#include <algorithm>

namespace catgut {

Vec3 keep_passive(Passivity& p, const PassivityInput& in, const PassivityOptions& o) {
  p.gave = p.used = 0;
  if (p.any) {
    const Vec3 moved = in.x - p.last;
    const double given = double{dot(p.force, moved)};
    if (p.energy > 0) p.energy *= std::exp(-double{in.dt / o.forget});
    p.energy += given;
    p.total += given;
    p.gave = dot(p.rubbed, moved) - static_cast<float>(given);
  }
  const float felt2 = std::max(length2(p.force), length2(in.force));
  p.energy = std::max(p.energy, -double{felt2 / std::max(o.least_stiffness, in.stiffness)});
  if (p.energy > o.allowance && in.lent > 0) {
    p.used = std::min(in.lent, static_cast<float>(p.energy - 0.5 * o.allowance));
    p.energy -= double{p.used};
  }
  p.most = std::max(p.most, p.energy);
  p.last = in.x;
  p.braking = false;

  Vec3 out = in.force;
  const double speed2 = double{length2(in.v)};
  if (p.energy > o.allowance && speed2 > 1e-8 && o.damping > 0) {
    const double alpha = std::min((p.energy - o.allowance) / (speed2 * double{in.dt}), double{o.damping});
    out -= in.v * static_cast<float>(alpha);
    p.braking = true;
  }
  if (length(out) > in.most) out *= in.most / length(out);
  const Vec3 change = out - p.force;
  const float step = o.slew * std::min(in.dt, o.slew_time);
  if (length(change) > step) out = p.force + change * (step / length(change));

  p.quiet = length(out) < o.small_force ? p.quiet + in.dt : 0;
  if (p.quiet > o.quiet_time) p.energy = 0;
  p.force = out;
  p.rubbed = in.rubbed;
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
