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
  w.reserve(n * n), known.reserve(n), change.reserve(n), slots.reserve(n), mark.reserve(n);
  for (auto* list : {&ux, &uy, &uz}) list->reserve(n);
  joint.has.reserve(n), joint.inverse.reserve(n * n), joint.contact.reserve(n);
  joint.resize(n);
}

void ContactSolver::Joint::resize(size_t size) {
  for (auto* list : {&friction, &wanted, &change}) list->resize(size);
  for (size_t d = 0; d < 3; ++d)
    for (auto* list : {&n[d], &start[d], &free[d], &impulse[d], &slip[d], &right[d], &answer[d]}) list->resize(size);
}

namespace {

// All contacts answer an impulse on one of them.
CATGUT_CLONES void answer(size_t n, Vec3 d, const float* __restrict w, float* __restrict x, float* __restrict y,
                          float* __restrict z) {
  for (size_t j = 0; j < n; ++j) x[j] += d.x * w[j], y[j] += d.y * w[j], z[j] += d.z * w[j];
}

// Of a symmetric positive definite matrix, in place (Gauss-Jordan).
CATGUT_CLONES void invert(size_t n, float* a) {
  for (size_t p = 0; p < n; ++p) {
    float* __restrict pivot = a + p * n;
    const float inverse = 1 / pivot[p];
    pivot[p] = 1;
    for (size_t j = 0; j < n; ++j) pivot[j] *= inverse;
    for (size_t i = 0; i < n; ++i) {
      if (i == p) continue;
      float* __restrict row = a + i * n;
      const float f = row[p];
      row[p] = 0;
      for (size_t j = 0; j < n; ++j) row[j] -= f * pivot[j];
    }
  }
}

// out = matrix * in, for a symmetric matrix; four columns at a time.
CATGUT_CLONES void multiply(size_t n, const float* __restrict a, const float* __restrict in, float* __restrict out) {
  for (size_t j = 0; j < n; ++j) out[j] = 0;
  size_t i = 0;
  for (; i + 4 <= n; i += 4) {
    const float* __restrict r0 = a + i * n, * __restrict r1 = r0 + n, * __restrict r2 = r1 + n, * __restrict r3 = r2 + n;
    const float f0 = in[i], f1 = in[i + 1], f2 = in[i + 2], f3 = in[i + 3];
    for (size_t j = 0; j < n; ++j) out[j] += (f0 * r0[j] + f1 * r1[j]) + (f2 * r2[j] + f3 * r3[j]);
  }
  for (; i < n; ++i)
    for (size_t j = 0; j < n; ++j) out[j] += in[i] * a[i * n + j];
}

constexpr float kRelax = 1.6f;  // over-relaxation

// The right-hand side of the linear solve: the free velocity, with the shift that makes Coulomb's law a projection (De Saxce).
CATGUT_CLONES void ask(size_t n, float rho, const float* __restrict nx, const float* __restrict ny, const float* __restrict nz,
                       const float* __restrict friction, const float* __restrict wanted, const float* __restrict px,
                       const float* __restrict py, const float* __restrict pz, const float* __restrict startx,
                       const float* __restrict starty, const float* __restrict startz, const float* __restrict sx,
                       const float* __restrict sy, const float* __restrict sz, const float* __restrict fx,
                       const float* __restrict fy, const float* __restrict fz, float* __restrict rx, float* __restrict ry,
                       float* __restrict rz) {
  for (size_t i = 0; i < n; ++i) {
    const float along = sx[i] * nx[i] + sy[i] * ny[i] + sz[i] * nz[i];
    const float tx = sx[i] - along * nx[i], ty = sy[i] - along * ny[i], tz = sz[i] - along * nz[i];
    const float shift = friction[i] * std::sqrt(tx * tx + ty * ty + tz * tz) - wanted[i];
    rx[i] = rho * (px[i] - startx[i]) + sx[i] - fx[i] - shift * nx[i];
    ry[i] = rho * (py[i] - starty[i]) + sy[i] - fy[i] - shift * ny[i];
    rz[i] = rho * (pz[i] - startz[i]) + sz[i] - fz[i] - shift * nz[i];
  }
}

// The impulse next to the answer within the cone of friction, and the velocity that it leaves. A contact that yields by `soft`
// [1/kg] along its normal: the same, of a cone whose height is scaled.
CATGUT_CLONES void project(size_t n, float rho, float soft, const float* __restrict nx, const float* __restrict ny,
                           const float* __restrict nz, const float* __restrict friction, const float* __restrict startx,
                           const float* __restrict starty, const float* __restrict startz, const float* __restrict ax,
                           const float* __restrict ay, const float* __restrict az, float* __restrict px, float* __restrict py,
                           float* __restrict pz, float* __restrict sx, float* __restrict sy, float* __restrict sz,
                           float* __restrict change) {
  const float softness = 1 / rho, scale = std::sqrt(1 + soft / rho);
  for (size_t i = 0; i < n; ++i) {
    const float x = startx[i] + ax[i], y = starty[i] + ay[i], z = startz[i] + az[i];
    const float hx = kRelax * x + (1 - kRelax) * px[i], hy = kRelax * y + (1 - kRelax) * py[i],
                hz = kRelax * z + (1 - kRelax) * pz[i];
    const float wx = hx - sx[i] * softness, wy = hy - sy[i] * softness, wz = hz - sz[i] * softness;
    const float front = wx * nx[i] + wy * ny[i] + wz * nz[i], along = front / scale, mu = friction[i] / scale;
    const float tx = wx - front * nx[i], ty = wy - front * ny[i], tz = wz - front * nz[i];
    const float drag = std::sqrt(tx * tx + ty * ty + tz * tz), edge = (along + mu * drag) / (1 + mu * mu);
    const bool sticks = drag <= mu * along, apart = mu * drag <= -along;
    const float press = (apart ? 0.0f : sticks ? along : edge) / scale;
    const float part = apart ? 0.0f : sticks ? 1.0f : mu * edge / (drag + 1e-30f);
    const float qx = press * nx[i] + part * tx, qy = press * ny[i] + part * ty, qz = press * nz[i] + part * tz;
    sx[i] -= rho * (hx - qx), sy[i] -= rho * (hy - qy), sz[i] -= rho * (hz - qz);
    const float dx = qx - px[i], dy = qy - py[i], dz = qz - pz[i], ex = x - qx, ey = y - qy, ez = z - qz;
    const float moved = dx * dx + dy * dy + dz * dz, off = ex * ex + ey * ey + ez * ez;
    change[i] = moved > off ? moved : off;
    px[i] = qx, py[i] = qy, pz[i] = qz;
  }
}

// A step's problem: W, of which only rows that are used are made, velocities and impulses.
struct Problem {
  const State& s;
  ContactSolver& k;
  size_t n;
  float soft;  // [1/kg] along the normal: across it, what sticks would creep

  float compliance(size_t i, size_t j) const {
    const bool a_self = k.contact[i].self, b_self = k.contact[j].self;
    const Terms *a = &k.terms[2 * i], *b = &k.terms[2 * j];
    float w = k.inverse.compliance(s.topology, a[0], b[0]);
    if (b_self) w -= k.inverse.compliance(s.topology, a[0], b[1]);
    if (a_self) w -= k.inverse.compliance(s.topology, a[1], b[0]);
    if (a_self && b_self) w += k.inverse.compliance(s.topology, a[1], b[1]);
    return w;
  }

  // Most candidates never touch: the row of a contact is made when its impulse first changes.
  float* row_of(size_t i) {
    float* row = k.w.data() + i * n;
    if (k.known[i]) return row;
    k.known[i] = 1;
    const Topology& t = s.topology;
    const auto ends = [&](size_t c) { return k.contact[c].self ? 2u : 1u; };
    std::fill(k.slots.begin(), k.slots.end(), 0.0f);
    for (uint32_t e = 0; e < ends(i); ++e) {
      const Terms& a = k.terms[2 * i + e];
      k.inverse.add_answer(a, e == 0 ? 1.0f : -1.0f, k.slots);
      for (uint32_t q = 0; q < a.count; ++q) k.mark[a.slot[q]] = static_cast<uint32_t>(i + 1);
    }
    for (size_t j = 0; j < n; ++j) {
      if (j == i || k.known[j]) {
        row[j] = j == i ? k.trial[i].self : k.w[j * n + i];
        continue;
      }
      float sum = 0;
      bool shares = false;
      for (uint32_t e = 0; e < ends(j); ++e) {
        const Terms& b = k.terms[2 * j + e];
        float part = 0;
        for (uint32_t q = 0; q < b.count; ++q) {
          part += b.weight[q] * k.slots[b.slot[q]];
          shares |= k.mark[b.slot[q]] == i + 1;
        }
        sum += e == 0 ? part : -part;
      }
      for (uint32_t e = 0; shares && e < ends(i); ++e)
        for (uint32_t f = 0; f < ends(j); ++f) {
          const float part = Inverse::shared(t, k.terms[2 * i + e], k.terms[2 * j + f]);
          sum += e == f ? part : -part;
        }
      row[j] = sum;
    }
    return row;
  }

  void give(size_t i, Vec3 d) {
    k.change[i] += d;
    answer(n, d, row_of(i), k.ux.data(), k.uy.data(), k.uz.data());
  }
  bool touches(size_t i) const {
    const ContactSolver::Trial& c = k.trial[i];
    return c.self > 0 && (!(c.impulse == Vec3{}) || dot(Vec3{k.ux[i], k.uy[i], k.uz[i]}, c.normal) < c.wanted);
  }

  // One sweep of projected Gauss-Seidel. Whether it changed little.
  bool sweep() {
    ++k.swept;
    float changed2 = 0, largest2 = 0;
    for (size_t i = 0; i < n; ++i) {
      ContactSolver::Trial& c = k.trial[i];
      if (!touches(i)) continue;
      c.before = c.impulse;
      const Vec3 u{k.ux[i], k.uy[i], k.uz[i]};
      const float pressed = dot(c.impulse, c.normal), closing = dot(u, c.normal) + soft * pressed - c.wanted;
      const float press = std::max(0.0f, pressed - closing / (c.self + soft));
      Vec3 across = c.impulse - c.normal * pressed - (u - c.normal * dot(u, c.normal)) / c.self;
      const float most = c.friction * press, drags = length(across);
      if (drags > most) across = across * (drags > 0 ? most / drags : 0);
      const Vec3 d = c.normal * press + across - c.impulse;
      if (!(d == Vec3{})) c.impulse = c.normal * press + across, give(i, d);
      changed2 = std::max(changed2, length2(d)), largest2 = std::max(largest2, length2(c.impulse));
    }
    return changed2 <= k.accuracy * k.accuracy * largest2;
  }
  bool sweeps() {
    for (int i = 0; i < k.sweeps; ++i)
      if (sweep()) return true;
    return false;
  }

  // Adds what touches now. Whether there was any.
  bool add_touching() {
    const size_t before = k.joint.contact.size();
    for (uint32_t i = 0; i < n; ++i)
      if (!k.joint.has[i] && touches(i)) k.joint.has[i] = 1, k.joint.contact.push_back(i);
    return k.joint.contact.size() > before;
  }

  void solve_jointly() {
    ContactSolver::Joint& q = k.joint;
    const size_t m = q.contact.size();
    q.resize(m), q.inverse.resize(m * m);
    float self = 0;
    for (size_t a = 0; a < m; ++a) {
      const size_t i = q.contact[a];
      const ContactSolver::Trial& c = k.trial[i];
      const float* row = row_of(i);
      for (size_t b = 0; b < m; ++b) q.inverse[a * m + b] = row[q.contact[b]];
      self += c.self;
      q.friction[a] = c.friction, q.wanted[a] = c.wanted;
      const Vec3 u{k.ux[i], k.uy[i], k.uz[i]}, across = u - c.normal * dot(u, c.normal);
      const Vec3 slip = u + c.normal * (c.friction * length(across) - c.wanted);
      for (int d = 0; d < 3; ++d) {
        q.n[d][a] = c.normal[d], q.start[d][a] = q.impulse[d][a] = c.impulse[d], q.free[d][a] = u[d], q.slip[d][a] = slip[d];
      }
    }
    // rho near the geometric mean of W's eigenvalues that matter.
    const float rho = 0.02f * self / static_cast<float>(m);
    for (size_t a = 0; a < m; ++a) q.inverse[a * m + a] += rho;
    invert(m, q.inverse.data());
    for (int it = 0; it < k.iterations; ++it) {
      ++k.iterated;
      ask(m, rho, q.n[0].data(), q.n[1].data(), q.n[2].data(), q.friction.data(), q.wanted.data(), q.impulse[0].data(),
          q.impulse[1].data(), q.impulse[2].data(), q.start[0].data(), q.start[1].data(), q.start[2].data(), q.slip[0].data(),
          q.slip[1].data(), q.slip[2].data(), q.free[0].data(), q.free[1].data(), q.free[2].data(), q.right[0].data(),
          q.right[1].data(), q.right[2].data());
      for (size_t d = 0; d < 3; ++d) multiply(m, q.inverse.data(), q.right[d].data(), q.answer[d].data());
      project(m, rho, soft, q.n[0].data(), q.n[1].data(), q.n[2].data(), q.friction.data(), q.start[0].data(),
              q.start[1].data(), q.start[2].data(), q.answer[0].data(), q.answer[1].data(), q.answer[2].data(),
              q.impulse[0].data(), q.impulse[1].data(), q.impulse[2].data(), q.slip[0].data(), q.slip[1].data(),
              q.slip[2].data(), q.change.data());
      float changed2 = 0, largest2 = 0;
      for (size_t a = 0; a < m; ++a) {
        changed2 = std::max(changed2, q.change[a]);
        largest2 = std::max(largest2, length2(Vec3{q.impulse[0][a], q.impulse[1][a], q.impulse[2][a]}));
      }
      if (changed2 <= k.joint_accuracy * k.joint_accuracy * largest2) break;
    }
    for (size_t a = 0; a < m; ++a) {
      const Vec3 to{q.impulse[0][a], q.impulse[1][a], q.impulse[2][a]}, d = to - k.trial[q.contact[a]].impulse;
      if (d == Vec3{}) continue;
      k.trial[q.contact[a]].impulse = to;
      give(q.contact[a], d);
    }
  }
};

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
  solver.slots.resize(solver.inverse.rows()), solver.mark.assign(solver.inverse.rows(), 0);
  for (auto* u : {&solver.ux, &solver.uy, &solver.uz}) u->resize(n);
  solver.change.assign(n, {});
  for (size_t i = 0; i < n; ++i) {
    const Contact& c = solver.contact[i];
    solver.terms[2 * i] = solver.inverse.terms(s.topology, c.point);
    if (c.self) solver.terms[2 * i + 1] = solver.inverse.terms(s.topology, c.other);
  }
  Problem problem{s, solver, n, solver.softness / (m.step * m.step)};
  for (size_t i = 0; i < n; ++i) {
    const Contact& c = solver.contact[i];
    Vec3 u = velocity(c.point, s.motion) - c.speed;
    if (c.self) u = u - velocity(c.other, s.motion);
    solver.ux[i] = u.x, solver.uy[i] = u.y, solver.uz[i] = u.z;
    // gap + h u >= 0; an overlap is undone at a limited speed.
    const float wanted = c.gap >= 0 ? -c.gap / m.step : std::min(-c.gap / m.step, solver.push_out);
    solver.trial[i] = {c.normal, wanted, problem.compliance(i, i), c.friction, c.impulse, {}};
  }
  solver.swept = solver.iterated = 0;
  solver.joint.contact.clear(), solver.joint.has.assign(n, 0);
  bool done = problem.sweeps();
  for (int round = 0; !done && round < solver.rounds && problem.add_touching(); ++round) {
    problem.solve_jointly();
    done = problem.sweeps();
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
