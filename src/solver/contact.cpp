// SPDX-License-Identifier: Apache-2.0
// solver/contact: reads candidates, moves particles and bodies. See the header.
#include "solver/contact.h"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace catgut {
namespace {

constexpr float kNear = 0.001f;               // [m] maximum motion of a node by the thread's solve in one step
constexpr float kLargestCorrection = 0.001f;  // [m] per contact and sweep: deep overlap is resolved over several substeps
constexpr float kUndoneTools = 0.0001f;       // [m] of earlier tool overlap resolved per substep
constexpr float kSameAxis = 0.00001f;         // [m] between axes: below this no side is defined

// The part of the relative slip `slip` that friction undoes, given the normal correction.
Vec3 friction_step(Vec3 slip, Vec3 n, float normal, float friction) {
  const Vec3 t = slip - n * dot(slip, n);
  const float l = length(t), most = friction * normal;
  if (l < 1e-12f) return {};
  return l <= most ? t : t * (most / l);
}

Vec3 moved(const ContactView& v, uint32_t i) { return xyz(v.x[i]) - xyz(v.prev[i]); }

// Effective inverse masses of the two ends of a thread segment: locked ends do not move here.
struct Segment {
  uint32_t s0, s1;
  float w0, w1;
};
bool segment_after(const ContactView& v, uint32_t strand, uint32_t slot, Segment& out) {
  const Strand& thread = v.strand[strand];
  const float inv_mass = v.strand_model[strand].inv_mass;
  const int32_t node = v.node_of_slot[slot - v.first_slot];
  if (node < 0 || static_cast<size_t>(node) + 1 >= thread.order.size()) return false;
  if (thread.cut[static_cast<size_t>(node)]) return false;  // cut since the candidates were found: no segment
  out.s0 = slot;
  out.s1 = thread.order[static_cast<size_t>(node) + 1];
  out.w0 = v.locked[out.s0 - v.first_slot] ? 0 : inv_mass;
  out.w1 = v.locked[out.s1 - v.first_slot] ? 0 : inv_mass;
  return true;
}
// [m] height up to which a segment lies on the drape. The direct solve handles tool contact above it.
float drape_height(const StrandModel& m, float ground) { return m.direct ? ground + 3 * m.radius : 1e9f; }

}  // namespace

uint32_t solve_tissue_pairs(const ContactView& v, const TissueCollision& tissue, const std::vector<PairCandidate>& list,
                            float friction) {
  uint32_t touching = 0;
  const float* const radius = tissue.radius.data();
  const Vec4* const x = v.x;
  for (const PairCandidate& c : list) {  // nine in ten do not touch
    const Four gap = load(x[c.b]) - load(x[c.a]), square = gap * gap;
    const float reach = radius[c.a] + radius[c.b], l2 = square[0] + square[1] + square[2];
    if (l2 >= reach * reach) continue;
    const Vec3 d{gap[0], gap[1], gap[2]};
    const float wa = v.inv_mass[c.a], wb = v.inv_mass[c.b], w = wa + wb;
    if (w == 0 || l2 < 1e-16f) continue;
    ++touching;
    const float l = std::sqrt(l2), depth = std::min(reach - l, kLargestCorrection);
    const Vec3 n = d / l;
    const Vec3 step = (n * depth - friction_step(moved(v, c.b) - moved(v, c.a), n, depth, friction)) / w;
    // Stored as whole vectors because they are loaded again soon: gathering recently stored parts stalls the processor.
    store(v.x[c.a], load(x[c.a]) + Four{step.x, step.y, step.z, 0} * -wa);
    store(v.x[c.b], load(x[c.b]) + Four{step.x, step.y, step.z, 0} * wb);
  }
  return touching;
}

uint32_t solve_tools_on_tissue(const ContactView& v, const TissueCollision& tissue, const std::vector<ToolCandidate>& list,
                               float friction) {
  uint32_t touching = 0;
  for (const ToolCandidate& c : list) {
    RigidBody& b = (*v.body)[c.body];
    const RigidModel& m = (*v.model)[c.body];
    const Capsule& capsule = m.capsule[c.capsule];
    const Vec3 p = transform(b.pose(), capsule.a), q = transform(b.pose(), capsule.b), axis = q - p, at = xyz(v.x[c.particle]);
    const float t = closest_on_segment(at, p, q);
    const Vec3 on = p + axis * t, d = at - on;
    const float reach = capsule.radius + tissue.tool_radius, l2 = length2(d);
    if (l2 >= reach * reach || l2 < 1e-16f) continue;
    ++touching;
    const float l = std::sqrt(l2), depth = std::min(reach - l, kLargestCorrection);
    const Vec3 n = d / l, r = on - b.x;
    const float wp = v.inv_mass[c.particle], w = wp + inverse_mass_at(m, b, r, n);
    if (w <= 0) continue;
    const Vec3 slip = moved(v, c.particle) - (on - previous_point(b, r));
    const Vec3 rub = friction_step(slip, n, depth, friction);
    const Vec3 impulse = (n * depth - rub) / w;
    add(v.x[c.particle], impulse * wp);
    push(m, b, -impulse, r);
    BodyContact& felt = (*v.on_body)[c.body];
    felt.linear -= impulse;
    felt.angular -= cross(r, impulse);
    felt.pressing -= n * (depth / w);
    felt.rubbing += rub / w;
    felt.pressed += depth / w;
  }
  return touching;
}

namespace {

// Separates points s and t (0..1) of the axes; returns whether they touch.
bool hold_apart(const ContactView& v, const ToolPair& pair, float s, float t, float friction, float most_press,
                ToolPair::Impulse& done) {
  RigidBody &a = (*v.body)[pair.a], &b = (*v.body)[pair.b];
  const RigidModel &ma = (*v.model)[pair.a], &mb = (*v.model)[pair.b];
  const Capsule &ca = ma.capsule[pair.capsule_a], &cb = mb.capsule[pair.capsule_b];
  const Vec3 on_a = transform(a.pose(), lerp(ca.a, ca.b, s)), on_b = transform(b.pose(), lerp(cb.a, cb.b, t)), d = on_b - on_a;
  const float reach = ca.radius + cb.radius, l2 = length2(d);
  if (l2 >= reach * reach && done.normal == 0) return false;
  const Vec3 before = previous_point(b, on_b - b.x) - previous_point(a, on_a - a.x);
  const float l = std::sqrt(l2);
  Vec3 n = d / std::max(l, 1e-12f);
  float gap = l - reach;
  if (l < kSameAxis) {  // any direction works if all points of the pair use the same one
    const Vec3 axis = normalized(rotate(a.q, ca.b - ca.a), {0, 0, 1});
    n = normalized(cross(axis, rotate(b.q, cb.b - cb.a)), any_perpendicular(axis));
  } else if (dot(d, before) < 0 && length2(before) > 0.25f * reach * reach) {
    n = -n, gap = -l - reach;  // passed through each other within the substep: move back
  }
  const float goal = std::min(0.0f, length(before) - reach + kUndoneTools);
  // One common point on both surfaces: otherwise friction would create a torque.
  const Vec3 at = on_a + n * (ca.radius + 0.5f * gap), ra = at - a.x, rb = at - b.x;
  const float w = inverse_mass_at(ma, a, ra, n) + inverse_mass_at(mb, b, rb, n);
  if (w <= 0) return false;
  float room = most_press;  // left over by the other points
  for (const ToolPair::Impulse& place : pair.done) room -= place.normal;
  const float press = std::max(std::min((goal - gap) / w, std::max(0.0f, room)), -done.normal);
  done.normal += press;
  const Vec3 slip = previous_point(a, ra) - previous_point(b, rb), across = slip - n * dot(slip, n);
  Vec3 rub = done.rub - n * dot(done.rub, n);
  if (const float far = length(across); far > 1e-12f) {
    const Vec3 way = across / far;
    rub -= across / (inverse_mass_at(ma, a, ra, way) + inverse_mass_at(mb, b, rb, way));
  }
  const float most = friction * done.normal, rubs = length(rub);
  if (rubs > most) rub *= most / rubs;
  const Vec3 rub_more = rub - done.rub, impulse = n * press + rub_more;
  done.rub = rub;
  push(ma, a, -impulse, ra);
  push(mb, b, impulse, rb);
  BodyContact &felt_a = (*v.on_body)[pair.a], &felt_b = (*v.on_body)[pair.b];
  felt_a.linear -= impulse, felt_b.linear += impulse;
  felt_a.angular -= cross(ra, impulse), felt_b.angular += cross(rb, impulse);
  felt_a.pressing -= n * press, felt_b.pressing += n * press;
  felt_a.rubbing -= rub_more, felt_b.rubbing += rub_more;
  felt_a.pressed += press, felt_b.pressed += press;
  felt_a.by_tool += press, felt_b.by_tool += press;
  return done.normal > 0;
}

}  // namespace

uint32_t solve_tools_on_tools(const ContactView& v, std::vector<ToolPair>& list, float friction, float most_press) {
  uint32_t touching = 0;
  for (ToolPair& pair : list) {
    const RigidBody &a = (*v.body)[pair.a], &b = (*v.body)[pair.b];
    const Capsule &ca = (*v.model)[pair.a].capsule[pair.capsule_a], &cb = (*v.model)[pair.b].capsule[pair.capsule_b];
    const auto ends = [](const RigidBody& body, const Capsule& c) {
      return std::pair{transform(body.pose(), c.a), transform(body.pose(), c.b)};
    };
    auto [a0, a1] = ends(a, ca);
    auto [b0, b1] = ends(b, cb);
    const auto [s, t] = closest_on_segments(a0, a1, b0, b1);
    const float reach = ca.radius + cb.radius;
    const bool near = length2(lerp(b0, b1, t) - lerp(a0, a1, s)) < reach * reach;
    if (!near && std::none_of(pair.done.begin(), pair.done.end(), [](const auto& d) { return d.normal > 0; })) continue;
    uint32_t places = 0;
    if ((s > 0 && s < 1 && t > 0 && t < 1) || pair.done[0].normal > 0)
      places += hold_apart(v, pair, s, t, friction, most_press, pair.done[0]);
    for (size_t end = 0; end < 4; ++end) {
      // Each point sees the motion of the ones before it.
      std::tie(a0, a1) = ends(a, ca), std::tie(b0, b1) = ends(b, cb);
      const bool of_a = end < 2;
      const float here = end % 2 == 0 ? 0.0f : 1.0f;
      const Vec3 point = of_a ? lerp(a0, a1, here) : lerp(b0, b1, here);
      const float there = of_a ? closest_on_segment(point, b0, b1) : closest_on_segment(point, a0, a1);
      places += hold_apart(v, pair, of_a ? here : there, of_a ? there : here, friction, most_press, pair.done[1 + end]);
    }
    touching += places > 0;
  }
  return touching;
}

uint32_t solve_thread_on_tools(const ContactView& v, const std::vector<ThreadToolCandidate>& list, float friction,
                               float ground) {
  uint32_t touching = 0;
  for (const ThreadToolCandidate& c : list) {
    Segment s;
    if (!segment_after(v, c.strand, c.slot, s) || s.w0 + s.w1 == 0) continue;
    RigidBody& b = (*v.body)[c.body];
    const RigidModel& m = (*v.model)[c.body];
    const Capsule& capsule = m.capsule[c.capsule];
    const Vec3 p = transform(b.pose(), capsule.a), q = transform(b.pose(), capsule.b);
    const Vec3 x0 = xyz(v.x[s.s0]), x1 = xyz(v.x[s.s1]);
    if (std::min(x0.y, x1.y) > drape_height(v.strand_model[c.strand], ground)) continue;
    const auto [ts, tt] = closest_on_segments(x0, x1, p, q);
    const Vec3 on = lerp(p, q, tt), d = lerp(x0, x1, ts) - on;
    const float reach = capsule.radius + v.strand_model[c.strand].radius, l2 = length2(d);
    if (l2 >= reach * reach || l2 < 1e-16f) continue;
    const float a0 = 1 - ts, a1 = ts, wt = s.w0 * a0 * a0 + s.w1 * a1 * a1;
    const float l = std::sqrt(l2), depth = std::min(reach - l, kLargestCorrection);
    const Vec3 n = d / l, r = on - b.x;
    const float w = wt + inverse_mass_at(m, b, r, n);
    if (wt <= 0) continue;
    ++touching;
    const Vec3 slip = moved(v, s.s0) * a0 + moved(v, s.s1) * a1 - (on - previous_point(b, r));
    const Vec3 impulse = (n * depth - friction_step(slip, n, depth, friction)) / w;
    add(v.x[s.s0], impulse * (s.w0 * a0));
    add(v.x[s.s1], impulse * (s.w1 * a1));
    push(m, b, -impulse, r);
    (*v.on_body)[c.body].linear -= impulse;
    (*v.on_body)[c.body].angular -= cross(r, impulse);
  }
  return touching;
}

void find_thread_touch(const ContactView& v, const std::vector<ThreadToolCandidate>& list, float ground,
                       std::vector<ThreadScratch>& scratch) {
  for (const ThreadToolCandidate& c : list) {
    Segment s;
    const StrandModel& model = v.strand_model[c.strand];
    if (!model.direct || !segment_after(v, c.strand, c.slot, s) || s.w0 + s.w1 == 0) continue;
    const Vec3 x0 = xyz(v.x[s.s0]), x1 = xyz(v.x[s.s1]);
    if (std::min(x0.y, x1.y) <= drape_height(model, ground)) continue;
    const Capsule& capsule = (*v.model)[c.body].capsule[c.capsule];
    const Pose pose = (*v.body)[c.body].pose();
    const Vec3 p = transform(pose, capsule.a), q = transform(pose, capsule.b);
    const auto [ts, tt] = closest_on_segments(x0, x1, p, q);
    const float reach = capsule.radius + model.radius + kNear;
    if (length2(lerp(x0, x1, ts) - lerp(p, q, tt)) > reach * reach) continue;
    scratch[c.strand].touch.push_back({static_cast<uint32_t>(v.node_of_slot[c.slot - v.first_slot]), c.body, c.capsule});
  }
}

uint32_t solve_thread_on_tissue(const ContactView& v, const TissueCollision& tissue,
                                const std::vector<ThreadTissueCandidate>& list, float friction) {
  uint32_t touching = 0;
  for (const ThreadTissueCandidate& c : list) {
    if (v.locked[c.slot - v.first_slot]) continue;
    const StrandModel& model = v.strand_model[c.strand];
    const Triangle& t = tissue.surface[c.triangle];
    const Vec3 a = xyz(v.x[t[0]]), b = xyz(v.x[t[1]]), e = xyz(v.x[t[2]]), p = xyz(v.x[c.slot]);
    const Vec3 n = normalized(cross(b - a, e - a));
    // Further beside the triangle's plane than the wall is thick: the thread is on another side; skip.
    const float gap = dot(p - a, n) - model.radius;
    if (gap >= 0 || gap < -0.002f) continue;
    const ClosestOnTriangle near = closest_on_triangle(p, a, b, e);
    if (length2(p - n * (gap + model.radius) - near.point) > 1e-6f) continue;  // more than 1 mm off the triangle
    const float wt = model.inv_mass;
    float w = wt;
    for (int k = 0; k < 3; ++k)
      w += near.weight[static_cast<size_t>(k)] * near.weight[static_cast<size_t>(k)] * v.inv_mass[t[static_cast<size_t>(k)]];
    ++touching;
    Vec3 slip = moved(v, c.slot);
    for (size_t k = 0; k < 3; ++k) slip -= moved(v, t[k]) * near.weight[k];
    const float depth = std::min(-gap, kLargestCorrection);
    const Vec3 impulse = (n * depth - friction_step(slip, n, depth, friction)) / w;
    add(v.x[c.slot], impulse * wt);
    for (size_t k = 0; k < 3; ++k) add(v.x[t[k]], impulse * (-v.inv_mass[t[k]] * near.weight[k]));
  }
  return touching;
}

uint32_t solve_thread_on_thread(const ContactView& v, const std::vector<ThreadPairCandidate>& list, float friction) {
  uint32_t touching = 0;
  for (const ThreadPairCandidate& c : list) {
    Segment a, b;
    if (!segment_after(v, c.strand_a, c.a, a) || !segment_after(v, c.strand_b, c.b, b)) continue;
    const Vec3 a0 = xyz(v.x[a.s0]), a1 = xyz(v.x[a.s1]), b0 = xyz(v.x[b.s0]), b1 = xyz(v.x[b.s1]);
    const auto [s, t] = closest_on_segments(a0, a1, b0, b1);
    const Vec3 d = lerp(b0, b1, t) - lerp(a0, a1, s);
    const float reach = v.strand_model[c.strand_a].radius + v.strand_model[c.strand_b].radius, l2 = length2(d);
    if (l2 >= reach * reach || l2 < 1e-16f) continue;
    const float w = a.w0 * (1 - s) * (1 - s) + a.w1 * s * s + b.w0 * (1 - t) * (1 - t) + b.w1 * t * t;
    if (w <= 0) continue;
    ++touching;
    const float l = std::sqrt(l2), depth = reach - l;
    const Vec3 n = d / l;
    const Vec3 slip = moved(v, b.s0) * (1 - t) + moved(v, b.s1) * t - moved(v, a.s0) * (1 - s) - moved(v, a.s1) * s;
    const Vec3 impulse = (n * depth - friction_step(slip, n, depth, friction)) / w;
    add(v.x[a.s0], impulse * (-a.w0 * (1 - s)));
    add(v.x[a.s1], impulse * (-a.w1 * s));
    add(v.x[b.s0], impulse * (b.w0 * (1 - t)));
    add(v.x[b.s1], impulse * (b.w1 * t));
  }
  return touching;
}

uint32_t solve_ground(const ContactView& v, const std::vector<Vec3>& body_force, float ground, float friction) {
  uint32_t touching = 0;
  const Vec3 n{0, 1, 0};
  for (const StrandModel& model : v.strand_model)
    for (uint32_t slot = model.first_slot; slot < model.first_slot + model.count; ++slot) {
      const float depth = ground + model.radius - v.x[slot].y;
      if (depth <= 0 || v.locked[slot - v.first_slot]) continue;
      ++touching;
      add(v.x[slot], n * depth - friction_step(moved(v, slot), n, depth, friction));
    }
  // Bodies without a hand: a needle's arc of capsules is supported at one end each, parked instruments at both.
  for (size_t k = 0; k < v.body->size(); ++k) {
    RigidBody& b = (*v.body)[k];
    const RigidModel& m = (*v.model)[k];
    const bool falls = length2(body_force[k]) > 0;
    if (!m.gravity && !falls) continue;
    for (size_t end = 0; end < (falls ? 2 : 1) * m.capsule.size(); ++end) {
      const Capsule& capsule = m.capsule[end % m.capsule.size()];
      const Vec3 at = transform(b.pose(), end < m.capsule.size() ? capsule.a : capsule.b);
      const float depth = ground + capsule.radius - at.y;
      if (depth <= 0) continue;
      ++touching;
      const Vec3 r = at - b.x;
      const float w = inverse_mass_at(m, b, r, n);
      push(m, b, (n * depth - friction_step(at - previous_point(b, r), n, depth, friction)) / w, r);
    }
  }
  return touching;
}

}  // namespace catgut
