// SPDX-License-Identifier: Apache-2.0
// haptic/limiter: see the header. The order of the steps is that of docs/rooms/haptic.md.
#include "haptic/limiter.h"

namespace catgut {
namespace {

Vec3 at_most(Vec3 v, float most) {
  const float l = length(v);
  return l > most ? v * (most / l) : v;
}
Vec3 toward(Vec3 from, Vec3 to, float step) { return from + at_most(to - from, step); }

}  // namespace

void disengage(Limiter& s) {
  s.engaged = Engaged::no;
  s.quiet = 0;
  s.ramp = 0;
  s.recovering = true;
}

float safe_dt(Limiter& s, float dt, const LimiterOptions& o) {
  if (dt > o.late) s.faults |= kLate, s.recovering = true;
  if (dt > 0 && dt <= 0.02f) return dt;
  s.faults |= kTimeBack;
  return 0.001f;
}

ArmForce limit(Limiter& s, const LimiterInput& in, float raw_dt, const LimiterOptions& o) {
  const float dt = safe_dt(s, raw_dt, o), slew_dt = std::min(dt, o.slew_time);
  const float lever = o.torque / o.force, pinch = o.grip / o.force;
  std::array<Vec3, 3> f{in.wanted.force, lever > 0 ? in.wanted.torque / lever : Vec3{},
                        pinch > 0 ? Vec3{in.wanted.grip / pinch, 0, 0} : Vec3{}};
  const auto zero = [&f] { f = {}; };

  // Finite. A non-finite input gives zero force, and its source is ignored until the force is low again.
  if (!is_finite(f[0]) || !is_finite(f[1]) || !is_finite(f[2]) || !std::isfinite(in.speed) || !std::isfinite(in.warmth) ||
      !std::isfinite(in.cap)) {
    s.faults |= kNotFinite;
    zero();
    disengage(s);
  }
  if (std::max({length2(f[0]), length2(f[1]), length2(f[2])}) > 100 * o.force * o.force) {
    s.faults |= kTooMuch;
    zero();
    disengage(s);
  }
  if (!in.ready) zero(), disengage(s);
  if (in.speed > o.top_speed) {
    // A hand that moves freely loses nothing: only a rendered force has to engage again.
    zero();
    s.recovering = true;
    if (std::max(length2(s.motor[0].out), length2(s.motor[1].out)) > o.free_force * o.free_force)
      s.faults |= kTooFast, disengage(s);
  }

  // Age. Young: used. Expired: the last force, fading, whatever the hand does; then off. No patch yet: zero.
  if (in.age < 0) {
    zero();
    disengage(s);
  } else if (in.age <= in.expiry) {
    for (size_t k = 0; k < 3; ++k) s.motor[k].trusted = f[k];
  } else {
    const float late = in.age - in.expiry, left = std::exp(-late / o.decay);
    for (size_t k = 0; k < 3; ++k) f[k] = s.motor[k].trusted * left;
    s.recovering = true;
    if (late > o.off_after) {
      zero();
      if (s.engaged != Engaged::no && s.engaged != Engaged::waiting) s.faults |= kExpired;
      disengage(s);
    }
  }

  // Soft map and clamp, on the vector's length.
  std::array<float, 3> allowed{};
  for (size_t k = 0; k < 3; ++k) {
    const float wanted = length(f[k]), cap = k == 0 || !(in.cap > 0) ? std::max(0.0f, in.cap) : o.force;
    allowed[k] = std::min({wanted <= o.knee ? wanted : o.knee + o.above * (wanted - o.knee), o.force, cap});
    if (wanted > 0) f[k] *= allowed[k] / wanted;
  }

  // Ramp-in is decided here, where the commanded force is known, and applied below. The grip does not count: a hand that holds
  // a needle must not drop it to get its force back.
  if (s.engaged == Engaged::no) s.engaged = Engaged::waiting;
  if (s.engaged == Engaged::waiting) {
    const bool small = std::max(allowed[0], allowed[1]) < o.engage_force;
    s.quiet = small && in.ready && in.age >= 0 && in.age <= in.expiry ? s.quiet + 1 : 0;
    if (s.quiet > o.engage_steps) s.engaged = Engaged::rising, s.ramp = 0;
    zero();
  }
  if (s.engaged == Engaged::rising) s.ramp = std::min(1.0f, s.ramp + slew_dt / o.ramp);

  bool caught_up = true;
  const float continuous = std::min(o.margin * o.continuous, o.force);
  for (size_t k = 0; k < 3; ++k) {
    LimiterMotors& m = s.motor[k];
    // Slew. Slow while force returns after a fault; never slower than usual on the way down.
    const float slew = s.recovering && length2(f[k]) > length2(m.soft) ? o.slew_recovery : o.slew;
    m.soft = toward(m.soft, f[k], slew * slew_dt);
    caught_up = caught_up && length2(f[k] - m.soft) < 1e-8f;

    // Heat: the cap decreases from the peak to the continuous force as the mean approaches it, and to zero as the motors get
    // hot.
    const float full = m.heat / (continuous * continuous);
    float most = o.force;
    if (full > 0.8f) most = continuous + (o.force - continuous) * std::clamp((1 - full) / 0.2f, 0.0f, 1.0f);
    if (in.warmth > o.warm) most = std::min(most, continuous * std::clamp((1 - in.warmth) / (1 - o.warm), 0.0f, 1.0f));
    Vec3 out = at_most(m.soft, most);
    if (most < o.force && length2(m.soft) > most * most) s.faults |= kTooWarm;

    if (s.engaged == Engaged::rising) out *= s.ramp;
    // The motors never receive a step, whatever the cause of a change.
    m.out = toward(m.out, out, o.slew * slew_dt);
    m.heat += (length2(m.out) - m.heat) * std::min(1.0f, dt / o.heat_time);
  }
  if (s.recovering && s.engaged == Engaged::yes && caught_up) s.recovering = false;
  if (s.engaged == Engaged::rising && s.ramp >= 1) s.engaged = Engaged::yes;
  return {s.motor[0].out, s.motor[1].out * lever, s.motor[2].out.x * pinch};
}

}  // namespace catgut
