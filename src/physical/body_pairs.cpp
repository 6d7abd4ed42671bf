// SPDX-License-Identifier: Apache-2.0
// physical/body_pairs: contacts of bodies with each other: shafts, jaws, needles. Declared in physical/body.h.
// Cones about the capsules of the outline are compared pair by pair. A contact exists before the two touch, as
// far as they may approach within the step, and is solved with all others: the impulse acts on both bodies.
#include <algorithm>
#include <cmath>

#include "physical/body_internal.h"

namespace catgut::physical {
namespace {

constexpr size_t kMaxOfPair = 6;        // contacts of two bodies
constexpr size_t kMaxPairRows = 48;     // of a step
constexpr float kJawStrength = 30;      // [N] of a jaw on a body that it closes on without gripping it
constexpr float kAlike = 0.9f;          // cosine beyond which two capsules lie along each other: contact at several places
constexpr float kSameContact = 0.985f;  // cosine of two normals of one contact
constexpr float kSamePlace = 1e-3f;     // [m]

struct Cone {
  Vec3 a, b;                         // [m] now
  Vec3 speed_a, speed_b;             // [m/s] of the jaws, in addition to the body's motion
  float radius_a = 0, radius_b = 0;  // [m]
  bool jaw = false;
};

Cone cone_of(const BodyModel& m, const Body& body, const BodiesScratch::Moving& moving, const BodyCapsule& c, float h) {
  const BodySphere &a = m.sphere[c.a], &b = m.sphere[c.b];
  const Vec3 la = local(m, a, body.opening), lb = local(m, b, body.opening);
  Cone cone{transform(body.pose, la), transform(body.pose, lb), {}, {}, std::abs(a.radius), std::abs(b.radius), a.jaw != 0};
  if (cone.jaw) {
    cone.speed_a = rotate(body.pose.q, (local(m, a, moving.opening) - la) * (1 / h));
    cone.speed_b = rotate(body.pose.q, (local(m, b, moving.opening) - lb) * (1 / h));
  }
  return cone;
}

// A tool's few capsules against the thread describe it whole; a needle's leave out the place where its own thread hangs.
const std::vector<BodyCapsule>& outline(const BodyModel& m) { return m.hinge_z > 0 ? m.thread_capsule : m.capsule; }

struct Sphere {
  Vec3 center;
  float radius = 0;
};
Sphere bound(const BodyModel& m, const Body& body) {
  Vec3 low{1e9f, 1e9f, 1e9f}, high = -low;
  for (const BodySphere& s : m.sphere) {
    const Vec3 p = local(m, s, body.opening);
    const float r = std::abs(s.radius);
    low = {std::min(low.x, p.x - r), std::min(low.y, p.y - r), std::min(low.z, p.z - r)};
    high = {std::max(high.x, p.x + r), std::max(high.y, p.y + r), std::max(high.z, p.z + r)};
  }
  return {transform(body.pose, (low + high) * 0.5f), 0.5f * length(high - low)};
}

}  // namespace

void find_pair_contacts(const BodiesModel& model, const Bodies& bodies, float h, BodiesScratch& k) {
  if (!model.pair_contact) return;
  std::array<Sphere, kMaxBodies> ball;
  std::array<float, kMaxBodies> fast{};
  const size_t n = bodies.body.size();
  for (size_t i = 0; i < n; ++i) {
    const Body& body = bodies.body[i];
    const BodiesScratch::Moving& moving = k.moving[i];
    ball[i] = bound(model.body[i], body);
    const float arm = distance(ball[i].center, moving.center) + ball[i].radius;
    fast[i] = std::max(length(moving.v) + length(moving.w) * arm, length(body.velocity) + length(body.spin) * arm);
  }
  const size_t first_row = k.row.size();
  for (uint32_t a = 0; a < n; ++a)
    for (uint32_t b = a + 1; b < n; ++b) {
      const BodyModel &ma = model.body[a], &mb = model.body[b];
      const Body &body_a = bodies.body[a], &body_b = bodies.body[b];
      const float all = model.reach + 1.5f * h * (fast[a] + fast[b]);
      if (distance(ball[a].center, ball[b].center) > ball[a].radius + ball[b].radius + all) continue;
      const auto holds = [](const Body& tool, uint32_t other) {
        return tool.grip.what == Gripped::needle && tool.grip.body == other;
      };
      const bool a_holds = holds(body_a, b), b_holds = holds(body_b, a);
      const size_t first_of_pair = k.row.size();
      for (uint32_t ia = 0; ia < outline(ma).size(); ++ia) {
        const Cone ca = cone_of(ma, body_a, k.moving[a], outline(ma)[ia], h);
        if (a_holds && ca.jaw) continue;
        const Vec3 middle = (ca.a + ca.b) * 0.5f;
        const float around = 0.5f * distance(ca.a, ca.b) + std::max(ca.radius_a, ca.radius_b);
        if (distance(middle, ball[b].center) > around + ball[b].radius + all) continue;
        for (uint32_t ib = 0; ib < outline(mb).size(); ++ib) {
          const Cone cb = cone_of(mb, body_b, k.moving[b], outline(mb)[ib], h);
          if (b_holds && cb.jaw) continue;
          const Vec3 to = (cb.a + cb.b) * 0.5f;
          if (distance(middle, to) > around + 0.5f * distance(cb.a, cb.b) + std::max(cb.radius_a, cb.radius_b) + all) continue;
          const auto add = [&](float s, float t, uint32_t which) {
            const Vec3 pa = lerp(ca.a, ca.b, s), pb = lerp(cb.a, cb.b, t), off = pa - pb;
            const float ra = ca.radius_a + (ca.radius_b - ca.radius_a) * s, rb = cb.radius_a + (cb.radius_b - cb.radius_a) * t;
            float far = length(off);
            const uint64_t key = key_of(5, a, ia, b << 12 | ib << 4 | which);
            const RowMemory* memory = remembered(bodies, key);
            Vec3 axis = far > 1e-6f ? off / far : normalized(cross(ca.b - ca.a, cb.b - cb.a), {0, 1, 0});
            // Axes that were pressed together have not changed sides.
            if (memory && dot(memory->impulse, memory->axis) > 0 && dot(memory->axis, axis) < -0.3f) axis = -axis, far = -far;
            const float gap = far - ra - rb;
            const Vec3 arm_a = pa - axis * ra - k.moving[a].center, arm_b = pb + axis * rb - k.moving[b].center;
            const Vec3 speed = lerp(ca.speed_a, ca.speed_b, s) - lerp(cb.speed_a, cb.speed_b, t);
            const Vec3 now = body_a.velocity + cross(body_a.spin, arm_a) - body_b.velocity - cross(body_b.spin, arm_b) + speed;
            const Vec3 next = point_speed(k.moving[a], arm_a) - point_speed(k.moving[b], arm_b) + speed;
            const auto nearing = [&](Vec3 v) { return 1.5f * std::max(0.0f, -dot(v, axis)) + 0.3f * length(v); };
            if (gap > model.reach + h * std::max(nearing(now), nearing(next))) return;
            // Neighbors touch at one place: the deepest of them counts. Of a pair of bodies, the nearest few.
            size_t same = k.row.size(), farthest = first_of_pair;
            for (size_t i = first_of_pair; i < k.row.size(); ++i) {
              if (k.row[i].gap > k.row[farthest].gap) farthest = i;
              if (dot(k.row[i].axis, axis) > kSameContact && length(k.row[i].ra - arm_a) < kSamePlace) same = i;
            }
            if (same == k.row.size() && same - first_of_pair >= kMaxOfPair) same = farthest;
            const bool replaces = same < k.row.size();
            if (replaces && k.row[same].gap <= gap) return;
            if (!replaces && k.row.size() - first_row >= kMaxPairRows) {
              ++k.overflow;
              return;
            }
            Row row;
            row.key = key, row.a = a, row.b = b, row.ra = arm_a, row.rb = arm_b, row.axis = axis, row.gap = gap;
            row.speed = speed, row.friction = model.pair_friction;
            if (ca.jaw || cb.jaw) row.along_limit = kJawStrength * h;
            if (memory) {
              const float press = std::max(0.0f, dot(memory->impulse, memory->axis));
              row.impulse = axis * press + across(across(memory->impulse, memory->axis), axis);
            }
            if (replaces) k.row[same] = row;
            else k.row.push_back(row);
          };
          float s = 0, t = 0;
          nearest_of_segments(ca.a, ca.b, cb.a, cb.b, s, t);
          add(s, t, 0);
          // Along each other they touch over a length: at its ends.
          if (std::abs(dot(normalized(ca.b - ca.a), normalized(cb.b - cb.a))) < kAlike) continue;
          add(0, nearest_along(cb.a, cb.b, ca.a), 1), add(1, nearest_along(cb.a, cb.b, ca.b), 2);
          add(nearest_along(ca.a, ca.b, cb.a), 0, 3), add(nearest_along(ca.a, ca.b, cb.b), 1, 4);
        }
      }
    }
}

void find_drape_contacts(const BodiesModel& model, const Bodies& bodies, const thread::Plane& drape, float h,
                         BodiesScratch& k) {
  for (uint32_t b = 0; b < bodies.body.size(); ++b) {
    const BodyModel& m = model.body[b];
    if (!k.moving[b].loose || k.moving[b].held) continue;
    for (uint32_t i = 0; i < m.sphere.size(); ++i) {
      const Vec3 at = transform(bodies.body[b].pose, m.sphere[i].at);
      const float radius = std::abs(m.sphere[i].radius), gap = dot(drape.normal, at) - drape.offset - radius;
      const Vec3 arm = at - drape.normal * radius - k.moving[b].center;
      if (gap > model.reach - 1.5f * h * std::min(0.0f, dot(drape.normal, point_speed(k.moving[b], arm)))) continue;
      if (k.row.size() >= kMaxRows) {
        ++k.overflow;
        return;
      }
      Row row;
      row.key = key_of(kDrapeRow, b, i, 0), row.a = b, row.ra = arm, row.axis = drape.normal, row.gap = gap;
      row.friction = drape.friction;
      if (const RowMemory* memory = remembered(bodies, row.key)) row.impulse = memory->impulse;
      k.row.push_back(row);
    }
  }
}

}  // namespace catgut::physical
