// SPDX-License-Identifier: Apache-2.0
// solver/thread_touch: reads and writes ThreadScratch, pushes tools. See the header.
#include "solver/thread_touch.h"

#include <algorithm>
#include <cmath>

#include "solver/collide.h"
#include "solver/thread.h"

namespace catgut {
namespace {

constexpr float kTouching = 2e-5f;   // [m] below this distance the two touch
constexpr float kConcerned = 0.25f;  // a segment touched beyond this fraction of its length also involves its other node
constexpr float kRecovery = 0.1f;    // [m/s] at which earlier overlap is resolved, slowly enough not to eject the thread
// [m/s] of sliding at which friction reaches its limit; below, it is proportional to the speed. Rigid stiction would turn
// micrometers into newtons (thread segments are that stiff), and alternating stick and slip would excite the thread.
constexpr float kCreep = 0.005f;

// W p of a free node, with the geometric stiffness of find_masses.
Vec3 move_of(const ThreadScratch& s, size_t i, Vec3 p) {
  const Vec3 t = way_before(s, i) + way_after(s, i);
  return (p * s.side[i] + t * (s.tilt[i] * dot(p, t))) * s.w[i];
}
// The same for a node in contact: along the normal only with the tool, along the tool as far as friction allows.
Vec3 move_of(const ThreadScratch& s, const NodeContact& c, Vec3 p) {
  const Vec3 free = move_of(s, c.node, p);
  return (free - c.reply * (dot(free, c.n) / c.own_inv_mass)) * c.slides + c.n * (c.tool_inv_mass * dot(p, c.n));
}
// A segment x0-x1 against a capsule with axis p-q.
struct Meeting {
  float gap = 1, part = 0;  // [m]; fraction of the segment's length
  Vec3 n, on;               // out of the tool; on its axis [m]
};
Meeting meet(Vec3 x0, Vec3 x1, Vec3 p, Vec3 q, float reach) {
  Meeting m;
  const auto [s, t] = closest_on_segments(x0, x1, p, q);
  m.part = s;
  m.on = lerp(p, q, t);
  const Vec3 d = lerp(x0, x1, s) - m.on;
  const float l = length(d);
  if (l < 1e-8f) return m;  // axis on axis: the direction is undefined
  m.n = d / l;
  m.gap = l - reach;
  return m;
}

// Position of a node at the start of the substep.
Vec3 came_from(const ThreadScratch& s, size_t i) { return {s.from_x[i], s.from_y[i], s.from_z[i]}; }
// Position to which the tool has carried a node since the start of the substep.
Vec3 carried(const ThreadScratch& s, const NodeContact& c, const RigidBody& b) {
  return transform(b.pose(), to_local(Pose{b.prev_x, b.prev_q}, came_from(s, c.node)));
}

// Coulomb friction as an implicit drag of mu N / v. N is the normal force of the last substep's tensions, v the speed of
// the last substep's sliding. In steady sliding that equals mu N, and the capstan equation follows node by node.
void feel_friction(ThreadScratch& s, NodeContact& c, const RigidBody& b, float h) {
  const size_t i = c.node;
  const Vec3 n0 = i > 0 ? normalized(node(s, i) - node(s, i - 1)) : Vec3{}, n1 = normalized(node(s, i + 1) - node(s, i));
  const Vec3 load = n1 * s.tension[i] - n0 * (i > 0 ? s.tension[i - 1] : 0);  // [N]
  const Vec3 at = node(s, i), stays = carried(s, c, b);
  Vec3 slid = at - stays;
  slid -= c.n * dot(slid, c.n);
  const float limit = s.touch_friction * std::max(0.0f, -dot(load, c.n)) * h * h;
  Vec3 speed = c.start - stays;  // [m] per substep
  speed -= c.n * dot(speed, c.n);
  const float grip = std::max(length(speed), kCreep * h) / std::max(limit, 1e-20f);  // [1/kg]
  c.slides = grip / (grip + s.w[i]);
  put_node(s, i, at - slid * (1 - c.slides));
}

}  // namespace

bool update_contacts(const StrandModel& model, ThreadScratch& s, const std::vector<RigidModel>& body_model,
                     const std::vector<RigidBody>& body, float h) {
  bool changed = false;
  for (NodeContact& c : s.contact) c.gap = 1;
  for (const ThreadTouch& touch : s.touch) {
    const size_t i = touch.pair;
    if (s.intact[i] == 0) continue;
    const Capsule& capsule = body_model[touch.body].capsule[touch.capsule];
    const Pose pose = body[touch.body].pose();
    const float reach = capsule.radius + model.radius;
    const Meeting m = meet(node(s, i), node(s, i + 1), transform(pose, capsule.a), transform(pose, capsule.b), reach);
    if (m.gap > kTouching) continue;
    const float part[2] = {1 - m.part, m.part};
    if (m.gap < 0) {
      // A thread node of 2 mg is placed outside directly. The solve after it turns the resulting stretch into tension, and the
      // tension into force on the tool.
      const RigidBody& b = body[touch.body];
      const Pose then{b.prev_x, b.prev_q};
      const Meeting was =
          meet(came_from(s, i), came_from(s, i + 1), transform(then, capsule.a), transform(then, capsule.b), reach);
      const float before = length2(was.n) > 0 ? was.gap : m.gap;
      const float depth = std::max(0.0f, std::min(0.0f, before + kRecovery * h) - m.gap);
      const float w = s.is_free[i] * part[0] * part[0] + s.is_free[i + 1] * part[1] * part[1];
      for (size_t k = 0; k < 2 && w > 0; ++k)
        if (s.is_free[i + k] > 0) put_node(s, i + k, node(s, i + k) + m.n * (depth * part[k] / w));
    }
    for (size_t k = 0; k < 2; ++k) {
      if (part[k] < kConcerned || s.contact_at[i + k] < 0) continue;
      NodeContact& c = s.contact[static_cast<size_t>(s.contact_at[i + k])];
      if (m.gap > c.gap || (c.released && m.gap >= 0)) continue;
      changed = changed || !c.active;
      c.fresh = !c.active;
      c.active = true;
      c.released = false;
      c.gap = m.gap;
      c.n = m.n;
      c.body = touch.body;
      c.at = m.on + m.n * capsule.radius;
    }
  }
  for (NodeContact& c : s.contact)
    if (c.active && c.fresh) {
      c.fresh = false;
      feel_friction(s, c, body[c.body], h);
    }
  return changed;
}

void compute_effective_masses(ThreadScratch& s, const std::vector<RigidModel>& body_model, const std::vector<RigidBody>& body) {
  // A tool moves by the sum of all impulses on it. A node therefore uses the total along its own normal, as given by the
  // tensions, divided by its own share.
  s.load.assign(body.size(), {});
  auto load_of = [&](const NodeContact& c) {
    return way_after(s, c.node) * s.tension[c.node] - way_before(s, c.node) * (c.node > 0 ? s.tension[c.node - 1] : 0);
  };
  for (const NodeContact& c : s.contact)
    if (c.active) s.load[c.body] += load_of(c);
  for (NodeContact& c : s.contact) {
    if (!c.active) continue;
    const float own = dot(load_of(c), c.n), whole = dot(s.load[c.body], c.n);
    const float sharing = own < -1e-6f ? std::max(1.0f, whole / own) : 1;
    const RigidBody& b = body[c.body];
    const size_t i = c.node;
    const Vec3 n0 = way_before(s, i), n1 = way_after(s, i), t = n0 + n1;
    // Perpendicular to the thread: a tilted normal would take tension from one side of the node.
    const Vec3 across = c.n - t * (dot(c.n, t) / std::max(length2(t), 1e-6f));
    if (length2(across) > 0.01f) c.n = normalized(across);
    c.reply = move_of(s, i, c.n);
    c.own_inv_mass = dot(c.n, c.reply);
    c.tool_inv_mass = sharing * inverse_mass_at(body_model[c.body], b, c.at - b.x, c.n);
    s.mass_before[i] = dot(n0, move_of(s, c, n0));
    s.mass_after[i] = dot(n1, move_of(s, c, n1));
    s.across[i] = dot(n0, move_of(s, c, n1));
  }
}

void push_tool(ThreadScratch& s, const NodeContact& c, Vec3 p, const std::vector<RigidModel>& body_model,
               std::vector<RigidBody>& body) {
  RigidBody& b = body[c.body];
  const Vec3 r = c.at - b.x;
  push(body_model[c.body], b, p, r);
  s.on_tool[c.body].linear += p;
  s.on_tool[c.body].angular += cross(r, p);
}

void save_positions(ThreadScratch& s) {
  for (NodeContact& c : s.contact) c.from = node(s, c.node);
}

bool move_contacts(ThreadScratch& s, float limit, const std::vector<RigidModel>& body_model, std::vector<RigidBody>& body) {
  bool changed = false;
  for (NodeContact& c : s.contact) {
    if (!c.active) continue;
    const Vec3 p = impulse_on(s, c.node), free = move_of(s, c.node, p);
    const float push_out = -dot(free, c.n) / c.own_inv_mass;
    if (c.pushed + push_out < 0) {
      c.active = false;  // it moves off as it would without the tool, as move_loose_nodes has done
      c.released = changed = true;
      continue;
    }
    Vec3 step = move_of(s, c, p);
    const float reach = length(step);
    if (reach > limit) step = step * (limit / reach);
    put_node(s, c.node, c.from + step);
    c.pushed += push_out;
    // The tool receives the normal part and the part that friction transmits.
    const Vec3 along = p - c.n * dot(p, c.n);
    push_tool(s, c, c.n * -push_out + along * (1 - c.slides), body_model, body);
  }
  return changed;
}

}  // namespace catgut
