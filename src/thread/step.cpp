// SPDX-License-Identifier: Apache-2.0
// thread/step: one step of a thread, as a list of stages. Reads Settings and Surroundings; writes State and the forces on
// holds, tools and plane. Small steps with few iterations: Macklin et al. 2019, 10.1145/3309486.3340247.
#include <algorithm>
#include <cmath>

#include "core/check.h"
#include "core/hash.h"
#include "thread/internal.h"

namespace catgut::thread {
namespace {

CATGUT_CLONES void predict(size_t nodes, float h, float gravity, const float* __restrict v, const float* __restrict f,
                           const float* __restrict w, float* __restrict u) {
  for (size_t i = 0; i < nodes; ++i) {
    const float moves = h * (v[i] + h * (gravity + f[i] * w[i]));  // always: loads under a mask are slow
    u[i] = w[i] > 0 ? moves : 0.0f;
  }
}

CATGUT_CLONES void move(size_t nodes, float keep, const float* __restrict u, float* __restrict x, float* __restrict fine,
                        float* __restrict v) {
  for (size_t i = 0; i < nodes; ++i) {
    const float low = fine[i] + u[i], sum = x[i] + low;
    fine[i] = low - (sum - x[i]);
    x[i] = sum;
    v[i] = u[i] * keep;
  }
}

// Neighbors exchange a part of their velocity difference: damps waves shorter than resolved, conserves momentum. More of it
// where thread bears on thread: vibration there makes contacts near their limit of friction slip now and then, and a knot
// creeps (with the friction of the arc alone by up to 0.5 mm/s at 1 N, measured). Not on tools: thread that slides round them
// would be braked.
constexpr float kTouchDamping = 1600;  // [1/s]
CATGUT_CLONES void calming(size_t nodes, float share, float touch_share, const uint8_t* __restrict touched,
                           const float* __restrict mass, const float* __restrict keep, float* __restrict exchange) {
  for (size_t i = 0; i + 1 < nodes; ++i) {
    const float both = touched[i] & touched[i + 1] & kOnThread ? touch_share : 0.0f;
    exchange[i] = keep[i] * (share + both) * (mass[i] < mass[i + 1] ? mass[i] : mass[i + 1]);
  }
}
CATGUT_CLONES void calm(size_t nodes, const float* __restrict exchange, const float* __restrict w, float* __restrict flow,
                        float* __restrict v) {
  for (size_t i = 0; i + 1 < nodes; ++i) flow[i] = exchange[i] * (v[i + 1] - v[i]);
  for (size_t k = 0; k < nodes; ++k) v[k] += w[k] * (flow[k] - flow[static_cast<ptrdiff_t>(k) - 1]);
}

// The maximum displacement [m] of a node since the pairs were listed.
CATGUT_CLONES float farthest_of(size_t nodes, const float* __restrict x, const float* __restrict y, const float* __restrict z,
                                const float* __restrict fx, const float* __restrict fy, const float* __restrict fz) {
  // Lanes by hand: a maximum does not depend on the order, but compilers do not reorder floats.
  float most[16] = {};
  size_t i = 0;
  for (; i + 16 <= nodes; i += 16)
    for (size_t k = 0; k < 16; ++k) {
      const float dx = x[i + k] - fx[i + k], dy = y[i + k] - fy[i + k], dz = z[i + k] - fz[i + k],
                  d = dx * dx + dy * dy + dz * dz;
      most[k] = d > most[k] ? d : most[k];
    }
  for (; i < nodes; ++i) {
    const float dx = x[i] - fx[i], dy = y[i] - fy[i], dz = z[i] - fz[i], d = dx * dx + dy * dy + dz * dz;
    most[0] = d > most[0] ? d : most[0];
  }
  return std::sqrt(*std::max_element(most, most + 16));
}
float farthest(const State& s) {
  return farthest_of(s.nodes(), s.x.x.data(), s.x.y.data(), s.x.z.data(), s.listed.x.data(), s.listed.y.data(),
                     s.listed.z.data());
}

CATGUT_CLONES void limit_motion(size_t nodes, float limit, float* __restrict ux, float* __restrict uy, float* __restrict uz,
                                float* __restrict moved) {
  for (size_t i = 0; i < nodes; ++i) {
    const float x = ux[i], y = uy[i], z = uz[i], size = std::sqrt(x * x + y * y + z * z), shorter = limit / size;
    const float part = shorter < 1 ? shorter : 1.0f;
    ux[i] = x * part, uy[i] = y * part, uz[i] = z * part;
    moved[i] = size > limit ? limit : size;
  }
}

CATGUT_CLONES void masses(size_t nodes, float free, float added, const float* __restrict least, const float* __restrict span,
                          const float* __restrict warm, float* __restrict mass, float* __restrict w) {
  for (size_t i = 0; i < nodes; ++i) {
    const float density = free + added * warm[i];
    mass[i] = (least[i] > density ? least[i] : density) * span[i];
    w[i] = 1 / mass[i];
  }
}

CATGUT_CLONES void record(size_t segments, const float* __restrict lambda, const float* __restrict move,
                          float* __restrict tension_sum, float* __restrict segment_move) {
  for (size_t i = 0; i < segments; ++i) {
    tension_sum[i] -= lambda[i];
    segment_move[i] = move[i] > move[i + 1] ? move[i] : move[i + 1];
  }
}

// Constants during a step.
void begin_step(const Settings& settings, const State& state, Scratch& s) {
  const size_t m = state.segments();
  const float h = settings.substep;
  for (size_t i = 0; i < m; ++i) {
    s.rest[i] = state.rest[i];
    s.inverse_rest[i] = 1 / state.rest[i];
    s.keep[i] = state.broken[i] ? 0.0f : 1.0f;
    s.alpha[i] = state.rest[i] / (settings.material.axial_stiffness * h * h);
    s.tension_sum[i] = 0;
    s.lambda[i] = -state.tension[i] * h * h;
  }
  for (Padded* c : {&s.rest, &s.inverse_rest, &s.keep, &s.alpha}) (*c)[m] = 0;
  // Line density that bending and tension require of a segment; a node uses the larger one of its two segments.
  auto need = [&](size_t i) {
    const float l = state.rest[i], loaded = h * h * std::abs(state.tension[i]) / (l * l * settings.load_limit);
    return std::max(bending_density(settings, l), loaded);
  };
  float before = need(0);
  for (size_t i = 0; i <= m; ++i) {
    const float after = i < m ? need(i) : before;
    s.least_density[i] = std::max(before, after);
    s.span[i] = 0.5f * ((i > 0 ? state.rest[i - 1] : 0.0f) + (i < m ? state.rest[i] : 0.0f));
    before = after;
  }
}

void find_masses(const Settings& settings, const State& state, Scratch& s, std::span<const Hold> holds) {
  masses(state.nodes(), settings.free_density, settings.touch_density - settings.free_density, s.least_density.data(),
         s.span.data(), state.warm.data(), s.mass.data(), s.w.data());
  for (const Hold& hold : holds)
    if (hold.stiffness <= 0) s.w[hold.node] = 0;
}

// Springs are implicit: they add h^2 k to the node's mass, so that no stiffness is too high.
void move_holds(const Settings& settings, const State& state, Scratch& s, std::span<Hold> holds, int substep) {
  const float h2 = settings.substep * settings.substep, part = 1.0f / static_cast<float>(settings.substeps);
  for (const Hold& hold : holds) {
    const uint32_t i = hold.node;
    const Vec3 away = (lerp(hold.from, hold.to, static_cast<float>(substep + 1) * part) - state.x.at(i)) - state.fine.at(i);
    if (hold.stiffness <= 0) {
      s.u.set(i, away);
      continue;
    }
    const float force = hold.stiffness * length(away - s.u.at(i));
    if (hold.limit > 0 && force > hold.limit) {
      s.u.add(i, normalized(away - s.u.at(i)) * (hold.limit * h2 * s.w[i]));
    } else {
      const float added = h2 * hold.stiffness, mass = s.mass[i] + added;
      s.u.set(i, (s.mass[i] * s.u.at(i) + added * away) / mass);
      s.w[i] = 1 / mass;
    }
  }
}

void record_hold_forces(const Settings& settings, const State& state, const Scratch& s, std::span<Hold> holds, int substep) {
  const float part = 1.0f / static_cast<float>(settings.substeps), per = part / (settings.substep * settings.substep);
  for (Hold& hold : holds) {
    const uint32_t i = hold.node;
    if (hold.stiffness > 0) {
      const Vec3 away =
          (lerp(hold.from, hold.to, static_cast<float>(substep + 1) * part) - state.x.at(i)) - state.fine.at(i) - s.u.at(i);
      const float force = hold.stiffness * length(away);
      hold.force += away * (hold.stiffness * part * (hold.limit > 0 && force > hold.limit ? hold.limit / force : 1.0f));
      continue;
    }
    Vec3 on_node = s.force.at(i) * part;
    if (i > 0) on_node += s.n.at(i - 1) * (s.lambda[i - 1] * per);
    if (i < state.segments()) on_node -= s.n.at(i) * (s.lambda[i] * per);
    for (const Active& c : s.active()) {
      const Vec3 impulse = three(c.normal * c.ln + c.lt) * per;
      if (c.i == i) on_node += c.wi0 * impulse;
      if (c.i + 1 == i) on_node += c.wi1 * impulse;
      if (c.j == i) on_node += c.wj0 * impulse;
      if (c.j + 1 == i) on_node += c.wj1 * impulse;
    }
    hold.force -= on_node;
  }
}

struct Hasher {
  uint64_t hash = 0;
  template <typename T>
  void operator()(const char*, const std::vector<T>& v) {
    hash = hash_bytes(v.data(), v.size() * sizeof(T), hash);
  }
  void operator()(const char*, float v) { hash = hash_bytes(&v, sizeof v, hash); }
  void operator()(const char*, uint32_t v) { hash = hash_bytes(&v, sizeof v, hash); }
};

CATGUT_CLONES void fade_warmth(size_t nodes, float fade, uint8_t* __restrict touched, float* __restrict warm) {
  for (size_t i = 0; i < nodes; ++i) {
    const float faded = warm[i] * fade, left = warm[i] > 1e-3f ? faded : 0.0f;
    warm[i] = touched[i] ? 1.0f : left;
  }
}
void warm_masses(const Settings& settings, State& state, Scratch& s) {
  const float fade = portable::exp(-settings.substep / settings.mass_decay);
  fade_warmth(state.nodes(), fade, s.touched.data(), state.warm.data());
  std::fill_n(s.touched.data(), state.nodes(), uint8_t{0});
}

// A mean tension above its strength breaks a segment: the one with the largest load relative to its strength. Contact bends it
// and lowers the strength to that of a knot. What counts is the tension over kSpan segments to either side: the simulated mass
// is hundreds of times the real one, and a jerk of a few nodes has peaks of inertia that no real thread has.
constexpr size_t kSpan = 4;
float load_beside(const State& state, size_t segment, int way) {
  float sum = 0;
  size_t count = 0;
  for (size_t i = segment; count < kSpan && i < state.segments() && !state.broken[i]; i += static_cast<size_t>(way))
    sum += state.tension[i], ++count;
  return count == kSpan ? sum / static_cast<float>(kSpan) : 0;
}

void break_overloaded(const Settings& settings, State& state) {
  float worst = 1;
  size_t where = state.segments();
  for (size_t i = 0; i < state.segments(); ++i) {
    const bool knotted = std::max(state.warm[i], state.warm[i + 1]) > 0.5f;
    const float strength = knotted ? settings.material.knot_strength : settings.material.straight_strength;
    if (state.tension[i] <= strength) continue;
    const float share = std::min(state.tension[i], std::max(load_beside(state, i, -1), load_beside(state, i, 1))) / strength;
    if (share > worst && !state.broken[i]) worst = share, where = i;
  }
  if (where == state.segments()) return;
  state.broken[where] = 1;
  state.travel = 1e9f;  // its crossings end
}

}  // namespace

State make_state(std::span<const Vec3> path) {
  CATGUT_CHECK(path.size() >= kLeastNodes && path.size() < kTool);
  const size_t n = path.size();
  State s;
  for (Columns3* c : {&s.x, &s.fine, &s.v, &s.plane_friction, &s.plane_drift, &s.listed}) c->assign(n, 0);
  s.warm.assign(n, 0), s.kept.assign(n, 0), s.plane_normal.assign(n, 0);
  for (size_t i = 0; i < n; ++i) s.x.set(i, path[i]);
  for (size_t i = 0; i + 1 < n; ++i) s.rest.push_back(distance(path[i], path[i + 1]));
  s.tension.assign(n - 1, 0), s.broken.assign(n - 1, 0);
  s.eyelet.reserve(kMaxEyelets);
  const size_t pairs = pair_capacity(n);
  s.key.reserve(pairs), s.budget.reserve(pairs), s.crossing.reserve(pairs);
  s.travel = 1e9f;  // the list is empty
  return s;
}

uint64_t hash_state(const State& state) {
  Hasher hasher;
  reflect(hasher, state);
  return hasher.hash;
}

Stepper::Stepper(size_t max_nodes) : scratch_(std::make_unique<Scratch>()) {
  Scratch& s = *scratch_;
  const size_t max_crossings = pair_capacity(max_nodes);
  s.max_nodes = max_nodes, s.max_crossings = max_crossings;
  for (Padded3* c : {&s.u, &s.force, &s.e, &s.n, &s.moment, &s.middle, &s.edge}) c->resize(max_nodes);
  for (Padded* c : {&s.mass,          &s.w,         &s.move,          &s.rest,     &s.inverse_rest, &s.keep,
                    &s.alpha,         &s.lambda,    &s.step,          &s.residual, &s.diag,         &s.off,
                    &s.tension_sum,   &s.half,      &s.least_density, &s.span,     &s.plane_level,  &s.plane_inverse,
                    &s.plane_slipped, &s.half_turn, &s.hinge,         &s.yields})
    c->resize(max_nodes);
  s.segment_move.resize(max_nodes + kMaxTools);
  for (Padded3* c : {&s.pairs.p, &s.pairs.a, &s.pairs.b, &s.pairs.n}) c->resize(Scratch::Pairs::kMost);
  for (Padded* c : {&s.pairs.s, &s.pairs.t, &s.pairs.far}) c->resize(Scratch::Pairs::kMost);
  s.lanes.resize(max_nodes);
  s.contact_u.resize(max_nodes + 1), s.contact_node.reserve(max_nodes + 1);
  s.active_memory.resize(max_crossings), s.touched.assign(max_nodes + 8, 0);
  s.new_key.reserve(max_crossings), s.new_budget.reserve(max_crossings), s.new_crossing.reserve(max_crossings);
  s.block_middle.resize(max_nodes / 8 + 2), s.block_radius.resize(max_nodes / 8 + 2);
  s.block_tools.resize(max_nodes / 8 + 2), s.near_block.resize(max_nodes / 8 + 2), s.holed.resize(max_nodes);
  s.tool_move.resize(2 * kMaxTools), s.pushed.resize(kMaxTools), s.body.reserve(kMaxTools);
  s.spike_right.resize(max_nodes), s.spike_left.resize(max_nodes);
  s.soft_moved.resize(kMaxSoftPoints), s.soft_before.resize(kMaxSoftPoints), s.soft_active.reserve(2 * kMaxSoftPoints);
  s.soft_seen.reserve(2 * kMaxSoftPoints), s.carried.reserve(max_nodes);
  s.corner.reserve(kMaxEyelets), s.reduced.resize(kMaxEyelets * kMaxEyelets), s.right.resize(kMaxEyelets);
}
Stepper::~Stepper() = default;
Stepper::Stepper(Stepper&&) noexcept = default;

void Stepper::step(const Settings& settings, State& state, Surroundings& around) {
  Scratch& s = *scratch_;
  const size_t n = state.nodes(), m = state.segments();
  CATGUT_CHECK(n <= s.max_nodes && around.tools.size() <= kMaxTools);
  state.key.reserve(s.max_crossings), state.budget.reserve(s.max_crossings), state.crossing.reserve(s.max_crossings);
  const float h = settings.substep, part = 1.0f / static_cast<float>(settings.substeps);
  const float keep = std::max(0.0f, 1 - settings.damping * h) / h, limit = settings.max_move * settings.material.diameter;
  for (Hold& hold : around.holds) hold.force = {};
  for (ToolCapsule& tool : around.tools) tool.force_a = tool.force_b = {};
  if (around.plane) around.plane->force = {};
  begin_step(settings, state, s);
  begin_bending(settings, state, s);
  begin_eyelets(settings, state, s, around);
  begin_bodies(settings, s, around);
  see_soft_contacts(state, s, around);

  std::fill_n(s.segment_move.data(), m, 0.0f);
  for (int sub = 0; sub < settings.substeps; ++sub) {
    if (state.travel + farthest(state) > 0.5f * settings.list_margin)
      refresh_pairs(settings, state, s, around.tools, static_cast<float>(sub) * part);
    const float time = static_cast<float>(sub + 1) * part;
    find_masses(settings, state, s, around.holds);
    if (around.soft) {
      turn_corners(settings, state, s, around);
      advance_soft(settings, s, *around.soft);
    }
    find_edges(state, s);
    for (Padded* f : {&s.force.x, &s.force.y, &s.force.z}) std::fill_n(f->data(), n, 0.0f);
    add_bending(state, s);
    if (around.soft && settings.hole_grip > 0) grip_corners(settings, state, s, *around.soft);
    for (const Pull& pull : around.pulls) s.force.add(pull.node, pull.force);
    predict(n, h, settings.gravity.x, state.v.x.data(), s.force.x.data(), s.w.data(), s.u.x.data());
    predict(n, h, settings.gravity.y, state.v.y.data(), s.force.y.data(), s.w.data(), s.u.y.data());
    predict(n, h, settings.gravity.z, state.v.z.data(), s.force.z.data(), s.w.data(), s.u.z.data());
    move_holds(settings, state, s, around.holds, sub);

    begin_contacts(settings, state, s, around, time);
    begin_soft_contacts(settings, state, s, around);
    prepare_stretch(settings, state, s, around.soft);
    std::fill_n(s.lambda.data(), m, 0.0f);
    for (int it = 0; it < settings.iterations; ++it) {
      // The same order in every substep: with alternating orders nodes of a held knot alternate, too, and contacts near their
      // limit slip.
      const bool backward = it % 2 > 0;
      solve_stretch(settings, state, s, around.soft);
      if (!s.soft_active.empty()) sweep_soft_contacts(s, *around.soft, settings.substep, backward);
      sweep_contacts(settings, state, s, around, backward);
    }
    end_contacts(settings, state, s, around);
    end_soft_contacts(settings, state, s, around);

    begin_carrying(settings, s, around, limit);
    limit_motion(n, limit, s.u.x.data(), s.u.y.data(), s.u.z.data(), s.move.data());
    end_carrying(s);
    record_hold_forces(settings, state, s, around.holds, sub);
    record(m, s.lambda.data(), s.move.data(), s.tension_sum.data(), s.segment_move.data());
    float tools_move = 0;
    for (size_t k = 0; k < 2 * around.tools.size(); ++k)
      tools_move = std::max(tools_move, length(s.tool_move[k]) + s.pushed[k / 2]);
    state.travel += tools_move;
    move(n, keep, s.u.x.data(), state.x.x.data(), state.fine.x.data(), state.v.x.data());
    move(n, keep, s.u.y.data(), state.x.y.data(), state.fine.y.data(), state.v.y.data());
    move(n, keep, s.u.z.data(), state.x.z.data(), state.fine.z.data(), state.v.z.data());
    // Across the corner in a hole the directions differ: an exchange would brake the thread that slides through.
    for (const Eyelet& e : state.eyelet) s.keep[e.segment] = 0;
    calming(n, settings.inner_damping, kTouchDamping * h, s.touched.data(), s.mass.data(), s.keep.data(), s.residual.data());
    for (Column* v : {&state.v.x, &state.v.y, &state.v.z}) calm(n, s.residual.data(), s.w.data(), s.step.data(), v->data());
    for (const Eyelet& e : state.eyelet) s.keep[e.segment] = state.broken[e.segment] ? 0.0f : 1.0f;
    warm_masses(settings, state, s);
  }
  end_bodies(settings, state, s, around);
  // The budgets after the last substep's motion: nothing of a step remains in the work space.
  for (size_t k = 0; k < state.key.size(); ++k) {
    const uint32_t other = partner_of(state.key[k]);
    state.budget[k] -=
        s.segment_move[segment_of(state.key[k])] + (other < kTool ? s.segment_move[other] : s.pushed[other - kTool]);
  }
  if (around.soft)
    for (size_t i = 0; i < s.soft_points; ++i) around.soft->moved[i] = s.soft_moved.at(i);
  for (size_t i = 0; i < m; ++i) state.tension[i] = s.tension_sum[i] * part / (h * h);
  if (settings.breaks) break_overloaded(settings, state);
}

}  // namespace catgut::thread
