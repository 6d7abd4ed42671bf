// SPDX-License-Identifier: Apache-2.0
// validation: see suture_scenes.h.
#include "validation/suture_scenes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>

#include "core/check.h"

namespace catgut::validation {

thread::State lay_course(std::span<const Stop> course, float spacing, float hole_friction) {
  std::vector<Vec3> path{course[0].at};
  std::vector<int32_t> hole{-1};
  float left = spacing;
  for (size_t c = 0; c + 1 < course.size(); ++c) {
    Vec3 from = course[c].at;
    const Vec3 to = course[c + 1].at;
    float piece = distance(from, to);
    while (piece >= left) {
      from = lerp(from, to, left / piece);
      path.push_back(from), hole.push_back(-1);
      piece -= left, left = spacing;
    }
    left -= piece;
    if (course[c + 1].hole >= 0) path.push_back(to), hole.push_back(course[c + 1].hole);
  }
  return thread::make_laced_state(path, hole, hole_friction);
}

void Sewn::start() {
  scratch = std::make_unique<physical::Scratch>(model, state);
  hold.resize(2);
  hold[0].node = 0, hold[1].node = static_cast<uint32_t>(state.thread.nodes()) - 1;
  for (thread::Hold& h : hold) h.from = h.to = state.thread.position(h.node);
}

void Sewn::move_holds(std::span<const Vec3> to, float seconds) {
  const int steps = std::max(1, static_cast<int>(std::lround(seconds / model.wall.step)));
  std::vector<Vec3> from;
  for (const thread::Hold& h : hold) from.push_back(h.to);
  for (int i = 1; i <= steps; ++i) {
    for (size_t k = 0; k < hold.size(); ++k) {
      hold[k].from = hold[k].to;
      if (k < to.size()) hold[k].to = lerp(from[k], to[k], static_cast<float>(i) / static_cast<float>(steps));
    }
    physical::Hands hands;
    hands.holds = hold, hands.pulls = pull, hands.wall_pulls = wall_pull;
    physical::step(model, state, *scratch, hands, *jobs);
  }
  for (thread::Hold& h : hold) h.from = h.to;
}

void Sewn::run(float seconds) { move_holds({}, seconds); }

namespace {
constexpr float kApart = 0.25f;  // [m] the hands' way to either side: farther than the thread is long
void soften(Sewn& s, float limit) {
  for (size_t i = 0; i < 2; ++i) s.hold[i].stiffness = 200, s.hold[i].limit = limit;
}

// Both hands take their ends up, off the tissue and off the strands that lead into it: a throw begins where the tails leave the
// knot. Laid from where they lie on the loop's own strands, it would keep that way as slack.
void lift_tails(Sewn& s, const Tying& t) {
  constexpr float kForce = 0.2f;  // [N]
  s.hold.resize(2);
  soften(s, kForce);
  const Vec3 high = t.center + t.up * kApart, aside = t.across * (t.side * 0.3f * kApart);
  const Vec3 to[2] = {high + aside, high - aside};
  const thread::State& thread = s.state.thread;
  for (const uint32_t i : {thread.eyelet.front().segment - 1, thread.eyelet.back().segment + 2}) {
    thread::Hold forceps;
    forceps.node = i, forceps.from = forceps.to = thread.position(i), forceps.stiffness = 1e4f;
    s.hold.push_back(forceps);
  }
  s.move_holds(to, 0.1f);
  s.run(0.1f);
}

// Where strand A (the thread's first end) leaves what is tied so far: the first node, from its end, that is near another
// strand or a hole. For strand B from the other end.
uint32_t exit_node(const thread::State& t, float diameter, bool first) {
  const uint32_t n = static_cast<uint32_t>(t.nodes());
  for (uint32_t k = 0; k < n; ++k) {
    const uint32_t i = first ? k : n - 1 - k;
    const uint32_t segment = first ? i : i - 1;
    for (const thread::Eyelet& e : t.eyelet)
      if (e.segment == segment) return i;
    for (size_t c = 0; c < t.key.size(); ++c)
      if ((thread::segment_of(t.key[c]) == segment || thread::partner_of(t.key[c]) == segment) &&
          t.crossing[c].gap < 0.3f * diameter && t.crossing[c].touch != thread::Touch::unknown)
        return i;
  }
  return 0;
}
}  // namespace

// The free tails are laid again: from their exits from the knot into the throw, then to both sides.
void tie_throw(Sewn& s, Tying& t, Throw one) {
  thread::State& thread = s.state.thread;
  const float d = s.model.thread.material.diameter, r = 0.75f * d, half = 1.1f * d * static_cast<float>(one.half_turns);
  CATGUT_CHECK(!thread.eyelet.empty());  // every bite has torn out
  if (t.throws > 0) lift_tails(s, t);
  const uint32_t n = static_cast<uint32_t>(thread.nodes());
  const uint32_t a = exit_node(thread, d, true), b = exit_node(thread, d, false);
  const Vec3 from_a = thread.position(a), from_b = thread.position(b);
  const Vec3 center = (from_a + from_b) * 0.5f + t.up * (t.lift + r), x = t.across * -t.side, z = t.up, y = cross(z, x);
  const float turns = static_cast<float>(one.half_turns * one.hand) * kPi;
  const float phase = std::sin(-0.5f * turns) < 0 ? 0.0f : kPi;
  for (const bool first : {true, false}) {
    const auto place = [&](Vec3 p) {
      if (!first) p = {-p.x, -p.y, p.z};
      return center + x * p.x + y * p.y + z * p.z;
    };
    std::vector<Vec3> curve{first ? from_a : from_b};
    const auto line = [&](Vec3 to) {
      const Vec3 from = curve.back();
      const int parts = std::max(1, static_cast<int>(distance(from, to) / (0.1f * d)));
      for (int i = 1; i <= parts; ++i) curve.push_back(lerp(from, to, static_cast<float>(i) / static_cast<float>(parts)));
    };
    line(place({-half, 0, -r}));
    const int parts = one.half_turns * 60;
    for (int i = 1; i <= parts; ++i) {
      const float along = half * (2 * static_cast<float>(i) / static_cast<float>(parts) - 1),
                  angle = phase + 0.5f * turns * along / half;
      curve.push_back(place({along, r * std::cos(angle), r * std::sin(angle)}));
    }
    line(curve.back() + x * (first ? 0.6f : -0.6f) + z * 0.06f);
    // Nodes along the curve, a segment's length at rest apart.
    size_t at = 1;
    Vec3 p = curve[0];
    for (uint32_t k = first ? a : b; first ? k > 0 : k + 1 < n;) {
      const uint32_t next = first ? k - 1 : k + 1;
      float left = thread.rest[first ? next : k];
      while (at + 1 < curve.size() && distance(p, curve[at]) < left) left -= distance(p, curve[at]), p = curve[at++];
      p = p + normalized(curve[at] - p) * left;
      thread.x.set(next, p), thread.fine.set(next, {}), thread.v.set(next, {});
      k = next;
    }
  }
  // What the moved parts remember of their neighbors is no longer true.
  size_t kept = 0;
  for (size_t k = 0; k < thread.key.size(); ++k) {
    const uint32_t i = thread::segment_of(thread.key[k]), j = thread::partner_of(thread.key[k]);
    if (i < a || j < a || i >= b || j >= b) continue;
    thread.key[kept] = thread.key[k], thread.budget[kept] = thread.budget[k], thread.crossing[kept] = thread.crossing[k];
    ++kept;
  }
  thread.key.resize(kept), thread.budget.resize(kept), thread.crossing.resize(kept);
  thread.travel = 1e9f;
  // Forceps hold the throw below meanwhile, or strands that are drawn tight.
  s.hold.resize(2);
  s.hold[0].from = s.hold[0].to = thread.position(0), s.hold[1].from = s.hold[1].to = thread.position(n - 1);
  const bool below = t.throws > 0 || thread.tension[thread.eyelet.front().segment] > 0.1f;
  if (below)
    for (const uint32_t i : {a, b, thread.eyelet.front().segment - 1, thread.eyelet.back().segment + 2}) {
      thread::Hold forceps;
      forceps.node = i, forceps.from = forceps.to = thread.position(i), forceps.stiffness = 1e4f;
      s.hold.push_back(forceps);
    }
  if (one.half_turns % 2 == 1) t.side = -t.side;
  pull_apart(s, t, t.tension, 0.6f);
  s.hold.resize(2);
  pull_apart(s, t, t.tension, 0.3f);
  ++t.throws;
}

void pull_apart(Sewn& s, const Tying& t, float tension, float seconds) {
  const Vec3 low = t.center + t.up * 2e-3f;
  const Vec3 to[2] = {low + t.across * (t.side * kApart), low - t.across * (t.side * kApart)};
  // The force grows as the hands draw.
  for (int i = 1; i <= 10; ++i) {
    soften(s, tension * std::min(1.0f, 0.15f * static_cast<float>(i)));
    if (i == 1) s.move_holds(to, 0.3f * seconds);
    else s.run(0.7f / 9 * seconds);
  }
}

void let_go(Sewn& s) {
  const float limit = s.hold[0].limit;
  for (int i = 9; i >= 0; --i) {
    soften(s, std::max(1e-3f, limit * 0.1f * static_cast<float>(i)));
    for (size_t k = 0; k < 2; ++k) s.hold[k].from = s.hold[k].to;
    s.run(0.01f);
  }
  s.hold.clear();
}

Sewn interrupted(const Stitch& q) {
  Sewn s;
  const wall::Wall w = two_tubes(q.gap);
  s.model = physical::make_model(w, knot_settings(q.friction));
  s.state.wall = w.state;
  const float z = 0.5f * q.gap + q.bite;
  std::vector<Stop> course{{}};
  for (const auto& [x, at, within] :
       {std::tuple{0.02f, z, true}, {0.0175f, z, false}, {0.0175f, -z, true}, {0.02f, -z, false}}) {
    physical::Hole hole = hole_at(w, {x, 0, at}, x > 0.019f ? 1.0f : -1.0f);
    hole.within = within;
    course.push_back({mouth(s.model, s.state, hole), static_cast<int32_t>(s.state.hole.size())});
    s.state.hole.push_back(hole);
  }
  course[0].at = course[1].at + Vec3{q.tail, 0, 0.002f};
  course.push_back({course[4].at + Vec3{q.tail, 0, -0.002f}});
  s.state.thread = lay_course(course, q.segment, q.hole_friction);
  s.start();
  return s;
}

Sewn ring_of_stitches(const Stitch& q, int count) {
  Sewn s;
  const wall::Wall w = two_tubes(q.gap, 48);
  s.model = physical::make_model(w, knot_settings(q.friction));
  s.state.wall = w.state;
  std::vector<Vec3> path;
  std::vector<int32_t> hole;
  std::vector<size_t> ends;  // nodes so far at the end of each strand
  const float z = 0.5f * q.gap + q.bite, tail = 0.012f;
  for (int k = 0; k < count; ++k) {
    const float angle = 2 * kPi * static_cast<float>(k) / static_cast<float>(count);
    const Vec3 out{std::cos(angle), std::sin(angle), 0};
    std::vector<Vec3> stop;
    for (const int corner : {0, 1, 2, 3}) {
      const bool outside = corner == 0 || corner == 3;
      physical::Hole h =
          hole_at(w, out * (outside ? 0.02f : 0.0175f) + Vec3{0, 0, corner < 2 ? z : -z}, outside ? 1.0f : -1.0f);
      h.within = corner == 0 || corner == 2;
      stop.push_back(mouth(s.model, s.state, h));
      s.state.hole.push_back(h);
    }
    stop.insert(stop.begin(), stop[0] + out * tail), stop.push_back(stop.back() + out * tail);
    for (size_t i = 0; i + 1 < stop.size(); ++i) {
      const int parts = std::max(3, static_cast<int>(distance(stop[i], stop[i + 1]) / q.segment));
      for (int n = i == 0 ? 0 : 1; n < parts; ++n) {
        path.push_back(lerp(stop[i], stop[i + 1], static_cast<float>(n) / static_cast<float>(parts))), hole.push_back(-1);
      }
      path.push_back(stop[i + 1]), hole.push_back(i + 2 < stop.size() ? 4 * k + static_cast<int32_t>(i) : -1);
    }
    ends.push_back(static_cast<size_t>(std::count(hole.begin(), hole.end(), -1)));
  }
  s.state.thread = thread::make_laced_state(path, hole, q.hole_friction);
  for (size_t k = 0; k + 1 < ends.size(); ++k) s.state.thread.broken[ends[k] - 1] = 1;
  s.start();
  s.hold.clear();
  return s;
}

Sewn purse_string(const Stitch& q, int passages) {
  Sewn s;
  wall::TubeShape shape;
  shape.around = 32, shape.rings = 10, shape.length = 0.035f;
  wall::Spec spec;
  spec.mesh = wall::tube(shape);
  spec.drag = 20;
  const wall::Wall w = wall::build_wall(spec);
  s.model = physical::make_model(w, knot_settings(q.friction));
  s.state.wall = w.state;
  std::vector<Stop> course{{}};
  for (int k = 0; k < passages; ++k) {
    const float a = 2 * kPi * (static_cast<float>(k) + 0.5f) / static_cast<float>(passages);
    const bool inward = k % 2 == 0;
    for (const bool first : {true, false}) {
      const float side = inward == first ? 1.0f : -1.0f, r = 0.01875f + 0.00125f * side;
      physical::Hole hole = hole_at(w, {r * std::cos(a), r * std::sin(a), -q.bite}, side);
      hole.within = first;
      course.push_back({mouth(s.model, s.state, hole), static_cast<int32_t>(s.state.hole.size())});
      s.state.hole.push_back(hole);
    }
  }
  course[0].at = course[1].at + Vec3{q.tail, 0, 0};
  course.push_back({course.back().at + Vec3{q.tail, 0, 0}});
  s.state.thread = lay_course(course, q.segment, q.hole_friction);
  s.start();
  return s;
}

void draw_purse(Sewn& s, float tension, float seconds) {
  const Vec3 to[2] = {{0.3f, 0.03f, -0.004f}, {0.3f, -0.03f, -0.004f}};
  for (int i = 1; i <= 12; ++i) {
    soften(s, tension * std::min(1.0f, static_cast<float>(i) / 8));
    if (i == 1) s.move_holds(to, seconds / 12);
    else s.run(seconds / 12);
  }
}

std::vector<float> gaps(const Sewn& s) {
  // Both tubes have the same columns, ring by ring from the near end; the second has its columns behind the first's.
  const uint32_t half = wall::columns(s.state.wall) / 2;
  std::vector<float> out;
  const auto at = [&](uint32_t c) { return wall::vec3(s.state.wall.motion.x[2 * c]); };
  for (uint32_t a = 0; a < half; ++a) {
    if (!s.model.surface.at_rim[a] || s.state.wall.topology.slot[a] == wall::kNone) continue;
    float nearest = 1;
    for (uint32_t b = half; b < 2 * half; ++b)
      if (s.model.surface.at_rim[b]) nearest = std::min(nearest, distance(at(a), at(b)));
    out.push_back(nearest);
  }
  return out;
}

double opening(const Sewn& s) {
  std::vector<Vec3> p;
  for (uint32_t c = 0; c < wall::columns(s.state.wall); ++c)
    if (s.model.surface.at_rim[c] && s.state.wall.topology.slot[c] != wall::kNone) p.push_back(wall::inner(s.state.wall, c));
  double twice = 0;
  for (size_t i = 0; i < p.size(); ++i) {
    const Vec3 a = p[i], b = p[(i + 1) % p.size()];
    twice += static_cast<double>(a.x * b.y - a.y * b.x);
  }
  return 0.5 * std::abs(twice);
}

void remove_thread(Sewn& s) {
  std::fill(s.state.thread.broken.begin(), s.state.thread.broken.end(), uint8_t{1});
  s.state.thread.eyelet.clear();
  s.state.thread.travel = 1e9f;
}

wall::Wall two_tubes(float gap, int around, int rings, float step, float length) {
  wall::TubeShape shape;
  shape.around = around, shape.rings = rings, shape.length = length;
  shape.center = {0, 0, 0.5f * gap}, shape.axis = {0, 0, -1};
  wall::Spec s;
  s.mesh = wall::tube(shape);
  shape.center.z = -0.5f * gap, shape.axis.z = 1;
  wall::append(s.mesh, wall::tube(shape));
  s.drag = 20, s.step = step;
  return wall::build_wall(s);
}

physical::Hole hole_at(const wall::Wall& wall, Vec3 p, float zeta) {
  return {wall::nearest_point(wall.model, wall.state, p, zeta)};
}

}  // namespace catgut::validation
