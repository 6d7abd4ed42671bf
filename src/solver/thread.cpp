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
// Of the diagonal. A light thread drawn straight between heavy ends has one soft mode, a hundred thousand times softer than the
// diagonal, and it is the one that matters: more than this would hide it.
constexpr double kRegularisation = 1e-6;
// Inverse mass of a sliding coordinate over that of a thread particle. It has no velocity of its own, so this acts as a small viscous drag:
// 7 mN at 0.15 m/s and 1 ms. Lighter would let friction overshoot the length of a segment within a substep.
constexpr double kSlideMass = 0.04;
constexpr int kSlideRounds = 4;
constexpr float kLargestStep = 0.6f;      // of the spacing, per Newton step

// n1^T W n2 of the node seen by two pair directions. A free node on a taut thread is hard to move sideways (see stiffen).
float node_inverse_mass(const ThreadScratch& s, const Thread& t, size_t i, Vec3 n1, Vec3 n2,
                        const std::vector<RigidModel>& model, const std::vector<RigidBody>& body) {
  if (s.hold_at[i] < 0) return s.w[i] * (s.sideways[i] * dot(n1, n2) + (1 - s.sideways[i]) * dot(n1, s.t[i]) * dot(n2, s.t[i]));
  const ThreadHold& hold = t.hold[static_cast<size_t>(s.hold_at[i])];
  const RigidBody& b = body[static_cast<size_t>(hold.body)];
  const RigidModel& m = model[static_cast<size_t>(hold.body)];
  const Vec3 r = rotate(b.q, hold.local);
  return m.inv_mass * dot(n1, n2) + dot(cross(r, n1), inverse_inertia(m, b, cross(r, n2)));
}

// Geometric stiffness. A taut thread resists being moved sideways with tension / length, which the bare linearisation does not know: it
// would shorten a taut zigzag by throwing its light nodes sideways, and never converge. So sideways a node is given the inertia
// m + h^2 T (1/l0 + 1/l1) (Tournier et al. 2015, Stable constrained dynamics); sideways[i] is the ratio of the inverse masses.
void stiffen(ThreadScratch& s, const Thread& t, size_t nodes, float h) {
  for (size_t i = 0; i < nodes; ++i) {
    s.sideways[i] = 1;
    if (i == 0 || i + 1 == nodes || s.anchor_at[i] >= 0 || s.hold_at[i] >= 0) continue;
    const float inv_h2 = 1 / (h * h);
    const float before = std::max(t.tension[i - 1], -s.lambda[i - 1] * inv_h2), after = std::max(t.tension[i], -s.lambda[i] * inv_h2);
    const float tension = std::max(0.0f, std::min(before, after));
    if (tension == 0) continue;
    const float l0 = std::max(distance(s.p[i - 1], s.p[i]), 1e-5f), l1 = std::max(distance(s.p[i], s.p[i + 1]), 1e-5f);
    s.t[i] = normalized(s.n[i - 1] + s.n[i], s.n[i]);
    s.sideways[i] = 1 / (1 + s.w[i] * h * h * tension * (1 / l0 + 1 / l1));
  }
}

// Solves the tridiagonal system for the change of the multipliers (into s.rhs), together with the slides at slipping anchors: one more
// unknown each, coupled to the two pairs beside it. A slide that would run backward (friction stops, it never drives) or beyond what the
// pair on its side still has is fixed at that bound and the system solved again: an active set, which shrinks every round.
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
    for (size_t i = 1; i < pairs; ++i) {
      const double f = s.off[i - 1] / s.diag[i - 1];
      s.diag[i] -= f * s.off[i - 1];
      s.rhs[i] -= f * s.rhs[i - 1];
    }
    for (size_t i = pairs; i-- > 0;) {
      if (i + 1 < pairs) s.rhs[i] -= s.off[i] * s.rhs[i + 1];
      s.rhs[i] /= s.diag[i];
    }
    bool again = false;
    for (size_t i = 1; i < pairs; ++i) {
      if (s.anchor_at[i] < 0) continue;
      const ThreadAnchor& a = thread.anchor[static_cast<size_t>(s.anchor_at[i])];
      SlideState& k = s.slide[static_cast<size_t>(s.anchor_at[i])];
      if (a.slipping == 0 || k.fixed) continue;
      k.step = static_cast<float>(ws * (drag_of(a, k) + s.rhs[i - 1] - s.rhs[i]));
      const float most_forward = std::max(0.0f, thread.rest[i - 1] - least), most_back = -std::max(0.0f, thread.rest[i] - least);
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
    const TissuePoint& point = t.anchor[static_cast<size_t>(s.anchor_at[i])].point;
    push(point, x, inv_mass, p);
    s.p[i] = position_of(point, x);
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
  t.assign(count, {});
  sideways.assign(count, 1);
  base_diag.assign(count, 0);
  base_off.assign(count, 0);
  base_rhs.assign(count, 0);
  diag.assign(count, 0);
  off.assign(count, 0);
  rhs.assign(count, 0);
  lambda.assign(count, 0);
  bend_lambda.assign(count, 0);
}

Vec3 thread_position(const Thread& t, size_t node, const Vec4* x, const std::vector<RigidBody>& body) {
  const uint32_t slot = t.order[node];
  for (const ThreadAnchor& a : t.anchor)
    if (a.slot == slot) return position_of(a.point, x);
  for (const ThreadHold& hold : t.hold)
    if (hold.slot == slot) return transform(body[static_cast<size_t>(hold.body)].pose(), hold.local);
  return xyz(x[slot]);
}

float thread_length(const Thread& t, const Vec4* x, const std::vector<RigidBody>& body) {
  float sum = 0;
  for (size_t i = 0; i + 1 < t.order.size(); ++i) sum += distance(thread_position(t, i, x, body), thread_position(t, i + 1, x, body));
  return sum;
}

void solve_bend(Vec3& a, Vec3& b, Vec3& c, float wa, float wb, float wc, float compliance, float h, float& lambda) {
  const Vec3 da = a - b, dc = c - b;
  const float la = length(da), lc = length(dc);
  if (la < 1e-9f || lc < 1e-9f) return;
  const Vec3 u = da / la, v = dc / lc;
  const float cosine = std::clamp(dot(u, v), -1.0f, 1.0f);
  const float violation = cosine + 1.0f;
  const Vec3 ga = (v - u * cosine) / la, gc = (u - v * cosine) / lc, gb = -(ga + gc);
  const float w = wa * length2(ga) + wb * length2(gb) + wc * length2(gc);
  const float alpha = compliance / (h * h);
  // Near straight the violation falls with the square of the angle and w with it, so the step stays bounded; at exactly 0 or 180
  // degrees the direction is undefined and there is nothing to apply.
  if (w < 1e-12f * (wa + wb + wc) / (la * lc)) return;
  float d = -(violation + alpha * lambda) / (w + alpha);
  // A rigid bend (compliance 0) linearised far from straight would overshoot: no more than a tenth of a segment at a time.
  const float reach = std::abs(d) * std::max({wa * length(ga), wb * length(gb), wc * length(gc)});
  const float limit = 0.1f * std::min(la, lc);
  if (reach > limit) d *= limit / reach;
  lambda += d;
  a += ga * (wa * d);
  b += gb * (wb * d);
  c += gc * (wc * d);
}

void solve_thread(const ThreadModel& model, Thread& thread, ThreadScratch& s, Vec4* x, const float* inv_mass,
                  const std::vector<RigidModel>& body_model, std::vector<RigidBody>& body, float h) {
  const size_t nodes = thread.order.size();
  if (nodes < 2) return;
  const size_t pairs = nodes - 1;
  const float inv_h2 = 1.0f / (h * h);
  const float alpha_per_metre = model.stretch_compliance / model.spacing * inv_h2;

  for (size_t i = 0; i < nodes; ++i) {
    s.p[i] = xyz(x[thread.order[i]]);
    s.w[i] = model.inv_mass;
    s.anchor_at[i] = s.hold_at[i] = -1;
  }
  auto node_of = [&](uint32_t slot) {
    return static_cast<size_t>(std::find(thread.order.begin(), thread.order.end(), slot) - thread.order.begin());
  };
  for (size_t k = 0; k < thread.anchor.size(); ++k) {
    const size_t i = node_of(thread.anchor[k].slot);
    s.anchor_at[i] = static_cast<int32_t>(k);
    s.p[i] = position_of(thread.anchor[k].point, x);
    s.w[i] = inverse_mass_of(thread.anchor[k].point, inv_mass);
  }
  for (size_t k = 0; k < thread.hold.size(); ++k) {
    const size_t i = node_of(thread.hold[k].slot);
    if (s.anchor_at[i] >= 0) continue;  // tissue keeps it: the tool's hold on it is felt through the neighbours
    s.hold_at[i] = static_cast<int32_t>(k);
    s.p[i] = transform(body[static_cast<size_t>(thread.hold[k].body)].pose(), thread.hold[k].local);
    s.w[i] = 0;
  }
  std::fill(s.sideways.begin(), s.sideways.end(), 1.0f);
  for (int sweep = 0; sweep < model.bend_sweeps; ++sweep)
    for (size_t i = 1; i + 1 < nodes; ++i) {
      // Locked nodes do not give way to bending: tissue and tools are far heavier than the thread.
      auto free_mass = [&](size_t k) { return s.anchor_at[k] < 0 && s.hold_at[k] < 0 ? s.w[k] : 0.0f; };
      const float wa = free_mass(i - 1), wb = free_mass(i), wc = free_mass(i + 1);
      if (wa + wb + wc > 0)
        solve_bend(s.p[i - 1], s.p[i], s.p[i + 1], wa, wb, wc, model.bend_compliance, h, s.bend_lambda[i]);
    }

  if (model.direct) {
    s.slide.assign(thread.anchor.size(), {});  // within its capacity: no allocation once as many anchors were seen
    for (int step = 0; step < kNewtonSteps; ++step) {
      for (size_t i = 0; i < pairs; ++i) s.n[i] = normalized(s.p[i + 1] - s.p[i], {0, 1, 0});
      stiffen(s, thread, nodes, h);
      // Weight meets the same sideways inertia as tension does. If it did not, it would carry a taut thread down faster than tension may
      // lift it back, and the thread would come to rest stretched, at any tension.
      if (step == 0)
        for (size_t i = 0; i < nodes; ++i)
          if (s.sideways[i] < 1) {
            const Vec3 fall = model.gravity * (h * h);
            s.p[i] -= (fall - s.t[i] * dot(fall, s.t[i])) * (1 - s.sideways[i]);
          }
      for (size_t i = 0; i < pairs; ++i) {
        const float alpha = alpha_per_metre * thread.rest[i];
        const double d = node_inverse_mass(s, thread, i, s.n[i], s.n[i], body_model, body) +
                         node_inverse_mass(s, thread, i + 1, s.n[i], s.n[i], body_model, body);
        s.base_diag[i] = d * (1 + kRegularisation) + alpha;
        s.base_rhs[i] = -(distance(s.p[i], s.p[i + 1]) - thread.rest[i]) - alpha * s.lambda[i];
        s.base_off[i] = i + 1 < pairs ? -node_inverse_mass(s, thread, i + 1, s.n[i], s.n[i + 1], body_model, body) : 0.0;
      }
      solve_with_slides(model, thread, s, pairs, h);

      // A bent stretch of light thread between heavy ends: the impulse that moves the ends would throw the light nodes far sideways, because
      // the linearisation does not know that they come to rest on the straight line. So a light node takes a bounded step, heavy
      // ones their full one; the next step sees the new directions.
      const float limit = kLargestStep * model.spacing;
      for (size_t i = 0; i < nodes; ++i) {
        Vec3 p{};
        if (i > 0) p += s.n[i - 1] * static_cast<float>(s.rhs[i - 1]);
        if (i < pairs) p -= s.n[i] * static_cast<float>(s.rhs[i]);
        if (s.hold_at[i] < 0 && s.anchor_at[i] < 0) {
          p = p * s.sideways[i] + s.t[i] * ((1 - s.sideways[i]) * dot(p, s.t[i]));
          const float reach = length(p) * s.w[i];
          if (reach > limit) p *= limit / reach;
        }
        push_node(s, thread, i, p, x, inv_mass, body_model, body);
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

  std::fill(s.sideways.begin(), s.sideways.end(), 1.0f);
  for (int sweep = 0; sweep < model.distance_sweeps; ++sweep)
    for (size_t i = 0; i < pairs; ++i) {
      const Vec3 d = s.p[i + 1] - s.p[i];
      const float l = length(d);
      if (l < 1e-9f) continue;
      const Vec3 n = d / l;
      const float alpha = alpha_per_metre * thread.rest[i];
      const float w = node_inverse_mass(s, thread, i, n, n, body_model, body) +
                      node_inverse_mass(s, thread, i + 1, n, n, body_model, body);
      if (w + alpha <= 0) continue;
      const float dl = (-(l - thread.rest[i]) - alpha * s.lambda[i]) / (w + alpha);
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
      const bool may = (wants > 0 && !a.blocked_needle) || (wants < 0 && !a.blocked_free);
      if (a.slipping == 0) a.slipping = may ? wants : 0;
      // While it slips the difference sits at the friction; it sticks again when the pull falls clearly below that.
      else if (static_cast<float>(a.slipping) * difference < 0.5f * threshold) a.slipping = 0;
      else if ((a.slipping > 0 && a.blocked_needle) || (a.slipping < 0 && a.blocked_free)) a.slipping = 0;
    }
}

}  // namespace catgut
