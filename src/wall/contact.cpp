// SPDX-License-Identifier: Apache-2.0
// wall/contact: see the header.
#include "wall/contact.h"

#include <algorithm>
#include <cmath>

#include "core/clones.h"
#include "wall/patch.h"

namespace catgut::wall {

namespace {

float nearest_on_segment(Vec3 a, Vec3 b, Vec3 p) {
  const Vec3 d = b - a;
  const float d2 = length2(d);
  return d2 > 0 ? std::clamp(dot(p - a, d) / d2, 0.0f, 1.0f) : 0.0f;
}

// One step toward the point nearest to target.
void step_toward(const Patch& patch, Vec3 target, float& xi, float& eta) {
  const Vec3 a = patch.along_xi(eta), b = patch.along_eta(xi), r = target - patch.at(xi, eta);
  const float aa = dot(a, a), bb = dot(b, b), ab = dot(a, b), det = aa * bb - ab * ab;
  if (!(det > 0)) return;
  const float low = patch.quad ? -1.0f : 0.0f, high = patch.quad ? 1.0f : 2.0f;
  const float next = std::clamp(xi + (bb * dot(r, a) - ab * dot(r, b)) / det, low, high);
  eta = std::clamp(eta + (dot(r, b) - ab * (next - xi)) / bb, low, high);
  if (!patch.quad) eta = std::min(eta, 2 - next);
  xi = next;
}

void find_plane(const State& s, float step, const Obstacle& o, uint32_t index, ContactSolver& solver) {
  for (uint32_t c = 0; c < columns(s); ++c)
    for (const float zeta : {1.0f, -1.0f}) {
      if (s.topology.slot[c] == kNone) continue;
      const Vec3 p = zeta > 0 ? outer(s, c) : inner(s, c);
      const float gap = dot(p - o.a, o.b);
      if (gap > solver.reach) {
        const Vec3 u = velocity(at_column(c, zeta), s.motion) - o.speed_a;
        if (gap > solver.reach + 2 * step * length(u)) continue;
      }
      Contact k;
      k.key = (uint64_t{index} << 40) | (uint64_t{c} << 1) | (zeta > 0 ? 1u : 0u);
      k.point = at_column(c, zeta);
      k.obstacle = index, k.normal = o.b, k.gap = gap, k.speed = o.speed_a, k.friction = o.friction;
      solver.contact.push_back(k);
    }
}

void find_capsule(const Model& m, const State& s, const Obstacle& o, uint32_t index, ContactSolver& solver) {
  for (uint32_t element = 0; element < m.lane_of_face.size() + s.topology.fragment.size(); ++element) {
    // Whole faces, then the fragments of divided ones.
    const size_t faces = m.lane_of_face.size();
    if (element < faces && fragments(s.topology, element) > 0) continue;
    const Fragment part =
        element < faces ? Fragment{~uint64_t{0}, element, m.lane_of_face[element]} : s.topology.fragment[element - faces];
    const uint32_t f = part.face, lane = part.lane, block = lane / kLanesOfBlock, in = lane % kLanesOfBlock;
    const auto& corner = s.topology.corners[block].column;
    const bool quad = s.topology.corners[block].quads != 0;
    // Bounding sphere of the face first.
    const Vec3 c0 = vec3(s.motion.x[2 * corner[0][in]]), c2 = vec3(s.motion.x[2 * corner[2][in]]);
    const Vec3 c1 = vec3(s.motion.x[2 * corner[1][in]]), c3 = vec3(s.motion.x[2 * corner[3][in]]);
    const Vec3 middle = (c0 + c2) * 0.5f;
    const float round2 = std::max({length2(c0 - c2), length2(c1 - middle) * 4, length2(c3 - middle) * 4});
    const float t0 = nearest_on_segment(o.a, o.b, middle);
    const float away = distance(lerp(o.a, o.b, t0), middle) - o.radius - 0.5f * std::sqrt(round2);
    if (away > 0.002f + length(vec3(s.motion.x[2 * corner[0][in] + 1]))) continue;

    Patch mid{{c0, c1, c2, c3}, quad};
    float xi = quad ? 0 : 0.6f, eta = xi, t = t0;
    for (int i = 0; i < 4; ++i) {
      step_toward(mid, lerp(o.a, o.b, t), xi, eta);
      t = nearest_on_segment(o.a, o.b, mid.at(xi, eta));
    }
    // The side of the mid-surface on which the capsule's axis lies.
    const Vec3 up = cross(mid.along_xi(eta), mid.along_eta(xi));
    const float zeta = dot(lerp(o.a, o.b, t) - mid.at(xi, eta), up) >= 0 ? 1.0f : -1.0f;
    Patch side = mid;
    for (int k = 0; k < 4; ++k) side.p[k] += vec3(s.motion.x[2 * corner[k][in] + 1]) * zeta;
    for (int i = 0; i < 4; ++i) {
      t = nearest_on_segment(o.a, o.b, side.at(xi, eta));
      step_toward(side, lerp(o.a, o.b, t), xi, eta);
    }
    const Vec3 at = side.at(xi, eta), axis = lerp(o.a, o.b, t);
    const Vec3 facing = normalized(cross(side.along_xi(eta), side.along_eta(xi)), {0, 0, 1}) * zeta;
    const Vec3 off = axis - at;
    const float far = length(off), front = dot(off, facing);
    // An axis below the skin, between the two faces, is pushed out along the face's normal. Seen past the rim of a face, it is
    // another face's contact.
    const bool below = front < 0 || far < 1e-6f;
    if (below && (quad ? std::max(std::abs(xi), std::abs(eta)) > 0.999f : std::min({xi, eta, 2 - xi - eta}) < 0.001f)) continue;
    const Vec3 normal = below ? facing * -1.0f : off * (-1 / far);
    const float gap = (below ? front : far) - o.radius;
    if (element >= faces && !(part.cells >> cell_at(quad, xi, eta) & 1)) continue;  // another fragment lies there
    Contact k;
    k.point = weights(m, s.topology, {f, xi, eta, zeta});
    k.speed = lerp(o.speed_a, o.speed_b, t);
    if (gap > solver.reach && gap > solver.reach + 2 * m.step * length(velocity(k.point, s.motion) - k.speed)) continue;
    k.key = (uint64_t{index} << 40) | (uint64_t{element} << 1) | (zeta > 0 ? 1u : 0u);
    k.obstacle = index, k.along = t, k.normal = normal, k.gap = gap;
    k.friction = o.friction;
    solver.contact.push_back(k);
  }
}

}  // namespace

void find_contacts(const Model& m, const State& s, std::span<const Obstacle> obstacle, ContactSolver& solver) {
  std::swap(solver.contact, solver.last);
  solver.contact.clear();
  for (uint32_t i = 0; i < obstacle.size(); ++i) {
    if (obstacle[i].kind == Obstacle::Kind::plane) find_plane(s, m.step, obstacle[i], i, solver);
    else find_capsule(m, s, obstacle[i], i, solver);
  }
}

void warm_start(const Model& m, Scratch& scratch, ContactSolver& solver) {
  std::sort(solver.contact.begin(), solver.contact.end(), [](const Contact& a, const Contact& b) { return a.key < b.key; });
  size_t k = 0;
  for (Contact& c : solver.contact) {
    while (k < solver.last.size() && solver.last[k].key < c.key) ++k;
    if (k == solver.last.size() || solver.last[k].key != c.key) continue;
    // The normal impulse is turned to the new normal; friction keeps its tangential part.
    const Vec3 old = solver.last[k].impulse;
    const float pressed = std::max(0.0f, dot(old, solver.last[k].normal));
    Vec3 across = old - solver.last[k].normal * dot(old, solver.last[k].normal);
    across = across - c.normal * dot(across, c.normal);
    c.impulse = c.normal * pressed + across;
    add_to(scratch.external, c.point, c.impulse / m.step);
    if (c.self) add_to(scratch.external, c.other, c.impulse / -m.step);
  }
}

void ContactSolver::reserve(size_t n) {
  contact.reserve(n), last.reserve(n), points.reserve(2 * n), terms.reserve(2 * n), trial.reserve(n);
  w.reserve(n * n), known.reserve(n), change.reserve(n);
  for (auto* list : {&ux, &uy, &uz}) list->reserve(n);
}

namespace {

// All contacts answer an impulse on one of them.
CATGUT_CLONES void answer(size_t n, Vec3 d, const float* __restrict w, float* __restrict x, float* __restrict y,
                          float* __restrict z) {
  for (size_t j = 0; j < n; ++j) x[j] += d.x * w[j], y[j] += d.y * w[j], z[j] += d.z * w[j];
}

}  // namespace

void solve_contacts(const Model& m, State& s, Scratch& scratch, std::span<const Obstacle> obstacle, ContactSolver& solver) {
  const size_t n = solver.contact.size();
  solver.force.assign(obstacle.size(), {}), solver.torque.assign(obstacle.size(), {});
  if (n == 0) return;
  solver.points.clear();
  for (const Contact& c : solver.contact) {
    solver.points.push_back(c.point);
    if (c.self) solver.points.push_back(c.other);
  }
  solver.inverse.need(s.topology, solver.points);
  solver.w.resize(n * n), solver.known.assign(n, 0), solver.terms.resize(2 * n), solver.trial.resize(n);
  for (auto* u : {&solver.ux, &solver.uy, &solver.uz}) u->resize(n);
  solver.change.assign(n, {});
  for (size_t i = 0; i < n; ++i) {
    const Contact& c = solver.contact[i];
    solver.terms[2 * i] = solver.inverse.terms(s.topology, c.point);
    if (c.self) solver.terms[2 * i + 1] = solver.inverse.terms(s.topology, c.other);
  }
  const auto compliance = [&](size_t i, size_t j) {
    const bool a_self = solver.contact[i].self, b_self = solver.contact[j].self;
    const Terms *a = &solver.terms[2 * i], *b = &solver.terms[2 * j];
    float w = solver.inverse.compliance(s.topology, a[0], b[0]);
    if (b_self) w -= solver.inverse.compliance(s.topology, a[0], b[1]);
    if (a_self) w -= solver.inverse.compliance(s.topology, a[1], b[0]);
    if (a_self && b_self) w += solver.inverse.compliance(s.topology, a[1], b[1]);
    return w;
  };
  for (size_t i = 0; i < n; ++i) {
    const Contact& c = solver.contact[i];
    Vec3 u = velocity(c.point, s.motion) - c.speed;
    if (c.self) u = u - velocity(c.other, s.motion);
    solver.ux[i] = u.x, solver.uy[i] = u.y, solver.uz[i] = u.z;
    // gap + h u >= 0; an overlap is undone at a limited speed.
    const float wanted = c.gap >= 0 ? -c.gap / m.step : std::min(-c.gap / m.step, solver.push_out);
    solver.trial[i] = {c.normal, wanted, compliance(i, i), c.friction, c.impulse, {}, {}};
  }
  // Most candidates never touch: the row of a contact is made when its impulse first changes.
  const auto row_of = [&](size_t i) {
    float* row = solver.w.data() + i * n;
    if (solver.known[i]) return row;
    solver.known[i] = 1;
    for (size_t j = 0; j < n; ++j) {
      if (j == i) row[j] = solver.trial[i].self;
      else row[j] = solver.known[j] ? solver.w[j * n + i] : compliance(std::max(i, j), std::min(i, j));
    }
    return row;
  };
  const auto give = [&](size_t i, Vec3 d) {
    solver.change[i] += d;
    answer(n, d, row_of(i), solver.ux.data(), solver.uy.data(), solver.uz.data());
  };
  float last2 = 0;
  for (solver.swept = 0;;) {
    for (size_t i = 0; i < n; ++i) {
      ContactSolver::Trial& c = solver.trial[i];
      c.before = c.impulse;
      if (!(c.self > 0)) continue;
      const Vec3 u{solver.ux[i], solver.uy[i], solver.uz[i]};
      const float closing = dot(u, c.normal) - c.wanted;
      if (closing >= 0 && c.impulse == Vec3{}) continue;  // apart, and stays so
      const float pressed = dot(c.impulse, c.normal);
      const float press = std::max(0.0f, pressed - closing / c.self);
      Vec3 across = c.impulse - c.normal * pressed - (u - c.normal * dot(u, c.normal)) / c.self;
      const float most = c.friction * press, drags = length(across);
      if (drags > most) across = across * (drags > 0 ? most / drags : 0);
      const Vec3 impulse = c.normal * press + across, d = impulse - c.impulse;
      if (d == Vec3{}) continue;
      c.impulse = impulse;
      give(i, d);
    }
    float changed2 = 0, largest2 = 0, sum2 = 0;
    for (const ContactSolver::Trial& c : solver.trial) {
      if (c.impulse == Vec3{} && c.before == Vec3{}) continue;
      const float d2 = length2(c.impulse - c.before);
      changed2 = std::max(changed2, d2), sum2 += d2;
      largest2 = std::max(largest2, length2(c.impulse));
    }
    if (++solver.swept >= solver.sweeps || changed2 <= solver.accuracy * solver.accuracy * largest2) break;
    // The next sweep starts from an extrapolation of the last ones; sweeps project any overshoot back.
    const float beta = last2 > 0 ? sum2 / last2 : 0;
    last2 = sum2;
    for (size_t i = 0; i < n; ++i) {
      ContactSolver::Trial& c = solver.trial[i];
      const Vec3 d = c.impulse - c.before;
      if (beta >= 1 || beta == 0) {
        c.onward = beta == 0 ? d : Vec3{};
        continue;
      }
      const Vec3 more = c.onward * beta;
      c.onward = more + d;
      if (more == Vec3{}) continue;
      c.impulse += more;
      give(i, more);
    }
  }
  for (size_t i = 0; i < n; ++i) solver.contact[i].impulse = solver.trial[i].impulse;
  std::fill(scratch.external.begin(), scratch.external.end(), Float4{});
  for (size_t i = 0; i < n; ++i) {
    const Contact& c = solver.contact[i];
    add_to(scratch.external, c.point, solver.change[i]);
    if (c.self) add_to(scratch.external, c.other, -solver.change[i]);
    else {
      const Vec3 f = c.impulse / -m.step;
      const Obstacle& o = obstacle[c.obstacle];
      const Vec3 at =
          o.kind == Obstacle::Kind::capsule ? lerp(o.a, o.b, c.along) + c.normal * o.radius : place(c.point, s.motion);
      solver.force[c.obstacle] += f;
      solver.torque[c.obstacle] += cross(at, f);
    }
  }
  apply_impulses(s, scratch, scratch.external);
  std::fill(scratch.external.begin(), scratch.external.end(), Float4{});
}

}  // namespace catgut::wall
