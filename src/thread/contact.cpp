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

Four motion(const Scratch& s, const Active& c) {
  const Four* u = s.contact_u.data();
  const Four moved = (u[c.i] * c.wi0 + u[c.i + 1] * c.wi1) + (u[c.j] * c.wj0 + u[c.j + 1] * c.wj1) - c.partner;
  if (c.body == ToolCapsule::kNoBody) return moved;
  const Scratch::MovedBody& b = s.body[c.body];
  return moved - four((b.moved - b.moved_before) + cross(b.turned - b.turned_before, c.arm));
}

void apply(Scratch& s, const Active& c, Four impulse) {
  Four* u = s.contact_u.data();
  u[c.i] += impulse * c.mi0;
  u[c.i + 1] += impulse * c.mi1;
  u[c.j] += impulse * c.mj0;
  u[c.j + 1] += impulse * c.mj1;
  if (c.body == ToolCapsule::kNoBody) return;
  Scratch::MovedBody& b = s.body[c.body];
  const Vec3 p = three(impulse), q = cross(c.arm, p);
  b.moved -= p * b.per_impulse, b.turned -= q * b.per_twist;
  b.impulse -= p, b.twist -= q;
}

// What the thread has done to the bodies of tools since the last substep moves their capsules.
void move_tools(Scratch& s, Surroundings& around, float time) {
  for (size_t k = 0; k < around.tools.size(); ++k) {
    ToolCapsule& tool = around.tools[k];
    if (tool.body == ToolCapsule::kNoBody) continue;
    const Scratch::MovedBody& b = s.body[tool.body];
    const Vec3 moved = b.moved - b.moved_before, turned = b.turned - b.turned_before;
    const auto by = [&](Vec3 from, Vec3 to) { return moved + cross(turned, lerp(from, to, time) - b.center); };
    const Vec3 at_a = by(tool.a, tool.to_a), at_b = by(tool.b, tool.to_b);
    tool.a += at_a, tool.to_a += at_a, tool.b += at_b, tool.to_b += at_b;
    s.pushed[k] = std::sqrt(std::max(length2(at_a), length2(at_b)));
  }
  for (size_t k = 0; k < s.body.size(); ++k) {
    Scratch::MovedBody& b = s.body[k];
    b.moved_before = b.moved, b.turned_before = b.turned;
    b.center = lerp(around.bodies[k].center, around.bodies[k].to_center, time) + b.moved;
  }
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
template <typename AnyColumns>
Four four_at(const AnyColumns& c, size_t i) {
  return Four{c.x[i], c.y[i], c.z[i], 0};
}
Four tangential(Four v, Four n) { return v - n * dot(v, n); }

void use_node(Scratch& s, uint32_t i) {
  if (s.touched[i]) return;
  s.touched[i] = 1;
  s.contact_node.push_back(i);
  s.contact_u[i] = four_at(s.u, i);
}

// Segment i at the predicted positions.
Four edge(const Scratch& s, size_t i) { return four_at(s.e, i) + four_at(s.u, i + 1) - four_at(s.u, i); }
Four direction(const Scratch& s, size_t i) {
  const Four e = edge(s, i);
  const float l = std::sqrt(dot(e, e));
  return l > 1e-20f ? e * (1 / l) : Four{1, 0, 0, 0};
}

// A contact of a polygon stands for the arc on which a real thread would bear: there the normals turn, and the sum of their
// magnitudes, on which friction acts, exceeds their vector sum N. A tension T that bears N turns by an angle 2 a with
// sin a = N / (2 T), and its normal forces add up to 2 a T. Returns their ratio a / sin a, at most 1.5. The polygon's own angle
// bounds a: a strand that is squeezed but straight does not turn.
float arc_factor(const State& state, const Scratch& s, uint32_t i, float normal_force) {
  const float tension = state.tension[i];
  if (normal_force <= 0 || tension <= 0 || i == 0 || i + 1 == state.segments() || state.broken[i - 1] || state.broken[i + 1])
    return 1;
  const Four turn = direction(s, i + 1) - direction(s, i - 1);
  const float x = std::min(0.5f * std::sqrt(dot(turn, turn)), normal_force / (2 * tension));
  return 3 / (2 + std::sqrt(std::max(0.0f, 1 - x * x)));  // a / sin a within 1 % to 60 degrees (Snell)
}

// Geometry of one pair at the predicted positions. Returns the motion after which the pair must be evaluated
// again.
float look_at(const Settings& settings, State& state, Scratch& s, Surroundings& around, float time, size_t k) {
  const uint32_t key = state.key[k], i = segment_of(key), other = partner_of(key);
  Crossing& c = state.crossing[k];
  const float d = settings.material.diameter, ready = kReady * d;
  const Four a = edge(s, i);
  Four p, b;
  float surface = d;
  if (other < kTool) {
    p = (four_at(state.x, i) - four_at(state.x, other)) + (four_at(state.fine, i) - four_at(state.fine, other)) +
        four_at(s.u, i) - four_at(s.u, other);
    b = edge(s, other);
  } else {
    const ToolCapsule& tool = around.tools[other - kTool];
    const Vec3 base = lerp(tool.a, tool.to_a, time);
    p = (four_at(state.x, i) - four(base)) + four_at(state.fine, i) + four_at(s.u, i);
    b = four(lerp(tool.b, tool.to_b, time) - base);
    if (dot(b, b) < 1e-12f) b = Four{1e-6f, 0, 0, 0};
    surface = 0.5f * d;  // and the radius where it touches
  }
  closest_points(p, a, b, c.s, c.t);
  if (other >= kTool) {
    const ToolCapsule& tool = around.tools[other - kTool];
    surface += tool.radius + tool.widens * c.t;
  }
  const Four apart = p + a * c.s - b * c.t;
  float far = std::sqrt(dot(apart, apart));
  Four normal = four(c.normal);
  if (c.touch == Touch::unknown) {
    normal = four(normalized(three(apart), any_perpendicular(normalized(three(a), {1, 0, 0}))));
    c.touch = Touch::apart;
  } else if (far > 1e-9f) {
    Four n = apart * (1 / far);
    // Of two that overlap a normal cannot reverse within one substep: they have passed into each other. A tool in a hand is
    // left out: jaws are put on thread, or closed on it.
    const bool both_yield = other < kTool || around.tools[other - kTool].body != ToolCapsule::kNoBody;
    if (both_yield && far < surface && dot(n, normal) < -0.3f) n = -n, far = -far;
    normal = n;
  }
  c.normal = three(normal);
  c.gap = far - surface;
  if (c.gap > ready) {
    c.normal_impulse = 0, c.friction_impulse = {}, c.drift = {}, c.touch = Touch::apart;
    return c.gap - ready;
  }
  const float wi0 = 1 - c.s, wi1 = c.s, mi0 = wi0 * s.w[i], mi1 = wi1 * s.w[i + 1];
  float w = wi0 * mi0 + wi1 * mi1;
  const bool thread = other < kTool;
  const float wj0 = thread ? c.t - 1 : 0.0f, wj1 = thread ? -c.t : 0.0f;
  const uint32_t j = thread ? other : i;
  const float mj0 = wj0 * s.w[j], mj1 = wj1 * s.w[j + 1];
  w = w + wj0 * mj0 + wj1 * mj1;
  if (w <= 0) return 0;
  const float h2 = settings.substep * settings.substep, normal_force = c.normal_impulse / h2;
  float arc = arc_factor(state, s, i, normal_force);
  Active& active = s.active.emplace_back();
  active.normal = normal;
  active.wi0 = wi0, active.wi1 = wi1, active.wj0 = wj0, active.wj1 = wj1;
  active.mi0 = mi0, active.mi1 = mi1, active.mj0 = mj0, active.mj1 = mj1;
  active.i = i, active.j = j, active.crossing = static_cast<uint32_t>(k);
  if (thread) {
    active.mu = settings.material.friction;
    arc = std::max(arc, arc_factor(state, s, other, normal_force));
  } else {
    active.mu = around.tools[other - kTool].friction;
    active.most = around.tools[other - kTool].press * h2;
    active.partner = four(lerp(s.tool_move[2 * (other - kTool)], s.tool_move[2 * (other - kTool) + 1], c.t));
    active.body = around.tools[other - kTool].body;
    if (active.body != ToolCapsule::kNoBody) {
      const Scratch::MovedBody& tool_body = s.body[active.body];
      const ToolCapsule& tool = around.tools[other - kTool];
      active.arm = lerp(lerp(tool.a, tool.to_a, time), lerp(tool.b, tool.to_b, time), c.t) + c.normal * (surface - 0.5f * d) -
                   tool_body.center;
      w += tool_body.per_impulse + length2(active.arm) * tool_body.per_twist;
    }
  }
  active.mu *= arc;
  for (uint32_t node : {i, i + 1, j, j + 1}) use_node(s, node);
  active.inverse = 1 / w;
  active.level = c.gap - dot(normal, motion(s, active));
  active.pull_back = settings.anchor * four(c.drift);
  active.ln = c.normal_impulse;
  active.lt = tangential(four(c.friction_impulse), normal);
  return 0;
}

// Takes the motion of the last substep from the budgets. Partners behind the segments are tools.
CATGUT_CLONES void spend(size_t pairs, uint32_t tools_at, const uint32_t* __restrict key, const float* __restrict moved,
                         float* __restrict budget) {
  for (size_t k = 0; k < pairs; ++k) {
    const uint32_t other = key[k] & 0xffff;
    const int first = static_cast<int>(key[k] >> 16),
              partner = static_cast<int>(other < kTool ? other : other - kTool + tools_at);
    budget[k] = budget[k] - moved[first] - moved[partner];
  }
}

}  // namespace

void begin_bodies(const Settings& settings, Scratch& s, const Surroundings& around) {
  s.body.assign(around.bodies.size(), {});
  for (size_t k = 0; k < s.body.size(); ++k) {
    s.body[k].per_impulse = around.bodies[k].inv_mass * static_cast<float>(settings.substeps);
    s.body[k].per_twist = around.bodies[k].inv_inertia * static_cast<float>(settings.substeps);
    s.body[k].center = around.bodies[k].center;
  }
  std::fill_n(s.pushed.begin(), around.tools.size(), 0.0f);
}

void end_bodies(const Settings& settings, State& state, Scratch& s, Surroundings& around) {
  if (s.body.empty()) return;
  move_tools(s, around, 1);
  state.travel += *std::max_element(s.pushed.begin(), s.pushed.begin() + static_cast<std::ptrdiff_t>(around.tools.size()));
  for (size_t k = 0; k < s.body.size(); ++k) {
    ToolBody& body = around.bodies[k];
    body.impulse = s.body[k].impulse / settings.substep, body.twist = s.body[k].twist / settings.substep;
    body.moved = s.body[k].moved, body.turned = s.body[k].turned;
  }
}

void begin_contacts(const Settings& settings, State& state, Scratch& s, Surroundings& around, float time) {
  s.active.clear(), s.contact_node.clear();
  if (!s.body.empty()) move_tools(s, around, time);
  float* moved = s.segment_move.data();
  const size_t pairs = state.key.size();
  const uint32_t tools_at = static_cast<uint32_t>(s.max_nodes);
  for (size_t k = 0; k < around.tools.size(); ++k) {
    const float part = 1.0f / static_cast<float>(settings.substeps);
    s.tool_move[2 * k] = (around.tools[k].to_a - around.tools[k].a) * part;
    s.tool_move[2 * k + 1] = (around.tools[k].to_b - around.tools[k].b) * part;
    moved[tools_at + k] = std::sqrt(std::max(length2(s.tool_move[2 * k]), length2(s.tool_move[2 * k + 1]))) + s.pushed[k];
  }
  spend(pairs, tools_at, state.key.data(), moved, state.budget.data());
  for (size_t k = 0; k < pairs; ++k)
    if (state.budget[k] <= 0) state.budget[k] = look_at(settings, state, s, around, time, k);
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
    const Four moved = motion(s, c);
    if (stays_apart(c, moved)) continue;
    apply(s, c, correct(c, moved));
  }
  store_motion(s);
  if (around.plane && !backward) sweep_plane(settings, state, s, *around.plane);
}

void end_contacts(const Settings& settings, State& state, Scratch& s, Surroundings& around) {
  const float newtons = 1 / (settings.substep * settings.substep * static_cast<float>(settings.substeps));
  load_motion(s);  // with what the plane has done
  for (const Active& c : s.active) {
    const Four went = motion(s, c);
    Crossing& crossing = state.crossing[c.crossing];
    crossing.gap = c.level + dot(c.normal, went);
    if (c.ln <= 0) {
      crossing.normal_impulse = 0, crossing.friction_impulse = {}, crossing.drift = {}, crossing.touch = Touch::apart;
      continue;
    }
    const uint32_t other = partner_of(state.key[c.crossing]);
    for (uint32_t i : {c.i, c.i + 1, c.j, c.j + 1}) s.touched[i] |= other < kTool ? kOnThread : kOnOther;
    crossing.drift = new_drift(settings, c, crossing.drift, three(tangential(went, c.normal)));
    crossing.normal_impulse = c.ln, crossing.friction_impulse = three(c.lt);
    crossing.touch = c.slipped ? Touch::slip : Touch::stick;
    if (other >= kTool) {
      const Vec3 impulse = three(c.normal * c.ln + c.lt);
      ToolCapsule& tool = around.tools[other - kTool];
      tool.force_a -= impulse * (newtons * (1 - crossing.t));
      tool.force_b -= impulse * (newtons * crossing.t);
    }
  }
  if (around.plane) end_plane(settings, state, s, *around.plane);
}

}  // namespace catgut::thread
