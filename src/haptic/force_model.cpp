// SPDX-License-Identifier: Apache-2.0
// haptic/force_model: see the header.
#include "haptic/force_model.h"

namespace catgut {
namespace {

constexpr float kLongest = 0.15f;    // [m] lever: the length of an instrument
constexpr float kCouplePart = 0.3f;  // of the device's stiffness in rotation, for couples

bool unit_or_zero(Vec3& v) {
  const float l2 = length2(v);
  if (l2 < 1e-12f) return v = {}, true;
  const bool was = std::abs(l2 - 1) < 1e-2f;
  v = normalized(v);
  return was;
}

// [N] that presses the tool against the tissue: the normal load of surface friction.
float pressing(const ForcePatch& p, Vec3 x) {
  return length2(p.normal) > 0 ? std::max(0.0f, dot(linear_force(p, x, {}), p.normal)) : 0;
}

Vec3 allowed_slide(const ForcePatch& p, Vec3 d) {
  if (length2(p.along) > 0) return p.along * dot(d, p.along);
  return d - p.normal * dot(d, p.normal);
}

}  // namespace

bool make_safe(ForcePatch& p, const ArmLimits& limits) {
  const float force = limits.force, stiffness = limits.stiffness, damping = limits.damping;
  const bool turns = limits.torque > 0, grips = limits.grip > 0;
  if (!turns) p.turn = {}, p.lever = p.couple = {}, p.couple_stiffness = 0;
  if (!grips) p.grip_from = p.grip_stiffness = 0;
  const float numbers[] = {p.period,
                           p.expiry,
                           p.gap,
                           p.coefficient,
                           p.drag,
                           p.presliding,
                           p.viscous,
                           p.pierce_force,
                           p.pierce_keep,
                           p.thread_tension,
                           p.cap,
                           p.couple_stiffness,
                           p.grip_from,
                           p.grip_stiffness,
                           p.turn.x + p.turn.y,
                           p.turn.z + p.turn.w};
  bool finite = is_finite(p.point) && is_finite(p.force) && is_finite(p.stiffness) && is_finite(p.damping) &&
                is_finite(p.normal) && is_finite(p.along) && is_finite(p.pierce) && is_finite(p.thread_direction) &&
                is_finite(p.lever) && is_finite(p.couple);
  for (const float n : numbers) finite = finite && std::isfinite(n);
  if (!finite) {
    const ForcePatch was = p;
    p = {};
    p.tick = was.tick, p.epoch = was.epoch, p.discontinuity_id = was.discontinuity_id, p.time_ns = was.time_ns;
    p.cap = 0;
    return false;
  }
  bool good = unit_or_zero(p.normal);
  good &= unit_or_zero(p.along);
  good &= unit_or_zero(p.pierce);
  unit_or_zero(p.thread_direction);
  // A stiffness above the device's limit is valid (steel is stiff), a negative one is not.
  const Eigen3 e = eigen(p.stiffness);
  for (const float value : e.value) good &= value > -1e-3f * stiffness;
  p.stiffness = clamp_eigenvalues(p.stiffness, 0, stiffness);
  p.damping = clamp_eigenvalues(p.damping, 0, damping);
  good &= p.cap >= 0 && p.coefficient >= 0 && p.drag >= 0 && p.viscous >= 0;
  p.cap = std::clamp(p.cap, 0.0f, force);
  p.coefficient = std::clamp(p.coefficient, 0.0f, 2.0f);
  p.drag = std::clamp(p.drag, 0.0f, force);
  p.viscous = std::clamp(p.viscous, 0.0f, damping);
  p.presliding = std::clamp(p.presliding, 1e-4f, 0.01f);
  p.pierce_keep = std::clamp(p.pierce_keep, 0.0f, 1.0f);
  p.period = std::clamp(p.period, 0.0f, 0.1f);
  p.expiry = std::clamp(p.expiry, 0.0f, 0.1f);
  if (turns) {
    good &= p.couple_stiffness >= 0;
    p.turn = normalized(p.turn);
    // The spring of the force turns the hand with stiffness x lever^2. What a shorter lever leaves of the torque is a couple.
    const Eigen3 now = eigen(p.stiffness);
    const float stiffest = std::max({now.value[0], now.value[1], now.value[2], 1.0f});
    const float most = std::min(kLongest, std::sqrt((1 - kCouplePart) * limits.turn_stiffness / stiffest)), l = length(p.lever);
    if (l > most) {
      const Vec3 kept = p.lever * (most / l);
      p.couple += cross(p.lever - kept, p.force);
      p.lever = kept;
    }
    if (length(p.couple) > limits.torque) p.couple *= limits.torque / length(p.couple);
    p.couple_stiffness = std::clamp(p.couple_stiffness, 0.0f, kCouplePart * limits.turn_stiffness);
  }
  if (grips) {
    good &= p.grip_stiffness >= 0;
    p.grip_from = std::clamp(p.grip_from, 0.0f, 1.0f);
    p.grip_stiffness = std::clamp(p.grip_stiffness, 0.0f, limits.grip_stiffness * kGripTravel);
  }
  return good;
}

Vec3 linear_force(const ForcePatch& p, Vec3 x, Vec3 v) {
  const bool surface = length2(p.normal) > 0;
  if (surface && dot(p.normal, x - p.point) >= p.gap) return {};
  Vec3 f = p.force + p.stiffness * (p.point - x);
  if (surface) f = p.normal * std::max(0.0f, dot(f, p.normal));  // tissue only pushes; only friction, below, acts sideways
  const Vec3 damped = f - p.damping * v;
  // Damping makes a contact softer on leaving, never sticky.
  return surface ? p.normal * std::max(0.0f, dot(damped, p.normal)) : damped;
}

namespace {

constexpr float kStickTime = 0.005f;   // [s]
constexpr float kFrictionPart = 0.1f;  // minimum stiffness of friction, relative to the device's stiffness

// Every force of a patch except friction and the decaying part of a punctured wall.
Vec3 smooth_force(const ForceModel& m, Vec3 x, Vec3 v) { return linear_force(m.now, x, v) + m.change; }

// Where the lever of a patch points once the hand has turned to q, and the torque of its couple there.
Vec3 lever_at(const ForcePatch& p, Quat q) { return length2(p.lever) > 0 ? rotate(q * conjugate(p.turn), p.lever) : Vec3{}; }
Vec3 couple_at(const ForcePatch& p, Quat q, float pressing_part) {
  const float size = length(p.couple);
  if (!(size > 0)) return {};
  const Vec3 axis = p.couple / size;
  return axis * ((size - p.couple_stiffness * dot(axis, rotation_vector(q * conjugate(p.turn)))) * pressing_part);
}
// Of a contact that the hand is about to leave, the part that remains; 1 for what holds the hand.
float pressing_part(const ForcePatch& p, Vec3 x) {
  const float full = length(p.force);
  return length2(p.normal) > 0 ? (full > 0 ? std::min(1.0f, length(linear_force(p, x, {})) / full) : 0.0f) : 1.0f;
}

// [N/m] that friction may add to the patch's own stiffness along its directions.
float room_for_friction(const ForcePatch& p, float budget) {
  const Sym3& k = p.stiffness;
  const Vec3 d = length2(p.along) > 0 ? p.along : p.normal;
  const float along = dot(d, k * d), used = length2(p.along) > 0 ? along : k.xx + k.yy + k.zz - along;
  return std::max(kFrictionPart * budget, budget - used);
}

}  // namespace

void receive(ForceModel& m, const ForcePatch& patch, const ForceModelOptions& options) {
  const bool fresh = !m.any || patch.epoch != m.now.epoch || patch.discontinuity_id != m.now.discontinuity_id;
  const Vec3 before = smooth_force(m, m.last, m.velocity);
  const Vec3 torque = cross(lever_at(m.now, m.q), before) + m.couple;
  const bool levers = length2(m.now.lever) + length2(patch.lever) > 0;
  m.now = patch;
  if (levers) m.last = m.hand + lever_at(patch, m.q) - patch.lever;  // the hand has not moved, only where the force acts
  if (length2(patch.along) > 0 && patch.drag > 0)  // friction along a direction in which the patch itself is stiff
    m.now.stiffness = clamp_eigenvalues(patch.stiffness, 0, (1 - kFrictionPart) * options.stiffness);
  // The patch's own damping, plus what its stiffness needs.
  const Sym3 least = m.now.stiffness * options.damping_time;
  m.now.damping = clamp_eigenvalues(m.now.damping + least, 0, options.damping);
  m.change = fresh ? Vec3{} : before - linear_force(m.now, m.last, m.velocity);
  m.fade = std::max(options.blend_least, options.blend * patch.period);
  m.turn_change =
      fresh ? Vec3{} : torque - cross(lever_at(patch, m.q), before) - couple_at(patch, m.q, pressing_part(patch, m.last));
  if (fresh) m.pierced = false, m.dropped = 1;
  if (patch.coefficient == 0 && patch.drag == 0) {
    if (!fresh) m.change -= m.bristle;
    m.bristle = {}, m.rub = 0;
  }
}

Vec3 evaluate(ForceModel& m, Vec3 x, Vec3 v, float dt, const ForceModelOptions& options) {
  const Vec3 moved = m.any ? x - m.last : Vec3{};
  m.last = x;
  m.velocity = v;
  m.any = true;
  const ForcePatch& p = m.now;
  m.change *= std::exp(-dt / std::max(1e-4f, m.fade));
  Vec3 f = smooth_force(m, x, v);

  // Puncture happens between two ticks and is rendered at once. Only the wall's own force drops: not thread tension, not
  // damping.
  if (p.pierce_force > 0) {
    const float wall = -dot(linear_force(p, x, {}) + m.change - p.thread_direction * p.thread_tension, p.pierce);
    if (!m.pierced && wall > p.pierce_force) m.pierced = true, m.pierced_at = wall, m.pierced_for = 0;
    if (m.pierced) {
      m.pierced_for += dt;
      // The physics did not puncture after all (the hand withdrew): the wall is restored.
      if (m.pierced_for > options.unconfirmed + 2 * p.period) m.dropped += (1 - p.pierce_keep) * dt / options.wall_back;
      else m.dropped = std::max(p.pierce_keep, m.dropped - (1 - p.pierce_keep) * dt / options.drop_time);
      const float left = std::min(wall, m.pierced_at * m.dropped);
      f += p.pierce * (wall - left);
      if (m.dropped >= 1) m.pierced = false, m.dropped = 1;
    }
  }

  // Friction: elastic up to the limit, then it slips (Hayward and Armstrong 2000). The elastic range is that of the model
  // of Dupont, Hayward, Armstrong and Altpeter 2002. Below the limit nothing creeps, for any encoder noise. The spring adds at
  // most what the device can render beyond the patch's own stiffness, and changes its stiffness without a step
  // in force.
  const float limit = p.drag + (p.coefficient > 0 ? p.coefficient * pressing(p, x) : 0);
  m.rubbed = {};
  if (limit > 0) {
    const float room = room_for_friction(p, options.stiffness);
    const float rub = std::min(room, std::max(m.rub, limit / p.presliding));
    if (m.rub > rub) m.bristle *= rub / m.rub;  // a softer spring at the same stretch: it releases energy, never adds any
    m.rub = rub;
    m.bristle = allowed_slide(p, m.bristle + allowed_slide(p, moved) * rub);
    const float l = length(m.bristle);
    if (l > limit) m.bristle *= limit / l;
    // Damped while it stretches (LuGre's sigma 1); where it slips, this would only increase friction.
    m.sticks += ((l > limit ? 0.0f : 1.0f) - m.sticks) * std::min(1.0f, dt / kStickTime);
    m.rubbed = -m.bristle - allowed_slide(p, v) * (p.viscous + m.sticks * rub * options.damping_time);
    f += m.rubbed;
  } else {
    m.bristle = {};
    m.rub = 0;
  }
  return f;
}

Vec3 lever_of(const ForceModel& m) { return lever_at(m.now, m.q); }

ArmForce evaluate(ForceModel& m, const FeltMotion& hand, float dt, const ForceModelOptions& options) {
  const ForcePatch& p = m.now;
  ArmForce out;
  const Vec3 lever = lever_at(p, hand.q), at = hand.x + (lever - p.lever);
  out.force = evaluate(m, at, hand.v + cross(hand.spin, lever), dt, options);
  m.hand = hand.x, m.q = hand.q;
  m.turn_change *= std::exp(-dt / std::max(1e-4f, m.fade));
  m.couple = couple_at(p, hand.q, pressing_part(p, at)) + m.turn_change;
  out.torque = cross(lever, out.force) + m.couple;
  if (const float size = length(p.couple); size > 0) {
    const float damping = std::min(options.turn_damping, p.couple_stiffness * options.damping_time);
    out.torque -= p.couple * (damping * dot(p.couple, hand.spin) / (size * size));
  }
  // Between the jaws; damped while they close, and never sticky.
  const float in = p.grip_from - hand.jaw;
  if (in > 0) out.grip = std::max(0.0f, p.grip_stiffness * (in - hand.jaw_rate * options.damping_time));
  return out;
}

}  // namespace catgut
