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
#include <cstring>
#include <utility>

#include "thread/internal.h"

namespace catgut::thread {
namespace {

// u: Scratch::contact_u. body: Scratch::body; none: no tool belongs to one.
inline Four motion(const Four* u, const Scratch::MovedBody* body, const Active& c) {
  const Four *i = u + c.i, *j = u + c.j;
  const Four moved = (i[0] * c.wi0 + i[1] * c.wi1) + (j[0] * c.wj0 + j[1] * c.wj1) - c.partner;
  if (!body || c.body == ToolCapsule::kNoBody) return moved;
  const Scratch::MovedBody& b = body[c.body];
  return moved - four((b.moved - b.moved_before) + cross(b.turned - b.turned_before, c.arm));
}
inline void apply(Four* u, Scratch::MovedBody* body, const Active& c, Four impulse) {
  Four *i = u + c.i, *j = u + c.j;
  i[0] += impulse * c.mi0;
  i[1] += impulse * c.mi1;
  j[0] += impulse * c.mj0;
  j[1] += impulse * c.mj1;
  if (!body || c.body == ToolCapsule::kNoBody) return;
  Scratch::MovedBody& b = body[c.body];
  const Vec3 p = three(impulse), q = cross(c.arm, p);
  b.moved -= p * b.per_impulse, b.turned -= q * b.per_twist;
  b.impulse -= p, b.twist -= q;
}
Scratch::MovedBody* bodies_of(Scratch& s) { return s.body.empty() ? nullptr : s.body.data(); }

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
  const float *x = s.u.x.data(), *y = s.u.y.data(), *z = s.u.z.data();
  Four* u = s.contact_u.data();
  for (uint32_t i : s.contact_node) u[i] = Four{x[i], y[i], z[i], 0};
}
void store_motion(Scratch& s) {
  float *x = s.u.x.data(), *y = s.u.y.data(), *z = s.u.z.data();
  const Four* from = s.contact_u.data();
  for (uint32_t i : s.contact_node) {
    const Four u = from[i];
    x[i] = u[0], y[i] = u[1], z[i] = u[2];
  }
}
Four tangential(Four v, Four n) { return v - n * dot(v, n); }

// The nodes that are marked as touched; takes the marks away.
void collect_nodes(size_t nodes, Scratch& s) {
  s.contact_node.clear();
  for (size_t first = 0; first < nodes; first += 8) {
    uint64_t marks;
    std::memcpy(&marks, &s.touched[first], sizeof marks);
    if (marks == 0) continue;
    for (size_t i = first; i < first + 8; ++i)
      if (s.touched[i]) s.contact_node.push_back(static_cast<uint32_t>(i)), s.touched[i] = 0;
  }
}

// Segments at the predicted positions.
CATGUT_CLONES void predicted_edges(size_t segments, const float* __restrict e, const float* __restrict u,
                                   float* __restrict edge) {
  for (size_t i = 0; i < segments; ++i) edge[i] = e[i] + u[i + 1] - u[i];
}
CATGUT_CLONES void directions(size_t segments, const float* __restrict ex, const float* __restrict ey,
                              const float* __restrict ez, float* __restrict nx, float* __restrict ny, float* __restrict nz) {
  for (size_t i = 0; i < segments; ++i) {
    const float l = std::sqrt(ex[i] * ex[i] + ey[i] * ey[i] + ez[i] * ez[i]), inverse = 1 / l;
    const bool known = l > 1e-20f;
    nx[i] = known ? ex[i] * inverse : 1.0f, ny[i] = known ? ey[i] * inverse : 0.0f, nz[i] = known ? ez[i] * inverse : 0.0f;
  }
}
// Half of the change of direction between the neighbors of a segment.
CATGUT_CLONES void half_turns(size_t segments, const float* __restrict nx, const float* __restrict ny,
                              const float* __restrict nz, float* __restrict half_turn) {
  for (size_t k = 0; k < segments; ++k) {
    const ptrdiff_t i = static_cast<ptrdiff_t>(k);
    const float x = nx[i + 1] - nx[i - 1], y = ny[i + 1] - ny[i - 1], z = nz[i + 1] - nz[i - 1];
    half_turn[i] = 0.5f * std::sqrt(x * x + y * y + z * z);
  }
}
void find_predicted_edges(const State& state, Scratch& s) {
  const size_t m = state.segments();
  predicted_edges(m, s.e.x.data(), s.u.x.data(), s.edge.x.data());
  predicted_edges(m, s.e.y.data(), s.u.y.data(), s.edge.y.data());
  predicted_edges(m, s.e.z.data(), s.u.z.data(), s.edge.z.data());
}
void find_half_turns(const State& state, Scratch& s) {
  const size_t m = state.segments();
  directions(m, s.edge.x.data(), s.edge.y.data(), s.edge.z.data(), s.n.x.data(), s.n.y.data(), s.n.z.data());
  half_turns(m, s.n.x.data(), s.n.y.data(), s.n.z.data(), s.half_turn.data());
}

// A contact of a polygon stands for the arc on which a real thread would bear: there the normals turn, and the sum of their
// magnitudes, on which friction acts, exceeds their vector sum N. A tension T that bears N turns by an angle 2 a with
// sin a = N / (2 T), and its normal forces add up to 2 a T. Returns their ratio a / sin a, at most 1.5. The polygon's own angle
// bounds a: a strand that is squeezed but straight does not turn. Here sin a of one strand; the larger one counts.
// Inlined into its clones: SSE code that is called from AVX code waits for the upper halves of the registers.
inline __attribute__((always_inline)) float arc_sine(const State& state, const Scratch& s, uint32_t i, float normal_force) {
  const float tension = state.tension[i];
  if (tension <= 0 || i == 0 || i + 1 == state.segments() || state.broken[i - 1] || state.broken[i + 1]) return 0;
  return std::min(s.half_turn[i], normal_force / (2 * tension));
}
float arc_factor(float sine) {  // a / sin a within 1 % to 60 degrees (Snell)
  return 3 / (2 + std::sqrt(std::max(0.0f, 1 - sine * sine)));
}
// Howell and Mazur 1953: fibers press elastically on each other's roughness, so the area that is sheared grows with less than
// the load, with its power 2/3 (elastic) to 1 (plastic). The middle, 7/8: an estimate, and three square roots.
float load_factor(float load, float friction_load) {
  constexpr float kLeast = 5e-3f;  // [N] below which the coefficient grows no more
  return load > 0 && friction_load > 0 ? std::sqrt(std::sqrt(std::sqrt(friction_load / std::max(load, kLeast)))) : 1.0f;
}

// closest_points of pairs side by side, and what is between them: its length and direction.
CATGUT_CLONES void closest(size_t count, const float* __restrict px, const float* __restrict py, const float* __restrict pz,
                           const float* __restrict ax, const float* __restrict ay, const float* __restrict az,
                           const float* __restrict bx, const float* __restrict by, const float* __restrict bz,
                           float* __restrict s_out, float* __restrict t_out, float* __restrict far_out, float* __restrict nx,
                           float* __restrict ny, float* __restrict nz) {
  for (size_t k = 0; k < count; ++k) {
    const float aa = ax[k] * ax[k] + ay[k] * ay[k] + az[k] * az[k], bb = bx[k] * bx[k] + by[k] * by[k] + bz[k] * bz[k],
                ab = ax[k] * bx[k] + ay[k] * by[k] + az[k] * bz[k], ar = ax[k] * px[k] + ay[k] * py[k] + az[k] * pz[k],
                br = bx[k] * px[k] + by[k] * py[k] + bz[k] * pz[k];
    const float det = aa * bb - ab * ab, inside = clamp01((ab * br - bb * ar) / det);
    float s = det > 1e-7f * aa * bb ? inside : 0.5f, t = (ab * s + br) / bb;
    const bool below = t<0, above = t> 1;
    const float toward = below ? -ar : ab - ar, at_end = clamp01(toward / aa);
    s = below || above ? at_end : s;
    t = below ? 0.0f : above ? 1.0f : t;
    const float x = px[k] + ax[k] * s - bx[k] * t, y = py[k] + ay[k] * s - by[k] * t, z = pz[k] + az[k] * s - bz[k] * t;
    const float far = std::sqrt(x * x + y * y + z * z), inverse = 1 / far;
    s_out[k] = s, t_out[k] = t, far_out[k] = far;
    nx[k] = x * inverse, ny[k] = y * inverse, nz[k] = z * inverse;
  }
}

// Both segments of pairs, of one axis: first node of the first one from that of the second one, and their edges.
void gather(size_t count, const uint32_t* __restrict first, const uint32_t* __restrict second, const float* __restrict x,
            const float* __restrict fine, const float* __restrict u, const float* __restrict edge, float* __restrict p,
            float* __restrict a, float* __restrict b) {
  for (size_t q = 0; q < count; ++q) {
    const uint32_t i = first[q], j = second[q];
    p[q] = (x[i] - x[j]) + (fine[i] - fine[j]) + u[i] - u[j], a[q] = edge[i], b[q] = edge[j];
  }
}
void take_pairs(const State& state, Scratch& s, const Surroundings& around, float time, size_t count) {
  Scratch::Pairs& p = s.pairs;
  bool tools = false;
  for (size_t q = 0; q < count; ++q) {
    const uint32_t key = state.key[p.index[q]], i = segment_of(key), other = partner_of(key);
    p.first[q] = i, p.second[q] = other < kTool ? other : i;
    tools |= other >= kTool;
  }
  const uint32_t *first = p.first.data(), *second = p.second.data();
  gather(count, first, second, state.x.x.data(), state.fine.x.data(), s.u.x.data(), s.edge.x.data(), p.p.x.data(), p.a.x.data(),
         p.b.x.data());
  gather(count, first, second, state.x.y.data(), state.fine.y.data(), s.u.y.data(), s.edge.y.data(), p.p.y.data(), p.a.y.data(),
         p.b.y.data());
  gather(count, first, second, state.x.z.data(), state.fine.z.data(), s.u.z.data(), s.edge.z.data(), p.p.z.data(), p.a.z.data(),
         p.b.z.data());
  if (!tools) return;
  for (size_t q = 0; q < count; ++q) {
    const uint32_t other = partner_of(state.key[p.index[q]]), i = first[q];
    if (other < kTool) continue;
    const ToolCapsule& tool = around.tools[other - kTool];
    const Vec3 base = lerp(tool.a, tool.to_a, time), b = lerp(tool.b, tool.to_b, time) - base;
    p.p.set(q, (state.x.at(i) - base) + state.fine.at(i) + s.u.at(i));
    p.b.set(q, length2(b) < 1e-12f ? Vec3{1e-6f, 0, 0} : b);
  }
}

// Geometry of the pair in place q. Returns the motion after which it must be evaluated again.
inline __attribute__((always_inline)) float look_at(const Settings& settings, State& state, Scratch& s, Surroundings& around,
                                                    float time, size_t q) {
  const Scratch::Pairs& pairs = s.pairs;
  const uint32_t k = pairs.index[q], i = pairs.first[q], other = partner_of(state.key[k]);
  Crossing& c = state.crossing[k];
  const bool thread = other < kTool;
  const float d = settings.material.diameter, ready = kReady * d;
  c.s = pairs.s[q], c.t = pairs.t[q];
  float surface = d;
  if (!thread) {
    const ToolCapsule& tool = around.tools[other - kTool];
    surface = 0.5f * d + (tool.radius + tool.widens * c.t);
  }
  float far = pairs.far[q];
  if (c.touch == Touch::unknown) {
    const Vec3 a = pairs.a.at(q), apart = pairs.p.at(q) + a * c.s - pairs.b.at(q) * c.t;
    c.normal = normalized(apart, any_perpendicular(normalized(a, {1, 0, 0})));
    c.touch = Touch::apart;
  } else if (far > 1e-9f) {
    Vec3 n = pairs.n.at(q);
    // Of two that overlap a normal cannot reverse within one substep: they have passed into each other. A tool in a hand is
    // left out: jaws are put on thread, or closed on it.
    const bool both_yield = thread || around.tools[other - kTool].body != ToolCapsule::kNoBody;
    if (both_yield && far < surface && dot(n, c.normal) < -0.3f) n = -n, far = -far;
    c.normal = n;
  }
  c.gap = far - surface;
  if (c.gap > ready) {
    c.normal_impulse = 0, c.friction_impulse = {}, c.drift = {}, c.touch = Touch::apart;
    return c.gap - ready;
  }
  const float *mobile = s.w.data() + i, wi0 = 1 - c.s, wi1 = c.s, mi0 = wi0 * mobile[0], mi1 = wi1 * mobile[1];
  float w = wi0 * mi0 + wi1 * mi1;
  const float wj0 = thread ? c.t - 1 : 0.0f, wj1 = thread ? -c.t : 0.0f;
  const uint32_t j = thread ? other : i;
  mobile = s.w.data() + j;
  const float mj0 = wj0 * mobile[0], mj1 = wj1 * mobile[1];
  w = w + wj0 * mj0 + wj1 * mj1;
  if (w <= 0) return 0;
  const float h2 = settings.substep * settings.substep, normal_force = c.normal_impulse / h2;
  float arc = 1;
  if (normal_force > 0) {
    if (!s.knows_turns) find_half_turns(state, s), s.knows_turns = true;
    float sine = arc_sine(state, s, i, normal_force);
    if (thread) sine = std::max(sine, arc_sine(state, s, other, normal_force));
    arc = arc_factor(sine);
  }
  Active& active = s.active_memory[s.actives++];
  active.normal = four(c.normal);
  active.wi0 = wi0, active.wi1 = wi1, active.wj0 = wj0, active.wj1 = wj1;
  active.mi0 = mi0, active.mi1 = mi1, active.mj0 = mj0, active.mj1 = mj1;
  active.i = i, active.j = j, active.crossing = k;
  if (thread) {
    active.mu = settings.material.friction * load_factor(normal_force, settings.material.friction_load), active.most = 1e9f,
    active.partner = Four{}, active.body = ToolCapsule::kNoBody;
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
  uint8_t* touched = s.touched.data();
  touched[i] = touched[i + 1] = touched[j] = touched[j + 1] = 1;
  active.inverse = 1 / w, active.level = c.gap, active.slipped = false;
  active.pull_back = settings.anchor * four(c.drift);
  active.ln = c.normal_impulse;
  active.lt = tangential(four(c.friction_impulse), active.normal);
  return 0;
}

CATGUT_CLONES void look_at_pairs(const Settings& settings, State& state, Scratch& s, Surroundings& around, float time,
                                 size_t count) {
  Scratch::Pairs& p = s.pairs;
  take_pairs(state, s, around, time, count);
  closest((count + 7) / 8 * 8, p.p.x.data(), p.p.y.data(), p.p.z.data(), p.a.x.data(), p.a.y.data(), p.a.z.data(), p.b.x.data(),
          p.b.y.data(), p.b.z.data(), p.s.data(), p.t.data(), p.far.data(), p.n.x.data(), p.n.y.data(), p.n.z.data());
  float* budget = state.budget.data();
  for (size_t q = 0; q < count; ++q) budget[p.index[q]] = look_at(settings, state, s, around, time, q);
}

bool any_spent(const float* budget) {  // of eight pairs
  Four a, b;
  std::memcpy(&a, budget, sizeof a), std::memcpy(&b, budget + 4, sizeof b);
  const auto spent = (a <= 0) | (b <= 0);
  uint64_t word[2];
  std::memcpy(word, &spent, sizeof word);
  return (word[0] | word[1]) != 0;
}

// Levels, then the impulses of the last substep.
inline __attribute__((always_inline)) void warm(size_t count, Active* c, Four* u, Scratch::MovedBody* body) {
  for (size_t k = 0; k < count; ++k) c[k].level -= dot(c[k].normal, motion(u, body, c[k]));
  for (size_t k = 0; k < count; ++k) apply(u, body, c[k], c[k].normal * c[k].ln + c[k].lt);
}
CATGUT_CLONES void warm_contacts(size_t count, Active* c, Four* u, Scratch::MovedBody* body) {
  if (body) warm(count, c, u, body);
  else warm(count, c, u, nullptr);
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
  if (s.active_memory.size() < pairs) s.active_memory.resize(pairs);
  s.actives = 0, s.knows_turns = false;
  size_t count = 0;
  bool any = false;
  const float* budget = state.budget.data();
  for (size_t first = 0; first < pairs; first += 8) {
    const size_t end = std::min(first + 8, pairs);
    if (end == first + 8 && !any_spent(budget + first)) continue;
    if (!std::exchange(any, true)) find_predicted_edges(state, s);
    for (size_t k = first; k < end; ++k)
      if (budget[k] <= 0) s.pairs.index[count++] = static_cast<uint32_t>(k);
    if (count + 8 > Scratch::Pairs::kMost) look_at_pairs(settings, state, s, around, time, std::exchange(count, 0));
  }
  if (count > 0) look_at_pairs(settings, state, s, around, time, count);
  if (around.plane) begin_plane(settings, state, s, *around.plane);
  collect_nodes(state.nodes(), s);
  load_motion(s);
  warm_contacts(s.actives, s.active_memory.data(), s.contact_u.data(), bodies_of(s));
  store_motion(s);
  if (around.plane) warm_plane(state, s, *around.plane);
}

namespace {
inline __attribute__((always_inline)) void sweep_all(size_t count, Active* c, ptrdiff_t next, Four* u,
                                                     Scratch::MovedBody* body) {
  for (size_t k = 0; k < count; ++k, c += next) {
    const Four moved = motion(u, body, *c);
    if (!stays_apart(*c, moved)) apply(u, body, *c, correct(*c, moved));
  }
}
CATGUT_CLONES void sweep(size_t count, Active* c, ptrdiff_t next, Four* u, Scratch::MovedBody* body) {
  if (body) sweep_all(count, c, next, u, body);
  else sweep_all(count, c, next, u, nullptr);
}
}  // namespace

void sweep_contacts(const Settings& settings, State& state, Scratch& s, const Surroundings& around, bool backward) {
  if (around.plane && backward) sweep_plane(settings, state, s, *around.plane);
  if (s.actives > 0) {
    load_motion(s);
    Active* first = s.active_memory.data();
    if (backward) sweep(s.actives, first + s.actives - 1, -1, s.contact_u.data(), bodies_of(s));
    else sweep(s.actives, first, 1, s.contact_u.data(), bodies_of(s));
    store_motion(s);
  }
  if (around.plane && !backward) sweep_plane(settings, state, s, *around.plane);
}

void end_contacts(const Settings& settings, State& state, Scratch& s, Surroundings& around) {
  const float newtons = 1 / (settings.substep * settings.substep * static_cast<float>(settings.substeps));
  load_motion(s);  // with what the plane has done
  const Four* u = s.contact_u.data();
  const Scratch::MovedBody* bodies = bodies_of(s);
  for (const Active& c : s.active()) {
    const Four went = motion(u, bodies, c);
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
