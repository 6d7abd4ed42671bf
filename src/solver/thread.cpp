// solver/thread: reads the order, anchors and holds; moves particles, tissue and bodies; writes tensions and slides.
// The direct solve is a Newton step on all stretch constraints at once; their matrix J M^-1 J^T is tridiagonal in the order of
// the thread. Bare Newton is singular where a slack thread folds, so it is regularised and its step limited; the sweeps
// after it clean up. Rest-length slide at an anchor is one more coordinate s with inverse mass w of a thread particle:
// rest[needle side] += s, rest[free side] -= s, which only adds to the two pairs beside the anchor and their coupling.
#include "solver/thread.h"

#include <algorithm>
#include <cmath>

namespace catgut {
namespace {

constexpr int kNewtonSteps = 2;
constexpr float kGoodEnough = 2e-6f;  // [m] a second step is spared when no pair is off by more
// Of the diagonal. A light thread drawn straight between heavy ends has one soft mode, a hundred thousand times softer than the
// diagonal, and it is the one that matters: more than this would hide it.
constexpr double kRegularisation = 1e-6;
// Inverse mass of a sliding coordinate over that of a thread particle. It has no velocity of its own, so this acts as a small
// viscous drag: 7 mN at 0.15 m/s and 1 ms. Lighter would let friction overshoot the length of a segment within a substep.
constexpr double kSlideMass = 0.04;
constexpr int kSlideRounds = 4;
constexpr float kMostForce = 20;      // [N] by which a Newton step may move a heavy node: about what breaks a thread
constexpr float kLargestStep = 0.6f;  // of the spacing, per Newton step

// A held node seen by two pair directions: n1^T W n2 of the rigid body at that place.
float held_inverse_mass(const ThreadHold& hold, Vec3 n1, Vec3 n2, const std::vector<RigidModel>& model,
                        const std::vector<RigidBody>& body) {
  const RigidBody& b = body[static_cast<size_t>(hold.body)];
  const RigidModel& m = model[static_cast<size_t>(hold.body)];
  const Vec3 r = rotate(b.q, hold.local);
  return m.inv_mass * dot(n1, n2) + dot(cross(r, n1), inverse_inertia(m, b, cross(r, n2)));
}
float node_inverse_mass(const ThreadScratch& s, const Thread& t, size_t i, Vec3 n, const std::vector<RigidModel>& model,
                        const std::vector<RigidBody>& body) {
  return s.hold_at[i] < 0 ? s.w[i] : held_inverse_mass(t.hold[static_cast<size_t>(s.hold_at[i])], n, n, model, body);
}

// The tridiagonal matrix J M^-1 J^T of all stretch constraints and its right-hand side, for the positions as they are.
//
// Geometric stiffness. A taut thread resists being moved sideways with tension / length, which the bare linearisation does not
// know: it would shorten a taut zigzag by throwing its light nodes sideways, and never converge. So sideways a free node is
// given the inertia m + h^2 T (1/l0 + 1/l1) (Tournier et al. 2015, Stable constrained dynamics); sideways[i] is the ratio of
// the inverse masses. With the tangent t = n0 + n1 of unit pair directions, t.t = 2 (1 + c) and n0.t = n1.t = 1 + c, c = n0.n1:
// no root is needed. Returns the largest residual [m].
float assemble(const Thread& t, ThreadScratch& s, size_t nodes, float alpha_per_metre, float h,
               const std::vector<RigidModel>& body_model, const std::vector<RigidBody>& body) {
  const size_t pairs = nodes - 1;
  const float inv_h2 = 1 / (h * h), h2 = h * h, shortest = 1e-5f;
  float worst = 0;
  for (size_t i = 0; i < pairs; ++i) {
    const Vec3 d = s.p[i + 1] - s.p[i];
    const float l = length(d);
    s.length[i] = std::max(l, shortest);
    s.n[i] = l > 1e-12f ? d / l : Vec3{0, 1, 0};
    const float alpha = alpha_per_metre * t.rest[i];
    const float residual = -(l - t.rest[i]) - alpha * s.lambda[i];
    if (!t.cut[i]) worst = std::max(worst, std::abs(residual));
    s.base_rhs[i] = residual;
    s.base_diag[i] = alpha;
    s.base_off[i] = 0;
    if (t.cut[i]) s.base_rhs[i] = 0;
  }
  for (size_t i = 0; i < nodes; ++i) {
    s.sideways[i] = 1;
    float before, after, across = 0;  // n0^T W n0, n1^T W n1, n0^T W n1
    if (s.hold_at[i] >= 0) {
      const ThreadHold& hold = t.hold[static_cast<size_t>(s.hold_at[i])];
      before = i > 0 ? held_inverse_mass(hold, s.n[i - 1], s.n[i - 1], body_model, body) : 0;
      after = i < pairs ? held_inverse_mass(hold, s.n[i], s.n[i], body_model, body) : 0;
      if (i > 0 && i < pairs) across = held_inverse_mass(hold, s.n[i - 1], s.n[i], body_model, body);
    } else {
      before = after = s.w[i];
      if (i > 0 && i < pairs) {
        const float c = dot(s.n[i - 1], s.n[i]);
        across = s.w[i] * c;
        const float pull =
            std::min(std::max(t.tension[i - 1], -s.lambda[i - 1] * inv_h2), std::max(t.tension[i], -s.lambda[i] * inv_h2));
        if (s.anchor_at[i] < 0 && pull > 0 && c > -0.999f) {
          const float rho = 1 / (1 + s.w[i] * h2 * pull * (1 / s.length[i - 1] + 1 / s.length[i]));
          s.sideways[i] = rho;
          const float along = (1 - rho) * 0.5f * (1 + c);
          before = after = s.w[i] * (rho + along);
          across = s.w[i] * (rho * c + along);
        }
      }
    }
    if (i > 0) s.base_diag[i - 1] += double{before} * (1 + kRegularisation);
    if (i < pairs) s.base_diag[i] += double{after} * (1 + kRegularisation);
    if (i > 0 && i < pairs) s.base_off[i - 1] = t.cut[i - 1] || t.cut[i] ? 0.0 : -across;
  }
  return worst;
}

// The inertia and the weight that carried the nodes to where they are now must meet the same geometric stiffness as the
// constraints will: implicit Euler is (M + h^2 K) dx = h M v + h^2 f, with K the tension's Laplacian. Without it a taut thread
// swings sideways as freely as a slack one while its tension may hardly pull it back: it would gain energy, or come to rest
// stretched.
//   The part from velocities, d = p - before - h^2 g, is smoothed by (1 + K) d' = d along the thread with locked nodes fixed: a
//   thread that moves as a whole keeps its motion, a taut one loses its flutter, a slack one (no tension) is left alone. The
//   weight's part across the thread is scaled by the node's own ratio, as its constraint impulses are: at rest the two then
//   balance, and the thread hangs as a catenary (catgut validate).
void stiffen_prediction(const ThreadModel& model, const Thread& t, ThreadScratch& s, size_t nodes, const Vec4* before,
                        float h) {
  const size_t pairs = nodes - 1;
  const float h2 = h * h;
  const Vec3 fall = model.gravity * h2;
  bool taut = false;
  for (size_t i = 0; i < pairs; ++i) {
    s.stiff[i] = t.cut[i] ? 0 : std::max(0.0f, t.tension[i]) * h2 * model.inv_mass / std::max(t.rest[i], 0.1f * model.spacing);
    taut = taut || s.stiff[i] > 1e-3f;
  }
  if (!taut) return;
  auto locked = [&](size_t i) { return s.anchor_at[i] >= 0 || s.hold_at[i] >= 0; };
  // Thomas algorithm on the three components at once.
  Vec3 last{};
  float carry = 0;
  for (size_t i = 0; i < nodes; ++i) {
    const Vec3 was = xyz(before[t.order[i]]);
    float diagonal = 1, left = 0, right = 0;
    Vec3 d = s.p[i] - was;
    if (!locked(i)) {
      d -= fall;
      left = i > 0 ? s.stiff[i - 1] : 0;
      right = i < pairs ? s.stiff[i] : 0;
      diagonal = 1 + left + right;
    }
    const float inverse = 1 / (diagonal - left * carry);
    carry = right * inverse;
    last = (d + last * left) * inverse;
    s.smooth[i] = last;
    s.carry[i] = carry;
  }
  for (size_t i = nodes; i-- > 0;) {
    if (i < pairs) s.smooth[i] += s.smooth[i + 1] * s.carry[i];
    if (locked(i)) continue;
    Vec3 weight = fall;
    if (i > 0 && i < pairs) {
      const float pull = std::min(t.tension[i - 1], t.tension[i]);
      const Vec3 d0 = s.p[i] - s.p[i - 1], d1 = s.p[i + 1] - s.p[i];
      const float l0 = length(d0), l1 = length(d1);
      if (pull > 0 && l0 > 1e-9f && l1 > 1e-9f) {
        const float rho = 1 / (1 + model.inv_mass * h2 * pull * (1 / std::max(l0, 1e-5f) + 1 / std::max(l1, 1e-5f)));
        const Vec3 tangent = normalized(d0 / l0 + d1 / l1);
        weight = tangent * dot(fall, tangent) + (fall - tangent * dot(fall, tangent)) * rho;
      }
    }
    s.moved[i] = s.smooth[i] + weight;
  }
  for (size_t i = 0; i < nodes; ++i)
    if (!locked(i)) s.p[i] = xyz(before[t.order[i]]) + s.moved[i];
}

// Solves the tridiagonal system for the change of the multipliers (into s.rhs), together with the slides at slipping anchors:
// one more unknown each, coupled to the two pairs beside it. A slide that would run backward (friction stops, it never drives)
// or beyond what the pair on its side still has is fixed at that bound and the system solved again: an active set, which
// shrinks every round.
void solve_with_slides(const ThreadModel& model, const Thread& thread, ThreadScratch& s, size_t pairs, float h) {
  const double ws = kSlideMass * model.inv_mass;
  const float least = 0.02f * model.spacing;
  for (SlideState& k : s.slide) k.fixed = false;
  for (int round = 0; round < kSlideRounds; ++round) {
    std::copy_n(s.base_diag.begin(), pairs, s.diag.begin());
    std::copy_n(s.base_off.begin(), pairs, s.off.begin());
    std::copy_n(s.base_rhs.begin(), pairs, s.rhs.begin());
    auto drag_of = [&](const ThreadAnchor& a, const SlideState& k) {
      return k.dragged ? 0.0 : -a.slipping * double{a.threshold()} * h * h;  // a known force on the slide, spent once a substep
    };
    for (size_t i = 1; i < pairs; ++i) {
      if (s.anchor_at[i] < 0) continue;
      const ThreadAnchor& a = thread.anchor[static_cast<size_t>(s.anchor_at[i])];
      const SlideState& k = s.slide[static_cast<size_t>(s.anchor_at[i])];
      if (a.slipping == 0) continue;
      const double known = k.fixed ? k.step : ws * drag_of(a, k);
      s.rhs[i] += known;  // C of the needle side falls by the slide
      s.rhs[i - 1] -= known;
      if (k.fixed) continue;
      s.diag[i] += ws, s.diag[i - 1] += ws;
      s.off[i - 1] -= ws;
    }
    // Thomas algorithm. The matrix is symmetric positive definite.
    double inverse = 1 / s.diag[0];
    s.diag[0] = inverse;  // from here on the inverse pivots
    for (size_t i = 1; i < pairs; ++i) {
      const double f = s.off[i - 1] * inverse;
      inverse = 1 / (s.diag[i] - f * s.off[i - 1]);
      s.diag[i] = inverse;
      s.rhs[i] -= f * s.rhs[i - 1];
    }
    s.rhs[pairs - 1] *= s.diag[pairs - 1];
    for (size_t i = pairs - 1; i-- > 0;) s.rhs[i] = (s.rhs[i] - s.off[i] * s.rhs[i + 1]) * s.diag[i];
    bool again = false;
    for (size_t i = 1; i < pairs; ++i) {
      if (s.anchor_at[i] < 0) continue;
      const ThreadAnchor& a = thread.anchor[static_cast<size_t>(s.anchor_at[i])];
      SlideState& k = s.slide[static_cast<size_t>(s.anchor_at[i])];
      if (a.slipping == 0 || k.fixed) continue;
      k.step = static_cast<float>(ws * (drag_of(a, k) + s.rhs[i - 1] - s.rhs[i]));
      const float most_forward = std::max(0.0f, thread.rest[i - 1] - least),
                  most_back = -std::max(0.0f, thread.rest[i] - least);
      float bounded = std::clamp(k.step, most_back, most_forward);
      if ((k.total + bounded) * static_cast<float>(a.slipping) < 0) bounded = -k.total, k.stopped = true;
      if (bounded != k.step) k.step = bounded, k.fixed = again = true;
    }
    if (!again) break;
  }
  for (SlideState& k : s.slide) k.dragged = true;
}

// Applies the positional impulse `p` to whatever node i is, and refreshes its position.
void push_node(ThreadScratch& s, const Thread& t, size_t i, Vec3 p, Vec4* x, const float* inv_mass,
               const std::vector<RigidModel>& model, std::vector<RigidBody>& body) {
  if (s.anchor_at[i] >= 0) {
    const ThreadAnchor& anchor = t.anchor[static_cast<size_t>(s.anchor_at[i])];
    push(anchor.point, x, inv_mass, p);
    s.p[i] = position_of(anchor, x);
  } else if (s.hold_at[i] >= 0) {
    const ThreadHold& hold = t.hold[static_cast<size_t>(s.hold_at[i])];
    RigidBody& b = body[static_cast<size_t>(hold.body)];
    push(model[static_cast<size_t>(hold.body)], b, p, rotate(b.q, hold.local));
    s.p[i] = transform(b.pose(), hold.local);
  } else {
    s.p[i] += p * s.w[i];
  }
}

}  // namespace

void ThreadScratch::resize(uint32_t count) {
  p.assign(count, {});
  w.assign(count, 0);
  anchor_at.assign(count, -1);
  hold_at.assign(count, -1);
  n.assign(count, {});
  length.assign(count, 0);
  sideways.assign(count, 1);
  bend_w.assign(count, 0);
  node_of_slot.assign(count, -1);
  base_diag.assign(count, 0);
  base_off.assign(count, 0);
  base_rhs.assign(count, 0);
  diag.assign(count, 0);
  off.assign(count, 0);
  rhs.assign(count, 0);
  lambda.assign(count, 0);
  bend.resize(count);
  stiff.assign(count, 0);
  carry.assign(count, 0);
  smooth.assign(count, {});
  moved.assign(count, {});
}

Vec3 thread_position(const Thread& t, size_t node, const Vec4* x, const std::vector<RigidBody>& body) {
  const uint32_t slot = t.order[node];
  for (const ThreadAnchor& a : t.anchor)
    if (a.slot == slot) return position_of(a, x);
  for (const ThreadHold& hold : t.hold)
    if (hold.slot == slot) return transform(body[static_cast<size_t>(hold.body)].pose(), hold.local);
  return xyz(x[slot]);
}

float thread_length(const Thread& t, const Vec4* x, const std::vector<RigidBody>& body) {
  float sum = 0;
  for (size_t i = 0; i + 1 < t.order.size(); ++i)
    if (!t.cut[i]) sum += distance(thread_position(t, i, x, body), thread_position(t, i + 1, x, body));
  return sum;
}

void solve_bend(Vec3& a, Vec3& b, Vec3& c, float wa, float wb, float wc, float compliance, float h, float& lambda) {
  const Vec3 da = a - b, dc = c - b;
  const float la2 = length2(da), lc2 = length2(dc);
  if (la2 < 1e-18f || lc2 < 1e-18f) return;
  const float inv_la = 1 / std::sqrt(la2), inv_lc = 1 / std::sqrt(lc2);
  const Vec3 u = da * inv_la, v = dc * inv_lc;
  const float cosine = std::clamp(dot(u, v), -1.0f, 1.0f);
  const float violation = cosine + 1.0f;
  if (violation < 1e-6f && lambda == 0) return;  // straight to a tenth of a degree
  const Vec3 ga = (v - u * cosine) * inv_la, gc = (u - v * cosine) * inv_lc, gb = -(ga + gc);
  const float w = wa * length2(ga) + wb * length2(gb) + wc * length2(gc);
  const float alpha = compliance / (h * h);
  // Near straight the violation falls with the square of the angle and w with it, so the step stays bounded; at exactly 0 or
  // 180 degrees the direction is undefined and there is nothing to apply.
  if (w < 1e-12f * (wa + wb + wc) * inv_la * inv_lc) return;
  float d = -(violation + alpha * lambda) / (w + alpha);
  // A rigid bend (compliance 0) linearised far from straight would overshoot: no more than a tenth of a segment at a time.
  const float most = std::max({wa * wa * length2(ga), wb * wb * length2(gb), wc * wc * length2(gc)}) * d * d;
  const float limit2 = 0.01f * std::min(la2, lc2);
  if (most > limit2) d *= std::sqrt(limit2 / most);
  lambda += d;
  a += ga * (wa * d);
  b += gb * (wb * d);
  c += gc * (wc * d);
}

void solve_thread(const ThreadModel& model, Thread& thread, ThreadScratch& s, Vec4* x, const Vec4* before,
                  const float* inv_mass, const std::vector<RigidModel>& body_model, std::vector<RigidBody>& body, float h) {
  const size_t nodes = thread.order.size();
  if (nodes < 2) return;
  const size_t pairs = nodes - 1;
  const float inv_h2 = 1.0f / (h * h);
  const float alpha_per_metre = model.stretch_compliance / model.spacing * inv_h2;

  for (size_t i = 0; i < nodes; ++i) {
    s.p[i] = xyz(x[thread.order[i]]);
    s.w[i] = s.bend_w[i] = model.inv_mass;
    s.anchor_at[i] = s.hold_at[i] = -1;
    s.node_of_slot[thread.order[i] - model.first_slot] = static_cast<int32_t>(i);
  }
  auto node_of = [&](uint32_t slot) { return static_cast<size_t>(s.node_of_slot[slot - model.first_slot]); };
  for (size_t k = 0; k < thread.anchor.size(); ++k) {
    const size_t i = node_of(thread.anchor[k].slot);
    s.anchor_at[i] = static_cast<int32_t>(k);
    s.p[i] = position_of(thread.anchor[k], x);
    s.w[i] = inverse_mass_of(thread.anchor[k].point, inv_mass);
    s.bend_w[i] = 0;  // locked nodes do not give way to bending: tissue and tools are far heavier than the thread
  }
  for (size_t k = 0; k < thread.hold.size(); ++k) {
    const size_t i = node_of(thread.hold[k].slot);
    if (s.anchor_at[i] >= 0) continue;  // tissue keeps it: the tool's hold on it is felt through the neighbours
    s.hold_at[i] = static_cast<int32_t>(k);
    s.p[i] = transform(body[static_cast<size_t>(thread.hold[k].body)].pose(), thread.hold[k].local);
    s.w[i] = s.bend_w[i] = 0;
  }

  if (model.direct) stiffen_prediction(model, thread, s, nodes, before, h);
  // Nothing bends across a cut: piece by piece.
  for (size_t begin = 0, i = 0; i < nodes; ++i) {
    if (i < pairs && !thread.cut[i]) continue;
    const size_t count = i + 1 - begin;
    solve_bends({s.p.data() + begin, count}, {s.bend_w.data() + begin, count}, model.bend_compliance, h, model.bend_sweeps,
                s.bend);
    begin = i + 1;
  }

  if (model.direct) {
    s.slide.assign(thread.anchor.size(), {});  // within its capacity: no allocation once as many anchors were seen
    for (int step = 0; step < kNewtonSteps; ++step) {
      const float residual = assemble(thread, s, nodes, alpha_per_metre, h, body_model, body);
      if (step > 0 && residual < kGoodEnough) break;
      solve_with_slides(model, thread, s, pairs, h);

      // Light nodes are held back below, heavy ones are not: a step far too long would push a needle again and again for the
      // same stretch, and feed energy in. So the whole step is shortened.
      float most = 0;
      for (size_t i = 0; i < nodes; ++i) {
        const bool moves =
            s.hold_at[i] >= 0
                ? body_model[static_cast<size_t>(thread.hold[static_cast<size_t>(s.hold_at[i])].body)].inv_mass > 0
                : s.anchor_at[i] >= 0 && s.w[i] > 0;
        if (!moves) continue;
        Vec3 p{};
        if (i > 0) p += s.n[i - 1] * static_cast<float>(s.rhs[i - 1]);
        if (i < pairs) p -= s.n[i] * static_cast<float>(s.rhs[i]);
        most = std::max(most, length(p));
      }
      if (most > kMostForce * h * h) {
        const float part = kMostForce * h * h / most;
        for (size_t i = 0; i < pairs; ++i) s.rhs[i] *= part;
        for (SlideState& k : s.slide) k.step *= part;
      }

      // A bent stretch of light thread between heavy ends: the impulse that moves the ends would throw the light nodes far
      // sideways, because the linearisation does not know that they come to rest on the straight line. So a light node takes a
      // bounded step, heavy ones their full one; the next step sees the new directions.
      const float limit = kLargestStep * model.spacing;
      for (size_t i = 0; i < nodes; ++i) {
        Vec3 p{};
        if (i > 0) p += s.n[i - 1] * static_cast<float>(s.rhs[i - 1]);
        if (i < pairs) p -= s.n[i] * static_cast<float>(s.rhs[i]);
        if (s.hold_at[i] < 0 && s.anchor_at[i] < 0) {
          if (s.sideways[i] < 1) {
            const Vec3 t = s.n[i - 1] + s.n[i];
            p = p * s.sideways[i] + t * ((1 - s.sideways[i]) * dot(p, t) / length2(t));
          }
          const float reach2 = length2(p) * s.w[i] * s.w[i];
          if (reach2 > limit * limit) p *= limit / std::sqrt(reach2);
          s.p[i] += p * s.w[i];
        } else {
          push_node(s, thread, i, p, x, inv_mass, body_model, body);
        }
      }
      for (size_t i = 0; i < pairs; ++i) s.lambda[i] += static_cast<float>(s.rhs[i]);
      for (size_t i = 1; i < pairs; ++i)
        if (s.anchor_at[i] >= 0) {
          SlideState& k = s.slide[static_cast<size_t>(s.anchor_at[i])];
          thread.rest[i] += k.step;
          thread.rest[i - 1] -= k.step;
          k.total += k.step;
        }
    }
  }

  for (int sweep = 0; sweep < model.distance_sweeps; ++sweep)
    for (size_t i = 0; i < pairs; ++i) {
      if (thread.cut[i]) continue;
      const Vec3 d = s.p[i + 1] - s.p[i];
      const float l2 = length2(d), rest = thread.rest[i], alpha = alpha_per_metre * rest, compliant = alpha * s.lambda[i];
      // Right to a tenth of a micrometre, as the direct solve leaves most pairs: spare the root and the division.
      if (std::abs(l2 - rest * rest) < 2e-7f * rest && std::abs(compliant) < 1e-7f) continue;
      if (l2 < 1e-18f) continue;
      const float l = std::sqrt(l2);
      const Vec3 n = d / l;
      const float w =
          node_inverse_mass(s, thread, i, n, body_model, body) + node_inverse_mass(s, thread, i + 1, n, body_model, body);
      if (w + alpha <= 0) continue;
      const float dl = (-(l - rest) - compliant) / (w + alpha);
      s.lambda[i] += dl;
      push_node(s, thread, i, n * -dl, x, inv_mass, body_model, body);
      push_node(s, thread, i + 1, n * dl, x, inv_mass, body_model, body);
    }

  for (size_t i = 0; i < nodes; ++i) set(x[thread.order[i]], s.p[i]);
  for (size_t i = 0; i < pairs; ++i) thread.tension[i] = -s.lambda[i] * inv_h2;

  // Stick or slip for the next substep, from this one's tensions.
  for (size_t i = 1; i < pairs; ++i)
    if (s.anchor_at[i] >= 0) {
      ThreadAnchor& a = thread.anchor[static_cast<size_t>(s.anchor_at[i])];
      if (model.direct && s.slide[static_cast<size_t>(s.anchor_at[i])].stopped) a.slipping = 0;
      a.tension_needle = thread.tension[i];
      a.tension_free = thread.tension[i - 1];
      const float difference = a.tension_needle - a.tension_free;
      const float threshold = a.threshold();
      const int wants = difference > threshold ? 1 : difference < -threshold ? -1 : 0;
      const bool may = !a.knotted && ((wants > 0 && !a.blocked_needle) || (wants < 0 && !a.blocked_free));
      if (a.slipping == 0) a.slipping = may ? wants : 0;
      // While it slips the difference sits at the friction; it sticks again when the pull falls clearly below that.
      else if (static_cast<float>(a.slipping) * difference < 0.5f * threshold) a.slipping = 0;
      else if ((a.slipping > 0 && a.blocked_needle) || (a.slipping < 0 && a.blocked_free)) a.slipping = 0;
    }
}

}  // namespace catgut
