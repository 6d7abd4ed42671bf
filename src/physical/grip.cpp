// SPDX-License-Identifier: Apache-2.0
// physical/grip: jaws that hold needle, thread and tissue by a normal force and Coulomb friction. Declared in physical/body.h.
// A held point is fixed to the jaws by a row of the common solve; beyond friction it slides, and at the end of the jaws it
// falls out.
#include <algorithm>
#include <cmath>

#include "physical/body_internal.h"

namespace catgut::physical {
namespace {

constexpr float kTake = 0.5f;          // [N] with which both jaws press tissue that they take
constexpr float kSqueezed = 0.7f;      // of its thickness remains of a wall between closed jaws
constexpr uint32_t kOtherStrand = 12;  // nodes apart along the thread: two places between the same jaws are two strands

// The nearest point of the wall's surface to p among all faces.
Foot nearest_surface(const wall::Model& wm, const wall::State& ws, const Surface& surface, BodiesScratch& k, Vec3 p,
                     float within) {
  Foot best;
  best.gap = 1e9f;
  for (uint32_t f = 0; f < k.ball.size(); ++f) {
    const BodiesScratch::Ball& ball = ball_of(wm, ws, k, f);
    const float r = ball.radius + within;
    if (length2(ball.center - p) > r * r) continue;
    for (uint32_t q = surface.first_of_face[f]; q < surface.first_of_face[f + 1]; ++q) {
      const Foot foot = nearest_on_patch(wm, ws, surface, q, p);
      if (distance(foot.at, p) < best.gap) best = foot, best.gap = distance(foot.at, p);
    }
  }
  return best;
}

// The point nearest to p on the face, and on the side of it, where `foot` stands.
Foot nearest_beside(const wall::Model& wm, const wall::State& ws, const Surface& surface, const Foot& foot, Vec3 p) {
  Foot best;
  float far = 1e9f;
  const uint32_t face = surface.patch[foot.patch].face;
  for (uint32_t q = surface.first_of_face[face]; q < surface.first_of_face[face + 1]; ++q) {
    if (surface.patch[q].side != surface.patch[foot.patch].side) continue;
    const Foot here = nearest_on_patch(wm, ws, surface, q, p);
    if (distance(here.at, p) < far) best = here, far = distance(here.at, p);
  }
  return best;
}

void add_point(const Body& tool, const Foot& foot, Grip& grip) {
  grip.point[grip.count++] = {to_local(tool.pose, foot.at), {}, foot.point, {}};
}

// A wall between the jaws, held at three points round its nearest one.
void grip_wall(const wall::Model& wm, const wall::State& ws, const Surface& surface, const Body& tool, const Foot& foot,
               Grip& grip) {
  grip = {};
  grip.what = Gripped::tissue, grip.size = kSqueezed * wm.laminate.thickness;
  const Vec3 u = any_perpendicular(foot.facing), v = cross(foot.facing, u);
  for (const Vec3 off : {u * 0.8e-3f, v * 0.7e-3f - u * 0.4e-3f, -v * 0.7e-3f - u * 0.4e-3f})
    add_point(tool, nearest_beside(wm, ws, surface, foot, foot.at + off), grip);
}

// Two walls between the jaws, such as two edges held together: each jaw holds its own at two points across the shaft.
// False: there is only one, or a jaw bears on none.
bool grip_walls(const wall::Model& wm, const wall::State& ws, const Surface& surface, BodiesScratch& k, const Body& tool,
                float gap, Grip& grip) {
  constexpr float kReach = 1.2e-3f, kAside = 0.7e-3f;  // [m] from a jaw to its wall; of a point from the jaw's middle
  std::array<Foot, 2> foot;
  for (size_t i = 0; i < 2; ++i) {
    foot[i] = nearest_surface(wm, ws, surface, k, transform(tool.pose, {(i == 0 ? -0.5f : 0.5f) * gap, 0, 0}), kReach);
    if (foot[i].gap > kReach) return false;
  }
  // The middle of one wall is the same from both sides; two that are squeezed hard still have theirs apart.
  const auto middle = [&](const Foot& f) {
    wall::Weights w = wall::weights(wm, ws.topology, f.point);
    w.zeta = 0;
    return wall::place(w, ws.motion);
  };
  if (distance(middle(foot[0]), middle(foot[1])) < 0.5f * wm.laminate.thickness) return false;
  grip = {};
  grip.what = Gripped::tissue, grip.size = std::min(gap, 2 * kSqueezed * wm.laminate.thickness);
  for (const Foot& f : foot) {
    const Vec3 along = normalized(across(rotate(tool.pose.q, {0, 0, 1}), f.facing), any_perpendicular(f.facing));
    for (const float off : {-kAside, kAside}) add_point(tool, nearest_beside(wm, ws, surface, f, f.at + along * off), grip);
  }
  return true;
}

void grip_needle(const BodiesModel& model, const Bodies& bodies, uint32_t tool, uint32_t needle, Vec3 at, Vec3 tangent,
                 Grip& grip) {
  const BodyModel& m = model.body[tool];
  const Body &t = bodies.body[tool], &n = bodies.body[needle];
  const Vec3 x = rotate(t.pose.q, {1, 0, 0}), along = normalized(across(tangent, x), rotate(t.pose.q, {0, 1, 0}));
  const Vec3 side = cross(x, along);
  grip.what = Gripped::needle, grip.body = needle, grip.count = 4;
  for (uint32_t i = 0; i < 4; ++i) {
    const Vec3 off = i < 2 ? along * (i == 0 ? m.jaw_width : -m.jaw_width) : side * (i == 2 ? 0.5e-3f : -0.5e-3f);
    const Vec3 p = at + off;
    grip.point[i] = {to_local(t.pose, p), to_local(n.pose, p), {}, {}};
  }
}

// [N] largest tension of the thread that lies on the outer side of a jaw, within `reach` of it; negative: there is none.
float tension_outside(const BodyModel& m, const Body& body, const thread::State& thread, float diameter, float reach) {
  float most = -1;
  for (const BodyCapsule& c : m.thread_capsule) {
    const BodySphere &sa = m.sphere[c.a], &sb = m.sphere[c.b];
    if (sa.jaw == 0) continue;
    const Vec3 a = transform(body.pose, local(m, sa, body.opening)), b = transform(body.pose, local(m, sb, body.opening));
    const Vec3 outward = rotate(body.pose.q, {static_cast<float>(sa.jaw), 0, 0});
    const float near = std::max(std::abs(sa.radius), std::abs(sb.radius)) + 0.5f * diameter + reach;
    const float around = near + 0.5f * distance(a, b);
    for (size_t i = 0; i + 1 < thread.nodes(); ++i) {
      const Vec3 p = thread.position(i);
      if (length2(p - (a + b) * 0.5f) > around * around) continue;
      const Vec3 off = p - lerp(a, b, nearest_along(a, b, p));
      if (length2(off) < near * near && dot(off, outward) > 0.3f * length(off))
        most = std::max({most, 0.0f, thread.tension[i]});
    }
  }
  return most;
}

}  // namespace

// The thread sees the jaws move for a whole step before they yield to it (yield_to_thread). In that step a tight turn of 500 N
// round them, 10 mm long, gains 0.2 N per micrometer.
void open_gently(const BodiesModel& model, const Bodies& bodies, const thread::State& thread, float thread_diameter, float h,
                 BodiesScratch& k) {
  constexpr float kBeside = 0.3e-3f;                  // [m] between jaw and thread
  constexpr float kSlack = 10e-3f, kPower = 0.5e-3f;  // [m/s] of a tip beside slack thread; [W] against taut thread
  for (size_t b = 0; b < bodies.body.size(); ++b) {
    const BodyModel& m = model.body[b];
    const Body& body = bodies.body[b];
    if (m.hinge_z <= 0 || k.moving[b].opening <= body.opening) continue;
    const float tension = tension_outside(m, body, thread, thread_diameter, kBeside);
    if (tension < 0) continue;
    const float speed = std::min(kSlack, kPower / std::max(tension, 1e-3f));
    k.moving[b].opening = std::min(k.moving[b].opening, body.opening + speed * h / m.hinge_z);
  }
}

void find_grips(const BodiesModel& model, const wall::Model& wm, const wall::State& ws, const Surface& surface,
                const thread::State& thread, float thread_diameter, Bodies& bodies, std::span<const HandTarget> target, float h,
                BodiesScratch& k) {
  for (uint32_t b = 0; b < bodies.body.size(); ++b) {
    const BodyModel& m = model.body[b];
    Body& body = bodies.body[b];
    Grip& grip = body.grip;
    if (m.hinge_z <= 0) continue;
    const bool closing = b < target.size() && target[b].connected && target[b].grip > 0;
    if (!closing && b < target.size() && target[b].connected) grip = {};
    const auto gap_at = [&](float z) { return 2 * (m.hinge_z - z) * portable::sin(body.opening); };
    if (closing && grip.what == Gripped::nothing && target[b].opening <= body.opening + 1e-4f) {
      const auto in_jaws = [&](Vec3 p, float size) {
        return std::abs(p.y) < m.jaw_width + 0.5f * size && std::abs(p.z) < 0.5f * m.jaw_length + 0.5f * size &&
               std::abs(p.x) < 0.5f * gap_at(p.z) + 0.5f * size + 0.3e-3f;
      };
      // Jaws that are shut take nothing that touches them from outside.
      const auto closed_on = [&](float z, float size) {
        const float gap = gap_at(z);
        return gap <= size + 0.3e-3f && gap > 0.25f * size;
      };
      // Needle first, then thread, then tissue.
      float best = 1e9f;
      for (uint32_t n = 0; n < bodies.body.size() && (target[b].may_hold & 1); ++n) {
        const BodyModel& nm = model.body[n];
        if (nm.hinge_z > 0 || n == b) continue;
        for (const BodyCapsule& c : nm.capsule) {
          const Vec3 pa = transform(bodies.body[n].pose, nm.sphere[c.a].at),
                     pb = transform(bodies.body[n].pose, nm.sphere[c.b].at);
          const Vec3 on = lerp(pa, pb, nearest_along(pa, pb, body.pose.p)), in = to_local(body.pose, on);
          const float size = 2 * std::abs(nm.sphere[c.a].radius), far = distance(on, body.pose.p);
          if (far > best || !in_jaws(in, size) || !closed_on(in.z, size)) continue;
          best = far;
          grip = {};
          grip_needle(model, bodies, b, n, on, normalized(pb - pa), grip);
          grip.size = size;
        }
      }
      bool strand_between = false;  // jaws that close on thread meet it before the tissue under it
      if (grip.what == Gripped::nothing && (target[b].may_hold & 2)) {
        const float size = thread_diameter;
        for (uint32_t i = 0; i < thread.nodes(); ++i) {
          const Vec3 p = thread.position(i), in = to_local(body.pose, p);
          if (length2(in) > 25e-6f || length(in) > best || !in_jaws(in, size)) continue;
          strand_between = true;
          if (!closed_on(in.z, size)) continue;
          best = length(in);
          grip = {};
          grip.what = Gripped::thread, grip.count = 1, grip.node = i, grip.size = size;
          grip.point[0].in_tool = in;
        }
        // Another strand between the same jaws, such as the crossing of a throw: both are pinched.
        best = 1e9f;
        for (uint32_t i = 0; i < thread.nodes() && grip.what == Gripped::thread; ++i) {
          const Vec3 in = to_local(body.pose, thread.position(i));
          if (length2(in) > 4e-6f || length(in) > best || !in_jaws(in, size) || !closed_on(in.z, size)) continue;
          if (std::max(i, grip.node) - std::min(i, grip.node) < kOtherStrand) continue;
          best = length(in);
          grip.count = 2, grip.body = i, grip.point[1].in_tool = in;
          grip.size = 2.6f * size;  // twisted strands lie on each other somewhere in the width of the jaws
        }
      }
      const bool on_tissue = closed_on(0, wm.laminate.thickness) || k.moving[b].squeeze > kTake;
      if (grip.what == Gripped::nothing && !strand_between && (target[b].may_hold & 4) && on_tissue) {
        if (k.moving[b].squeeze <= kTake || !grip_walls(wm, ws, surface, k, body, gap_at(0), grip)) {
          const Foot foot = nearest_surface(wm, ws, surface, k, body.pose.p, 3e-3f);
          if (foot.gap < 1.2e-3f || (foot.gap < 1e8f && dot(body.pose.p - foot.at, foot.facing) < 0 && foot.gap < 2e-3f))
            grip_wall(wm, ws, surface, body, foot, grip);
        }
      }
    }
    if (grip.what == Gripped::nothing) continue;
    if (closing) grip.force = target[b].grip;
    // The jaws cannot close beyond what they hold.
    const float stop = std::min(0.5f, 0.5f * grip.size / m.hinge_z);
    k.moving[b].opening = std::max(k.moving[b].opening, stop);
    if (grip.what == Gripped::tissue && grip.count == 4) {  // two walls: each jaw carries its own along
      constexpr float kGather = 0.1f;                       // [rad/s]
      k.moving[b].opening = std::max(k.moving[b].opening, body.opening - kGather * h);
      for (uint32_t i = 0; i < 4; ++i)
        grip.point[i].in_tool.x = (i < 2 ? -1.0f : 1.0f) * (m.hinge_z - grip.point[i].in_tool.z) * portable::sin(body.opening);
    }
    const float pinch = grip.force, part = 1.0f / static_cast<float>(grip.count);
    const Vec3 x = rotate(body.pose.q, {1, 0, 0}), center = k.moving[b].center;
    if (grip.what == Gripped::thread) {
      for (uint32_t i = 0; i < grip.count; ++i) {
        thread::Hold hold;
        hold.node = i == 0 ? grip.node : grip.body;
        hold.from = transform(body.shown, grip.point[i].in_tool);
        hold.limit = std::max(1e-3f, 2 * m.grip_friction * pinch * part);
        hold.stiffness = hold.limit / kThreadGripGive;
        k.hold.push_back(hold), k.hold_body.push_back(b), k.hold_at.push_back(grip.point[i].in_tool);
        if (k.row.size() >= kMaxRows) continue;
        Row row;
        row.kind = Row::Kind::spring, row.key = key_of(kThreadGripRow, b, i, 0), row.a = b, row.axis = {1, 0, 0};
        row.ra = transform(body.pose, grip.point[i].in_tool) - k.moving[b].center;
        row.across_limit = hold.limit * h;
        row.impulse = grip.point[i].impulse;
        k.row.push_back(row);
      }
      continue;
    }
    for (uint32_t i = 0; i < grip.count && k.row.size() < kMaxRows; ++i) {
      GripPoint& g = grip.point[i];
      Row row;
      row.kind = Row::Kind::grip, row.key = key_of(4, b, i, 0), row.a = b, row.axis = x;
      const Vec3 mine = transform(body.pose, g.in_tool);
      Vec3 other;
      row.ra = mine - center;
      if (grip.what == Gripped::needle) {
        row.b = grip.body;
        other = transform(bodies.body[grip.body].pose, g.in_needle);
        row.rb = other - k.moving[grip.body].center;
      } else {
        row.on_wall = true, row.point = wall::weights(wm, ws.topology, g.tissue);
        other = wall::place(row.point, ws.motion);
        row.point.zeta = 0;
        row.soft = 0.1e-3f / (h * h);  // the tissue between the jaws: 10 N/mm
      }
      row.wanted = clamped((other - mine) * (kCorrect / h), model.push_out);
      row.along_limit = std::max(pinch, 2.0f) * part * h * 4;  // the jaws' own strength, far above their friction
      row.across_limit = 2 * m.grip_friction * pinch * part * h;
      row.impulse = g.impulse;
      k.row.push_back(row);
    }
  }
}

namespace {

// The node and its place in the jaws after a step; true when the thread has left the jaws.
bool slip_thread(const BodyModel& m, const Body& b, const thread::Hold& hold, const thread::State& t, uint32_t& node,
                 Vec3& in_tool, float& slid) {
  const Vec3 at = t.position(hold.node), give = hold.to - at;
  const float size = length(give);
  if (size > kThreadGripGive) {
    const Vec3 slip = give * (1 - kThreadGripGive / size);
    slid += length(slip);
    in_tool = in_tool - rotate(conjugate(b.shown.q), slip);
  }
  // The neighbor that is nearer to the middle of the jaws takes over, with the same give.
  const Vec3 middle{0, 0, std::clamp(in_tool.z, -0.5f * m.jaw_length, 0.5f * m.jaw_length)};
  float best = distance(to_local(b.shown, at), middle);
  for (const int d : {-1, 1}) {
    const int64_t i = static_cast<int64_t>(hold.node) + d;
    if (i < 0 || i >= static_cast<int64_t>(t.nodes()) || t.broken[static_cast<size_t>(std::min<int64_t>(i, hold.node))])
      continue;
    const Vec3 other = t.position(static_cast<size_t>(i));
    const float far = distance(to_local(b.shown, other), middle);
    if (far > best - 0.02e-3f) continue;
    best = far, node = static_cast<uint32_t>(i);
    in_tool = to_local(b.shown, other + clamped(give, kThreadGripGive));
  }
  // The thread's end has left the jaws, or they were torn off.
  const bool end = node == 0 || node + 1 == t.nodes() || t.broken[node - 1] || t.broken[node];
  return best > (end ? 0.6f : 2.0f) * m.jaw_length;
}

// Both strands; where one has left the jaws, the other remains.
void slip_strands(const BodyModel& m, Body& b, std::span<const thread::Hold> hold, const thread::State& t) {
  Grip& grip = b.grip;
  uint32_t* const node[] = {&grip.node, &grip.body};
  bool out[2] = {};
  for (uint32_t i = 0; i < grip.count; ++i) out[i] = slip_thread(m, b, hold[i], t, *node[i], grip.point[i].in_tool, grip.slid);
  if (grip.count == 2 && out[0] && !out[1]) grip.node = grip.body, grip.point[0] = grip.point[1], out[0] = false, out[1] = true;
  if (grip.count == 2 && out[1]) grip.count = 1, grip.body = 0, grip.point[1] = {};
  if (out[0]) grip = {};
}

}  // namespace

void settle_grips(const BodiesModel& model, const wall::Model& wm, const wall::State& ws, const thread::State& t,
                  Bodies& bodies, BodiesScratch& k) {
  for (size_t i = 0; i < k.hold.size(); ++i) {
    const uint32_t b = k.hold_body[i];
    if (i > 0 && k.hold_body[i - 1] == b) continue;  // the second strand of the same jaws
    const size_t strands = i + 1 < k.hold.size() && k.hold_body[i + 1] == b ? 2 : 1;
    if (model.body[b].hinge_z > 0 && bodies.body[b].grip.what == Gripped::thread)
      slip_strands(model.body[b], bodies.body[b], std::span(k.hold).subspan(i, strands), t);
  }
  for (const Row& row : k.row) {
    for (uint32_t i = 0; i < 2; ++i)
      if (row.key == key_of(kThreadGripRow, row.a, i, 0)) bodies.body[row.a].grip.point[i].impulse = row.impulse;
    if (row.kind != Row::Kind::grip) continue;
    Body& body = bodies.body[row.a];
    Grip& grip = body.grip;
    const uint32_t i = static_cast<uint32_t>(row.key >> 36) & 0xffff;
    GripPoint& g = grip.point[i];
    g.impulse = row.impulse;
    // Beyond the bristle the held point has slid to another place of the jaws.
    const Vec3 mine = transform(body.pose, g.in_tool);
    const Vec3 other = grip.what == Gripped::needle ? transform(bodies.body[grip.body].pose, g.in_needle)
                                                    : wall::place(wall::weights(wm, ws.topology, g.tissue), ws.motion);
    const Vec3 error = other - mine, tangential = across(error, row.axis);
    const float size = length(tangential);
    if (row.at_limit && size > kBristle) {
      const Vec3 slip = tangential * (1 - kBristle / size);
      grip.slid += length(slip) / static_cast<float>(grip.count);
      if (grip.what == Gripped::needle) g.in_needle = g.in_needle - rotate(conjugate(bodies.body[grip.body].pose.q), slip);
      else g.in_tool = g.in_tool + rotate(conjugate(body.pose.q), slip);
    }
  }
  for (uint32_t b = 0; b < bodies.body.size(); ++b) {
    const BodyModel& m = model.body[b];
    Grip& grip = bodies.body[b].grip;
    if (grip.what == Gripped::tissue) {
      Vec3 middle{};
      for (uint32_t i = 0; i < grip.count; ++i) middle += grip.point[i].in_tool / static_cast<float>(grip.count);
      if (length(middle) > 0.5f * m.jaw_length + 1.5e-3f) grip = {};
    } else if (grip.what == Gripped::needle) {
      // What lies between the jaws now: the needle may have slid to its end.
      const BodyModel& nm = model.body[grip.body];
      Vec3 middle{};
      for (uint32_t i = 0; i < grip.count; ++i) middle += grip.point[i].in_needle / static_cast<float>(grip.count);
      float best = 1e9f;
      for (const BodyCapsule& c : nm.capsule) {
        const Vec3 pa = nm.sphere[c.a].at, pb = nm.sphere[c.b].at;
        best = std::min(best, distance(lerp(pa, pb, nearest_along(pa, pb, middle)), middle));
      }
      if (best > grip.size + 0.3e-3f) grip = {};
    }
  }
}

}  // namespace catgut::physical
