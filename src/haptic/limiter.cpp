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

Vec3 limit(Limiter& s, const LimiterInput& in, float raw_dt, const LimiterOptions& o) {
  const float dt = safe_dt(s, raw_dt, o), slew_dt = std::min(dt, o.slew_time);
  Vec3 f = in.wanted;

  // Finite. A non-finite input gives zero force, and its source is ignored until the force is low again.
  if (!is_finite(f) || !std::isfinite(in.speed) || !std::isfinite(in.warmth) || !std::isfinite(in.cap)) {
    s.faults |= kNotFinite;
    f = {};
    disengage(s);
  }
  if (length2(f) > 100 * o.force * o.force) {
    s.faults |= kTooMuch;
    f = {};
    disengage(s);
  }
  if (!in.ready) f = {}, disengage(s);
  if (in.speed > o.top_speed) {
    // A hand that moves freely loses nothing: only a rendered force has to engage again.
    f = {};
    s.recovering = true;
    if (length2(s.out) > o.free_force * o.free_force) s.faults |= kTooFast, disengage(s);
  }

  // Age. Young: used. Expired: the last force, fading, whatever the hand does; then off. No patch yet: zero.
  if (in.age < 0) {
    f = {};
    disengage(s);
  } else if (in.age <= in.expiry) {
    s.trusted = f;
  } else {
    const float late = in.age - in.expiry;
    f = s.trusted * std::exp(-late / o.decay);
    s.recovering = true;
    if (late > o.off_after) {
      f = {};
      if (s.engaged != Engaged::no && s.engaged != Engaged::waiting) s.faults |= kExpired;
      disengage(s);
    }
  }

  // Soft map and clamp, on the vector's length.
  const float wanted = length(f);
  float allowed = wanted <= o.knee ? wanted : o.knee + o.above * (wanted - o.knee);
  allowed = std::min({allowed, o.force, std::max(0.0f, in.cap)});
  if (wanted > 0) f *= allowed / wanted;

  // Ramp-in is decided here, where the commanded force is known, and applied below.
  if (s.engaged == Engaged::no) s.engaged = Engaged::waiting;
  if (s.engaged == Engaged::waiting) {
    s.quiet = allowed < o.engage_force && in.ready && in.age >= 0 && in.age <= in.expiry ? s.quiet + 1 : 0;
    if (s.quiet > o.engage_steps) s.engaged = Engaged::rising, s.ramp = 0;
    f = {};
  }

  // Slew. Slow while force returns after a fault; never slower than usual on the way down.
  const bool growing = length2(f) > length2(s.soft);
  const float slew = s.recovering && growing ? o.slew_recovery : o.slew;
  s.soft = toward(s.soft, f, slew * slew_dt);
  if (s.recovering && s.engaged == Engaged::yes && length2(f - s.soft) < 1e-8f) s.recovering = false;

  // Heat: the cap decreases from the peak to the continuous force as the mean approaches it, and to zero as the motors get hot.
  const float continuous = std::min(o.margin * o.continuous, o.force);
  const float full = s.heat / (continuous * continuous);
  float most = o.force;
  if (full > 0.8f) most = continuous + (o.force - continuous) * std::clamp((1 - full) / 0.2f, 0.0f, 1.0f);
  if (in.warmth > o.warm) most = std::min(most, continuous * std::clamp((1 - in.warmth) / (1 - o.warm), 0.0f, 1.0f));
  Vec3 out = at_most(s.soft, most);
  if (most < o.force && length2(s.soft) > most * most) s.faults |= kTooWarm;

  if (s.engaged == Engaged::rising) {
    s.ramp = std::min(1.0f, s.ramp + slew_dt / o.ramp);
    if (s.ramp >= 1) s.engaged = Engaged::yes;
    out *= s.ramp;
  }
  // The motors never receive a step, whatever the cause of a change.
  s.out = toward(s.out, out, o.slew * slew_dt);
  s.heat += (length2(s.out) - s.heat) * std::min(1.0f, dt / o.heat_time);
  return s.out;
}

}  // namespace catgut
