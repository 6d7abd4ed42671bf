// SPDX-License-Identifier: Apache-2.0
// physical/body: see the header.
#include "physical/body.h"

#include <algorithm>
#include <cmath>

#include "physical/body_internal.h"
#include "wall/cut.h"

namespace catgut::physical {
namespace {

// Columns of an element at their present places.
struct Corners {
  std::array<uint32_t, 4> column{};
  uint32_t count = 4;
};
Corners corners_of(const wall::Model& m, const wall::Topology& t, uint32_t face) {
  const uint32_t lane = wall::lane_of_element(m, t, face), block = lane / wall::kLanesOfBlock, in = lane % wall::kLanesOfBlock;
  Corners c;
  for (size_t k = 0; k < 4; ++k) c.column[k] = t.corners[block].column[k][in];
  c.count = t.corners[block].quads ? 4 : 3;
  return c;
}

}  // namespace

void add_capsule(BodyModel& m, Vec3 a, Vec3 b, float ra, float rb, int8_t jaw, float spacing) {
  const int parts = std::max(1, static_cast<int>(std::ceil(distance(a, b) / spacing)));
  const uint32_t first = static_cast<uint32_t>(m.sphere.size());
  for (int i = 0; i <= parts; ++i) {
    const float t = static_cast<float>(i) / static_cast<float>(parts);
    m.sphere.push_back({lerp(a, b, t), ra + (rb - ra) * t, jaw});
    if (i > 0) m.capsule.push_back({first + static_cast<uint32_t>(i) - 1, first + static_cast<uint32_t>(i)});
  }
  // A cone as up to four cylinders within it: closed jaws leave the plane between them free.
  const int chunks = ra == rb ? 1 : std::min(4, parts);
  for (int i = 0; i < chunks; ++i)
    m.thread_capsule.push_back(
        {first + static_cast<uint32_t>(parts * i / chunks), first + static_cast<uint32_t>(parts * (i + 1) / chunks)});
}

wall::Weights load_point(wall::Weights w, const wall::Motion& motion, Vec3 direction) {
  wall::Weights up = w, mid = w;
  up.zeta = 1, mid.zeta = 0;
  const float along = dot(normalized(wall::place(up, motion) - wall::place(mid, motion)), direction);
  w.zeta *= std::max(0.0f, 1 - along * along);
  return w;
}

BodyModel make_tool(const ToolShape& t) {
  BodyModel m;
  m.hinge_z = t.jaw_reach, m.mass = t.mass;
  m.inertia = t.mass * 0.02f * 0.02f;
  const float tip = -0.5f * m.jaw_length;
  for (const int8_t jaw : {int8_t{-1}, int8_t{1}}) {
    const float side = static_cast<float>(jaw);
    add_capsule(m, {side * t.tip_radius, 0, tip}, {side * t.hinge_radius, 0, t.jaw_reach}, t.tip_radius, t.hinge_radius, jaw,
                1.8e-3f);
  }
  add_capsule(m, {0, 0, t.jaw_reach}, {0, 0, t.length}, t.shaft_radius, t.shaft_radius, 0, 3e-3f);
  m.center = {0, 0, 0.06f};
  return m;
}

Vec3 local(const BodyModel& m, const BodySphere& s, float opening) {
  if (s.jaw == 0 || opening == 0) return s.at;
  const float angle = -static_cast<float>(s.jaw) * opening, c = portable::cos(angle), d = portable::sin(angle);
  const float z = s.at.z - m.hinge_z;
  return {c * s.at.x + d * z, s.at.y, m.hinge_z - d * s.at.x + c * z};
}

void place_body(const BodyModel& m, Body& b, const Pose& pose, float opening) {
  b = {};
  b.pose = b.shown = pose, b.opening = b.shown_opening = opening;
  b.target_place = transform(pose, m.center), b.target_turn = pose.q;
}

void BodiesScratch::reserve(const wall::Model& wm, const wall::State& ws) {
  const size_t faces = wm.lane_of_face.size() + wall::max_fragments(wm);
  inverse = wall::Inverse(wall::columns(ws));
  inverse.need(ws.topology, {});
  row.reserve(kMaxRows), points.reserve(kMaxRows), wall_row.reserve(kMaxRows), w.reserve(kMaxRows * kMaxRows);
  for (auto* list : {&speed, &change, &before, &onward}) list->reserve(kMaxRows);
  ball.reserve(faces);
  near_run.reserve(faces);
  around.resize(kMaxBodies);
  constexpr size_t kMaxSpheres = 192;
  for (Around& a : around) {
    a.in_body.reserve(kMaxSpheres), a.at_here.reserve(kMaxSpheres), a.run.reserve(kMaxSpheres / kRun);
    a.face.reserve(faces), a.run_face.reserve(4 * faces), a.run_rim.reserve(2 * faces);
  }
  moving.reserve(64), tool.reserve(kMaxThreadCapsules), tool_body.reserve(kMaxThreadCapsules);
  loose.reserve(kMaxBodies), loose_body.reserve(kMaxBodies);
  hold.reserve(64), hold_body.reserve(64), hold_at.reserve(64);
}

const BodiesScratch::Ball& ball_of(const wall::Model& wm, const wall::State& ws, BodiesScratch& k, uint32_t face) {
  BodiesScratch::Ball& ball = k.ball[face];
  if (ball.step == k.ball_step) return ball;
  const Corners c = corners_of(wm, ws.topology, face);
  const float part = 1.0f / static_cast<float>(c.count);
  ball.center = {}, ball.step = k.ball_step;
  for (uint32_t i = 0; i < c.count; ++i) ball.center += wall::vec3(ws.motion.x[2 * c.column[i]]) * part;
  float radius2 = 0, half2 = 0;
  for (uint32_t i = 0; i < c.count; ++i) {
    radius2 = std::max(radius2, length2(wall::vec3(ws.motion.x[2 * c.column[i]]) - ball.center));
    half2 = std::max(half2, length2(wall::vec3(ws.motion.x[2 * c.column[i] + 1])));
  }
  ball.radius = 1.001f * (std::sqrt(radius2) + std::sqrt(half2));
  return ball;
}

namespace {

// Spheres of a body where it is now, with the box and the balls about them.
void place_spheres(const BodyModel& m, const Body& body, BodiesScratch::Around& a) {
  const size_t n = m.sphere.size();
  a.pose = body.pose, a.opening = body.opening, a.low_here = Vec3{1e9f, 1e9f, 1e9f}, a.high_here = -a.low_here;
  a.in_body.resize(n), a.at_here.resize(n), a.run.resize((n + kRun - 1) / kRun);
  for (size_t i = 0; i < n; ++i) {
    const BodySphere& s = m.sphere[i];
    a.in_body[i] = local(m, s, body.opening);
    const Vec3 p = a.at_here[i] = transform(body.pose, a.in_body[i]);
    Vec3 &l = a.low_here, &u = a.high_here;
    l = {std::min(l.x, p.x - s.radius), std::min(l.y, p.y - s.radius), std::min(l.z, p.z - s.radius)};
    u = {std::max(u.x, p.x + s.radius), std::max(u.y, p.y + s.radius), std::max(u.z, p.z + s.radius)};
  }
  a.farthest = a.lever = 0;
  for (size_t i = 0; i < n; ++i) {
    a.farthest = std::max(a.farthest, distance(a.in_body[i], m.center) + m.sphere[i].radius);
    if (m.sphere[i].jaw != 0) a.lever = std::max(a.lever, distance(m.sphere[i].at, {0, 0, m.hinge_z}));
  }
  for (size_t r = 0; r < a.run.size(); ++r) {
    BodiesScratch::Run& run = a.run[r];
    // One sphere more: the capsule that goes to it is of this run.
    const size_t first = r * kRun, end = std::min(n, first + kRun + 1);
    run.center_here = {}, run.radius_here = 0;
    for (size_t i = first; i < end; ++i) run.center_here += a.at_here[i] / static_cast<float>(end - first);
    for (size_t i = first; i < end; ++i)
      run.radius_here = std::max(run.radius_here, distance(a.at_here[i], run.center_here) + m.sphere[i].radius);
  }
}

// The elements within `reach` [m] of a body, and of each of its runs.
void list_faces(const wall::Model& wm, const wall::State& ws, const Surface& surface, float reach, BodiesScratch::Around& a,
                BodiesScratch& k) {
  a.face.clear(), a.run_face.clear(), a.run_rim.clear();
  const uint32_t faces = static_cast<uint32_t>(k.ball.size());
  for (uint32_t f = 0; f < faces; ++f) {
    const BodiesScratch::Ball& ball = ball_of(wm, ws, k, f);
    const Vec3 c = ball.center, l = a.low_here, u = a.high_here;
    const float r = ball.radius + reach;
    if (c.x > l.x - r && c.y > l.y - r && c.z > l.z - r && c.x < u.x + r && c.y < u.y + r && c.z < u.z + r) a.face.push_back(f);
  }
  for (BodiesScratch::Run& run : a.run) {
    run.center = run.center_here, run.radius = run.radius_here;
    run.face_first = static_cast<uint32_t>(a.run_face.size()), run.rim_first = static_cast<uint32_t>(a.run_rim.size());
    for (uint32_t f = 0; f < faces; ++f) {
      const float r = k.ball[f].radius + run.radius + reach;
      if (length2(k.ball[f].center - run.center) > r * r) continue;
      a.run_face.push_back(f);
      const uint32_t first = surface.first_of_face[f], end = surface.first_of_face[f + 1];
      if (first < end && surface.patch[end - 1].side == 0) a.run_rim.push_back(f);
    }
    run.face_end = static_cast<uint32_t>(a.run_face.size()), run.rim_end = static_cast<uint32_t>(a.run_rim.size());
  }
}

}  // namespace

void find_body_contacts(const BodiesModel& model, const wall::Model& wm, const wall::State& ws, const Surface& surface,
                        Bodies& bodies, float h, SurfaceSearch& search, BodiesScratch& k) {
  const uint32_t faces = wall::elements(wm, ws.topology);
  k.ball.resize(faces), k.around.resize(kMaxBodies), ++k.ball_step;
  if (search.box.size() < faces) search.box.resize(faces);
  if (search.part.size() < surface.patch.size()) search.part.resize(surface.patch.size());
  // A box that is made here is not for later searches of the step: the wall's speed in it is that before the forces.
  const auto box_here = [&](uint32_t f) -> const FaceBox& {
    constexpr uint32_t kHere = 1u << 31;
    if (search.box[f].step != (search.step | kHere) && search.box[f].step != search.step)
      box_of(wm, ws, search, f), search.box[f].step = search.step | kHere;
    return search.box[f];
  };
  // A wall gives in its thickness, which the solve does not know: jaws that close on it from both sides would need any force,
  // and so would jaws that open between walls.
  constexpr float kInner = 0.3f;  // of a contact's normal, along the way in which the jaw opens: on its inner side
  // Between closed jaws the wall is thinner than it is there. When they let go, it would have to leave both at once, with 40 N:
  // until they have opened as far, they press it with no more than this.
  constexpr float kParting = 0.2f;     // [N] of each contact
  constexpr float kInside = 0.05e-3f;  // [m]
  constexpr float kAhead = 4e-3f;      // [m] by which lists of elements reach beyond what a step needs
  const float wall_speed = 1.0f;       // [m/s] of the wall, for the search alone
  constexpr float kThrown = 0.8f;      // [m/s] of a loose needle that a tool or thread may throw in this step
  for (uint32_t b = 0; b < bodies.body.size(); ++b) {
    const BodyModel& m = model.body[b];
    Body& body = bodies.body[b];
    const BodiesScratch::Moving& moving = k.moving[b];
    const uint64_t before = body.skip;
    const bool has_jaws = m.hinge_z > 0;
    if (has_jaws) body.skip = 0;
    BodiesScratch::Around& a = k.around[b];
    if (!a.made || !(a.pose == body.pose) || a.opening != body.opening) place_spheres(m, body, a);
    const float fast = std::max(length(moving.v), length(body.velocity));
    const float most = model.reach + 2 * h * (fast + wall_speed);  // of a list
    // What `add` below may use in this step, at most.
    const float any_point =
        std::max(length(moving.v) + length(moving.w) * a.farthest, length(body.velocity) + length(body.spin) * a.farthest) +
        std::abs(moving.opening - body.opening) * a.lever / h + search.speed;
    const float margin = std::min(most, model.reach + 1.01f * h * std::max(1.8f * any_point, kThrown));
    float nearer = 0;  // [m]
    for (const BodiesScratch::Run& run : a.run)
      nearer = std::max(nearer, distance(run.center_here, run.center) + run.radius_here - run.radius);
    if (!a.made || a.version != ws.topology.version ||
        nearer + most - a.margin + 5 * static_cast<float>(search.moved - a.moved) > kAhead) {
      a.margin = most, a.moved = search.moved, a.version = ws.topology.version, a.made = true;
      list_faces(wm, ws, surface, most + kAhead, a, k);
    }
    for (size_t i = 0; m.falls && i < a.face.size(); ++i)
      ball_of(wm, ws, k, a.face[i]);  // for `locate`, at the end of the step
    const Grip& grip = body.grip;
    const bool holds_tissue = grip.what == Gripped::tissue;
    const Vec3 jaws = body.pose.p;
    const auto bit = [](uint32_t sphere) { return sphere < 64 ? uint64_t{1} << sphere : uint64_t{0}; };
    const auto skipped = [&](uint32_t sphere) { return !has_jaws && (before & bit(sphere)) != 0; };
    const auto parting = [&](uint32_t sphere) { return has_jaws && (before & bit(sphere)) != 0; };
    const auto add = [&](uint32_t part, const Foot& foot, Vec3 on_axis, float radius, Vec3 jaw_speed, uint64_t kind,
                         uint64_t inside, int jaw) {
      const float gap = foot.gap - radius;
      if (gap < -kInside && foot.gap > -0.9f * wm.laminate.thickness) body.skip |= inside;
      const uint64_t key = key_of(kind, b, part, foot.patch);
      const RowMemory* memory = remembered(bodies, key);
      const bool pressed = memory && dot(memory->impulse, memory->axis) > 0 && dot(memory->axis, foot.normal) > 0.3f;
      // An axis deep below a face belongs to the other face, unless it was pressed there.
      if (foot.gap < (pressed ? -0.9f : -0.35f) * wm.laminate.thickness) return;
      const wall::Weights w = load_point(wall::weights(wm, ws.topology, foot.point), ws.motion, foot.normal);
      const Vec3 r = on_axis - foot.normal * radius - moving.center;
      const Vec3 u = wall::velocity(w, ws.motion);
      // As far as it may come near in this step, however it turns.
      const auto nearing = [&](Vec3 v) { return 1.5f * std::max(0.0f, -dot(v, foot.normal)) + 0.3f * length(v); };
      const float closing =
          h * std::max({nearing(point_speed(moving, r) + jaw_speed - u),
                        nearing(body.velocity + cross(body.spin, r) + jaw_speed - u), moving.loose ? kThrown : 0});
      if (gap > model.reach + closing) return;
      const float least = gap - closing;  // at the end of the step
      // The same plane from two patches that meet there is one contact. Of a sphere no more than twelve, those that come
      // nearest: in a pit of a fine wall there are as many.
      size_t same = 0, farthest = k.row.size();
      for (size_t i = k.row.size(); i-- > 0 && k.row[i].a == b && (k.row[i].key >> 36) == (key >> 36); ++same) {
        if (dot(k.row[i].axis, foot.normal) > 0.985f && std::abs(k.row[i].gap - gap) < 0.05e-3f) return;
        if (farthest == k.row.size() || k.row[i].least > k.row[farthest].least) farthest = i;
      }
      bool replaces = same >= 12;
      if (!replaces && k.row.size() >= kMaxRows - 40 - 24 * std::min<size_t>(bodies.body.size() - 1 - b, 3)) {
        // Deep in soft tissue: of all contacts of the body, too, those that come nearest.
        ++k.overflow;
        for (size_t i = k.row.size(); i-- > 0 && k.row[i].a == b && k.row[i].on_wall;)
          if (farthest == k.row.size() || k.row[i].least > k.row[farthest].least) farthest = i;
        if (farthest == k.row.size()) return;
        replaces = true;
      }
      if (replaces && k.row[farthest].least <= least) return;
      Row row;
      row.key = key, row.a = b, row.on_wall = true, row.point = w;
      row.ra = r, row.axis = foot.normal, row.gap = gap, row.least = least, row.speed = jaw_speed,
      row.friction = m.wall_friction;
      if (inside) row.along_limit = kParting * h;
      const bool inner = dot(foot.normal, rotate(body.pose.q, {static_cast<float>(jaw), 0, 0})) > kInner;
      if (jaw != 0 && (inner || moving.opening != body.opening)) row.soft = 1 / (wall::kThicknessStiffness * h * h);
      if (memory) {
        const float press = std::max(0.0f, dot(memory->impulse, memory->axis));
        row.impulse = foot.normal * press + across(across(memory->impulse, memory->axis), foot.normal);
      }
      if (replaces) k.row[farthest] = row;
      else k.row.push_back(row);
    };
    for (uint32_t i = 0; i < m.sphere.size(); ++i) {
      const BodySphere& s = m.sphere[i];
      if (i % kRun == 0) {
        const BodiesScratch::Run& run = a.run[i / kRun];
        k.near_run.clear();
        for (const uint32_t f : a.faces(run)) {
          const BodiesScratch::Ball& ball = ball_of(wm, ws, k, f);
          const float r = 1.001f * (ball.radius + run.radius_here + margin);
          if (length2(ball.center - run.center_here) <= r * r) k.near_run.push_back(f);
        }
      }
      if (k.near_run.empty() && !holds_tissue) continue;
      if (s.radius <= 0 || skipped(i)) continue;
      const Vec3 in_body = a.in_body[i], p = a.at_here[i];
      if (holds_tissue && s.jaw != 0 && distance(p, jaws) < 6e-3f) {
        body.skip |= bit(i);
        continue;
      }
      const uint64_t inside = parting(i) ? bit(i) : 0;
      const Vec3 jaw_speed = s.jaw == 0 ? Vec3{} : rotate(body.pose.q, (local(m, s, moving.opening) - in_body) * (1 / h));
      const float reach = s.radius + margin;
      for (const uint32_t f : k.near_run) {
        const float r = k.ball[f].radius + reach;
        if (length2(k.ball[f].center - p) > r * r) continue;
        // Beyond this, in front of a face or behind it, `add` has no use for it.
        const FaceBox& box = box_here(f);
        const float useful = 1.05f * std::max(reach, 0.9f * wm.laminate.thickness);
        for (uint32_t q = surface.first_of_face[f]; q < surface.first_of_face[f + 1]; ++q) {
          if (least_distance(wm, ws, surface, search, box, q, p) > useful || least_of_part(surface, search, q, p) > useful)
            continue;
          const Foot foot = nearest_on_patch(wm, ws, surface, q, p, corners_in(search, q));
          if (foot.gap - s.radius > margin || (foot.on_edge && foot.gap < 0)) continue;
          add(i, foot, p, s.radius, jaw_speed, kSphereRow, inside, s.jaw);
        }
      }
    }
    // A sharp edge of the wall between two spheres.
    for (uint32_t i = 0; i < m.capsule.size(); ++i) {
      const std::span<const uint32_t> rims = a.rims(a.run[m.capsule[i].a / kRun]);
      if (rims.empty()) continue;
      const BodySphere &sa = m.sphere[m.capsule[i].a], &sb = m.sphere[m.capsule[i].b];
      if (sa.radius <= 0 || sb.radius <= 0 || skipped(m.capsule[i].a) || skipped(m.capsule[i].b)) continue;
      const Vec3 la = a.in_body[m.capsule[i].a], lb = a.in_body[m.capsule[i].b];
      const Vec3 pa = a.at_here[m.capsule[i].a], pb = a.at_here[m.capsule[i].b];
      if (holds_tissue && sa.jaw != 0 && distance((pa + pb) * 0.5f, jaws) < 6e-3f) continue;
      const uint64_t inside = has_jaws ? before & (bit(m.capsule[i].a) | bit(m.capsule[i].b)) : 0;
      const Vec3 middle = (pa + pb) * 0.5f;
      const float reach = 0.5f * distance(pa, pb) + std::max(sa.radius, sb.radius) + margin;
      for (const uint32_t f : rims) {
        const BodiesScratch::Ball& ball = ball_of(wm, ws, k, f);
        const float r = ball.radius + reach;
        if (length2(ball.center - middle) > r * r) continue;
        const uint32_t last = surface.first_of_face[f + 1];
        uint32_t strip = surface.first_of_face[f];
        while (surface.patch[strip].side != 0) ++strip;
        for (uint32_t q = strip; q < last; ++q) {
          if (least_distance(wm, ws, surface, search, box_here(f), q, middle) > 1.001f * reach ||
              least_of_part(surface, search, q, middle) > 1.001f * reach)
            continue;
          for (const float zeta : {-1.0f, 1.0f}) {
            const auto [ea, eb, up] = strip_ends(wm, ws, surface, q, zeta);
            float t = 0, u = 0;
            nearest_of_segments(pa, pb, ea, eb, t, u);
            if (t < 0.05f || t > 0.95f) continue;
            const Vec3 on = lerp(pa, pb, t), at = lerp(ea, eb, u), off = on - at;
            const float far = length(off), radius = sa.radius + (sb.radius - sa.radius) * t;
            if (far - radius > margin || far < 1e-6f) continue;
            Foot foot = nearest_on_patch(wm, ws, surface, q, at);
            if (dot(off, foot.facing) < -0.1f * far || dot(off, up) < -0.1f * far * length(up)) continue;
            foot.normal = off / far, foot.gap = far;
            const Vec3 jaw_speed =
                sa.jaw == 0 ? Vec3{}
                            : rotate(body.pose.q,
                                     lerp(local(m, sa, moving.opening) - la, local(m, sb, moving.opening) - lb, t) * (1 / h));
            foot.patch = 2 * q + (zeta > 0 ? 1 : 0);
            add(i, foot, on, radius, jaw_speed, kAxisRow, inside, sa.jaw);
          }
        }
      }
    }
  }
}

}  // namespace catgut::physical
