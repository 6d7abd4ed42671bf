// haptic/force_model: see the header.
#include "haptic/force_model.h"

namespace catgut {
namespace {

bool unit_or_zero(Vec3& v) {
  const float l2 = length2(v);
  if (l2 < 1e-12f) return v = {}, true;
  const bool was = std::abs(l2 - 1) < 1e-2f;
  v = normalized(v);
  return was;
}

// [N] that presses the tool against the tissue: what surface friction is a part of.
float pressing(const ForcePatch& p, Vec3 x) {
  return length2(p.normal) > 0 ? std::max(0.0f, dot(linear_force(p, x, {}), p.normal)) : 0;
}

Vec3 allowed_slide(const ForcePatch& p, Vec3 d) {
  if (length2(p.along) > 0) return p.along * dot(d, p.along);
  return d - p.normal * dot(d, p.normal);
}

}  // namespace

bool make_safe(ForcePatch& p, float force, float stiffness, float damping) {
  const float numbers[] = {p.period,  p.expiry,       p.gap,         p.coefficient,    p.drag, p.presliding,
                           p.viscous, p.pierce_force, p.pierce_keep, p.thread_tension, p.cap};
  bool finite = is_finite(p.point) && is_finite(p.force) && is_finite(p.stiffness) && is_finite(p.damping) &&
                is_finite(p.normal) && is_finite(p.along) && is_finite(p.pierce) && is_finite(p.thread_direction);
  for (const float n : numbers) finite = finite && std::isfinite(n);
  if (!finite) {
    const ForcePatch was = p;
    p = {};
    p.tick = was.tick, p.epoch = was.epoch, p.topology = was.topology, p.time_ns = was.time_ns;
    p.cap = 0;
    return false;
  }
  bool good = unit_or_zero(p.normal);
  good &= unit_or_zero(p.along);
  good &= unit_or_zero(p.pierce);
  unit_or_zero(p.thread_direction);
  // A stiffness beyond the arm's is no fault of the simulation (steel is stiff), one below zero is.
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
  return good;
}

Vec3 linear_force(const ForcePatch& p, Vec3 x, Vec3 v) {
  const bool surface = length2(p.normal) > 0;
  if (surface && dot(p.normal, x - p.point) >= p.gap) return {};
  Vec3 f = p.force + p.stiffness * (p.point - x);
  if (surface) f = p.normal * std::max(0.0f, dot(f, p.normal));  // tissue pushes; only friction, below, acts sideways
  const Vec3 damped = f - p.damping * v;
  // Damping makes a contact softer to leave, it never makes it stick.
  return surface ? p.normal * std::max(0.0f, dot(damped, p.normal)) : damped;
}

void receive(ForceModel& m, const ForcePatch& patch, const ForceModelOptions& options) {
  const bool fresh = !m.any || patch.epoch != m.now.epoch || patch.topology != m.now.topology;
  m.before = fresh ? patch : m.now;
  m.now = patch;
  m.since = 0;
  m.blend = fresh ? 0 : options.blend * patch.period;
  if (fresh) m.pierced = false, m.dropped = 1;
  if (patch.coefficient == 0 && patch.drag == 0) m.bristle = {};
}

Vec3 evaluate(ForceModel& m, Vec3 x, Vec3 v, float dt, const ForceModelOptions& options) {
  const Vec3 moved = m.any ? x - m.last : Vec3{};
  m.last = x;
  m.any = true;
  const ForcePatch& p = m.now;
  m.since += dt;
  const float part = m.since < m.blend ? m.since / m.blend : 1.0f;
  Vec3 f = linear_force(p, x, v);
  if (part < 1) f = lerp(linear_force(m.before, x, v), f, part);

  // Piercing happens between two ticks, and is felt when it happens.
  if (p.pierce_force > 0) {
    const float against = -dot(f, p.pierce);
    if (!m.pierced && against > p.pierce_force) m.pierced = true, m.pierced_at = against;
    if (m.pierced) {
      m.dropped = std::max(p.pierce_keep, m.dropped - (1 - p.pierce_keep) * dt / options.drop_time);
      const float left = std::min(against, m.pierced_at * m.dropped);
      f += p.pierce * (against - left);
    }
  }

  // Dahl: the contact is dragged along and lags by at most `presliding`. dz = dx - z |dx| / presliding; force = -limit z /
  // presliding. Bounded, continuous, and it gives back less than it took.
  const float limit = p.drag + (p.coefficient > 0 ? p.coefficient * pressing(p, x) : 0);
  if (limit > 0) {
    const Vec3 slide = allowed_slide(p, moved);
    const float travel = std::min(1.0f, length(slide) / p.presliding);
    m.bristle = allowed_slide(p, m.bristle + slide - m.bristle * travel);
    const float l = length(m.bristle);
    if (l > p.presliding) m.bristle *= p.presliding / l;
    f -= m.bristle * (limit / p.presliding) + allowed_slide(p, v) * p.viscous;
  } else {
    m.bristle = {};
  }
  return f;
}

}  // namespace catgut
