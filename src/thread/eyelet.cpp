// SPDX-License-Identifier: Apache-2.0
// thread/eyelet: the thread through holes in something soft. A segment with a hole in it is measured round the corner, so it is
// one more row of the stretch system; friction in the hole scales the tension behind it (Euler-Eytelwein, built up over a
// bristle of kBristle). The soft thing answers through its compliance, which couples all holes: the rows of the corners are
// solved together, the spans between them as before. Reads SoftPoints; writes motion, multipliers and impulses on both sides.
#include <cmath>
#include <cstddef>

#include "core/check.h"
#include "core/elementary.h"
#include "thread/internal.h"

namespace catgut::thread {
namespace {

constexpr float kMeet = 0.5f;      // of a segment: holes so near to each other are drawn together no further
constexpr float kSame = 0.02f;     // of a segment: holes so near to each other have no direction between them
constexpr float kEmbedded = 4000;  // [1/s] at which a node between two near holes takes on the tissue's motion; chosen
constexpr float kNear = 0.3f;      // of a segment: a node so near to the hole is measured along its span, not to the hole

Vec3 hole_from(const State& state, const Scratch& s, const SoftPoints& soft, uint32_t point, size_t node) {
  return ((soft.at[point] - state.x.at(node)) - state.fine.at(node)) + (s.soft_moved.at(point) - s.u.at(node));
}
Vec3 across(Vec3 v, Vec3 axis) { return v - axis * dot(v, axis); }

// The rotation that takes unit vector a to unit vector b, applied to v.
Vec3 turned(Vec3 v, Vec3 a, Vec3 b) {
  const float c = dot(a, b);
  if (c < -0.999f) return v * -1.0f;
  const Vec3 axis = cross(a, b);
  return v * c + cross(axis, v) + axis * (dot(axis, v) / (1 + c));
}

// All points answer an impulse on one of them.
CATGUT_CLONES void answer(size_t points, Vec3 p, const float* __restrict w, float* __restrict x, float* __restrict y,
                          float* __restrict z) {
  for (size_t j = 0; j < points; ++j) x[j] += p.x * w[j], y[j] += p.y * w[j], z[j] += p.z * w[j];
}

// L U in place, by columns; the diagonal is inverted.
CATGUT_CLONES void factor_columns(size_t n, float* a) {
  for (size_t p = 0; p < n; ++p) {
    const float inverse = a[p * n + p] = 1 / a[p * n + p];
    float* __restrict l = a + p * n;
    for (size_t i = p + 1; i < n; ++i) l[i] *= inverse;
    for (size_t j = p + 1; j < n; ++j) {
      float* __restrict column = a + j * n;
      const float f = column[p];
      for (size_t i = p + 1; i < n; ++i) column[i] -= l[i] * f;
    }
  }
}
CATGUT_CLONES void solve_columns(size_t n, const float* __restrict a, float* __restrict y) {
  for (size_t j = 0; j < n; ++j)
    for (size_t i = j + 1; i < n; ++i) y[i] -= a[j * n + i] * y[j];
  for (size_t j = n; j-- > 0;) {
    y[j] *= a[j * n + j];
    for (size_t i = 0; i < j; ++i) y[i] -= a[j * n + i] * y[j];
  }
}

bool joined(const State& state, size_t segment) { return segment < state.segments() && !state.broken[segment]; }

// What lies before segment k's first node: the hole in the segment before, or that segment's first node.
Vec3 from_before(const State& state, const Scratch& s, const SoftPoints& soft, size_t e) {
  const Eyelet& eyelet = state.eyelet[e];
  if (e > 0 && state.eyelet[e - 1].segment + 1 == eyelet.segment) {
    const Vec3 here = hole_from(state, s, soft, eyelet.point, eyelet.segment);
    const Vec3 between = here - hole_from(state, s, soft, state.eyelet[e - 1].point, eyelet.segment);
    return length(between) < kSame * state.rest[eyelet.segment] ? Vec3{} : between;
  }
  return hole_from(state, s, soft, eyelet.point, eyelet.segment - 1);
}
Vec3 to_behind(const State& state, const Scratch& s, const SoftPoints& soft, size_t e) {
  const Eyelet& eyelet = state.eyelet[e];
  if (e + 1 < state.eyelet.size() && state.eyelet[e + 1].segment == eyelet.segment + 1) {
    const Vec3 here = hole_from(state, s, soft, eyelet.point, eyelet.segment);
    const Vec3 between = hole_from(state, s, soft, state.eyelet[e + 1].point, eyelet.segment) - here;
    return length(between) < kSame * state.rest[eyelet.segment] ? Vec3{} : between;
  }
  return hole_from(state, s, soft, eyelet.point, eyelet.segment + 2) * -1.0f;
}

float apart(const Scratch& s, const SoftPoints& soft, const Eyelet& a, const Eyelet& b) {
  return distance(soft.at[a.point] + s.soft_moved.at(a.point), soft.at[b.point] + s.soft_moved.at(b.point));
}

// The hole in the next segment that this one has met: the thread pushes both alike. None: itself.
size_t met(const State& state, const Scratch& s, const SoftPoints& soft, size_t e) {
  const auto meets = [&](size_t a, size_t b) {
    return state.eyelet[a].segment + 1 == state.eyelet[b].segment &&
           apart(s, soft, state.eyelet[a], state.eyelet[b]) < kMeet * state.rest[state.eyelet[b].segment];
  };
  if (e + 1 < state.eyelet.size() && meets(e, e + 1)) return e + 1;
  return e > 0 && meets(e - 1, e) ? e - 1 : e;
}

// Directions and lengths on both sides of a corner.
void look(const State& state, const Scratch& s, const SoftPoints& soft, size_t e, Scratch::Corner& c) {
  const Eyelet& eyelet = state.eyelet[e];
  const size_t k = eyelet.segment;
  const Vec3 in = hole_from(state, s, soft, eyelet.point, k), out = hole_from(state, s, soft, eyelet.point, k + 1) * -1.0f;
  const float near = kNear * state.rest[k];
  c.length_in = length(in), c.length_out = length(out);
  // A node that is through waits beyond the hole while its next segment has a hole already: up to a segment from it.
  const bool waits_in = eyelet.before<0, waits_out = eyelet.before> state.rest[k];
  c.near_in = (c.length_in < near || waits_in) && k > 0 && joined(state, k - 1);
  c.near_out = (c.length_out < near || waits_out) && joined(state, k + 1);
  // The nearer, the more along the span: a direction that changed at once would change the length at once.
  const auto toward = [&](Vec3 to_node, Vec3 span, bool waits) {
    return waits ? span : to_node / near + normalized(span) * (1 - length(to_node) / near);
  };
  c.in = normalized(c.near_in ? toward(in, from_before(state, s, soft, e), waits_in) : in, normalized(out, {1, 0, 0}));
  c.out = normalized(c.near_out ? toward(out, to_behind(state, s, soft, e), waits_out) : out, c.in);
  if (c.near_in) c.length_in = dot(in, c.in);
  if (c.near_out) c.length_out = dot(out, c.out);
}

// Lengths again, along the same directions where a node is near.
void measure(const State& state, const Scratch& s, const SoftPoints& soft, size_t e, Scratch::Corner& c) {
  const Eyelet& eyelet = state.eyelet[e];
  const Vec3 in = hole_from(state, s, soft, eyelet.point, eyelet.segment);
  const Vec3 out = hole_from(state, s, soft, eyelet.point, eyelet.segment + 1) * -1.0f;
  c.length_in = c.near_in ? dot(in, c.in) : length(in);
  c.length_out = c.near_out ? dot(out, c.out) : length(out);
}

// Thread that is pushed through the hole leaves it with all of the push: friction drives nothing.
float passed(const Scratch& s, const Eyelet& eyelet) {
  return s.lambda[eyelet.segment] > 0 ? 1.0f : portable::exp(eyelet.friction * eyelet.angle * eyelet.slip / kBristle);
}

// Between two holes that are nearer to each other than its diameter, thread does not turn to and fro as the node does that
// waits there. Both share the turn from before the first hole to behind the second.
void share_turns(const Settings& settings, State& state, Scratch& s, const SoftPoints& soft) {
  for (size_t e = 0; e + 1 < state.eyelet.size(); ++e) {
    Eyelet &a = state.eyelet[e], &b = state.eyelet[e + 1];
    if (a.segment + 1 != b.segment) continue;
    const float part = clamp01(2 - 2 * apart(s, soft, a, b) / settings.material.diameter);
    if (part <= 0) continue;
    const float half = 0.5f * portable::acos(std::clamp(dot(s.corner[e].in, s.corner[e + 1].out), -1.0f, 1.0f));
    a.angle += part * (half - a.angle), b.angle += part * (half - b.angle);
    s.corner[e].pass = passed(s, a), s.corner[e + 1].pass = passed(s, b);
  }
}

// The node that waits between two near holes has tissue round it: across the thread it moves with that. Without, it swung
// through both holes, and what it was thrown by grew.
void calm_between(const Settings& settings, State& state, Scratch& s, SoftPoints& soft) {
  const float share = std::min(1.0f, kEmbedded * settings.substep);
  for (size_t e = 0; e + 1 < state.eyelet.size(); ++e) {
    const Eyelet &a = state.eyelet[e], &b = state.eyelet[e + 1];
    if (a.segment + 1 != b.segment) continue;
    const size_t node = b.segment;
    const float part = clamp01(2 - 2 * apart(s, soft, a, b) / state.rest[node]);
    if (part <= 0) continue;
    const Vec3 along = normalized(s.corner[e].in + s.corner[e + 1].out, s.corner[e].in);
    const Vec3 v = state.v.at(node) - 0.5f * (soft.speed[a.point] + soft.speed[b.point]);
    const Vec3 change = across(v, along) * (-part * share);
    state.v.add(node, change);
    for (const uint32_t point : {a.point, b.point})
      push_soft(s, soft, point, change * (-0.5f * s.mass[node] * settings.substep), settings.substep);
  }
}

// A node has come through the hole: its overshoot and its motion turn into the other span, and the hole takes the kick. A node
// of slack thread passes beside the hole. The segment to the next node keeps the length that it had round the corner.
void pass_node(State& state, Scratch& s, SoftPoints& soft, uint32_t point, size_t node, size_t next, Vec3 from, Vec3 to,
               float length_before, float substep) {
  const Vec3 hole = soft.at[point], away = ((state.x.at(node) - hole) + state.fine.at(node)) - s.soft_moved.at(point);
  const Vec3 moved = turned(away, from, to) - away;
  state.fine.add(node, moved);
  const Vec3 span = (state.x.at(next) - state.x.at(node)) + (state.fine.at(next) - state.fine.at(node));
  state.fine.add(node, normalized(span) * (length(span) - length_before));
  const Vec3 v = state.v.at(node) - soft.speed[point], change = turned(v, from, to) - v;
  state.v.add(node, change);
  push_soft(s, soft, point, change * (-s.mass[node] * substep), substep);
}

}  // namespace

void begin_eyelets(const Settings& settings, State& state, Scratch& s, Surroundings& around) {
  if (!around.soft) {
    CATGUT_CHECK(state.eyelet.empty() && around.soft_contacts.empty());
    return;
  }
  const size_t n = around.soft->at.size();
  CATGUT_CHECK(n <= kMaxSoftPoints && state.eyelet.size() <= s.corner.capacity());
  s.soft_points = n;
  for (Padded* c : {&s.soft_moved.x, &s.soft_moved.y, &s.soft_moved.z}) std::fill_n(c->data(), n, 0.0f);
  s.soft_answer = around.soft->step / settings.substep;
  for (Vec3& p : around.soft->impulse) p = {};
}

void advance_soft(const Settings& settings, Scratch& s, const SoftPoints& soft) {
  for (size_t i = 0; i < s.soft_points; ++i) {
    s.soft_before.set(i, s.soft_moved.at(i));
    s.soft_moved.add(i, soft.speed[i] * settings.substep);
  }
}

void push_soft(Scratch& s, SoftPoints& soft, uint32_t i, Vec3 multiplier, float substep) {
  soft.impulse[i] += multiplier / substep;
  const size_t n = s.soft_points;
  const Vec3 p = multiplier * s.soft_answer;
  answer(n, p, soft.w.data() + size_t{i} * n, s.soft_moved.x.data(), s.soft_moved.y.data(), s.soft_moved.z.data());
  const Vec3 q = across(p, soft.axis[i]);
  for (uint32_t t = soft.tilt_first[i]; t < soft.tilt_first[i + 1]; ++t) {
    const uint32_t j = soft.tilt[t].other;
    s.soft_moved.add(j, across(q, soft.axis[j]) * soft.tilt[t].value);
  }
}

void turn_corners(const Settings& settings, State& state, Scratch& s, Surroundings& around) {
  SoftPoints& soft = *around.soft;
  // A node that passes, and the next one, which is beside the hole now, have left the surface that they touched.
  const auto leave = [&](size_t node) {
    for (SoftContact& c : around.soft_contacts)
      if (c.node == node) c.normal = {};
  };
  s.corner.resize(state.eyelet.size());
  for (Padded* u : {&s.u.x, &s.u.y, &s.u.z}) std::fill_n(u->data(), state.nodes(), 0.0f);
  size_t kept = 0;
  for (size_t e = 0; e < state.eyelet.size(); ++e) {
    Eyelet& eyelet = state.eyelet[e];
    Scratch::Corner& c = s.corner[e];
    size_t k = eyelet.segment;
    look(state, s, soft, e, c);
    // An end of the thread leaves the hole.
    const bool last = !joined(state, k + 1), first = k == 0 || !joined(state, k - 1);
    const float end = 0.1f * state.rest[k];
    if (state.broken[k] || (last && c.length_out < end) || (first && c.length_in < end)) continue;
    const float inside = state.rest[k] * c.length_in / std::max(c.length_in + c.length_out, 1e-9f);
    eyelet.slip = std::clamp(eyelet.slip - (inside - eyelet.before), -kBristle, kBristle);
    eyelet.before = inside;
    eyelet.angle = portable::acos(std::clamp(dot(c.in, c.out), -1.0f, 1.0f));
    c.pass = passed(s, eyelet);
    const bool free_behind = e + 1 == state.eyelet.size() || state.eyelet[e + 1].segment != k + 1;
    const bool free_before = kept == 0 || state.eyelet[kept - 1].segment + 1 != k;
    if (c.near_out && c.length_out < 0 && free_behind) {
      pass_node(state, s, soft, eyelet.point, k + 1, k, c.out, c.in, c.length_in + c.length_out, settings.substep);
      leave(k + 1), leave(k + 2);
      eyelet.before -= state.rest[k];
      ++eyelet.segment;
    } else if (c.near_in && c.length_in < 0 && free_before) {
      pass_node(state, s, soft, eyelet.point, k, k + 1, c.in, c.out, c.length_in + c.length_out, settings.substep);
      leave(k), leave(k - 1);  // k > 0: near_in
      --eyelet.segment;
      eyelet.before += state.rest[eyelet.segment];
    }
    state.eyelet[kept] = eyelet;
    s.corner[kept] = c;
    ++kept;
  }
  state.eyelet.resize(kept), s.corner.resize(kept);
  share_turns(settings, state, s, soft);
  calm_between(settings, state, s, soft);
}

void grip_corners(const Settings& settings, const State& state, Scratch& s, SoftPoints& soft) {
  for (size_t e = 0; e < state.eyelet.size(); ++e) {
    const Scratch::Corner& c = s.corner[e];
    const float half = 0.5f * settings.hole_grip * state.eyelet[e].slip / kBristle;
    s.force.add(state.eyelet[e].segment, c.in * -half);
    s.force.add(state.eyelet[e].segment + 1, c.out * -half);
    push_soft(s, soft, state.eyelet[e].point, (c.in + c.out) * (half * settings.substep * settings.substep), settings.substep);
  }
}

void find_corners(const State& state, Scratch& s, const SoftPoints& soft) {
  for (size_t e = 0; e < state.eyelet.size(); ++e) {
    look(state, s, soft, e, s.corner[e]);
    const size_t k = state.eyelet[e].segment;
    s.n.set(k, s.corner[e].in);
    s.touched[k] |= kOnOther, s.touched[k + 1] |= kOnOther;
  }
}

void prepare_corners(const State& state, Scratch& s, const SoftPoints& soft) {
  const size_t n = state.eyelet.size(), m = state.segments();
  float *right = s.spike_right.data(), *left = s.spike_left.data();
  std::fill_n(right, m + 1, 0.0f), std::fill_n(left, m + 1, 0.0f);
  for (size_t e = 0; e < n; ++e) {
    Scratch::Corner& c = s.corner[e];
    const size_t k = state.eyelet[e].segment;
    const bool beside = e > 0 && state.eyelet[e - 1].segment + 1 == k;
    c.diag = s.w[k] + c.pass * s.w[k + 1] + s.alpha[k];
    c.sup_before = c.sub_before = 0;
    if (k > 0) {
      c.sup_before = -s.keep[k - 1] * s.w[k] * dot(beside ? s.corner[e - 1].out : s.n.at(k - 1), c.in);
      c.sub_before = beside ? s.corner[e - 1].pass * c.sup_before : c.sup_before;
      s.off[k - 1] = 0;
    }
    c.sup = k + 1 < m ? -s.keep[k + 1] * s.w[k + 1] * dot(c.out, s.n.at(k + 1)) : 0.0f;
    c.sub = c.pass * c.sup;
    s.diag[k] = 1, s.off[k] = 0;
    // The answers of the spans on both sides to a unit of this corner.
    if (k > 0 && !beside) right[k - 1] = -c.sup_before;
    if (k + 1 < m) left[k + 1] = -c.sub;
  }
  for (size_t e = 0; e + 1 < n; ++e)  // no span between neighbors
    if (state.eyelet[e].segment + 1 == state.eyelet[e + 1].segment) left[state.eyelet[e + 1].segment] = 0;
  factor_tridiagonal(s, m);
  solve_tridiagonal(s, m, right, right);
  solve_tridiagonal(s, m, left, left);

  // The corners' own system: what the spans leave of their rows, and the soft thing's compliance between all holes.
  float* a = s.reduced.data();
  for (size_t e = 0; e < n; ++e) {
    const Scratch::Corner& c = s.corner[e];
    const uint32_t point = state.eyelet[e].point;
    const size_t k = state.eyelet[e].segment;
    const Vec3 g = c.in - c.out;
    const float* row = soft.w.data() + size_t{point} * s.soft_points;
    for (size_t b = 0; b < n; ++b) {
      const Scratch::Corner& d = s.corner[b];
      a[b * n + e] = s.soft_answer * row[state.eyelet[b].point] * dot(g, d.in - d.out * d.pass);
    }
    const Vec3 tilting = across(g, soft.axis[point]);
    for (uint32_t t = soft.tilt_first[point]; t < soft.tilt_first[point + 1]; ++t)
      for (size_t b = 0; b < n; ++b)
        if (state.eyelet[b].point == soft.tilt[t].other) {
          const Scratch::Corner& d = s.corner[b];
          a[b * n + e] += s.soft_answer * soft.tilt[t].value *
                          dot(tilting, across(d.in - d.out * d.pass, soft.axis[state.eyelet[b].point]));
        }
    a[e * n + e] += c.diag;
    if (k > 0) {
      a[e * n + e] += c.sub_before * right[k - 1];
      if (e > 0) a[(e - 1) * n + e] += state.eyelet[e - 1].segment + 1 == k ? c.sub_before : c.sub_before * left[k - 1];
    }
    a[e * n + e] += c.sup * left[k + 1];
    if (e + 1 < n) a[(e + 1) * n + e] += state.eyelet[e + 1].segment == k + 1 ? c.sup : c.sup * right[k + 1];
  }
  factor_columns(n, a);
}

// After the spans' own solution in s.step, with 0 in the rows of the corners, whose residuals are in `right`.
void solve_corners(const Settings& settings, const State& state, Scratch& s) {
  const size_t n = state.eyelet.size(), m = state.segments();
  float *x = s.step.data(), *y = s.right.data();
  const float* a = s.reduced.data();
  for (size_t e = 0; e < n; ++e) {
    const size_t k = state.eyelet[e].segment;
    y[e] -= s.corner[e].sup * x[k + 1];
    if (k > 0) y[e] -= s.corner[e].sub_before * x[k - 1];
  }
  solve_columns(n, a, y);
  // With friction the rows are not symmetric: at holes that nearly meet they can come near a singular system, whose solution
  // would throw the wall about.
  const float most = most_multiplier(settings);
  for (size_t e = 0; e < n; ++e) {
    const float before = s.lambda[state.eyelet[e].segment];
    if (std::abs(before + y[e]) > most) y[e] = std::clamp(before + y[e], -most, most) - before;
  }
  const float *right = s.spike_right.data(), *left = s.spike_left.data();
  size_t i = 0;
  for (size_t e = 0; e <= n; ++e) {
    const size_t end = e < n ? state.eyelet[e].segment : m;
    const float before = e > 0 ? y[e - 1] : 0.0f, behind = e < n ? y[e] : 0.0f;
    for (; i < end; ++i) x[i] += left[i] * before + right[i] * behind;
    if (e < n) x[i++] = y[e];
  }
}

void take_corner_residuals(const State& state, Scratch& s, const SoftPoints& soft) {
  for (size_t e = 0; e < state.eyelet.size(); ++e) {
    Scratch::Corner& c = s.corner[e];
    const size_t k = state.eyelet[e].segment;
    measure(state, s, soft, e, c);
    s.right[e] = (s.rest[k] - (c.length_in + c.length_out)) - s.alpha[k] * s.lambda[k];
    s.residual[k] = 0;
  }
}

// The rest of what a corner's multiplier does: the common part moved the node behind it along `in`.
void apply_corners(const State& state, Scratch& s, SoftPoints& soft, float substep) {
  for (size_t e = 0; e < state.eyelet.size(); ++e) {
    const Scratch::Corner& c = s.corner[e];
    const size_t k = state.eyelet[e].segment;
    const float step = s.step[k];
    s.u.add(k + 1, (c.out * c.pass - c.in) * (s.w[k + 1] * step));
    const Vec3 push = (c.in - c.out * c.pass) * step;
    const size_t other = met(state, s, soft, e);
    push_soft(s, soft, state.eyelet[e].point, other == e ? push : push * 0.5f, substep);
    if (other != e) push_soft(s, soft, state.eyelet[other].point, push * 0.5f, substep);
  }
}

State make_laced_state(std::span<const Vec3> path, std::span<const int32_t> hole, float hole_friction) {
  CATGUT_CHECK(path.size() == hole.size());
  std::vector<Vec3> node;
  for (size_t i = 0; i < path.size(); ++i)
    if (hole[i] < 0) node.push_back(path[i]);
  State state = make_state(node);
  size_t nodes = 0;
  for (size_t i = 0; i < path.size(); ++i) {
    if (hole[i] < 0) {
      ++nodes;
      continue;
    }
    CATGUT_CHECK(i > 0 && i + 1 < path.size() && hole[i - 1] < 0 && hole[i + 1] < 0);
    Eyelet e;
    e.point = static_cast<uint32_t>(hole[i]);
    e.segment = static_cast<uint32_t>(nodes) - 1;
    e.friction = hole_friction;
    e.before = distance(path[i - 1], path[i]);
    state.rest[e.segment] = e.before + distance(path[i], path[i + 1]);
    state.eyelet.push_back(e);
  }
  return state;
}

}  // namespace catgut::thread
