// SPDX-License-Identifier: Apache-2.0
// technique/seam: see seam.h.
#include "technique/seam.h"

#include <algorithm>
#include <cmath>

#include "technique/common.h"
#include "technique/technique.h"

namespace catgut {
namespace {

// Extra thread between two points that count as closed, beyond the gap: it bends round two edges.
constexpr float kRoom = 0.001f;  // [m]

// Completed bites, in their order along the thread.
void find_passes(const TechniqueView& view, size_t points, std::vector<Pass>& pass) {
  pass.clear();
  for (size_t i = 0; i < points; ++i) {
    const StitchPoint& p = view.point[i];
    if (!p.exit) pass.push_back({p.bite, p.wall, p.inside, p.inside});
    else if (!pass.empty() && pass.back().bite == p.bite) pass.back().out_inside = p.inside;
  }
}

// "A line is created connecting the two points and is segmented ... One particle on each SB closest to a segment is identified
// and paired at each segment point." Figure 13: the ends of the line are the midpoints themselves.
void pair_in_between(const SeamModel& model, SeamState& state, const Vec4* x, Vec3 from, Vec3 to, ClosurePlan& plan) {
  if (model.rim[0].empty() || model.rim[1].empty()) return;
  const uint32_t leader = static_cast<uint32_t>(plan.pair.size()) - 1;
  const int segments = static_cast<int>(std::min(1000.0f, std::round(distance(from, to) / model.step)));
  for (int i = 1; i < segments; ++i) {
    const Vec3 at = lerp(from, to, static_cast<float>(i) / static_cast<float>(segments));
    const uint32_t a = nearest_of(model.rim[0], x, at), b = nearest_of(model.rim[1], x, at);
    const bool used = std::any_of(plan.pair.begin(), plan.pair.end(), [&](const ClosurePlan::Pair& p) {
      return !p.midpoint && (p.a.particle[0] == a || p.b.particle[0] == b);
    });
    if (used) continue;  // the line is sampled finer than the rim: its neighbor has this particle
    const float apart = distance(xyz(x[a]), xyz(x[b]));
    plan.pair.push_back({particle_point(a), particle_point(b), apart, std::min(apart, model.gap), 0, 0});
    SeamRow row;
    row.leader = leader;
    state.row.push_back(row);
  }
}

// Suture points k and k + 1 lie on different walls.
void add_midpoint(const SeamModel& model, SeamState& state, const TechniqueView& view, size_t k, ClosurePlan& plan) {
  const StitchPoint &a = view.point[k], &b = view.point[k + 1];
  const float apart = distance(a.at, b.at);
  // "If mp contains a midpoint when a new one is added": the last of this suture.
  std::ptrdiff_t last = -1;
  for (size_t r = state.first_row; r < plan.pair.size(); ++r)
    if (plan.pair[r].midpoint) last = static_cast<std::ptrdiff_t>(r);
  plan.compliance = model.compliance;
  plan.pair.push_back({a.point, b.point, apart, std::min(apart, model.gap), 0, 1});
  SeamRow row;
  row.leader = static_cast<uint32_t>(plan.pair.size()) - 1;
  row.point = static_cast<uint32_t>(k);
  row.from = std::min(a.span, apart);  // slack is pulled out first: closing starts when the thread is straight
  state.row.push_back(row);
  if (last < 0) return;
  const ClosurePlan::Pair& before = plan.pair[static_cast<size_t>(last)];
  const Vec3 from = 0.5f * (position_of(before.a, view.x) + position_of(before.b, view.x));
  pair_in_between(model, state, view.x, from, 0.5f * (a.at + b.at), plan);
}

}  // namespace

// A A B B A A ...: each first pass from outside in, each second from inside out. After a fault the pattern continues from the
// faulty bite, so that one mistake is one fault.
Fault judge_connell(std::span<const Pass> pass) {
  uint32_t wall = 0, in_run = 0;
  Fault fault = Fault::none;
  for (size_t i = 0; i < pass.size(); ++i) {
    const Pass& p = pass[i];
    fault = Fault::none;
    const bool second = in_run == 1;
    if (i > 0 && (p.wall == wall) != second) fault = Fault::wrong_body, in_run = 0;
    if (in_run == 2) in_run = 0;
    wall = p.wall;
    ++in_run;
    const bool outward = in_run == 2;
    if (fault == Fault::none && (p.in_inside != outward || p.out_inside == outward)) fault = Fault::wrong_layer;
  }
  return fault;
}

// "Stay sutures are created with a single bite through two different bowels": one end, then the other, each with one bite or
// with one in and one out again.
Fault judge_stay(std::span<const Pass> pass) {
  uint32_t changes = 0, in_run = 0;
  for (size_t i = 0; i < pass.size(); ++i) {
    const bool change = i > 0 && pass[i].wall != pass[i - 1].wall;
    changes += change;
    in_run = change ? 1 : in_run + 1;
  }
  return changes > 1 || in_run > 2 ? Fault::wrong_body : Fault::none;
}

void seam(const SeamModel& model, SeamState& state, const TechniqueView& view, ClosurePlan& plan, EventList& events) {
  merge_reported(events, state.reported);
  if (view.suture_index != state.suture_index) {
    // A new suture: rows without a knot have lost their thread.
    for (size_t r = state.first_row; r < state.row.size(); ++r)
      if (state.row[r].hold == SeamHold::thread) state.row[r].hold = SeamHold::nothing;
    state.suture_index = view.suture_index;
    state.first_row = static_cast<uint32_t>(state.row.size());
    state.points = state.passes = state.throws = state.reported = 0;
  }
  if (cut_in_stitch(events)) {
    for (size_t r = state.first_row; r < state.row.size(); ++r) state.row[r].hold = SeamHold::nothing;
  }
  judge_begun_knots(view, true, state.reported, events);

  // A point counts once its bite is complete ("When a bite is completed, the needle creates a suture point"): until then the
  // needle can still be withdrawn.
  size_t points = 0;
  while (points < view.point.size() && view.bite[view.point[points].bite].complete) ++points;
  if (points > state.points) {
    find_passes(view, points, state.pass);
    const std::vector<Pass>& pass = state.pass;
    for (; state.passes < pass.size(); ++state.passes) {
      const std::span<const Pass> so_far(pass.data(), state.passes + 1);
      const Fault fault = model.connell ? judge_connell(so_far) : judge_stay(so_far);
      uint32_t fresh = 0;  // every bite out of order is reported, once
      if (fault != Fault::none) report_fault(fault, pass[state.passes].bite, view.point[points - 1].at, fresh, events);
    }
    // "If the two most recent suture points are on the same soft body, the thread is simply pulled through without closing the
    // gap between tissues yet. If [they] are on different soft bodies, the system automatically pulls those two tissue points
    // toward each other."
    for (size_t k = state.points > 0 ? state.points - 1 : 0; k + 1 < points; ++k)
      if (view.point[k].wall != view.point[k + 1].wall) add_midpoint(model, state, view, k, plan);
    state.points = static_cast<uint32_t>(points);
  }

  // A throw locked in this tick holds all earlier rows.
  const uint32_t throws = locked_throws(view.knot);
  if (throws > state.throws) {
    for (size_t r = state.first_row; r < state.row.size(); ++r)
      if (state.row[r].hold == SeamHold::thread) state.row[r].hold = SeamHold::knot;
  }
  state.throws = throws;

  // Leaders first, then their followers: a leader stands before its rows.
  for (uint32_t r = 0; r < state.row.size(); ++r) {
    SeamRow& row = state.row[r];
    ClosurePlan::Pair& pair = plan.pair[r];
    const SeamRow& leader = state.row[row.leader];
    if (row.leader != r) {
      pair.progress = plan.pair[row.leader].progress;
      tell_closed(r, pair, view.x, row.reported, events);
      continue;
    }
    float wanted = pair.progress;
    if (leader.hold == SeamHold::nothing) {
      wanted = 0;
    } else if (r >= state.first_row && row.point + 1 < view.point.size()) {
      const StitchPoint &a = view.point[row.point], &b = view.point[row.point + 1];
      const float to = pair.end + kRoom, span = a.span;
      // The last pull of the needle strains the thread between the points. Until it has closed anything, the thread counts as
      // straight at the greatest length that was.
      if (pair.progress == 0) row.from = std::max(row.from, std::min(span, distance(a.at, b.at)));
      const float room = row.from - to;
      wanted = room > 1e-6f ? std::clamp((row.from - span) / room, 0.0f, 1.0f) : 1.0f;
      if (leader.hold == SeamHold::knot) wanted = std::max(wanted, pair.progress);
    }
    advance(pair.progress, wanted, model.fastest, view.dt);
    tell_closed(r, pair, view.x, row.reported, events);
  }
}

namespace {

template <bool connell>
void begin_seam(const TechniqueSetup& s, TechniqueModel& model) {
  model.seam.connell = connell;
  model.seam.rim = {s.rim[0].outer, s.rim[1].outer};
  model.seam.step = s.step, model.seam.gap = s.gap, model.seam.compliance = s.compliance;
}

void tick_seam(const TechniqueModel& m, TechniqueState& s, const TechniqueView& view, ClosurePlan& plan, EventList& events) {
  seam(m.seam, s.seam, view, plan, events);
}

bool seam_fits(const TechniqueState& s, size_t rows, size_t) {
  const std::vector<SeamRow>& row = s.seam.row;
  if (row.size() != rows) return false;
  for (size_t r = 0; r < rows; ++r)
    if (row[r].leader > r) return false;
  return true;
}

constexpr char kNoEnds[] = "it joins two open bowel ends and the scene does not have two",
               kAddEnd[] = "add a second [[body]] with an open end";

}  // namespace

const TechniqueRow kConnell{
    .name = "connell",
    .title = "Connell",
    .description = "one running suture that joins two bowel ends and inverts their edges (section 2.5.2)",
    .hint = "in and out on one end, straight across, in and out on the other",
    .plan = "connell",
    .walls = 2,
    .missing = kNoEnds,
    .remedy = kAddEnd,
    .interrupted = false,
    .closes_opening = false,
    .begin = begin_seam<true>,
    .tick = tick_seam,
    .fits = seam_fits,
};

const TechniqueRow kStay{
    .name = "stay",
    .title = "stay suture",
    .description = "one bite through each of two bowel ends, tied; both ends are held (section 2.5.3)",
    .hint = "one bite through each end, pull even, tie two throws, cut",
    .plan = "stay",
    .walls = 2,
    .missing = kNoEnds,
    .remedy = kAddEnd,
    .interrupted = true,
    .closes_opening = false,
    .begin = begin_seam<false>,
    .tick = tick_seam,
    .fits = seam_fits,
};

}  // namespace catgut
