// SPDX-License-Identifier: Apache-2.0
// thread/contact: contact of the thread with itself, tools and a plane, without passing through, with friction that sticks.
// Reads the pair list and the predicted motion; writes motion, impulses and the memory of each crossing.
//   A crossing's normal is transported: a strand pressed to the wrong side is pushed back to its own side. Impulses of
//   the
// last substep are applied first and then corrected, so a held load does not depend on the number of sweeps. Sticking remembers
// the tangential motion that it could not undo (drift) and undoes a fifth of it per substep: without that a held knot
// creeps. Method: projected Gauss-Seidel in XPBD (Macklin et al. 2019, 10.1145/3309486.3340247), with warm start.
#include <algorithm>
#include <cmath>

#include "thread/internal.h"

namespace catgut::thread {
namespace {

constexpr float kToolPress = 20;  // [N] maximum of a tool on a segment: thread wedged between two rigid tools yields

Four motion(const Scratch& s, const Active& c) {
  const Four* u = s.contact_u.data();
  return (u[c.i] * c.wi0 + u[c.i + 1] * c.wi1) + (u[c.j] * c.wj0 + u[c.j + 1] * c.wj1) - c.partner;
}

void apply(Scratch& s, const Active& c, Four impulse) {
  Four* u = s.contact_u.data();
  u[c.i] += impulse * c.mi0;
  u[c.i + 1] += impulse * c.mi1;
  u[c.j] += impulse * c.mj0;
  u[c.j + 1] += impulse * c.mj1;
}

void load_motion(Scratch& s) {
  for (uint32_t i : s.contact_node) s.contact_u[i] = Four{s.u.x[i], s.u.y[i], s.u.z[i], 0};
}
void store_motion(Scratch& s) {
  for (uint32_t i : s.contact_node) {
    const Four u = s.contact_u[i];
    s.u.x[i] = u[0], s.u.y[i] = u[1], s.u.z[i] = u[2];
  }
}
void use_node(Scratch& s, uint32_t i) {
  if (s.touched[i]) return;
  s.touched[i] = 1;
  s.contact_node.push_back(i);
  s.contact_u[i] = Four{s.u.x[i], s.u.y[i], s.u.z[i], 0};
}

void add_active(const Settings& settings, Scratch& s, Active c, float gap, Vec3 drift, float ln, Vec3 lt) {
  c.mi0 = c.wi0 * s.w[c.i], c.mi1 = c.wi1 * s.w[c.i + 1], c.mj0 = c.wj0 * s.w[c.j], c.mj1 = c.wj1 * s.w[c.j + 1];
  const float w = c.wi0 * c.mi0 + c.wi1 * c.mi1 + c.wj0 * c.mj0 + c.wj1 * c.mj1;
  if (w <= 0) return;
  for (uint32_t i : {c.i, c.i + 1, c.j, c.j + 1}) use_node(s, i);
  c.inverse = 1 / w;
  c.level = gap - dot(c.normal, motion(s, c));
  c.pull_back = four(settings.anchor * drift);
  c.ln = ln;
  c.lt = four(tangential(lt, three(c.normal)));
  s.active.push_back(c);
}

Vec3 direction(const Scratch& s, size_t i) { return normalized(s.e.at(i) + s.u.at(i + 1) - s.u.at(i), Vec3{1, 0, 0}); }

// A contact of a polygon stands for the arc on which a real thread would bear: there the normals turn, and the sum of their
// magnitudes, on which friction acts, exceeds their vector sum N. A tension T that bears N turns by an angle 2 a with
// sin a = N / (2 T), and its normal forces add up to 2 a T. Returns their ratio a / sin a, at most 1.5. The polygon's own angle
// bounds a: a strand that is squeezed but straight does not turn.
float arc_factor(const State& state, const Scratch& s, uint32_t i, float normal_force) {
  const float tension = state.tension[i];
  if (normal_force <= 0 || tension <= 0 || i == 0 || i + 1 == state.segments() || state.broken[i - 1] || state.broken[i + 1])
    return 1;
  const float x = std::min(0.5f * length(direction(s, i + 1) - direction(s, i - 1)), normal_force / (2 * tension));
  return 3 / (2 + std::sqrt(std::max(0.0f, 1 - x * x)));  // a / sin a within 1 % to 60 degrees (Snell)
}

// Geometry of one pair at the predicted positions. Returns the motion after which the pair must be evaluated
// again.
float look_at(const Settings& settings, State& state, Scratch& s, Surroundings& around, float time, size_t k) {
  const uint32_t key = state.key[k], i = segment_of(key), other = partner_of(key);
  Crossing& c = state.crossing[k];
  const float d = settings.material.diameter, ready = kReady * d;
  const Vec3 a = s.e.at(i) + s.u.at(i + 1) - s.u.at(i);
  Vec3 p, b, base;
  float surface = d;
  if (other < kTool) {
    p = between(state, i, other) + s.u.at(i) - s.u.at(other);
    b = s.e.at(other) + s.u.at(other + 1) - s.u.at(other);
  } else {
    const ToolCapsule& tool = around.tools[other - kTool];
    base = lerp(tool.a, tool.to_a, time);
    p = (state.x.at(i) - base) + state.fine.at(i) + s.u.at(i);
    b = lerp(tool.b, tool.to_b, time) - base;
    if (length2(b) < 1e-12f) b = {1e-6f, 0, 0};
    surface = tool.radius + 0.5f * d;
  }
  closest_points(p, a, b, c.s, c.t);
  const Vec3 apart = p + a * c.s - b * c.t;
  float far = length(apart);
  if (c.touch == Touch::unknown) {
    c.normal = normalized(apart, any_perpendicular(normalized(a, {1, 0, 0})));
    c.touch = Touch::apart;
  } else if (far > 1e-9f) {
    Vec3 n = apart / far;
    // At a distance below one diameter a normal cannot reverse within one substep: the strands have passed into each other.
    if (other < kTool && far < d && dot(n, c.normal) < -0.3f) n = -n, far = -far;
    c.normal = n;
  }
  c.gap = far - surface;
  if (c.gap > ready) {
    c.normal_impulse = 0, c.friction_impulse = {}, c.drift = {}, c.touch = Touch::apart;
    return c.gap - ready;
  }
  const float h2 = settings.substep * settings.substep, normal_force = c.normal_impulse / h2;
  float arc = arc_factor(state, s, i, normal_force);
  Active active;
  active.i = i, active.wi0 = 1 - c.s, active.wi1 = c.s, active.normal = four(c.normal),
  active.crossing = static_cast<uint32_t>(k);
  if (other < kTool) {
    active.j = other, active.wj0 = c.t - 1, active.wj1 = -c.t, active.mu = settings.material.friction;
    arc = std::max(arc, arc_factor(state, s, other, normal_force));
  } else {
    active.j = i;
    active.mu = around.tools[other - kTool].friction;
    active.most = kToolPress * h2;
    active.partner = four(lerp(s.tool_move[2 * (other - kTool)], s.tool_move[2 * (other - kTool) + 1], c.t));
  }
  active.mu *= arc;
  add_active(settings, s, active, c.gap, c.drift, c.normal_impulse, c.friction_impulse);
  return 0;
}

}  // namespace

void begin_contacts(const Settings& settings, State& state, Scratch& s, Surroundings& around, float time) {
  s.active.clear(), s.contact_node.clear();
  const float* moved = s.segment_move.data();
  const size_t pairs = state.key.size();
  for (size_t k = 0; k < around.tools.size(); ++k) {
    const float part = 1.0f / static_cast<float>(settings.substeps);
    s.tool_move[2 * k] = (around.tools[k].to_a - around.tools[k].a) * part;
    s.tool_move[2 * k + 1] = (around.tools[k].to_b - around.tools[k].b) * part;
  }
  for (size_t k = 0; k < pairs; ++k) {
    const uint32_t key = state.key[k], other = partner_of(key);
    const float partner =
        other < kTool
            ? moved[other]
            : std::sqrt(std::max(length2(s.tool_move[2 * (other - kTool)]), length2(s.tool_move[2 * (other - kTool) + 1])));
    float left = state.budget[k] - moved[segment_of(key)] - partner;
    if (left <= 0) left = look_at(settings, state, s, around, time, k);
    state.budget[k] = left;
  }
  if (around.plane) begin_plane(settings, state, s, *around.plane);
  for (uint32_t i : s.contact_node) s.touched[i] = 0;
  for (const Active& c : s.active) apply(s, c, c.normal * c.ln + c.lt);
  store_motion(s);
  if (around.plane) warm_plane(state, s, *around.plane);
}

void sweep_contacts(const Settings& settings, State& state, Scratch& s, const Surroundings& around, bool backward) {
  if (around.plane && backward) sweep_plane(settings, state, s, *around.plane);
  load_motion(s);
  const size_t count = s.active.size();
  for (size_t k = 0; k < count; ++k) {
    Active& c = s.active[backward ? count - 1 - k : k];
    apply(s, c, correct(c, motion(s, c)));
  }
  store_motion(s);
  if (around.plane && !backward) sweep_plane(settings, state, s, *around.plane);
}

void end_contacts(const Settings& settings, State& state, Scratch& s, Surroundings& around) {
  const float newtons = 1 / (settings.substep * settings.substep * static_cast<float>(settings.substeps));
  load_motion(s);  // with what the plane has done
  for (const Active& c : s.active) {
    const Vec3 went = three(motion(s, c)), normal = three(c.normal), moved = tangential(went, normal);
    const Vec3 impulse = three(c.normal * c.ln + c.lt);
    const uint32_t other = partner_of(state.key[c.crossing]);
    if (c.ln > 0)
      for (uint32_t i : {c.i, c.i + 1, c.j, c.j + 1}) s.touched[i] |= other < kTool ? kOnThread : kOnOther;
    Crossing& crossing = state.crossing[c.crossing];
    crossing.drift = new_drift(settings, c, crossing.drift, moved);
    crossing.normal_impulse = c.ln, crossing.friction_impulse = three(c.lt);
    crossing.gap = c.level + dot(normal, went);
    crossing.touch = c.ln <= 0 ? Touch::apart : c.slipped ? Touch::slip : Touch::stick;
    if (other >= kTool) {
      ToolCapsule& tool = around.tools[other - kTool];
      tool.force_a -= impulse * (newtons * (1 - crossing.t));
      tool.force_b -= impulse * (newtons * crossing.t);
    }
  }
  if (around.plane) end_plane(settings, state, s, *around.plane);
}

}  // namespace catgut::thread
