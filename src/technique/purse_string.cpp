// SPDX-License-Identifier: Apache-2.0
// technique/purse_string: reads suture points and thread length, returns a ClosurePlan. Paper 2.5.1, figure 11.
#include "technique/purse_string.h"

#include <algorithm>
#include <cmath>

#include "technique/technique.h"

namespace catgut {
namespace {

constexpr float kRoom = 1.3f;  // length of thread in the closed edge, relative to the path round it

Vec3 center_of(std::span<const uint32_t> rim, const Vec4* x) {
  Vec3 c{};
  for (uint32_t i : rim) c += xyz(x[i]);
  return rim.empty() ? c : c / static_cast<float>(rim.size());
}
// Newell's vector: normal of the loop's best plane, its length twice the projected area.
Vec3 newell(std::span<const uint32_t> rim, const Vec4* x) {
  Vec3 n{};
  const Vec3 c = center_of(rim, x);
  for (size_t i = 0; i < rim.size(); ++i) n += cross(xyz(x[rim[i]]) - c, xyz(x[rim[(i + 1) % rim.size()]]) - c);
  return n;
}

// Angle that the suture points cover round the opening, signed [rad] about the axis.
float turned(std::span<const Vec3> sp, Vec3 center, Vec3 axis) {
  float sum = 0;
  for (size_t i = 0; i + 1 < sp.size(); ++i) {
    Vec3 a = sp[i] - center, b = sp[i + 1] - center;
    a -= axis * dot(a, axis);
    b -= axis * dot(b, axis);
    sum += portable::atan2(dot(cross(a, b), axis), dot(a, b));
  }
  return sum;
}

}  // namespace

float opening_area(std::span<const uint32_t> rim, const Vec4* x) { return 0.5f * length(newell(rim, x)); }

int first_out_of_order(std::span<const Vec3> sp, size_t from) {
  const size_t n = sp.size();
  if (n < 4) return -1;  // fewer than three others to choose from: undecided
  for (size_t i = from; i < n; ++i) {
    std::array<size_t, 3> next{};
    for (size_t k = 0; k < 3; ++k) next[k] = i + 3 < n ? i + 1 + k : (i + 1 + k) % n;
    const float d = distance(sp[i], sp[next[0]]);
    if (distance(sp[i], sp[next[1]]) < d || distance(sp[i], sp[next[2]]) < d) return static_cast<int>(i);
  }
  return -1;
}

void purse_string(const PurseStringModel& model, PurseStringState& state, const TechniqueView& view, ClosurePlan& plan,
                  EventList& events) {
  if (model.rim_inner.size() < 3) return;
  const Vec4* x = view.x;
  const float loop = view.loop, dt = view.dt;
  std::vector<Vec3>& sp = state.where;
  sp.clear();
  for (const StitchPoint& p : view.point) sp.push_back(p.at);
  if (state.area_start == 0) state.area_start = opening_area(model.rim_inner, x);
  state.checked = std::min(state.checked, static_cast<uint32_t>(sp.size()));
  if (state.finished) return;
  if (sp.empty()) {  // baked in its present state, or removed: no thread controls the closure
    state.ring_complete = state.ring_complete && state.closing;
    return;
  }

  // The path from point to point, and whether points not checked yet lie in order, now that all are known.
  const auto measure_ring = [&] {
    state.path_start = 0;
    for (size_t i = 0; i + 1 < sp.size(); ++i) state.path_start += distance(sp[i], sp[i + 1]);
    for (; state.checked < sp.size(); ++state.checked)
      if (first_out_of_order(sp, state.checked) == static_cast<int>(state.checked))
        events.add({EventKind::bite_out_of_order, 0, (state.checked + 1) % static_cast<uint32_t>(sp.size()), 0,
                    sp[(state.checked + 1) % sp.size()]});
  };
  if (!state.ring_complete) {
    // While the ring is incomplete, a point can be checked once three more follow it.
    for (; state.checked + 3 < sp.size(); ++state.checked)
      if (first_out_of_order(std::span(sp).subspan(state.checked, 4)) == 0)
        events.add({EventKind::bite_out_of_order, 0, state.checked + 1, 0, sp[state.checked + 1]});
    const Vec3 center = center_of(model.rim_outer, x), axis = normalized(newell(model.rim_outer, x));
    if (sp.size() < 2 * static_cast<size_t>(model.min_bites) || sp.size() % 2 != 0) return;  // even: no incomplete bite
    const float angle = std::abs(turned(sp, center, axis));
    // The distance from the last point to the first is at most 1.5 of the largest step so far.
    float step = 0;
    for (size_t i = 0; i + 1 < sp.size(); ++i) step = std::max(step, distance(sp[i], sp[i + 1]));
    if (angle < kPi || distance(sp.back(), sp.front()) > 1.5f * step) return;
    state.ring_complete = true;
    measure_ring();
    events.add({EventKind::ring_complete, 0, static_cast<uint32_t>(sp.size()), angle, center});
    return;
  }

  if (!state.closing) {
    // One more bite than the ring needs: its thread adds to the path.
    if (state.checked < sp.size() && sp.size() % 2 == 0) measure_ring();
    // Closing starts when the thread in the ring is as short as the path: the slack is out.
    if (loop > 0.995f * state.path_start) return;
    state.closing = true;
    const Vec3 center = center_of(model.rim_outer, x), axis = normalized(newell(model.rim_outer, x));
    const Vec3 anvil = center + model.anvil;
    auto toward = [&](Vec3 from, float radius) {
      Vec3 out = from - anvil;
      const float height = dot(out, axis);
      out -= axis * height;
      // Gathered tissue keeps a little of its height, so that the edge does not collapse into a plane.
      return anvil + normalized(out) * radius + axis * (0.5f * height);
    };
    auto add_pull = [&](const EmbeddedPoint& p, float radius) {
      const Vec3 from = position_of(p, x);
      plan.pull.push_back({p, from, toward(from, radius)});
    };
    for (uint32_t i : model.rim_inner) add_pull(particle_point(i), model.anvil_radius);
    for (uint32_t i : model.rim_outer) add_pull(particle_point(i), model.anvil_radius + model.wall);
    const float thread_radius = model.anvil_radius + 2 * model.wall;
    for (const StitchPoint& p : view.point) add_pull(p.point, thread_radius);
    plan.compliance = model.compliance;
    state.path_end = 0;
    const size_t first = plan.pull.size() - view.point.size();
    for (size_t i = first; i + 1 < plan.pull.size(); ++i) state.path_end += distance(plan.pull[i].to, plan.pull[i + 1].to);
    // Gathered tissue takes up length on the thread. The thread controls closing, but the edge arrives before the loop is as
    // short as the bare path. The remaining thread is pulled against the tissue itself.
    state.path_end *= kRoom;
    events.add({EventKind::closure_started, 0, 0, opening_area(model.rim_inner, x), anvil});
  }

  const float wanted = std::clamp((state.path_start - loop) / (state.path_start - state.path_end), 0.0f, 1.0f);
  plan.progress += std::clamp(wanted - plan.progress, -model.fastest * dt, model.fastest * dt);
  if (plan.progress >= 0.99f) {
    state.finished = true;
    plan.progress = 1;
    events.add({EventKind::closure_finished, 0, 0, opening_area(model.rim_inner, x), center_of(model.rim_inner, x)});
  }
}

const TechniqueRow kPurseString{
    .name = "purse_string",
    .title = "purse-string",
    .description = "a running suture round an opening; both ends are pulled and it closes (section 2.5.1)",
    .hint = "bite round the rim, then pull both ends",
    .plan = "purse_string",
    .walls = 1,
    .missing = "a purse-string needs an opening and no body has one",
    .remedy = "leave one end of the body open",
    .interrupted = false,
    .closes_opening = true,
    .begin =
        [](const TechniqueSetup& s, TechniqueModel& model) {
          PurseStringModel& m = model.purse_string;
          m.rim_outer = s.rim[0].outer, m.rim_inner = s.rim[0].inner;
          m.anvil = s.anvil, m.anvil_radius = s.anvil_radius;
          m.compliance = s.compliance, m.min_bites = s.min_bites, m.wall = s.wall;
        },
    .tick = [](const TechniqueModel& m, TechniqueState& s, const TechniqueView& view, ClosurePlan& plan,
               EventList& events) { purse_string(m.purse_string, s.purse_string, view, plan, events); },
    .fits = [](const TechniqueState& s, size_t, size_t points) { return s.purse_string.checked <= points; },
};

}  // namespace catgut
