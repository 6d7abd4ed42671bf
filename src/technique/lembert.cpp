// SPDX-License-Identifier: Apache-2.0
// technique/lembert: see lembert.h.
#include "technique/lembert.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "technique/common.h"
#include "technique/technique.h"

namespace catgut {
namespace {

constexpr float kSameAngle = 0.005f;  // [rad] 0.1 mm on the rim

// Signed angle from u to v about the unit vector axis, -pi..pi.
float signed_angle(Vec3 u, Vec3 v, Vec3 axis) {
  u -= axis * dot(u, axis);
  v -= axis * dot(v, axis);
  return portable::atan2(dot(cross(u, v), axis), dot(u, v));
}

struct Ring {
  Vec3 center, axis;
};

// cp of 2.5.4, and the direction that the ring faces.
Ring ring_of(const LembertModel& model, const Vec4* x) {
  Ring ring;
  for (const auto* group : {&model.outer, &model.inner})
    for (uint32_t i : *group) ring.center += xyz(x[i]);
  ring.center = ring.center / static_cast<float>(model.outer.size() + model.inner.size());
  Vec3 newell{};
  for (size_t i = 0; i < model.outer.size(); ++i)
    newell += cross(xyz(x[model.outer[i]]) - ring.center, xyz(x[model.outer[(i + 1) % model.outer.size()]]) - ring.center);
  ring.axis = normalized(newell, {0, 1, 0});
  return ring;
}

// The nearest point to p on the line through a group's particles, the nearer of its two particles first.
EmbeddedPoint on_ring(std::span<const uint32_t> group, const Vec4* x, Vec3 p) {
  const size_t n = group.size();
  float best = std::numeric_limits<float>::max(), at = 0;
  size_t found = 0;
  for (size_t k = 0; k < n; ++k) {
    const Vec3 from = xyz(x[group[k]]), way = xyz(x[group[(k + 1) % n]]) - from;
    const float t = std::clamp(dot(p - from, way) / std::max(length2(way), 1e-12f), 0.0f, 1.0f),
                d = length2(from + way * t - p);
    if (d < best) best = d, found = k, at = t;
  }
  const uint32_t one = group[found], next = group[(found + 1) % n];
  EmbeddedPoint point = particle_point(at > 0.5f ? next : one);
  const float rest = std::min(at, 1 - at);
  if (rest < 0.01f) return point;
  point.count = 2;
  point.particle[1] = at > 0.5f ? one : next;
  point.weight[0] = 1 - rest;
  point.weight[1] = rest;
  return point;
}

void add_pair(const LembertModel& model, LembertState& state, const Vec4* x, const EmbeddedPoint& a, const EmbeddedPoint& b,
              LembertRow row, uint32_t midpoint, ClosurePlan& plan) {
  const float apart = distance(position_of(a, x), position_of(b, x));
  plan.compliance = model.compliance;
  plan.pair.push_back({a, b, apart, std::min(apart, model.gap), 0, midpoint});
  state.row.push_back(row);
}

// A tied stitch that holds, of any suture.
struct Neighbor {
  uint32_t suture = 0, stitch = 0;
  Vec3 at;  // [m] where its two edges meet
};

Vec3 middle_of(const ClosurePlan::Pair& p, const Vec4* x) { return 0.5f * (position_of(p.a, x) + position_of(p.b, x)); }

// Calls `each(suture, state, plan)` for this suture and then for all others.
template <typename Each>
void for_every_suture(const LembertState& state, const TechniqueView& view, const ClosurePlan& plan, Each&& each) {
  each(view.suture, state, plan);
  for (uint32_t k = 0; k < view.state_of.size(); ++k)
    if (k != view.suture) each(k, view.state_of[k].lembert, view.plan_of[k]);
}

// Figure 15: particles of both groups between two stitches, each with the closest of the opposite group.
void pair_between(const LembertModel& model, LembertState& state, const TechniqueView& view, const Ring& ring, uint32_t one,
                  const Neighbor& other, ClosurePlan& plan) {
  const Vec4* x = view.x;
  const Vec3 v1 = middle_of(plan.pair[state.stitch[one].row], x) - ring.center, v2 = other.at - ring.center;
  const auto taken = [&](uint32_t i) {
    bool found = false;
    for_every_suture(state, view, plan, [&](uint32_t, const LembertState&, const ClosurePlan& of) {
      found = found || std::any_of(of.pair.begin(), of.pair.end(),
                                   [&](const ClosurePlan::Pair& p) { return p.a.particle[0] == i || p.b.particle[0] == i; });
    });
    return found;
  };
  const LembertRow row{one, other.stitch, other.suture, 0};
  for (uint32_t i : model.outer)
    if (is_between(v1, v2, xyz(x[i]) - ring.center, ring.axis) && !taken(i))
      add_pair(model, state, x, particle_point(i), particle_point(nearest_of(model.inner, x, xyz(x[i]))), row, 0, plan);
  for (uint32_t i : model.inner)
    if (is_between(v1, v2, xyz(x[i]) - ring.center, ring.axis) && !taken(i))
      add_pair(model, state, x, particle_point(nearest_of(model.outer, x, xyz(x[i]))), particle_point(i), row, 0, plan);
}

// "The closest particle in pg_i and pg_o is found and they are pulled to their midpoint when a knot is tied. When a subsequent
// suture point is placed, particles in pg_i and pg_o between the two suture points are pulled together." On the inner side we
// take the point between two particles. Where the outer particle is already pulled, the stitch uses that pair: stitches
// closer than the particle spacing would otherwise pull one particle to several targets.
void tie(const LembertModel& model, LembertState& state, const TechniqueView& view, ClosurePlan& plan) {
  Vec3 at{};
  for (const StitchPoint& p : view.point) at += p.at;
  at = at / static_cast<float>(view.point.size());
  const Ring ring = ring_of(model, view.x);
  const uint32_t stitch = static_cast<uint32_t>(state.stitch.size()), nearest = nearest_of(model.outer, view.x, at);
  const auto drawn =
      std::find_if(plan.pair.begin(), plan.pair.end(), [&](const ClosurePlan::Pair& p) { return p.a.particle[0] == nearest; });
  state.stitch.push_back({static_cast<uint32_t>(drawn - plan.pair.begin()), view.suture_index, 1});
  if (drawn != plan.pair.end()) drawn->midpoint = 1;
  else
    add_pair(model, state, view.x, particle_point(nearest), on_ring(model.inner, view.x, at), {stitch, stitch, view.suture, 0},
             1, plan);
  // The nearest stitch in each direction, of any suture.
  for (const float way : {1.0f, -1.0f}) {
    float least = model.widest;
    Neighbor neighbor;
    bool found = false;
    for_every_suture(state, view, plan, [&](uint32_t suture, const LembertState& of, const ClosurePlan& pairs) {
      for (uint32_t s = 0; s < of.stitch.size(); ++s) {
        if (!of.stitch[s].holds || (suture == view.suture && s == stitch)) continue;
        const Vec3 there = middle_of(pairs.pair[of.stitch[s].row], view.x);
        const float angle = way * signed_angle(at - ring.center, there - ring.center, ring.axis);
        if (angle > 0 && angle < least) least = angle, neighbor = {suture, s, there}, found = true;
      }
    });
    if (found) pair_between(model, state, view, ring, stitch, neighbor, plan);
  }
}

}  // namespace

bool is_between(Vec3 v1, Vec3 v2, Vec3 vp, Vec3 axis) {
  const float a = std::abs(signed_angle(v1, v2, axis));
  const float b = std::abs(signed_angle(v1, vp, axis)), c = std::abs(signed_angle(v2, vp, axis));
  return b + c <= a + kSameAngle;  // never less than a
}

void lembert(const LembertModel& model, LembertState& state, const TechniqueView& view, ClosurePlan& plan, EventList& events) {
  if (model.outer.size() < 3 || model.inner.size() < 3) return;
  merge_reported(events, state.reported);
  // However a suture ends: too few throws hold nothing.
  const auto end_suture = [&] {
    if (state.throws == 0 || state.throws >= static_cast<uint32_t>(model.throws)) return;
    const Vec3 where = view.point.empty() ? Vec3{} : view.point.back().at;
    report_fault(Fault::too_few_throws, state.knot, where, state.reported, events);
    if (state.tied) state.stitch.back().holds = 0;
  };
  if (view.suture_index != state.suture_index) {
    end_suture();
    state.suture_index = view.suture_index;
    state.throws = state.knot = state.tied = state.reported = 0;
  }
  judge_begun_knots(view, false, state.reported, events);

  const bool first = state.throws == 0;
  state.throws = locked_throws(view.knot);
  if (!view.knot.empty()) state.knot = static_cast<uint32_t>(view.knot.size()) - 1;
  if (first && state.throws > 0 && !view.point.empty()) {
    if (one_wall(walls_taken(view.point))) {
      // Tied to itself: it joins no layers.
      report_fault(Fault::one_wall_only, view.point.back().bite, view.point.back().at, state.reported, events);
    } else {
      tie(model, state, view, plan);
      state.tied = 1;
    }
  }
  const size_t before = events.size();
  for (size_t i = 0; i < before; ++i)
    if (events[i].kind == EventKind::thread_cut) end_suture();
  if (state.tied && cut_in_stitch(events)) state.stitch.back().holds = 0;

  const auto other_holds = [&](const LembertRow& row) {
    const bool own = row.other_suture == view.suture || row.other_suture >= view.state_of.size();
    const LembertState& of = own ? state : view.state_of[row.other_suture].lembert;
    return row.other < of.stitch.size() && of.stitch[row.other].holds;
  };
  for (uint32_t r = 0; r < state.row.size(); ++r) {
    LembertRow& row = state.row[r];
    const bool holds =
        (state.stitch[row.one].holds && other_holds(row)) ||
        std::any_of(state.stitch.begin(), state.stitch.end(), [&](const LembertStitch& s) { return s.row == r && s.holds; });
    advance(plan.pair[r].progress, holds ? 1.0f : 0.0f, model.fastest, view.dt);
    tell_closed(r, plan.pair[r], view.x, row.reported, events);
  }
}

const TechniqueRow kLembert{
    .name = "lembert",
    .title = "Lembert",
    .description = "single stitches through both layers of a cut bowel, each tied (section 2.5.4)",
    .hint = "bite outer and inner layer, tie two throws, cut",
    .plan = "lembert",
    .walls = 2,
    .missing = "it joins two layers and the scene's body has one",
    .remedy = "give the body an inner_radius",
    .interrupted = true,
    .closes_opening = false,
    .begin =
        [](const TechniqueSetup& s, TechniqueModel& model) {
          // The sides that face each other: closed points meet there, without a wall between.
          LembertModel& m = model.lembert;
          m.outer = s.rim[0].inner, m.inner = s.rim[1].outer;
          m.gap = s.gap, m.compliance = s.compliance, m.throws = s.throws;
        },
    .tick = [](const TechniqueModel& m, TechniqueState& s, const TechniqueView& view, ClosurePlan& plan,
               EventList& events) { lembert(m.lembert, s.lembert, view, plan, events); },
    .fits =
        [](const TechniqueState& s, size_t rows, size_t) {
          const LembertState& l = s.lembert;
          return l.row.size() == rows && !(l.tied && l.stitch.empty()) &&
                 std::all_of(l.row.begin(), l.row.end(), [&](const LembertRow& r) { return r.one < l.stitch.size(); }) &&
                 std::all_of(l.stitch.begin(), l.stitch.end(), [&](const LembertStitch& t) { return t.row < rows; });
        },
};

}  // namespace catgut
