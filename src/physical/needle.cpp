// SPDX-License-Identifier: Apache-2.0
// physical/needle: see the header.
#include "physical/needle.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "physical/near_faces.h"

namespace catgut::physical {
namespace {

constexpr float kBeside = 1.2e-3f;  // [m] of shaft outside a hole that does not touch the face: it leaves at a slant
constexpr float kTipRadius = 0.08e-3f;
constexpr float kDrawnBack = 0.25f;  // of what a face pushes back along the needle: friction that pulls its tip forward by more

Vec3 place_of(const wall::Model& wm, const wall::State& ws, const wall::Point& p) {
  return wall::place(wall::weights(wm, ws.topology, p), ws.motion);
}

// The angle of the arc nearest to p, beyond its ends too: within half a turn of its middle.
float angle_of(const NeedleModel& n, const Pose& pose, Vec3 p) {
  const Vec3 q = to_local(pose, p) - n.circle;
  float angle = portable::atan2(q.y, q.x);
  const float middle = 0.5f * n.shape.arc;
  while (angle < middle - kPi) angle += 2 * kPi;
  while (angle > middle + kPi) angle -= 2 * kPi;
  return angle;
}

// Of the elements near the needle's body. against: unit; only faces that face a motion along it. Zero: all.
Foot nearest_face(const wall::Model& wm, const wall::State& ws, const Surface& surface, BodiesScratch& k, uint32_t body, Vec3 p,
                  float within, Vec3 against, float least_slope) {
  Foot best;
  best.gap = 1e9f;
  float facing = -1;
  for (const uint32_t f : k.around[body].face) {
    const BodiesScratch::Ball& ball = ball_of(wm, ws, k, f);
    const float r = ball.radius + within;
    if (length2(ball.center - p) > r * r) continue;
    for (uint32_t q = surface.first_of_face[f]; q < surface.first_of_face[f + 1]; ++q) {
      const Foot foot = nearest_on_patch(wm, ws, surface, q, p);
      if ((foot.on_edge && foot.gap < 0) || foot.gap < -0.35f * wm.laminate.thickness) continue;
      if (length2(against) > 0 && -dot(against, foot.facing) < least_slope) continue;
      const float far = std::abs(foot.gap), front = dot(normalized(p - foot.at), foot.facing);
      if (far > std::abs(best.gap) + 1e-7f || (far > std::abs(best.gap) - 1e-7f && front < facing)) continue;
      best = foot, facing = front;
    }
  }
  return best;
}

// Loads of a channel act across the needle: along the director where the needle lies in the wall.
wall::Weights across_load(wall::Weights w, const wall::Motion& motion, Vec3 axis) {
  const float kept = w.zeta - load_point(w, motion, axis).zeta;
  w.zeta = kept;
  return w;
}

// The point of a face above a point within the wall.
wall::Point on_face(wall::Point p, float side) {
  p.zeta = side;
  return p;
}

void start_channel(Needle& n, const wall::Point& at, float side) {
  Channel& c = n.channel[n.channels++];
  c = {};
  c.entry_side = side;
  c.point[0] = on_face(at, side), c.count = 1;
  n.tip = c.point[0], n.inside = true;
  n.events |= kEntered;
}

// [m] A shaft farther than this from all of a channel has left it sideways. Its thread follows it out of the exit: that far
// behind the swage the channel may be.
constexpr float kSideways = 2.5e-3f, kFollows = 10e-3f;

void leave_channels(const NeedleModel& m, const wall::Model& wm, const wall::State& ws, const Pose& pose, Needle& n) {
  for (uint32_t c = 0; c < n.channels; ++c) {
    Channel& channel = n.channel[c];
    const auto near = [&](const wall::Point& p) {
      const Vec3 at = place_of(wm, ws, p);
      const float angle = angle_of(m, pose, at), far = distance(at, arc_point(m, pose, std::clamp(angle, 0.0f, m.shape.arc)));
      return far < (angle < 0 && channel.entry_hole != wall::kNone ? kFollows : kSideways);
    };
    if (std::any_of(channel.point.begin(), channel.point.begin() + channel.count, near)) continue;
    leave_channel(n, c);
    return;  // the next one in the next step
  }
}

}  // namespace

wall::Point locate(const wall::Model& wm, const wall::State& ws, const Surface& surface, BodiesScratch& k, Vec3 p,
                   const wall::Point& from, float& off) {
  wall::Point best;
  off = 1e9f;
  const auto piece_of = [&](const wall::Point& at) { return surface.piece[wall::weights(wm, ws.topology, at).column[0]]; };
  const uint32_t piece = piece_of(from);
  std::array<uint32_t, 40> near;
  const size_t count = near_faces(wm, from.face, near);
  std::sort(near.begin(), near.begin() + static_cast<std::ptrdiff_t>(count));
  for (const uint32_t f : std::span(near.data(), count)) {
    const BodiesScratch::Ball& ball = ball_of(wm, ws, k, f);
    const float r = ball.radius + 1e-3f;
    if (length2(ball.center - p) > r * r) continue;
    // Outer face, then inner one; a fragment has several such pairs.
    for (uint32_t q = surface.first_of_face[f]; q < surface.first_of_face[f + 1] && surface.patch[q].side == 1; q += 2) {
      const Foot out = nearest_on_patch(wm, ws, surface, q, p), in = nearest_on_patch(wm, ws, surface, q + 1, p);
      const float above = dot(p - out.at, out.facing), below = dot(p - in.at, in.facing), sum = -(above + below);
      if (!(sum > 1e-6f)) continue;
      const float zeta = std::clamp((above - below) / sum, -1.0f, 1.0f), share = 0.5f * (1 + zeta);
      const wall::Point at{out.point.face, in.point.xi + share * (out.point.xi - in.point.xi),
                           in.point.eta + share * (out.point.eta - in.point.eta), zeta};
      const float far = distance(place_of(wm, ws, at), p);
      if (far < off && piece_of(at) == piece) off = far, best = at;
    }
  }
  return best;
}

void leave_channel(Needle& n, uint32_t c) {
  const Channel& channel = n.channel[c];
  n.torn = c, n.torn_hole = channel.exit_hole == wall::kNone ? channel.entry_hole : wall::kNone;
  n.events |= kTornOut;
  if (c + 1 == n.channels) n.inside = false;
  std::copy(n.channel.begin() + c + 1, n.channel.begin() + n.channels, n.channel.begin() + c);
  --n.channels;
}

float puncture_force(const PunctureLaw& law, const NeedleShape& shape) { return law.puncture * shape.wire_radius / 0.33e-3f; }

NeedleModel make_needle(const NeedleShape& shape, uint32_t body) {
  NeedleModel n;
  n.body = body, n.shape = shape;
  // The center of mass of the arc is the origin.
  const float a = shape.arc;
  n.circle = Vec3{portable::sin(a) / a, (1 - portable::cos(a)) / a, 0} * -shape.radius;
  return n;
}

BodyModel make_needle_body(const NeedleShape& shape) {
  BodyModel m;
  const NeedleModel n = make_needle(shape, 0);
  const float whole = shape.arc * shape.radius;
  const int parts = std::max(4, static_cast<int>(std::ceil(whole / 1.1e-3f)));
  for (int i = 0; i <= parts; ++i) {
    const float along = whole * static_cast<float>(i) / static_cast<float>(parts), left = whole - along;
    const float radius = std::max(kTipRadius, shape.wire_radius * std::min(1.0f, left / shape.taper));
    m.sphere.push_back({arc_point(n, {}, along / shape.radius), radius, 0});
    if (i > 0) m.capsule.push_back({static_cast<uint32_t>(i) - 1, static_cast<uint32_t>(i)});
  }
  m.sphere.back().radius = -kTipRadius;  // the tip has a row of its own
  // Against the thread. The first part is the swage, where its own thread begins, the last one the tip.
  const int first = 2, chunks = 9;
  m.thread_capsule.push_back({0, static_cast<uint32_t>(first)});
  for (int i = 0; i < chunks; ++i) {
    const int a = first + (parts - 1 - first) * i / chunks, b = first + (parts - 1 - first) * (i + 1) / chunks;
    m.thread_capsule.push_back({static_cast<uint32_t>(a), static_cast<uint32_t>(b)});
  }
  m.thread_capsule.push_back({static_cast<uint32_t>(parts) - 1, static_cast<uint32_t>(parts)});
  m.mass = shape.mass;
  const float middle2 = length2(n.circle);
  m.inertia = shape.mass * std::max(shape.radius * shape.radius - middle2, 0.2f * shape.radius * shape.radius);
  m.falls = true;
  m.wall_friction = 0.15f;
  return m;
}

Vec3 arc_point(const NeedleModel& n, const Pose& pose, float angle) {
  return transform(pose, n.circle + Vec3{portable::cos(angle), portable::sin(angle), 0} * n.shape.radius);
}
Vec3 arc_tangent(const NeedleModel&, const Pose& pose, float angle) {
  return rotate(pose.q, {-portable::sin(angle), portable::cos(angle), 0});
}

void skip_channels(const NeedlesModel& model, const wall::Model& wm, const wall::State& ws, std::span<const Needle> needle,
                   Bodies& bodies) {
  for (size_t i = 0; i < needle.size(); ++i) {
    const NeedleModel& m = model.needle[i];
    Body& body = bodies.body[m.body];
    body.skip = 0;
    const float whole = m.shape.arc * m.shape.radius;
    const int parts = std::max(4, static_cast<int>(std::ceil(whole / 1.1e-3f)));
    for (uint32_t c = 0; c < needle[i].channels; ++c) {
      const Channel& channel = needle[i].channel[c];
      const bool last_inside = needle[i].inside && c + 1 == needle[i].channels;
      const float from = angle_of(m, body.pose, place_of(wm, ws, channel.point[0])) * m.shape.radius - kBeside;
      const float to =
          last_inside ? 1
                      : angle_of(m, body.pose, place_of(wm, ws, channel.point[channel.count - 1])) * m.shape.radius + kBeside;
      for (int s = 0; s <= parts && s < 64; ++s) {
        const float along = whole * static_cast<float>(s) / static_cast<float>(parts);
        if (along > from && (last_inside || along < to)) body.skip |= uint64_t{1} << s;
      }
    }
  }
}

void find_needle_rows(const NeedlesModel& model, const BodiesModel& bm, const wall::Model& wm, const wall::State& ws,
                      const Surface& surface, const thread::State& thread, const Bodies& bodies, std::span<Needle> needle,
                      float h, BodiesScratch& k) {
  const PunctureLaw& law = model.law;
  for (uint32_t i = 0; i < needle.size(); ++i) {
    const NeedleModel& m = model.needle[i];
    Needle& n = needle[i];
    const Body& body = bodies.body[m.body];
    const Vec3 center = k.moving[m.body].center;
    n.events = 0, n.tip_row = n.exit_row[0] = n.exit_row[1] = wall::kNone;
    const auto add = [&](Row& row, Vec3 at) {
      row.a = m.body, row.ra = at - center;
      const auto memory = std::lower_bound(bodies.memory.begin(), bodies.memory.end(), row.key,
                                           [](const RowMemory& r, uint64_t key) { return r.key < key; });
      if (memory != bodies.memory.end() && memory->key == row.key) {
        row.impulse = memory->impulse;
        if (row.kind == Row::Kind::contact) {
          const float press = std::max(0.0f, dot(memory->impulse, memory->axis));
          const Vec3 side = memory->impulse - memory->axis * dot(memory->impulse, memory->axis);
          row.impulse = row.axis * press + side - row.axis * dot(side, row.axis);
        }
      }
      if (k.row.size() < kMaxRows) k.row.push_back(row);
    };
    const auto key = [&](uint64_t kind, uint64_t part) { return (uint64_t{8} + kind) << 60 | uint64_t{i} << 36 | part; };

    // The swage on its thread. A last node of which the thread has broken off is none: alone it would be thrown to and fro.
    if (n.thread_node != wall::kNone && n.thread_node > 0 && !thread.broken[n.thread_node - 1]) {
      const Vec3 at = swage_of(m, body.pose);
      Row row;
      row.kind = Row::Kind::spring, row.key = key(0, 0), row.axis = {1, 0, 0};
      row.across_limit = law.swage_strength * h;
      add(row, at);
      thread::Hold hold;
      hold.node = n.thread_node, hold.stiffness = law.swage_stiffness, hold.limit = law.swage_strength;
      hold.from = swage_of(m, body.shown);
      k.hold.push_back(hold), k.hold_body.push_back(m.body), k.hold_at.push_back(swage_of(m, {}));
    }

    // The shaft in its channels.
    for (uint32_t c = 0; c < n.channels; ++c) {
      const Channel& channel = n.channel[c];
      const bool open = n.inside && c + 1 == n.channels;
      std::array<Vec3, kMaxPath + 1> way;
      for (uint32_t p = 0; p < channel.count; ++p) way[p] = place_of(wm, ws, channel.point[p]);
      if (open) way[channel.count] = place_of(wm, ws, n.tip);
      const uint32_t ends = channel.count + (open ? 1 : 0);
      for (uint32_t p = 0; p < channel.count; ++p) {
        Row row;
        row.point = wall::weights(wm, ws.topology, channel.point[p]);
        const Vec3 there = way[p];
        const float angle = angle_of(m, body.pose, there);
        if (angle < 0 || angle > m.shape.arc) continue;
        const Vec3 at = arc_point(m, body.pose, angle);
        row.kind = Row::Kind::channel, row.key = channel_key(i, c, p), row.on_wall = true;
        row.axis = arc_tangent(m, body.pose, angle);
        row.point = across_load(row.point, ws.motion, row.axis);
        row.wanted = (there - at) * (1 / h);  // implicit: with `soft` a spring of side_stiffness
        row.soft = 1 / (law.side_stiffness * h * h);
        // Friction of the shaft that this point stands for.
        const float before = p > 0 ? distance(there, way[p - 1]) : 0, after = p + 1 < ends ? distance(there, way[p + 1]) : 0;
        row.along_limit = law.friction * 0.5f * (before + after) * h, row.friction = 1, row.across_limit = law.most * h;
        add(row, at);
      }
      if (!open) continue;
      // The tip in the tissue: it cuts forward, and tissue stands on both sides of it.
      const Vec3 tip = tip_of(m, body.pose), tangent = arc_tangent(m, body.pose, m.shape.arc);
      Row row;
      row.point = wall::weights(wm, ws.topology, n.tip);
      const Vec3 there = wall::place(row.point, ws.motion);
      row.kind = Row::Kind::channel, row.key = channel_key(i, c, 63), row.on_wall = true;
      row.axis = tangent;
      row.point = across_load(row.point, ws.motion, row.axis);
      n.give = tip - there;
      row.wanted = -n.give * (1 / h);
      row.soft = 1 / (law.side_stiffness * h * h);
      row.along_limit = law.cutting * h, row.friction = 0, row.across_limit = law.most * h;
      add(row, tip);
      // A face in front of the tip gives way at the force of an exit.
      for (uint32_t side = 0; side < 2; ++side) {
        const float zeta = side == 0 ? 1.0f : -1.0f;
        const Foot foot = nearest_on_patch(wm, ws, surface, patch_at(wm, ws, surface, n.tip, side == 0 ? 1 : -1), tip);
        if (dot(tangent, foot.facing) < 0.1f) continue;
        if (zeta == channel.entry_side && distance(place_of(wm, ws, channel.point[0]), foot.at) < law.same_face) continue;
        Row face;
        face.key = key(2, side), face.on_wall = true, face.point = wall::weights(wm, ws.topology, foot.point);
        face.point.zeta = 0;
        face.axis = -foot.facing, face.gap = dot(foot.at - tip, foot.facing);
        face.along_limit = puncture_force(law, m.shape) * law.exit_share * h;
        n.exit_row[side] = static_cast<uint32_t>(k.row.size()), n.exit_on[side] = foot.point;
        add(face, tip);
      }
    }
    if (n.inside) continue;

    // The tip on a face: it enters at the puncture force.
    const Vec3 tip = tip_of(m, body.pose), tangent = arc_tangent(m, body.pose, m.shape.arc);
    const float margin = bm.reach + 2 * h * (std::max(length(k.moving[m.body].v), length(body.velocity)) + 1);
    // Just out of a hole, it has no contact with the face that it came through, but with another wall that lies on that face.
    const Channel* last = n.channels > 0 ? &n.channel[n.channels - 1] : nullptr;
    const bool just_out = last && distance(place_of(wm, ws, last->point[last->count - 1]), tip) < kBeside;
    const Foot foot = nearest_face(wm, ws, surface, k, m.body, tip, margin, just_out ? tangent : Vec3{}, law.least_slope);
    if (foot.gap > margin) continue;
    Row row;
    row.key = key(3, foot.patch), row.on_wall = true,
    row.point = load_point(wall::weights(wm, ws.topology, foot.point), ws.motion, foot.normal);
    row.axis = foot.normal, row.gap = foot.gap - kTipRadius, row.friction = law.tip_friction;
    // It enters a face on which it pressed in the last step. Drawn backward it scratches the face, or sticks to it and drags it
    // along: friction pulled it forward then, and it does not enter.
    const uint64_t first = key(3, 0);
    const auto felt = std::lower_bound(bodies.memory.begin(), bodies.memory.end(), first,
                                       [](const RowMemory& r, uint64_t from) { return r.key < from; });
    const bool touched = felt != bodies.memory.end() && felt->key - first < uint64_t{1} << 36;
    const float slope = -dot(tangent, foot.normal), press = touched ? dot(felt->impulse, foot.normal) : 0;
    const float pull = touched ? dot(felt->impulse + tangent * (press * slope), tangent) : 0;
    const bool enters = surface.patch[foot.patch].side != 0 && slope > law.least_slope && press > 0 &&
                        pull < kDrawnBack * press * slope && n.channels < kMaxChannels;
    if (enters) row.along_limit = puncture_force(law, m.shape) * h;
    n.tip_row = static_cast<uint32_t>(k.row.size()), n.tip_on = foot.point;
    add(row, tip - foot.normal * kTipRadius);
    if (!enters) n.tip_row = wall::kNone;
  }
}

void advance_needles(const NeedlesModel& model, const wall::Model& wm, const wall::State& ws, const Surface& surface,
                     const Bodies& bodies, std::span<Needle> needle, float h, BodiesScratch& k) {
  for (uint32_t i = 0; i < needle.size(); ++i) {
    const NeedleModel& m = model.needle[i];
    Needle& n = needle[i];
    const Body& body = bodies.body[m.body];
    const Vec3 tip = tip_of(m, body.pose), tangent = arc_tangent(m, body.pose, m.shape.arc);
    const auto gave_way = [&](uint32_t row) { return row < k.row.size() && k.row[row].at_limit; };
    leave_channels(m, wm, ws, body.pose, n);
    if (n.events & kTornOut) continue;
    if (!n.inside) {
      if (gave_way(n.tip_row)) {
        const Row& row = k.row[n.tip_row];
        n.entry_peak = length(row.impulse) / h;
        start_channel(n, n.tip_on, n.tip_on.zeta > 0 ? 1.0f : -1.0f);
      } else if (n.channels > 0) {
        // Back out of the exit: the tip is inside again.
        Channel& last = n.channel[n.channels - 1];
        const Vec3 exit = place_of(wm, ws, last.point[last.count - 1]);
        if (last.exit_hole == wall::kNone && dot(tip - exit, tangent) < -0.1e-3f && distance(tip, exit) < 3e-3f) {
          n.tip = last.point[last.count - 1];
          if (last.count > 1) --last.count;
          last.exit_side = 0, last.torn[1] = 0, n.inside = true;
        }
      }
      continue;
    }
    Channel& channel = n.channel[n.channels - 1];
    bool out = false;
    for (uint32_t side = 0; side < 2 && !out; ++side) {
      if (!gave_way(n.exit_row[side])) continue;
      n.exit_peak = length(k.row[n.exit_row[side]].impulse) / h;
      channel.exit_side = side == 0 ? 1.0f : -1.0f;
      if (channel.count == kMaxPath) --channel.count;
      channel.point[channel.count++] = on_face(n.exit_on[side], channel.exit_side);
      n.inside = false, n.events |= kLeft;
      out = true;
    }
    if (out) continue;
    // The tip's material point follows along the needle; what is left across is the tissue's elastic give. A needle that turns
    // about its tip turns part of that into its direction, and has cut nothing: else it sank by a millimeter into the wall.
    const Vec3 there = place_of(wm, ws, n.tip), give = tip - there;
    const float most = length(give - tangent * dot(give, tangent));
    const float along = dot(give, tangent) - std::clamp(dot(n.give, tangent), -most, most);
    float off = 0;
    const wall::Point at = locate(wm, ws, surface, k, there + tangent * along, n.tip, off);
    if (off < 1e8f) n.tip = at;
    // Withdrawn: points ahead of the tip are gone, and with the first of them the channel.
    while (channel.count > 0 &&
           (angle_of(m, body.pose, place_of(wm, ws, channel.point[channel.count - 1])) - m.shape.arc) * m.shape.radius >
               0.15e-3f)
      --channel.count;
    if (channel.count == 0) {
      --n.channels, n.inside = false, n.events |= kWithdrawn;
      continue;
    }
    if (channel.count < kMaxPath - 1 &&
        distance(place_of(wm, ws, n.tip), place_of(wm, ws, channel.point[channel.count - 1])) > kPathStep)
      channel.point[channel.count++] = n.tip;
  }
}

}  // namespace catgut::physical
