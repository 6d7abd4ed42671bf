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

namespace {

// A pin as one sum over all the particles of its two points: their difference is sum(share * x), and a pull of 1 along it moves
// particle k by move[k]. An even number, so that two sums run side by side.
struct PinRow {
  uint32_t count = 0;
  float inv_mass = 0;  // [1/kg]
  std::array<uint32_t, 2 * TissuePoint::kMost> particle{};
  std::array<float, 2 * TissuePoint::kMost> share{}, move{};
};

PinRow row_of(const TissuePin& pin, const float* w) {
  PinRow row;
  const auto take = [&](const TissuePoint& t, float sign) {
    for (uint32_t k = 0; k < t.count; ++k) {
      uint32_t at = 0;
      while (at < row.count && row.particle[at] != t.particle[k]) ++at;
      if (at == row.count) row.particle[row.count++] = t.particle[k];
      row.share[at] += sign * t.weight[k];
    }
  };
  take(pin.a, 1);
  take(pin.b, -1);
  if (row.count % 2) row.particle[row.count] = row.particle[row.count - 1], ++row.count;  // with no share in it
  for (uint32_t k = 0; k < row.count; ++k) {
    row.move[k] = row.share[k] * w[row.particle[k]];
    row.inv_mass += row.share[k] * row.move[k];
  }
  return row;
}

// A rope that pulls already and is as it should be to within `tolerance` [m] is left alone; one that does not yet is solved
// however little it is too long, or it would be left until it is and then twitch. room [m]: how much nearer or further its
// points may come before it has to be looked at again. Returns the size of its step [N s^2].
float solve_row(TissuePin& pin, Vec4* x, const uint32_t* particle, const float* share, const float* move, uint32_t count,
                float inv_mass, float h, float tolerance, float& room) {
  Four even{}, odd{};
  for (uint32_t k = 0; k < count; k += 2) {
    even += load(x[particle[k]]) * share[k];
    odd += load(x[particle[k + 1]]) * share[k + 1];
  }
  const Four sum = even + odd;
  const Vec3 d{sum[0], sum[1], sum[2]};
  const float l = length(d);
  if (l <= pin.length && pin.lambda >= 0) {
    room = pin.length - l + tolerance;
    return 0;
  }
  const float alpha = pin.compliance / (h * h);
  const float off = l - pin.length + alpha * pin.lambda;
  room = tolerance - std::abs(off);
  if (room > 0 && pin.lambda < 0) return 0;
  room = tolerance;
  if (inv_mass + alpha <= 0) return 0;
  const Vec3 n = l > 1e-9f ? d / l : Vec3{0, 1, 0};
  const float step = std::min(-off / (inv_mass + alpha), -pin.lambda);
  pin.lambda += step;
  const Four push{n.x * step, n.y * step, n.z * step, 0};
  for (uint32_t k = 0; k < count; ++k) {
    Vec4& at = x[particle[k]];
    store(at, load(at) + push * move[k]);
  }
  return std::abs(step);
}

}  // namespace

void solve_pin(TissuePin& pin, Vec4* x, const float* w, float h) {
  const PinRow row = row_of(pin, w);
  float room = 0;
  solve_row(pin, x, row.particle.data(), row.share.data(), row.move.data(), row.count, row.inv_mass, h, 0, room);
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
  web.particle.clear();
  web.share.clear();
  web.move.clear();
  web.row.assign(1, 0);
  for (const TissuePin& p : pin) {
    web.point.push_back(p.a);
    web.point.push_back(p.b);
    const PinRow row = row_of(p, w);
    web.particle.insert(web.particle.end(), row.particle.begin(), row.particle.begin() + row.count);
    web.share.insert(web.share.end(), row.share.begin(), row.share.begin() + row.count);
    web.move.insert(web.move.end(), row.move.begin(), row.move.begin() + row.count);
    web.row.push_back(static_cast<uint32_t>(web.particle.size()));
    web.inv_mass.push_back(row.inv_mass);
  }

  // By particle: the pins that it is part of, and its share there.
  web.start.assign(particles + 2, 0);
  for (const uint32_t k : web.particle) ++web.start[k + 2];
  for (size_t i = 1; i < web.start.size(); ++i) web.start[i] += web.start[i - 1];
  web.pin.resize(web.particle.size());
  web.weight.resize(web.particle.size());
  for (uint32_t i = 0; i < pin.size(); ++i)
    for (uint32_t k = web.row[i]; k < web.row[i + 1]; ++k) {
      const uint32_t at = web.start[web.particle[k] + 1]++;  // runs through its part to where the next begins
      web.pin[at] = i;
      web.weight[at] = std::abs(web.share[k]);
    }

  web.first.assign(1, 0);
  web.other.clear();
  web.by_pin.assign(pin.size(), 0);
  for (uint32_t i = 0; i < pin.size(); ++i) {
    for (uint32_t k = web.row[i]; k < web.row[i + 1]; ++k)
      for (uint32_t r = web.start[web.particle[k]]; r < web.start[web.particle[k] + 1]; ++r) {
        const uint32_t j = web.pin[r];
        if (j == i) continue;
        if (web.by_pin[j] == 0) web.other.push_back({j, 0});
        // A pinned particle couples nothing, but a pin is listed once.
        web.by_pin[j] += std::max(1e-20f, std::abs(web.move[k]) * web.weight[r]);
      }
    for (size_t r = web.first.back(); r < web.other.size(); ++r) {
      constexpr float kMore = 1.01f;  // than the sum, which is rounded
      web.other[r].coupling = kMore * web.by_pin[web.other[r].pin];
      web.by_pin[web.other[r].pin] = 0;
    }
    web.first.push_back(static_cast<uint32_t>(web.other.size()));
  }
}

void solve_pins(std::span<TissuePin> pin, const PinWeb& web, Vec4* x, const float* w, float h, int sweeps, float tolerance,
                std::vector<float>& room) {
  // More than the arithmetic rounds off in all the steps of a substep.
  constexpr float kRounding = 5e-6f;
  if (web.first.size() != pin.size() + 1) {
    for (int sweep = 0; sweep < sweeps; ++sweep)
      for (TissuePin& p : pin) solve_pin(p, x, w, h);
    return;
  }
  room.assign(pin.size(), -1);
  for (int sweep = 0; sweep < sweeps; ++sweep)
    for (size_t i = 0; i < pin.size(); ++i) {
      if (room[i] >= 0) continue;
      const uint32_t at = web.row[i];
      const float step = solve_row(pin[i], x, &web.particle[at], &web.share[at], &web.move[at], web.row[i + 1] - at,
                                   web.inv_mass[i], h, tolerance - kRounding, room[i]);
      if (step == 0 || sweep + 1 == sweeps) continue;
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
