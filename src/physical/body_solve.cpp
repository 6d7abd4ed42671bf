// SPDX-License-Identifier: Apache-2.0
// physical/body_solve: motion of the bodies under hands, thread and the solved rows. Declared in physical/body.h.
#include <algorithm>
#include <cmath>

#include "physical/body_internal.h"

namespace catgut::physical {
namespace {

// [kg] that the thread adds to a swage within a step, at most: more than the stiffness of their spring, times h^2.
constexpr float kSwageMass = 20e-3f;
// [kg], [kg m2] that a needle in jaws or tissue weighs more. Between a tool and a wall that weigh ten times as much it needs
// more sweeps than there are: it shook in its jaws by 20 degrees.
constexpr float kHeldMass = 10e-3f, kHeldInertia = 1e-6f;
constexpr float kCatchUp = 0.2f;  // in a step, of the way from where the thread sees a needle to where it is

// [N] on a segment, of a needle that nothing holds, which weighs 20 mN, and of a tool that comes as near to the drape as
// kOnDrape: cloth gives way, and thread between the two is not crushed.
constexpr float kLoosePress = 0.3f;
// [N] Instruments pass through each other here, which their hands would not let them: thread between two of them gives way.
constexpr float kBetweenPress = 4;
constexpr float kBetween = 0.4e-3f;  // [m] apart
// [rad] Jaws that are less open leave no room for a kink of thread between them. It gives way likewise.
constexpr float kShutting = 0.02f;
// [m/s] A needle that nothing holds, and that is faster, is moved by the thread within the thread's step: it stops at a strand
// or is thrown back, with any force. So is one that thread presses with kLoosePress against tissue. At rest on elastic coils it
// would be pushed about for seconds; there it has a drag.
constexpr float kFast = 0.2f;
constexpr float kOnDrape = 0.4e-3f;   // [m]
constexpr float kOpenForce = 2;       // [N] at the tips, maximum with which jaws open against thread round them
constexpr float kSinks = 10e-6f;      // [m] in a step, by which a slowed needle would come deeper than the solve allows
constexpr float kThreadSpeed = 0.8f;  // [m/s] of a node at most: thread::Settings::max_move
constexpr float kCloseForce = 3;      // [N] at the tip of a jaw, maximum with which jaws close on tissue that they do not hold

// Velocity of the hand's target, from the target of the last step.
struct Wish {
  Vec3 away, speed, turn, spin;  // [m], [m/s], [rad], [rad/s]
};
Wish wish_of(const BodyModel& m, const Body& b, const HandTarget& t, float h) {
  Wish w;
  const Vec3 to = transform(t.pose, m.center);
  w.away = to - center_of(m, b), w.turn = rotation_vector(normalized(t.pose.q * conjugate(b.pose.q)));
  if (b.held) {
    w.speed = clamped((to - b.target_place) / h, kMaxSpeed);
    w.spin = clamped(rotation_vector(normalized(t.pose.q * conjugate(b.target_turn))) / h, kMaxSpin);
  }
  return w;
}

// Velocity after the hand's spring, other forces and impulses; inverse inertia for further impulses.
void start_motion(const BodiesModel& model, const BodyModel& m, const Body& b, const HandTarget* t, float h, Vec3 push,
                  Vec3 twist, BodiesScratch::Moving& out) {
  push += b.thread_force * h, twist += b.thread_torque * h;
  out.center = center_of(m, b), out.held = t && t->connected;
  if (!out.held) {
    if (m.falls) push += model.gravity * (m.mass * h);
    if (t) push += t->load * h;
    const float keep = m.falls ? 1 - 2 * h : 1 - 50 * h;
    const float drag = m.falls ? h * out.drag : 0, turn_drag = m.falls ? h * out.turn_drag : 0;
    const bool stuck = m.falls && !out.loose;
    const float more = stuck ? kHeldMass : 0, turns = stuck ? kHeldInertia : 0;
    out.inv_mass = 1 / (m.mass + more + drag), out.inv_inertia = 1 / (m.inertia + turns + turn_drag);
    out.v = (b.velocity * (keep * m.mass + more) + out.drag_speed * drag + push) * out.inv_mass;
    out.w = (b.spin * (keep * m.inertia + turns) + out.drag_spin * turn_drag + twist) * out.inv_inertia;
    return;
  }
  const Wish w = wish_of(m, b, *t, h);
  const float damping = m.damping + out.drag, turn_damping = m.turn_damping + out.turn_drag;
  const float mass = m.mass + h * damping + h * h * m.stiffness;
  out.inv_mass = 1 / mass;
  out.v = (b.velocity * m.mass + (w.away * m.stiffness + w.speed * damping) * h + push) / mass;
  const Vec3 force = (w.away - out.v * h) * m.stiffness + (w.speed - out.v) * damping;
  if (length2(force) > m.max_force * m.max_force) {
    // A hand at its strongest: constant force, no stiffness. Its damping and the thread's drag are inertia only: what has
    // become more since the last step was at rest, or the tool would press with more than the hand.
    out.inv_mass = 1 / (m.mass + h * damping);
    const float moving = m.mass + h * std::min(damping, m.damping + b.drag);
    out.v = (b.velocity * moving + normalized(force) * (m.max_force * h) + push) * out.inv_mass;
  }
  const float inertia = m.inertia + h * turn_damping + h * h * m.turn_stiffness;
  out.inv_inertia = 1 / inertia;
  out.w = (b.spin * m.inertia + (w.turn * m.turn_stiffness + w.spin * turn_damping) * h + twist) / inertia;
  const Vec3 torque = (w.turn - out.w * h) * m.turn_stiffness + (w.spin - out.w) * turn_damping;
  if (length2(torque) > m.max_torque * m.max_torque) {
    out.inv_inertia = 1 / (m.inertia + h * turn_damping);
    const float turning = m.inertia + h * std::min(turn_damping, m.turn_damping + b.turn_drag);
    out.w = (b.spin * turning + normalized(torque) * (m.max_torque * h) + twist) * out.inv_inertia;
  }
}

bool is_on(const thread::Plane* drape, const BodyModel& model, const Body& body) {
  return drape && std::any_of(model.sphere.begin(), model.sphere.end(), [&](const BodySphere& s) {
           const Vec3 at = transform(body.pose, local(model, s, body.opening));
           return dot(drape->normal, at) - drape->offset < std::abs(s.radius) + kOnDrape;
         });
}

}  // namespace

// The thread's force on a tool is one step late. A throw round the jaws holds them from all sides, with up to 1e6 N/m, and the
// jaws' tips weigh 16 g to it: they would be thrown to and fro, in 20 steps with 50 N. A drag toward the hand's motion, as
// great as the load, holds them; where nothing moves it does nothing. A needle that falls on thread, or has it pulled against
// its side, would be thrown away likewise, and one in jaws turned to and fro in their grip: its drag is toward their motion.
void feel_thread(const BodiesModel& model, const Bodies& bodies, const thread::State& thread, const thread::Plane* drape,
                 float substep, float h, BodiesScratch& k) {
  constexpr float kGive = 20e-6f;  // [m] by which a tool moves off thread that presses it, until the thread is slack
  constexpr float kFades = 0.9f;   // in a step: loads that come and go would brake a tool
  k.moving.resize(bodies.body.size());
  for (size_t b = 0; b < bodies.body.size(); ++b) {
    BodiesScratch::Moving& m = k.moving[b];
    m.drag = m.turn_drag = 0, m.drag_speed = m.drag_spin = m.thread_push = m.thread_twist = {};
    const auto holds = [&](const Body& tool) { return tool.grip.what == Gripped::needle && tool.grip.body == b; };
    const auto holder = std::find_if(bodies.body.begin(), bodies.body.end(), holds);
    m.holder =
        model.body[b].falls && holder != bodies.body.end() ? static_cast<uint32_t>(holder - bodies.body.begin()) : wall::kNone;
    m.loose = model.body[b].falls && bodies.body[b].skip == 0 && m.holder == wall::kNone;
    // One that meets the drape squeezes thread against it with no more than one that lies there.
    m.lies = m.loose && is_on(drape, model.body[b], bodies.body[b]);
    m.fast = m.loose && !m.lies && length2(bodies.body[b].velocity) > kFast * kFast;
  }
  std::array<uint32_t, kMaxBodies + 1> first{};  // of the capsules of a body, in the order of show_bodies
  for (size_t b = 0; b < bodies.body.size(); ++b)
    first[b + 1] = first[b] + static_cast<uint32_t>(model.body[b].thread_capsule.size());
  for (size_t i = 0; i < thread.key.size(); ++i) {
    const uint32_t partner = thread::partner_of(thread.key[i]);
    const float load = thread.crossing[i].normal_impulse / (substep * substep);
    if (partner < thread::kTool || load <= 0) continue;
    const auto after = std::upper_bound(first.begin() + 1, first.begin() + bodies.body.size(), partner - thread::kTool);
    const size_t b = static_cast<size_t>(after - first.begin()) - 1;
    const BodyModel& m = model.body[b];
    if (partner - thread::kTool - first[b] >= m.thread_capsule.size()) continue;
    const BodyCapsule& c = m.thread_capsule[partner - thread::kTool - first[b]];
    const Vec3 at = lerp(local(m, m.sphere[c.a], bodies.body[b].opening), local(m, m.sphere[c.b], bodies.body[b].opening),
                         thread.crossing[i].t);
    const float drag = load * h / kGive, arm2 = length2(at - m.center);
    k.moving[b].drag += drag, k.moving[b].turn_drag += drag * arm2;
    k.moving[b].fast |= k.moving[b].loose && load >= 0.99f * kLoosePress && !is_on(drape, m, bodies.body[b]);
    if (!model.body[b].falls || k.moving[b].fast || k.moving[b].holder != wall::kNone) continue;
    const uint32_t node = thread::segment_of(thread.key[i]);
    const Vec3 speed = lerp(thread.v.at(node), thread.v.at(node + 1), thread.crossing[i].s);
    k.moving[b].drag_speed += drag * speed;
    k.moving[b].drag_spin += drag * cross(rotate(bodies.body[b].pose.q, at - m.center), speed);
  }
  for (size_t b = 0; b < bodies.body.size(); ++b) {
    BodiesScratch::Moving& m = k.moving[b];
    if (!model.body[b].falls) {
      m.drag = std::max(m.drag, kFades * bodies.body[b].drag);
      m.turn_drag = std::max(m.turn_drag, kFades * bodies.body[b].turn_drag);
      continue;
    }
    if (m.fast) {
      m.drag = m.turn_drag = 0;
      continue;
    }
    const Body& body = bodies.body[b];
    // Thread that leaves a wedge is faster than the needle was: a drag must not take it along.
    if (m.drag > 0) m.drag_speed = clamped(m.drag_speed / m.drag, length(body.velocity));
    if (m.turn_drag > 0) m.drag_spin = clamped(m.drag_spin / m.turn_drag, length(body.spin));
    // The thread may have left it since then; what it did acts in this step all the same.
    m.drag += length(body.thread_force) * h / kGive;
    m.turn_drag += length(body.thread_torque) * h / kGive * std::sqrt(model.body[b].inertia / model.body[b].mass);
    if (m.holder == wall::kNone) continue;
    const Body& tool = bodies.body[m.holder];
    m.drag_spin = tool.spin;
    m.drag_speed = tool.velocity + cross(tool.spin, center_of(model.body[b], body) - center_of(model.body[m.holder], tool));
  }
}

// [N] with which the wall presses the inner side of each jaw, at the tips; negative: no contact.
static std::array<float, 2> squeeze_of(const BodyModel& m, const Bodies& bodies, uint32_t b, float h) {
  std::array<float, 2> force{-1, -1};
  for (const uint64_t kind : {1, 2}) {
    auto at = std::lower_bound(bodies.memory.begin(), bodies.memory.end(), key_of(kind, b, 0, 0),
                               [](const RowMemory& r, uint64_t key) { return r.key < key; });
    for (; at != bodies.memory.end() && at->key < key_of(kind, b + 1, 0, 0); ++at) {
      const uint32_t part = static_cast<uint32_t>(at->key >> 36) & 0xffff;
      const BodySphere& s = m.sphere[kind == 1 ? part : m.capsule[part].a];
      if (s.jaw == 0) continue;
      const Vec3 outward = rotate(bodies.body[b].pose.q, {static_cast<float>(s.jaw), 0, 0});
      if (dot(at->axis, outward) < 0.3f) continue;
      float& sum = force[s.jaw > 0 ? 1 : 0];
      sum = std::max(sum, 0.0f) + std::max(dot(at->impulse, outward), 0.0f) / h * (m.hinge_z - s.at.z) / m.hinge_z;
    }
  }
  return force;
}

void predict_bodies(const BodiesModel& model, const Bodies& bodies, std::span<const HandTarget> target, float h,
                    BodiesScratch& k) {
  k.moving.resize(bodies.body.size());
  constexpr float kSlow = 0.15f;
  for (size_t i = 0; i < bodies.body.size(); ++i) {
    start_motion(model, model.body[i], bodies.body[i], i < target.size() ? &target[i] : nullptr, h, {}, {}, k.moving[i]);
    k.moving[i].squeeze = 0;
    const Body& b = bodies.body[i];
    const BodyModel& m = model.body[i];
    float opening = i < target.size() && target[i].connected ? target[i].opening : b.opening;
    opening = std::clamp(opening, b.opening - m.jaw_speed * h, b.opening + m.jaw_speed * h);
    if (m.hinge_z > 0 && opening < b.opening) {
      // Jaws that close stop at tissue between them: slow where both meet it, at half of kCloseForce half as fast, above it
      // they yield.
      const std::array<float, 2> force = squeeze_of(m, bodies, static_cast<uint32_t>(i), h);
      const float least = std::min(force[0], force[1]), most = std::max(force[0], force[1]);
      if (least >= 0) opening = b.opening + (opening - b.opening) * (kSlow * std::max(-1.0f, 1 - most / kCloseForce));
      k.moving[i].squeeze = std::max(0.0f, least);
    }
    k.moving[i].opening = opening;
  }
  k.overflow = 0, k.step = h;
  k.row.clear(), k.hold.clear(), k.hold_body.clear(), k.hold_at.clear();
}

void warm_bodies(const BodiesModel& model, const Bodies& bodies, std::span<const HandTarget> target, wall::Scratch& ws, float h,
                 BodiesScratch& k) {
  std::array<Vec3, kMaxBodies> push{}, twist{};
  for (const Row& row : k.row) {
    push[row.a] += row.impulse, twist[row.a] += cross(row.ra, row.impulse);
    if (row.b != wall::kNone) push[row.b] -= row.impulse, twist[row.b] -= cross(row.rb, row.impulse);
    if (row.on_wall) wall::add_to(ws.external, row.point, row.impulse / -h);
  }
  for (size_t i = 0; i < bodies.body.size(); ++i) {
    const float opening = k.moving[i].opening;
    start_motion(model, model.body[i], bodies.body[i], i < target.size() ? &target[i] : nullptr, h, push[i], twist[i],
                 k.moving[i]);
    k.moving[i].opening = opening;
  }
}

// Where two instruments overlap, or are nearly in contact.
static void yield_between(const BodiesModel& model, BodiesScratch& k) {
  for (size_t i = 0; i < k.tool.size(); ++i) {
    const BodyModel& mi = model.body[k.tool_body[i]];
    thread::ToolCapsule& a = k.tool[i];
    for (size_t j = 0; j < i && mi.hinge_z > 0; ++j) {
      if (k.tool_body[j] == k.tool_body[i] || model.body[k.tool_body[j]].hinge_z <= 0) continue;
      thread::ToolCapsule& b = k.tool[j];
      const float near = a.radius + b.radius + kBetween,
                  around = near + 0.5f * (distance(a.to_a, a.to_b) + distance(b.to_a, b.to_b));
      if (length2((a.to_a + a.to_b) - (b.to_a + b.to_b)) > 4 * around * around) continue;
      float s = 0, t = 0;
      nearest_of_segments(a.to_a, a.to_b, b.to_a, b.to_b, s, t);
      if (distance(lerp(a.to_a, a.to_b, s), lerp(b.to_a, b.to_b, t)) > near) continue;
      a.press = std::min(a.press, kBetweenPress), b.press = std::min(b.press, kBetweenPress);
    }
  }
}

// [m/s] of a needle if it moves on as before. Its rows of the last step do not tell: one of them may be gone, as where the
// swage has passed a point of its channel, and the others would throw it aside. One that is held in its place on the drape does
// not fall: with the weight that the spring between them adds, it bounced there.
static Vec3 coasting(const BodiesModel& model, const Body& needle, const BodiesScratch::Moving& moving, float h) {
  return moving.loose && !moving.held ? needle.velocity + model.gravity * h : needle.velocity;
}

void show_bodies(const BodiesModel& model, Bodies& bodies, const thread::Plane* drape, float h, BodiesScratch& k) {
  k.tool.clear(), k.tool_body.clear(), k.loose.clear(), k.loose_body.clear();
  for (uint32_t b = 0; b < bodies.body.size(); ++b) {
    const BodyModel& m = model.body[b];
    Body& body = bodies.body[b];
    const BodiesScratch::Moving& moving = k.moving[b];
    Pose next;
    if (m.falls && !moving.fast) {
      next.q = turned(body.shown.q, clamped(body.spin, kMaxSpin) * h +
                                        rotation_vector(normalized(body.pose.q * conjugate(body.shown.q))) * kCatchUp);
      const Vec3 center = transform(body.shown, m.center);
      next.p = center + clamped(coasting(model, body, moving, h), kMaxSpeed) * h + (moving.center - center) * kCatchUp -
               rotate(next.q, m.center);
    } else {
      next.q = turned(body.pose.q, clamped(moving.w, kMaxSpin) * h);
      next.p = moving.center + clamped(moving.v, kMaxSpeed) * h - rotate(next.q, m.center);
    }
    for (const BodyCapsule& c : m.thread_capsule) {
      const BodySphere &a = m.sphere[c.a], &z = m.sphere[c.b];
      thread::ToolCapsule t;
      t.a = transform(body.shown, local(m, a, body.shown_opening)),
      t.b = transform(body.shown, local(m, z, body.shown_opening));
      t.to_a = transform(next, local(m, a, moving.opening)), t.to_b = transform(next, local(m, z, moving.opening));
      // A needle's point is a cone; jaws are cylinders within their cones, which leave the plane between closed jaws free.
      t.radius = m.falls ? std::abs(a.radius) : std::min(std::abs(a.radius), std::abs(z.radius));
      t.widens = m.falls ? std::abs(z.radius) - t.radius : 0;
      t.friction = m.thread_friction;
      const auto on_drape = [&](Vec3 p) { return drape && dot(drape->normal, p) - drape->offset < t.radius + kOnDrape; };
      // Of a needle in jaws or tissue the swage passes where its thread does. A tip, driven on, would crush thread: it yields.
      const bool swage = m.falls && &c == &m.thread_capsule.front(), tip = m.falls && &c == &m.thread_capsule.back();
      if (moving.fast) t.body = static_cast<uint32_t>(k.loose.size());
      else if (swage && !moving.loose) t.press = 0;
      else if (moving.loose || tip || on_drape(t.to_a) || on_drape(t.to_b)) t.press = kLoosePress;
      else if (a.jaw != 0 && moving.opening < kShutting) t.press = kBetweenPress;
      k.tool.push_back(t), k.tool_body.push_back(b);
    }
    for (size_t i = 0; i < k.hold.size(); ++i)
      if (k.hold_body[i] == b) k.hold[i].to = transform(next, k.hold_at[i]);
    if (moving.fast) {
      thread::ToolBody loose;
      loose.center = transform(body.shown, m.center), loose.to_center = transform(next, m.center);
      loose.inv_mass = moving.inv_mass, loose.inv_inertia = moving.inv_inertia;
      k.loose.push_back(loose), k.loose_body.push_back(b);
    }
    body.shown = next, body.shown_opening = moving.opening;
  }
  if (!model.pair_contact) yield_between(model, k);
}

// Jaws that open against a strand round them do so with a limited force: at half of it half as fast, above it they yield.
static void yield_to_thread(const BodiesModel& model, const Bodies& bodies, BodiesScratch& k) {
  std::array<float, kMaxBodies> closing{};  // [N] of the thread, at the tips
  uint32_t part = 0;
  for (size_t i = 0; i < k.tool.size(); ++i) {
    const uint32_t b = k.tool_body[i];
    part = i > 0 && k.tool_body[i - 1] == b ? part + 1 : 0;
    const BodyModel& m = model.body[b];
    const BodySphere &a = m.sphere[m.thread_capsule[part].a], &z = m.sphere[m.thread_capsule[part].b];
    if (m.hinge_z <= 0 || a.jaw == 0) continue;
    const Vec3 inward = rotate(bodies.body[b].pose.q, {-static_cast<float>(a.jaw), 0, 0});
    closing[b] +=
        (dot(k.tool[i].force_a, inward) * (m.hinge_z - a.at.z) + dot(k.tool[i].force_b, inward) * (m.hinge_z - z.at.z)) /
        m.hinge_z;
  }
  for (size_t b = 0; b < bodies.body.size(); ++b) {
    BodiesScratch::Moving& moving = k.moving[b];
    const float now = bodies.body[b].opening;
    if (model.body[b].hinge_z <= 0 || moving.opening <= now || closing[b] <= 0) continue;
    const float free = std::max(-1.0f, 1 - closing[b] / kOpenForce);
    moving.opening = std::max(0.0f, now + (moving.opening - now) * free);
  }
}

void take_thread_forces(const BodiesModel& model, Bodies& bodies, BodiesScratch& k) {
  // The mean over two steps. The force comes one step late: of turns of thread round a shaft, which weigh about what the shaft
  // does near its tip, it would grow from step to step with alternating signs until they break.
  for (Body& b : bodies.body) b.thread_force = 0.5f * b.thread_force, b.thread_torque = 0.5f * b.thread_torque;
  yield_to_thread(model, bodies, k);
  for (size_t i = 0; i < k.tool.size(); ++i) {
    Body& b = bodies.body[k.tool_body[i]];
    const Vec3 c = k.moving[k.tool_body[i]].center;
    const thread::ToolCapsule& t = k.tool[i];
    b.thread_force += 0.5f * (t.force_a + t.force_b);
    b.thread_torque += 0.5f * (cross(t.a - c, t.force_a) + cross(t.b - c, t.force_b));
  }
  for (size_t i = 0; i < k.loose.size(); ++i) {
    const thread::ToolBody& loose = k.loose[i];
    Body& b = bodies.body[k.loose_body[i]];
    BodiesScratch::Moving& moving = k.moving[k.loose_body[i]];
    moving.thread_push = loose.impulse, moving.thread_twist = loose.twist;
    moving.v += loose.impulse * moving.inv_mass, moving.w += loose.twist * moving.inv_inertia;
    b.shown.q = turned(b.shown.q, loose.turned);
    b.shown.p = loose.to_center + loose.moved - rotate(b.shown.q, model.body[k.loose_body[i]].center);
    // What the capsules report beyond that comes from strands that sleep.
    b.thread_force -= 0.5f * loose.impulse / k.step, b.thread_torque -= 0.5f * loose.twist / k.step;
  }
  for (size_t i = 0; i < k.hold.size(); ++i) {
    const uint32_t index = k.hold_body[i];
    Body& b = bodies.body[index];
    if (model.body[index].hinge_z <= 0) {
      // Needle and thread weigh about the same: the force goes with what the thread would add if the swage moved otherwise. The
      // thread was led as the needle moved before, and slowly to where it has been moved since: so it does not give twice.
      for (Row& row : k.row)
        if (row.kind == Row::Kind::spring && row.a == index) {
          row.soft = row.soft_across = 1 / kSwageMass;
          row.wanted =
              coasting(model, b, k.moving[index], k.step) + cross(b.spin, row.ra) - k.hold[i].force * (k.step * row.soft);
        }
      continue;
    }
    // The same for jaws on a thread: a short strand between them and a hole is as stiff as the grip.
    const uint32_t strand = i > 0 && k.hold_body[i - 1] == index ? 1 : 0;
    const auto row = std::find_if(k.row.begin(), k.row.end(),
                                  [&](const Row& r) { return r.key == key_of(kThreadGripRow, index, strand, 0); });
    if (row != k.row.end()) {
      row->soft = row->soft_across = 1 / (k.hold[i].stiffness * k.step * k.step);
      row->wanted = point_speed(k.moving[index], row->ra) - k.hold[i].force * (k.step * row->soft);
      continue;
    }
    const Vec3 at = transform(b.pose, k.hold_at[i]) - k.moving[index].center;
    b.thread_force -= 0.5f * k.hold[i].force, b.thread_torque -= 0.5f * cross(at, k.hold[i].force);
  }
  // More than any thread bears: a tool was put on a thread from one step to the next.
  constexpr float kMost = 60;  // [N]
  for (Body& b : bodies.body) {
    const float size = length(b.thread_force);
    if (size > kMost) b.thread_force = b.thread_force * (kMost / size), b.thread_torque = b.thread_torque * (kMost / size);
  }
}

void solve_bodies(const BodiesModel& model, const wall::Model& wm, wall::State& ws, wall::Scratch& wscratch, Bodies& bodies,
                  std::span<const HandTarget> target, BodiesScratch& k) {
  const float h = wm.step;
  const size_t n = k.row.size();
  k.points.clear(), k.wall_row.clear();
  for (uint32_t i = 0; i < n; ++i)
    if (k.row[i].on_wall)
      k.row[i].place = static_cast<uint32_t>(k.points.size()), k.points.push_back(k.row[i].point), k.wall_row.push_back(i);
  const size_t walls = k.points.size();
  k.inverse.need(ws.topology, k.points);
  k.w.resize(walls * walls), k.speed.resize(walls), k.change.assign(walls, {});
  for (size_t i = 0; i < walls; ++i) {
    for (size_t j = 0; j <= i; ++j)
      k.w[i * walls + j] = k.w[j * walls + i] = k.inverse.compliance(ws.topology, k.points[i], k.points[j]);
    k.speed[i] = wall::velocity(k.points[i], ws.motion);
  }
  for (Row& row : k.row) {
    const auto inertia = [&](uint32_t body, Vec3 r) {
      const BodiesScratch::Moving& m = k.moving[body];
      row.diagonal_along += m.inv_mass + length2(cross(r, row.axis)) * m.inv_inertia;
      row.diagonal_across += m.inv_mass + length2(r) * m.inv_inertia;
    };
    row.diagonal_along = row.diagonal_across = row.on_wall ? k.w[row.place * walls + row.place] : 0;
    inertia(row.a, row.ra);
    if (row.b != wall::kNone) inertia(row.b, row.rb);
  }
  const auto speed_of = [&](const Row& row) {
    Vec3 u = point_speed(k.moving[row.a], row.ra) + row.speed;
    if (row.b != wall::kNone) u = u - point_speed(k.moving[row.b], row.rb);
    if (row.on_wall) u = u - k.speed[row.place];
    return u;
  };
  const auto give = [&](Row& row, Vec3 d) {
    BodiesScratch::Moving& a = k.moving[row.a];
    a.v += d * a.inv_mass, a.w += cross(row.ra, d) * a.inv_inertia;
    if (row.b != wall::kNone) {
      BodiesScratch::Moving& b = k.moving[row.b];
      b.v -= d * b.inv_mass, b.w -= cross(row.rb, d) * b.inv_inertia;
    }
    if (row.on_wall) {
      k.change[row.place] -= d;
      const float* w = k.w.data() + size_t{row.place} * walls;
      for (size_t j = 0; j < walls; ++j) k.speed[j] -= d * w[j];
    }
  };
  const auto project = [&](Row& row) {
    const Vec3 u = speed_of(row);
    const float un = dot(u, row.axis), pn = dot(row.impulse, row.axis);
    const Vec3 ut = u - row.axis * un, pt = row.impulse - row.axis * pn;
    switch (row.kind) {
      case Row::Kind::contact: {
        const float wanted = row.gap >= 0 ? -row.gap / h : std::min(-row.gap / h, model.push_out);
        float press = std::max(0.0f, pn - (un - wanted + pn * row.soft) / (row.diagonal_along + row.soft));
        row.at_limit = row.along_limit > 0 && press >= row.along_limit;
        if (row.at_limit) press = row.along_limit;
        return row.axis * press + clamped(pt - ut / row.diagonal_across, row.friction * press);
      }
      case Row::Kind::channel: {  // free along the needle but for friction; held across it
        const float slide = std::clamp(pn - un / row.diagonal_along, -row.along_limit, row.friction * row.along_limit);
        const Vec3 wanted = across(row.wanted, row.axis);
        const Vec3 side = pt - (ut - wanted + pt * row.soft) / (row.diagonal_across + row.soft);
        return row.axis * slide + clamped(side, row.across_limit);
      }
      case Row::Kind::grip: {
        const float wn = dot(row.wanted, row.axis);
        const float hold =
            std::clamp(pn - (un - wn + pn * row.soft) / (row.diagonal_along + row.soft), -row.along_limit, row.along_limit);
        const Vec3 wanted = across(row.wanted, row.axis);
        const Vec3 side = pt - (ut - wanted + pt * row.soft) / (row.diagonal_across + row.soft);
        row.at_limit = length2(side) > row.across_limit * row.across_limit;
        return row.axis * hold + clamped(side, row.across_limit);
      }
      default: {  // spring
        const float wn = dot(row.wanted, row.axis);
        const float pull = pn - (un - wn + pn * row.soft) / (row.diagonal_across + row.soft);
        const Vec3 side =
            pt - (ut - (row.wanted - row.axis * wn) + pt * row.soft_across) / (row.diagonal_across + row.soft_across);
        return clamped(row.axis * pull + side, row.across_limit);
      }
    }
  };
  k.before.resize(n), k.onward.assign(n, {});
  float last2 = 0;
  for (k.swept = 0; n > 0;) {
    for (size_t i = 0; i < n; ++i) k.before[i] = k.row[i].impulse;
    for (size_t i = 0; i < n; ++i) {
      const Vec3 to = project(k.row[i]), d = to - k.row[i].impulse;
      if (d == Vec3{}) continue;
      k.row[i].impulse = to;
      give(k.row[i], d);
    }
    float changed2 = 0, largest2 = 0, sum2 = 0;
    for (size_t i = 0; i < n; ++i) {
      const float d2 = length2(k.row[i].impulse - k.before[i]);
      changed2 = std::max(changed2, d2), sum2 += d2, largest2 = std::max(largest2, length2(k.row[i].impulse));
    }
    if (++k.swept >= model.sweeps || changed2 <= model.accuracy * model.accuracy * largest2) break;
    // Accelerated as in wall/contact: the next sweep starts from an extrapolation, and projects any overshoot back.
    const float beta = last2 > 0 ? sum2 / last2 : 0;
    last2 = sum2;
    for (size_t i = 0; i < n; ++i) {
      const Vec3 d = k.row[i].impulse - k.before[i];
      if (beta >= 1 || beta == 0) {
        k.onward[i] = beta == 0 ? d : Vec3{};
        continue;
      }
      const Vec3 more = k.onward[i] * beta;
      k.onward[i] = more + d;
      if (more == Vec3{}) continue;
      k.row[i].impulse += more;
      give(k.row[i], more);
    }
  }
  std::fill(wscratch.external.begin(), wscratch.external.end(), wall::Float4{});
  for (size_t i = 0; i < walls; ++i) wall::add_to(wscratch.external, k.points[i], k.change[i]);
  if (walls > 0) wall::apply_impulses(ws, wscratch, wscratch.external);
  std::fill(wscratch.external.begin(), wscratch.external.end(), wall::Float4{});

  for (uint32_t b = 0; b < bodies.body.size(); ++b) {
    const BodyModel& m = model.body[b];
    Body& body = bodies.body[b];
    BodiesScratch::Moving& moving = k.moving[b];
    Vec3 force{}, torque{};
    for (const Row& row : k.row) {
      if (row.a == b) force += row.impulse / h, torque += cross(row.ra, row.impulse) / h;
      if (row.b == b) force -= row.impulse / h, torque -= cross(row.rb, row.impulse) / h;
    }
    body.force = force + body.thread_force + moving.thread_push / h;
    body.torque = torque + body.thread_torque + moving.thread_twist / h;
    const bool loose = m.falls && moving.holder == wall::kNone;
    if (loose && (moving.held || moving.lies)) moving.w = moving.w * (1 - kBedDrag * h);
    if (moving.lies) moving.v = moving.v * (1 - kBedDrag * h);
    moving.v = clamped(moving.v, kMaxSpeed), moving.w = clamped(moving.w, kMaxSpin);
    BodiesScratch::Moving slow = moving;
    slow.v = clamped(moving.v, loose ? kLooseSpeed : kMaxSpeed), slow.w = clamped(moving.w, loose ? kLooseSpin : kMaxSpin);
    // One that thread or a contact throws away faster than this would sink into it: it is slowed after its step, unless its
    // swage would outrun its thread.
    const auto sinks = [&](const Row& row) {
      if (row.kind != Row::Kind::contact || (row.a != b && row.b != b) || dot(row.impulse, row.axis) <= 0) return false;
      const Vec3 r = row.a == b ? row.ra : row.rb, lost = point_speed(moving, r) - point_speed(slow, r);
      return (row.a == b ? dot(lost, row.axis) : -dot(lost, row.axis)) * h > kSinks;
    };
    const auto outruns = [&](const Row& row) {
      return row.kind == Row::Kind::spring && row.a == b && length2(point_speed(moving, row.ra)) > kThreadSpeed * kThreadSpeed;
    };
    const bool too_fast = !(slow.v == moving.v && slow.w == moving.w);
    if (too_fast && ((moving.thread_push == Vec3{} && std::none_of(k.row.begin(), k.row.end(), sinks)) ||
                     std::any_of(k.row.begin(), k.row.end(), outruns)))
      moving.v = slow.v, moving.w = slow.w;
    body.hand_force = body.hand_torque = {};
    if (moving.held) {
      const Wish w = wish_of(m, body, target[b], h);
      body.hand_force =
          clamped((w.away - moving.v * h) * m.stiffness + (w.speed - moving.v) * (m.damping + moving.drag), m.max_force);
      body.hand_torque = clamped(
          (w.turn - moving.w * h) * m.turn_stiffness + (w.spin - moving.w) * (m.turn_damping + moving.turn_drag), m.max_torque);
      body.target_place = transform(target[b].pose, m.center), body.target_turn = target[b].pose.q;
    }
    body.held = moving.held;
    body.drag = moving.drag, body.turn_drag = moving.turn_drag;
    body.velocity = slow.v, body.spin = slow.w, body.opening = moving.opening;
    body.pose.q = turned(body.pose.q, moving.w * h);
    body.pose.p = moving.center + moving.v * h - rotate(body.pose.q, m.center);
  }
  bodies.overflow += k.overflow;
  bodies.memory.clear();
  for (const Row& row : k.row)
    if (row.kind != Row::Kind::grip && !(row.impulse == Vec3{})) bodies.memory.push_back({row.key, row.axis, row.impulse});
  std::sort(bodies.memory.begin(), bodies.memory.end(), [](const RowMemory& x, const RowMemory& y) { return x.key < y.key; });
}

}  // namespace catgut::physical
