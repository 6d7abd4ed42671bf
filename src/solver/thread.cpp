// SPDX-License-Identifier: Apache-2.0
// solver/thread: reads the order, anchors and holds; moves particles, tissue and bodies; writes tensions and slides.
// The direct solve is a Newton step on all stretch constraints at once. Their matrix J M^-1 J^T is tridiagonal in the order of
// the thread. Bare Newton is singular where a slack thread folds, so it is regularized and its step limited. The sweeps
// after it remove the residual. Rest-length slide at an anchor is one more coordinate s with inverse mass w of a particle:
// rest[needle side] += s, rest[free side] -= s. It only adds to the two pairs beside the anchor and their coupling.
#include "solver/thread.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace catgut {
namespace {

constexpr int kNewtonSteps = 2;
constexpr int kContactSteps = 5;      // while nodes start or end contact with a tool
constexpr float kGoodEnough = 2e-6f;  // [m] a second step is skipped when no residual is larger
// Relative to the diagonal. A light thread straight between heavy ends has one soft mode, 1e5 times softer than the diagonal,
// and that mode matters: a larger value would suppress it.
constexpr double kRegularisation = 1e-6;
// Inverse mass of a sliding coordinate relative to a thread particle. It has no velocity of its own, so this acts as a small
// viscous drag: 7 mN at 0.15 m/s and 1 ms. A lighter one would let friction overshoot a segment's length within a substep.
constexpr double kSlideMass = 0.04;
constexpr int kSlideRounds = 4;
constexpr float kMostForce = 20;      // [N] limit of a Newton step on a heavy node: about the strength of a thread
constexpr float kLargestStep = 0.6f;  // fraction of the spacing, per Newton step

// A held node seen by two pair directions: n1^T W n2 of the rigid body at that point.
float held_inverse_mass(const ThreadHold& hold, Vec3 n1, Vec3 n2, const std::vector<RigidModel>& model,
                        const std::vector<RigidBody>& body) {
  const RigidBody& b = body[static_cast<size_t>(hold.body)];
  const RigidModel& m = model[static_cast<size_t>(hold.body)];
  const Vec3 r = rotate(b.q, hold.local);
  return m.inv_mass * dot(n1, n2) + dot(cross(r, n1), inverse_inertia(m, b, cross(r, n2)));
}
float node_inverse_mass(const ThreadScratch& s, const Strand& t, size_t i, Vec3 n, const std::vector<RigidModel>& model,
                        const std::vector<RigidBody>& body) {
  return s.hold_at[i] < 0 ? s.w[i] : held_inverse_mass(t.hold[static_cast<size_t>(s.hold_at[i])], n, n, model, body);
}

// Kind and position of every node of the order.
void gather_nodes(const StrandModel& model, const Strand& thread, ThreadScratch& s, const Vec4* x, const Vec4* before,
                  const float* inv_mass, const std::vector<RigidBody>& body) {
  const size_t nodes = thread.order.size(), pairs = nodes - 1;
  for (size_t i = 0; i < nodes; ++i) {
    const uint32_t slot = thread.order[i];
    put_node(s, i, xyz(x[slot]));
    s.from_x[i] = before[slot].x, s.from_y[i] = before[slot].y, s.from_z[i] = before[slot].z;
    s.w[i] = model.inv_mass;
    s.is_free[i] = 1;
    s.anchor_at[i] = s.hold_at[i] = -1;
    s.node_of_slot[slot - model.first_slot] = static_cast<int32_t>(i);
  }
  for (size_t i = 0; i < pairs; ++i) {
    s.intact[i] = thread.cut[i] ? 0 : 1;
    s.rest[i] = thread.rest[i];
    s.tension[i] = thread.cut[i] ? 0 : thread.tension[i];
  }
  // Clear the rows behind the last pair; the thread may have had more pairs before.
  s.tension[pairs] = s.intact[pairs] = s.step[pairs] = s.lambda[pairs] = s.is_free[nodes] = 0;
  auto node_of = [&](uint32_t slot) { return static_cast<uint32_t>(s.node_of_slot[slot - model.first_slot]); };
  s.constrained.clear();
  s.anchor_node.resize(thread.anchor.size());
  s.waiting.assign(thread.anchor.size(), {});
  for (size_t k = 0; k < thread.anchor.size(); ++k) {
    const uint32_t i = s.anchor_node[k] = node_of(thread.anchor[k].slot);
    if (s.anchor_at[i] < 0) s.constrained.push_back(i);
    s.anchor_at[i] = static_cast<int32_t>(k);
    put_node(s, i, position_of(thread.anchor[k], x));
    s.w[i] = inverse_mass_of(thread.anchor[k].point, inv_mass);
    s.is_free[i] = 0;
  }
  for (size_t k = 0; k < thread.hold.size(); ++k) {
    const uint32_t i = node_of(thread.hold[k].slot);
    if (s.anchor_at[i] >= 0) continue;  // the tissue owns it: the tool's hold acts through the neighbors
    if (s.hold_at[i] < 0) s.constrained.push_back(i);
    s.hold_at[i] = static_cast<int32_t>(k);
    put_node(s, i, transform(body[static_cast<size_t>(thread.hold[k].body)].pose(), thread.hold[k].local));
    s.w[i] = s.is_free[i] = 0;
  }
  for (const NodeContact& c : s.contact) s.contact_at[c.node] = -1;  // of the previous substep
  s.contact.clear();
  s.on_tool.assign(body.size(), {});
  for (const ThreadTouch& t : s.touch)
    for (uint32_t i = t.pair; i <= t.pair + 1; ++i) {
      if (s.is_free[i] == 0 || s.contact_at[i] >= 0) continue;
      s.contact_at[i] = static_cast<int32_t>(s.contact.size());
      s.contact.push_back({});
      s.contact.back().node = i;
      s.contact.back().start = node(s, i);
    }
}

// The tridiagonal matrix J M^-1 J^T of all stretch constraints, as coefficients of every pair's two nodes, and its right-hand
// side, at the current positions.
//
// Geometric stiffness. A taut thread resists lateral motion with tension / length, which the bare linearization omits. It
// would shorten a taut zigzag by moving its light nodes sideways, and never converge. Laterally, a free node therefore
// has the inertia m + h^2 T (1/l0 + 1/l1) (Tournier et al. 2015, Stable constrained dynamics); side[i] is the ratio of
// the inverse masses. With the tangent t = n0 + n1 of unit pair directions, t.t = 2 (1 + c) and n0.t = n1.t = 1 + c, c = n0.n1.
// This needs no square root. Returns the largest residual [m].
float assemble(const Strand& t, ThreadScratch& s, size_t nodes, float alpha_per_meter, float h,
               const std::vector<RigidModel>& body_model, const std::vector<RigidBody>& body) {
  std::copy(t.rest.begin(), t.rest.end(), s.rest.begin());
  const float worst = find_directions(s, nodes - 1, alpha_per_meter);
  find_masses(s, nodes, h);
  for (const uint32_t i : s.constrained) {
    if (s.hold_at[i] < 0) continue;
    const ThreadHold& hold = t.hold[static_cast<size_t>(s.hold_at[i])];
    const Vec3 n0 = way_before(s, i), n1 = way_after(s, i);
    s.mass_before[i] = held_inverse_mass(hold, n0, n0, body_model, body);
    s.mass_after[i] = held_inverse_mass(hold, n1, n1, body_model, body);
    s.across[i] = held_inverse_mass(hold, n0, n1, body_model, body);
  }
  compute_effective_masses(s, body_model, body);
  return worst;
}

// Solves the tridiagonal system for the change of the multipliers (into s.step), together with the slides at slipping anchors.
// One more unknown each, coupled to the two pairs beside it. A slide is fixed at a bound if it would run backward (friction
// never drives) or beyond what the pair on its side has left. The system is then solved again: an active set that
// shrinks every round.
void solve_with_slides(const StrandModel& model, const Strand& thread, ThreadScratch& s, size_t pairs, float h) {
  const double ws = kSlideMass * model.inv_mass;
  const float least = 0.02f * model.spacing;
  PartitionedTridiagonal<double, 1>& m = s.stretch;
  PaddedColumn<double>& rhs = m.right[0];
  auto drag_of = [&](const ThreadAnchor& a, const SlideState& k) {
    return k.dragged ? 0.0 : -a.slipping * double{a.threshold()} * h * h;  // a known force on the slide, once per substep
  };
  // The thread can slide only between two uncut pairs.
  auto slides = [&](size_t k) {
    const size_t i = s.anchor_node[k];
    return thread.anchor[k].slipping != 0 && s.anchor_at[i] == static_cast<int32_t>(k) && i > 0 && i < pairs &&
           s.intact[i - 1] > 0 && s.intact[i] > 0;
  };
  for (SlideState& k : s.slide) k.fixed = false;
  for (int round = 0; round < kSlideRounds; ++round) {
    find_matrix(s, pairs, kRegularisation);
    for (size_t j = 0; j < s.slide.size(); ++j) {
      if (!slides(j)) continue;
      const SlideState& k = s.slide[j];
      const size_t i = s.anchor_node[j];
      const double known = k.fixed ? k.step : ws * drag_of(thread.anchor[j], k);
      rhs[i] += known;  // C of the needle side decreases by the slide
      rhs[i - 1] -= known;
      if (k.fixed) continue;
      m.diag[i] += ws, m.diag[i - 1] += ws;
      m.off[i - 1] -= ws;
    }
    solve_partitions(m, pairs);
    bool again = false;
    for (size_t j = 0; j < s.slide.size(); ++j) {
      SlideState& k = s.slide[j];
      if (k.fixed || !slides(j)) continue;
      const ThreadAnchor& a = thread.anchor[j];
      const size_t i = s.anchor_node[j];
      k.step = static_cast<float>(ws * (drag_of(a, k) + rhs[i - 1] - rhs[i]));
      const float most_forward = std::max(0.0f, thread.rest[i - 1] - least),
                  most_back = -std::max(0.0f, thread.rest[i] - least);
      float bounded = std::clamp(k.step, most_back, most_forward);
      if ((k.total + bounded) * static_cast<float>(a.slipping) < 0) bounded = -k.total, k.stopped = true;
      if (bounded != k.step) k.step = bounded, k.fixed = again = true;
    }
    if (!again) break;
  }
  for (SlideState& k : s.slide) k.dragged = true;
  for (size_t i = 0; i < pairs; ++i) s.step[i] = static_cast<float>(rhs[i]);
}

// Applies the positional impulse `p` to node i, of any kind, and refreshes its position. Tissue under an anchor waits for
// push_anchors, because its sixteen particles are expensive. The node moves as they will, except for impulses of other
// anchors on the same particles.
void push_node(ThreadScratch& s, const Strand& t, size_t i, Vec3 p, const std::vector<RigidModel>& model,
               std::vector<RigidBody>& body) {
  if (s.anchor_at[i] >= 0) {
    s.waiting[static_cast<size_t>(s.anchor_at[i])] += p;
    put_node(s, i, node(s, i) + p * s.w[i]);
  } else if (s.hold_at[i] >= 0) {
    const ThreadHold& hold = t.hold[static_cast<size_t>(s.hold_at[i])];
    RigidBody& b = body[static_cast<size_t>(hold.body)];
    push(model[static_cast<size_t>(hold.body)], b, p, rotate(b.q, hold.local));
    put_node(s, i, transform(b.pose(), hold.local));
  } else {
    // It does not move into a tool that it touches: the tool receives that part.
    if (s.contact_at[i] >= 0) {
      const NodeContact& c = s.contact[static_cast<size_t>(s.contact_at[i])];
      if (const float into = dot(p, c.n); c.active && into < 0) {
        push_tool(s, c, c.n * into, model, body);
        p -= c.n * into;
      }
    }
    put_node(s, i, node(s, i) + p * s.w[i]);
  }
}

// Applies the accumulated anchor impulses to the tissue.
void push_anchors(ThreadScratch& s, const Strand& t, Vec4* x, const float* inv_mass) {
  for (size_t k = 0; k < t.anchor.size(); ++k) {
    if (length2(s.waiting[k]) > 0) push(t.anchor[k].point, x, inv_mass, s.waiting[k]);
    s.waiting[k] = {};
  }
}

// The next marked pair from i on, or `pairs`.
size_t next_unfit(const ThreadScratch& s, size_t i, size_t pairs) {
  for (; i < pairs; i = (i / 64 + 1) * 64) {
    const uint64_t word = s.violated[i / 64] >> (i % 64);
    if (word != 0) return i + static_cast<size_t>(std::countr_zero(word));
  }
  return pairs;
}
void mark_unfit(ThreadScratch& s, size_t i) { s.violated[i / 64] |= uint64_t{1} << (i % 64); }

// Gauss-Seidel sweeps over the pairs in order. After the direct solve nine in ten are satisfied: they are detected at once and
// skipped. A pair that moves marks its neighbors, which preserves the order of work.
void sweep_distances(const StrandModel& model, const Strand& thread, ThreadScratch& s, size_t pairs, float alpha_per_meter,
                     const std::vector<RigidModel>& body_model, std::vector<RigidBody>& body) {
  std::copy(thread.rest.begin(), thread.rest.end(), s.rest.begin());
  mark_violated_segments(s, pairs, alpha_per_meter);
  for (int sweep = 0; sweep < model.distance_sweeps; ++sweep)
    for (size_t i = next_unfit(s, 0, pairs); i < pairs; i = next_unfit(s, i + 1, pairs)) {
      const Vec3 d = node(s, i + 1) - node(s, i);
      const float l2 = length2(d), rest = s.rest[i], alpha = alpha_per_meter * rest, compliant = alpha * s.lambda[i];
      const bool fit = std::abs(l2 - rest * rest) < kFitLength * rest && std::abs(compliant) < kFitCompliant;
      if (fit || l2 < 1e-18f || s.intact[i] == 0) {
        s.violated[i / 64] &= ~(uint64_t{1} << (i % 64));
        continue;
      }
      const float l = std::sqrt(l2);
      const Vec3 n = d / l;
      const float w =
          node_inverse_mass(s, thread, i, n, body_model, body) + node_inverse_mass(s, thread, i + 1, n, body_model, body);
      if (w + alpha <= 0) continue;
      const float dl = distance_step(l, rest, w, alpha, s.lambda[i]);
      s.lambda[i] += dl;
      push_node(s, thread, i, n * -dl, body_model, body);
      push_node(s, thread, i + 1, n * dl, body_model, body);
      if (i > 0) mark_unfit(s, i - 1);
      if (i + 1 < pairs) mark_unfit(s, i + 1);
    }
}

}  // namespace

void ThreadScratch::resize(uint32_t count) {
  for (PaddedColumn<float>* c :
       {&x,       &y,      &z,      &w,      &is_free, &mass_before, &mass_after, &across,  &side,     &tilt, &rest,
        &tension, &nx,     &ny,     &nz,     &intact,  &lambda,      &inv_length, &alpha,   &residual, &step, &from_x,
        &from_y,  &from_z, &gone_x, &gone_y, &gone_z,  &moved_x,     &moved_y,    &moved_z, &stiff})
    c->assign(count, 0);
  anchor_at.assign(count, -1);
  hold_at.assign(count, -1);
  contact_at.assign(count, -1);
  contact.clear();
  touch.clear();
  node_of_slot.assign(count, -1);
  constrained.clear();
  violated.assign(count / 64 + 1, 0);
  stretch.resize(count);
  motion.resize(count);
  bend.resize(count);
}

void solve_bend(Vec3& a, Vec3& b, Vec3& c, float wa, float wb, float wc, float compliance, float h, float& lambda) {
  const Vec3 da = a - b, dc = c - b;
  const float la2 = length2(da), lc2 = length2(dc);
  if (la2 < 1e-18f || lc2 < 1e-18f) return;
  const float inv_la = 1 / std::sqrt(la2), inv_lc = 1 / std::sqrt(lc2);
  const Vec3 u = da * inv_la, v = dc * inv_lc;
  const float cosine = std::clamp(dot(u, v), -1.0f, 1.0f);
  const float violation = cosine + 1.0f;
  if (violation < 1e-6f && lambda == 0) return;  // straight to 0.1 degree
  const Vec3 ga = (v - u * cosine) * inv_la, gc = (u - v * cosine) * inv_lc, gb = -(ga + gc);
  const float w = wa * length2(ga) + wb * length2(gb) + wc * length2(gc);
  const float alpha = compliance / (h * h);
  // Near straight the violation decreases with the square of the angle and w with it, so the step stays bounded. At 0 and at
  // 180 degrees the direction is undefined and no correction applies.
  if (w < 1e-12f * (wa + wb + wc) * inv_la * inv_lc) return;
  float d = -(violation + alpha * lambda) / (w + alpha);
  // A rigid bend (compliance 0) linearized far from straight would overshoot: at most a tenth of a segment per step.
  const float most = std::max({wa * wa * length2(ga), wb * wb * length2(gb), wc * wc * length2(gc)}) * d * d;
  const float limit2 = 0.01f * std::min(la2, lc2);
  if (most > limit2) d *= std::sqrt(limit2 / most);
  lambda += d;
  a += ga * (wa * d);
  b += gb * (wb * d);
  c += gc * (wc * d);
}

void solve_thread(const StrandModel& model, Strand& thread, ThreadScratch& s, Vec4* x, const Vec4* before,
                  const float* inv_mass, const std::vector<RigidModel>& body_model, std::vector<RigidBody>& body, float h) {
  const size_t nodes = thread.order.size();
  if (nodes < 2) return;
  const size_t pairs = nodes - 1;
  const float inv_h2 = 1.0f / (h * h);
  const float alpha_per_meter = model.stretch_compliance / model.spacing * inv_h2;

  gather_nodes(model, thread, s, x, before, inv_mass, body);
  if (model.direct) smooth_motion(s, nodes, model.inv_mass, 0.1f * model.spacing, model.gravity * (h * h), h);
  if (model.bend_sweeps > 0) {
    // Locked nodes do not move by bending: tissue and tools are far heavier than the thread.
    for (size_t color = 0; color < 3; ++color)
      for (size_t i = color, k = 0; i < nodes; i += 3, ++k) {
        s.bend.set(color, k, node(s, i), s.is_free[i] * model.inv_mass);
        s.bend.whole[color][k] = i > 0 ? s.intact[i - 1] * s.intact[i] : 0;
      }
    solve_bends(s.bend, nodes, model.bend_compliance, h, model.bend_sweeps);
    for (size_t color = 0; color < 3; ++color)
      for (size_t i = color, k = 0; i < nodes; i += 3, ++k) put_node(s, i, s.bend.at(color, k));
  }

  if (model.direct) {
    bool changed = false;
    s.slide.assign(thread.anchor.size(), {});  // within its capacity: no allocation after the largest anchor count so far
    for (int step = 0; step < kNewtonSteps || (changed && step < kContactSteps); ++step) {
      if (update_contacts(model, s, body_model, body, h)) changed = true;
      const float residual = assemble(thread, s, nodes, alpha_per_meter, h, body_model, body);
      if (step > 0 && !changed && residual < kGoodEnough) break;
      solve_with_slides(model, thread, s, pairs, h);

      // Light nodes are limited below, heavy ones are not: a long step would move a needle repeatedly for the same stretch,
      // and add energy. The whole step is therefore scaled.
      float most = 0;
      for (const uint32_t i : s.constrained) {
        const bool moves =
            s.hold_at[i] >= 0
                ? body_model[static_cast<size_t>(thread.hold[static_cast<size_t>(s.hold_at[i])].body)].inv_mass > 0
                : s.w[i] > 0;
        if (moves) most = std::max(most, length(impulse_on(s, i)));
      }
      for (const NodeContact& c : s.contact)
        if (c.active && body_model[c.body].inv_mass > 0) most = std::max(most, length(impulse_on(s, c.node)));
      if (most > kMostForce * h * h) {
        const float part = kMostForce * h * h / most;
        for (size_t i = 0; i < pairs; ++i) s.step[i] *= part;
        for (SlideState& k : s.slide) k.step *= part;
      }

      // A bent stretch of light thread between heavy ends. The impulse that moves the ends would move the light nodes far
      // sideways: the linearization does not include that they settle on the straight line. Light nodes therefore
      // take a bounded step, heavy ones a full step; the next step uses the new directions.
      for (const uint32_t i : s.constrained) push_node(s, thread, i, impulse_on(s, i), body_model, body);
      push_anchors(s, thread, x, inv_mass);
      for (const uint32_t i : s.constrained)  // at the sum of all impulses
        if (s.anchor_at[i] >= 0) put_node(s, i, position_of(thread.anchor[static_cast<size_t>(s.anchor_at[i])], x));
      save_positions(s);
      move_loose_nodes(s, nodes, kLargestStep * model.spacing);
      changed = move_contacts(s, kLargestStep * model.spacing, body_model, body);
      for (size_t j = 0; j < s.slide.size(); ++j) {
        SlideState& k = s.slide[j];
        const size_t i = s.anchor_node[j];
        if (k.step == 0 || i == 0 || i >= pairs) continue;
        thread.rest[i] += k.step;
        thread.rest[i - 1] -= k.step;
        k.total += k.step;
      }
    }
  }

  sweep_distances(model, thread, s, pairs, alpha_per_meter, body_model, body);
  push_anchors(s, thread, x, inv_mass);
  update_contacts(model, s, body_model, body, h);

  for (size_t i = 0; i < nodes; ++i) set(x[thread.order[i]], node(s, i));
  for (size_t i = 0; i < pairs; ++i) thread.tension[i] = -s.lambda[i] * inv_h2;

  // Stick or slip for the next substep, from the present tensions.
  for (size_t j = 0; j < thread.anchor.size(); ++j) {
    const size_t i = s.anchor_node[j];
    if (i == 0 || i >= pairs || s.anchor_at[i] != static_cast<int32_t>(j)) continue;
    ThreadAnchor& a = thread.anchor[j];
    if (model.direct && s.slide[j].stopped) a.slipping = 0;
    a.tension_needle = thread.tension[i];
    a.tension_free = thread.tension[i - 1];
    const float difference = a.tension_needle - a.tension_free;
    const float threshold = a.threshold();
    const int wants = difference > threshold ? 1 : difference < -threshold ? -1 : 0;
    const bool whole = !thread.cut[i] && !thread.cut[i - 1];
    const bool may = whole && !a.knotted && ((wants > 0 && !a.blocked_needle) || (wants < 0 && !a.blocked_free));
    if (a.slipping == 0) a.slipping = may ? wants : 0;
    // While it slips, the difference equals the friction; it sticks when the pull falls clearly below that.
    else if (!whole || static_cast<float>(a.slipping) * difference < 0.5f * threshold) a.slipping = 0;
    else if ((a.slipping > 0 && a.blocked_needle) || (a.slipping < 0 && a.blocked_free)) a.slipping = 0;
  }
}

}  // namespace catgut
