// solver/attach: reads attachments, moves tissue particles and rigid bodies alike. XPBD (Macklin et al. 2016) per attachment.
#include "solver/attach.h"

#include <Eigen/Dense>

namespace catgut {

TissuePoint spread_point(std::span<const uint32_t> particle, const Vec4* rest, Vec3 at) {
  TissuePoint t;
  t.count = static_cast<uint32_t>(std::min<size_t>(particle.size(), TissuePoint::kMost));
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  auto rest_of = [&](uint32_t k) { return Eigen::Vector3d(rest[particle[k]].x, rest[particle[k]].y, rest[particle[k]].z); };
  for (uint32_t k = 0; k < t.count; ++k) mean += rest_of(k) / t.count;
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (uint32_t k = 0; k < t.count; ++k) spread += (rest_of(k) - mean) * (rest_of(k) - mean).transpose();
  // b_k = 1/n + (q_k - mean)^T S^-1 (at - mean); the pseudo-inverse leaves directions alone in which the particles do not
  // spread.
  const Eigen::Vector3d slope = spread.completeOrthogonalDecomposition().solve(Eigen::Vector3d(at.x, at.y, at.z) - mean);
  for (uint32_t k = 0; k < t.count; ++k) {
    t.particle[k] = particle[k];
    t.weight[k] = static_cast<float>(1.0 / t.count + (rest_of(k) - mean).dot(slope));
  }
  return t;
}

float NeedleArc::nearest(Vec3 p) const {
  float phi = std::atan2(p.y - centre.y, p.x - centre.x);
  // Angles of the gap behind the arc belong to whichever end is nearer.
  if (phi < 0 && phi < 0.5f * (arc - 2 * kPi)) phi += 2 * kPi;
  return std::clamp(phi, 0.0f, arc);
}

void solve_attachment(Attachment& a, Vec4* x, const float* w, const std::vector<RigidModel>& model,
                      std::vector<RigidBody>& body, float h) {
  const Vec3 p = position_of(a.point, x);
  const float alpha = a.compliance / (h * h);
  float wsum = inverse_mass_of(a.point, w);
  if (a.body < 0) {
    if (wsum + alpha <= 0) return;
    const Vec3 d = (a.target - p - alpha * a.lambda) / (wsum + alpha);
    a.lambda += d;
    push(a.point, x, w, d);
    return;
  }
  RigidBody& b = body[static_cast<size_t>(a.body)];
  const RigidModel& m = model[static_cast<size_t>(a.body)];
  const Vec3 r = rotate(b.q, a.target);
  const Vec3 residual = b.x + r - p - alpha * a.lambda;
  const Vec3 n = normalized(residual);
  if (length2(n) == 0) return;
  wsum += inverse_mass_at(m, b, r, n);
  const Vec3 d = residual / (wsum + alpha);
  a.lambda += d;
  push(a.point, x, w, d);
  push(m, b, -d, r);
}

static float inverse_mass_of(const TissuePin& pin, const float* w) {
  return inverse_mass_of(pin.a, w) + inverse_mass_of(pin.b, w);
}

// wsum: of its points [1/kg]. room [m]: how much slack its rope has for certain, negative when it pulls. Returns the size of
// its step [N s^2].
static float solve_pin(TissuePin& pin, Vec4* x, const float* w, float wsum, float h, float& room) {
  // More than the arithmetic rounds off in all the steps of a substep.
  constexpr float kRounding = 5e-6f;
  const Vec3 d = position_of(pin.a, x) - position_of(pin.b, x);
  const float l = length(d);
  if (l <= pin.length && pin.lambda >= 0) {
    room = pin.length - l - kRounding;
    return 0;
  }
  room = -1;
  const Vec3 n = l > 1e-9f ? d / l : Vec3{0, 1, 0};
  const float alpha = pin.compliance / (h * h);
  if (wsum + alpha <= 0) return 0;
  const float step = std::min(-(l - pin.length + alpha * pin.lambda) / (wsum + alpha), -pin.lambda);
  pin.lambda += step;
  push(pin.a, x, w, n * step);
  push(pin.b, x, w, n * -step);
  return std::abs(step);
}

void solve_pin(TissuePin& pin, Vec4* x, const float* w, float h) {
  float room = 0;
  solve_pin(pin, x, w, inverse_mass_of(pin, w), h, room);
}

static bool same(const TissuePoint& a, const TissuePoint& b) {
  return a.count == b.count && std::equal(a.particle.begin(), a.particle.begin() + a.count, b.particle.begin()) &&
         std::equal(a.weight.begin(), a.weight.begin() + a.count, b.weight.begin());
}

void weave(std::span<const TissuePin> pin, const float* w, uint32_t particles, PinWeb& web) {
  bool still = web.first.size() == pin.size() + 1;
  for (size_t i = 0; still && i < pin.size(); ++i)
    still = same(web.point[2 * i], pin[i].a) && same(web.point[2 * i + 1], pin[i].b);
  if (still) return;
  web.point.clear();
  web.inv_mass.clear();
  for (const TissuePin& p : pin) {
    web.point.push_back(p.a);
    web.point.push_back(p.b);
    web.inv_mass.push_back(inverse_mass_of(p, w));
  }

  // Every particle's row: the pins that it is part of, and its weight there.
  const auto each = [&](auto&& of) {
    for (uint32_t k = 0; k < web.point.size(); ++k)
      for (uint32_t m = 0; m < web.point[k].count; ++m) of(k / 2, web.point[k].particle[m], std::abs(web.point[k].weight[m]));
  };
  web.start.assign(particles + 2, 0);
  each([&](uint32_t, uint32_t particle, float) { ++web.start[particle + 2]; });
  for (size_t i = 1; i < web.start.size(); ++i) web.start[i] += web.start[i - 1];
  web.pin.resize(web.start.back());
  web.weight.resize(web.start.back());
  each([&](uint32_t i, uint32_t particle, float weight) {  // start[particle + 1] runs through its row to where the next begins
    const uint32_t at = web.start[particle + 1]++;
    web.pin[at] = i;
    web.weight[at] = weight;
  });

  web.first.assign(1, 0);
  web.other.clear();
  web.by_pin.assign(pin.size(), 0);
  for (uint32_t i = 0; i < pin.size(); ++i) {
    for (const TissuePoint* p : {&pin[i].a, &pin[i].b})
      for (uint32_t m = 0; m < p->count; ++m) {
        const uint32_t particle = p->particle[m];
        for (uint32_t r = web.start[particle]; r < web.start[particle + 1]; ++r) {
          const uint32_t j = web.pin[r];
          if (j == i) continue;
          if (web.by_pin[j] == 0) web.other.push_back({j, 0});
          // A pinned particle couples nothing, but a row is listed once.
          web.by_pin[j] += std::max(1e-20f, w[particle] * std::abs(p->weight[m]) * web.weight[r]);
        }
      }
    for (size_t r = web.first.back(); r < web.other.size(); ++r) {
      constexpr float kMore = 1.01f;  // than the sum, which is rounded
      web.other[r].coupling = kMore * web.by_pin[web.other[r].pin];
      web.by_pin[web.other[r].pin] = 0;
    }
    web.first.push_back(static_cast<uint32_t>(web.other.size()));
  }
}

void solve_pins(std::span<TissuePin> pin, const PinWeb& web, Vec4* x, const float* w, float h, int sweeps,
                std::vector<float>& room) {
  if (web.first.size() != pin.size() + 1) {
    for (int sweep = 0; sweep < sweeps; ++sweep)
      for (TissuePin& p : pin) solve_pin(p, x, w, h);
    return;
  }
  room.assign(pin.size(), -1);
  for (int sweep = 0; sweep < sweeps; ++sweep)
    for (size_t i = 0; i < pin.size(); ++i) {
      if (room[i] >= 0) continue;
      const float step = solve_pin(pin[i], x, w, web.inv_mass[i], h, room[i]);
      if (step == 0) continue;
      for (uint32_t r = web.first[i]; r < web.first[i + 1]; ++r) room[web.other[r].pin] -= step * web.other[r].coupling;
    }
}

void solve_channel(ChannelPoint& c, const NeedleArc& arc, Vec4* x, const float* w, const RigidModel& model, RigidBody& needle,
                   float h) {
  const Vec3 p = position_of(c.point, x);
  const Vec3 local = to_local(needle.pose(), p);
  const float phi = arc.nearest(local);
  const Vec3 on_arc = arc.point(phi);
  const Vec3 tangent = rotate(needle.q, arc.tangent(phi));
  const float wp = inverse_mass_of(c.point, w);
  const float inv_h2 = 1.0f / (h * h);

  const Vec3 r = rotate(needle.q, on_arc);
  Vec3 gap = needle.x + r - p;
  gap -= tangent * dot(gap, tangent);  // sideways only: beyond an end of the arc nothing pulls it back along the shaft
  const float alpha = c.compliance * inv_h2;
  const Vec3 residual = gap - alpha * c.lambda;
  const Vec3 n = normalized(residual);
  if (length2(n) > 0) {
    const Vec3 d = residual / (wp + inverse_mass_at(model, needle, r, n) + alpha);
    c.lambda += d;
    push(c.point, x, w, d);
    push(model, needle, -d, r);
  }

  // Drag: undo the slip since the start of the substep, as far as the largest force allows.
  const float slip = arc.radius * (phi - c.at);  // tissue moved toward the tip by this
  const float wt = wp + inverse_mass_at(model, needle, r, tangent);
  const float limit = c.drag * h * h;
  const float wanted = std::clamp(c.drag_lambda - slip / wt, -limit, limit);
  const float d = wanted - c.drag_lambda;
  c.drag_lambda = wanted;
  push(c.point, x, w, tangent * d);
  push(model, needle, tangent * -d, r);
}

}  // namespace catgut
